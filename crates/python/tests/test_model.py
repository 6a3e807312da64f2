"""Embeds points with a backbone that the program of the wheel trained."""

import pathlib
import pickle
import shutil
import tempfile
import unittest

import numpy as np
import partprobe
from material import program

SETTINGS = ["train.steps=2", "train.valid_every=0", "synth.n=12", "sample.n_points=600", "eval.restarts=1", "eval.bootstrap=0"]
TOKENS = ["tokens.train_tokens=64", "tokens.test_tokens=64"]


def setUpModule():
    global FOLDER, RUN
    FOLDER = tempfile.TemporaryDirectory()
    RUN = pathlib.Path(FOLDER.name) / "run"
    settings = [word for setting in SETTINGS + TOKENS for word in ("--set", setting)]
    # The bounds of the smoke run are not met after two updates.
    finished = program("run", "smoke", "--out", RUN, *settings)
    if finished.returncode not in (0, 3):
        raise RuntimeError(finished.stderr)


def tearDownModule():
    FOLDER.cleanup()


class Embeddings(unittest.TestCase):
    def setUp(self):
        self.model = partprobe.Model(RUN, supervision="step-parts")
        self.carrier = partprobe.label(partprobe.synth(seed=7), id="bracket")

    def test_rows_are_unit_vectors_and_forms_of_input_agree(self):
        sample = self.model.sample(self.carrier)
        self.assertEqual(sample.points.shape, (600, 3))
        rows = self.model.embed(self.carrier)
        self.assertEqual((rows.shape, rows.dtype), ((600, self.model.dim), np.float32))
        np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, rtol=1e-5)
        np.testing.assert_array_equal(self.model.embed(sample), rows)
        np.testing.assert_array_equal(self.model.embed(sample.points, sample.normals), rows)
        scores = partprobe.score(sample.labels(), embedding=rows)
        self.assertTrue(0.0 < scores["miou"] <= 1.0)

    def test_the_program_has_the_same_embeddings(self):
        with tempfile.TemporaryDirectory() as folder:
            carrier = pathlib.Path(folder) / "bracket.npz"
            self.carrier.save(carrier)
            out = pathlib.Path(folder) / "out"
            finished = program("embed", self.model.path, carrier, "--form", "points", "--out", out)
            self.assertEqual(finished.returncode, 0, finished.stderr)
            np.testing.assert_array_equal(np.load(out / "bracket.npz")["embeddings"], self.model.embed(self.carrier))

    def test_without_a_seed_the_lowest_one_is_taken(self):
        first = partprobe.Model(RUN, supervision="step-parts", seed=0)
        self.assertEqual(self.model.path, first.path)

    def test_a_model_can_be_pickled(self):
        again = pickle.loads(pickle.dumps(self.model))
        self.assertEqual(repr(again), repr(self.model))

    def test_what_is_not_a_model_is_refused(self):
        for error, words, path, options in [
            (partprobe.UsageError, "choose one backbone", RUN, {}),
            (partprobe.UsageError, "choose one backbone", RUN, {"supervision": "nothing"}),
            (partprobe.UsageError, "was trained on `step-parts` with seed 0", self.model.path, {"supervision": "ward-20"}),
            (partprobe.UsageError, "was trained on `step-parts` with seed 0", self.model.path, {"seed": 7}),
            (partprobe.UsageError, "a seed must be from 0 to", RUN, {"seed": -1}),
            (FileNotFoundError, "gone", RUN / "gone", {}),
            (partprobe.DamagedFileError, "config.toml", RUN / "config.toml", {}),
        ]:
            with self.assertRaises(error) as caught:
                partprobe.Model(path, **options)
            self.assertIn(words, str(caught.exception))
        with self.assertRaises(partprobe.UsageError):
            self.model.embed([[0.0, 0.0, 0.0]])
        sample = self.model.sample(self.carrier)
        with self.assertRaisesRegex(partprobe.UsageError, "have their own"):
            self.model.embed(sample, sample.normals)

    def test_exchanged_weights_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder) / "checkpoints/ward-20-0"
            place.mkdir(parents=True)
            (place / "model.safetensors").write_bytes(self.model.path.read_bytes())
            with self.assertRaisesRegex(partprobe.UsageError, "was trained on `step-parts`"):
                partprobe.Model(folder)

    def test_weights_that_were_changed_after_their_training_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder) / "checkpoints/step-parts-0"
            shutil.copytree(self.model.path.parent, place)
            self.assertEqual(partprobe.Model(folder).dim, self.model.dim)
            weights = bytearray(self.model.path.read_bytes())
            weights[-1] ^= 1
            (place / "model.safetensors").write_bytes(weights)
            with self.assertRaisesRegex(partprobe.DamagedFileError, "was changed after its training ended"):
                partprobe.Model(folder)


if __name__ == "__main__":
    unittest.main()
