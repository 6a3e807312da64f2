"""Releases the labels of STEP files as a package, attaches the package to the files again, and compares all bytes.

    release_study.py FOLDER… --partprobe PROGRAM

Input: folders of STEP files. Their parent is the folder in which the commands run, so that ids do not depend on where it is.
Output: a Markdown table on stdout, with one row per unit: whole files, and solids.
Exit status: 1 if a carrier or the index differs.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile

UNITS = ("file", "solid")
HEAD = ("unit", "files", "shapes", "faces", "carriers", "package", "bytes per face", "`label`", "`release`", "`attach`", "equal carriers")


def cpu_seconds():
    """Returns the CPU seconds of all commands so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Study:
    """The commands, with the folder in which they run."""

    def __init__(self, program, folders, scratch):
        self.program, self.scratch = program, pathlib.Path(scratch)
        parents = {folder.parent for folder in folders}
        if len(parents) != 1:
            raise SystemExit("the folders must lie in one folder")
        self.parent, self.names = parents.pop(), [folder.name for folder in folders]

    def call(self, *words):
        """Runs a command with one worker, and returns its CPU seconds."""
        before = cpu_seconds()
        command = [str(word) for word in (self.program, *words, "--jobs", "1", "--quiet")]
        subprocess.run(command, cwd=self.parent, check=True, stdout=subprocess.DEVNULL)
        return cpu_seconds() - before

    def row(self, unit):
        """Measures one unit. Returns the cells of its row, and whether everything is equal."""
        data, package, again = (self.scratch / f"{name}-{unit}" for name in ("data", "package", "again"))
        seconds = [
            self.call("label", *self.names, "--unit", unit, "--out", data),
            self.call("release", data, "--out", package),
            self.call("attach", package, *self.names, "--out", again),
        ]
        carriers = sorted(path.relative_to(data) for path in data.rglob("*.npz"))
        equal = sum((again / path).is_file() and (data / path).read_bytes() == (again / path).read_bytes() for path in carriers)
        same_index = (data / "index.jsonl").read_bytes() == (again / "index.jsonl").read_bytes()
        counts = json.loads((package / "release.json").read_text())["counts"]
        n_files = sum(path.is_file() for name in self.names for path in (self.parent / name).rglob("*"))
        n_bytes = size_of(package.iterdir())
        cells = [
            unit,
            n_files,
            counts["n_shapes"],
            counts["n_faces"],
            f"{size_of(data / path for path in carriers) / 1e6:.0f} MB",
            f"{n_bytes / 1e6:.1f} MB",
            f"{n_bytes / counts['n_faces']:.1f}",
            *(f"{one:.1f} s" for one in seconds),
            f"{equal} of {len(carriers)}" + ("" if same_index else ", but the index differs"),
        ]
        return cells, same_index and equal == len(carriers) == len(list(again.rglob("*.npz")))


def size_of(paths):
    """Returns the bytes of some files."""
    return sum(path.stat().st_size for path in paths)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    all_equal = True
    print("| " + " | ".join(HEAD) + " |\n|---" + "|---:" * (len(HEAD) - 1) + "|")
    with tempfile.TemporaryDirectory() as scratch:
        study = Study(arguments.partprobe, arguments.folders, scratch)
        for unit in UNITS:
            cells, is_equal = study.row(unit)
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)
            all_equal &= is_equal
    return 0 if all_equal else 1


if __name__ == "__main__":
    sys.exit(main())
