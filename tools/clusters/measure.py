"""Measures what a million files cost: measure.py PROGRAM FOLDER…

In: folders of STEP files. Out: Markdown with CPU seconds per 1 000 files for one and two workers, in total over the program and its
workers, and the mean size and number of faces of each folder. CPU seconds depend little on what else the machine does; times do.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile


def cpu_seconds(command):
    """CPU seconds, user and system, of a command with all that it starts."""
    before = os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system


def measure(program, folder, scratch):
    files = [path for path in folder.rglob("*") if path.is_file()]
    seconds = {}
    for jobs in (1, 2):
        out = scratch / f"{folder.name}-{jobs}"
        seconds[jobs] = cpu_seconds([program, "label", folder, "--out", out, "--jobs", str(jobs), "--quiet"])
    index = [json.loads(line) for line in (out / "index.jsonl").read_text().splitlines()]
    shapes = [line for line in index if line["status"] == "ok"]
    n_faces = sum(line["n_faces"] for line in shapes)
    n_bytes = sum((out / line["file"]).stat().st_size for line in shapes)
    thousands = len(files) / 1000
    return (
        f"| {folder.name} | {len(files)} | {sum(path.stat().st_size for path in files) / len(files) / 1000:.0f} "
        f"| {n_faces / len(shapes):.0f} | {seconds[1] / thousands:.1f} | {seconds[2] / thousands:.1f} "
        f"| {n_bytes / len(shapes) / 1000:.0f} | {seconds[1] / thousands * 1000 / 3600:.1f} |"
    )


def main():
    program, *folders = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    print("| group | files | kB per file | faces per shape | CPU s per 1 000 files, 1 worker | 2 workers | kB per carrier | CPU hours per million |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as scratch:
        for folder in folders:
            print(measure(program, folder, pathlib.Path(scratch)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
