"""Makes what the tests read: generated STEP files, and a data set that the program of the wheel labels."""

import pathlib
import subprocess
import sys
import tempfile

import partprobe

PROGRAM = pathlib.Path(sys.executable).with_name("partprobe")
N_PARTS = 4


def program(*arguments):
    """The finished process of the program that the wheel installed."""
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


class Material:
    """A folder with `parts/*.step`, a damaged file among them, and `dataset/`; it is removed at the end."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        self.parts = self.path / "parts"
        self.dataset = self.path / "dataset"
        self.parts.mkdir()
        for index in range(N_PARTS):
            (self.parts / f"part{index}.step").write_bytes(partprobe.synth(seed=7, index=index))
        (self.parts / "empty.step").write_bytes(b"")
        finished = program("label", self.parts, "--out", self.dataset, "--jobs", 1)
        if finished.returncode:
            raise RuntimeError(finished.stderr)

    def remove(self):
        self.folder.cleanup()
