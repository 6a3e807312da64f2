"""Makes a large STEP file from a small one, by repeating its data section with new `#` numbers.

    python tools/occt/repeat_step.py FILE.step OUT.step --megabytes 100
    /usr/bin/time -v partprobe label OUT.step --out DIR      # "Maximum resident set size" is that of the worker

All copies are at the same position. This does not matter for a measurement of memory, because the reader shares nothing between copies.
"""

import argparse
import re


def shifted(data, offset):
    """Returns the text with an offset added to every `#` number, except inside quotes."""
    pieces = data.split("'")
    pieces[::2] = [re.sub(r"#(\d+)", lambda match: f"#{int(match[1]) + offset}", piece) for piece in pieces[::2]]
    return "'".join(pieces)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("out")
    parser.add_argument("--megabytes", type=float, default=100)
    options = parser.parse_args()
    with open(options.file, encoding="latin-1") as file:
        text = file.read()
    start = text.index("DATA;") + len("DATA;")
    end = text.index("ENDSEC;", start)
    head, data, tail = text[:start], text[start:end], text[end:]
    step = max(int(number) for number in re.findall(r"#(\d+)", data)) + 1
    copies = max(1, round(options.megabytes * 1e6 / len(data)))
    with open(options.out, "w", encoding="latin-1") as out:
        out.write(head)
        for copy in range(copies):
            out.write(shifted(data, copy * step))
        out.write(tail)
    print(f"{options.out}: {copies} copies of {options.file}")


if __name__ == "__main__":
    main()
