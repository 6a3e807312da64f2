"""Runs the examples in the docstrings of the module, and requires a docstring of everything that it exports."""

import doctest
import inspect
import unittest

import partprobe


def documented():
    """Each exported function, class and method, by its name."""
    for name in partprobe.__all__:
        value = getattr(partprobe, name)
        if not callable(value):
            continue
        yield name, value
        if inspect.isclass(value):
            for member, inner in vars(value).items():
                if not member.startswith("_"):
                    yield f"{name}.{member}", inner


class Docstrings(unittest.TestCase):
    def test_everything_is_documented_and_examples_are_true(self):
        n_examples = 0
        parser = doctest.DocTestParser()
        for name, value in [("partprobe", partprobe), *documented()]:
            with self.subTest(name):
                text = inspect.getdoc(value)
                self.assertTrue(text)
                test = parser.get_doctest(text, {}, name, None, None)
                failures = []
                doctest.DocTestRunner(verbose=False).run(test, out=failures.append)
                self.assertEqual("".join(failures), "")
                n_examples += len(test.examples)
        self.assertGreater(n_examples, 20)


if __name__ == "__main__":
    unittest.main()
