"""Measures the CPU time and the speed of `partprobe label`, from which the cost of a million files follows.

    measure.py PROGRAM FOLDER…

Input: folders of STEP files. Each folder is a row of the table.
Output: a Markdown table on stdout, with the mean size and number of faces, the files per second for one worker and for one worker per
core, the CPU seconds per 1 000 files of the program and its workers together, the size of a carrier, and the CPU hours per million files.

CPU seconds depend little on other programs on the machine. Files per second need an idle machine.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile


N_CORES = os.cpu_count() or 1


def seconds_of(command):
    """Returns the seconds that a command takes, and its CPU seconds (user and system), including those of its child processes."""
    before = os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    cpu = after.children_user - before.children_user + after.children_system - before.children_system
    return after.elapsed - before.elapsed, cpu


def measure(program, folder, scratch):
    """Labels a folder with one worker and with all cores, and returns its row of the table."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    walls, cpus = {}, {}
    for jobs in (1, N_CORES):
        # Only the second call counts, so the files are in memory for both numbers of workers.
        for again in ("", "-again"):
            out = scratch / f"{folder.name}-{jobs}{again}"
            walls[jobs], cpus[jobs] = seconds_of([program, "label", folder, "--out", out, "--jobs", str(jobs), "--quiet"])
    index = [json.loads(line) for line in (out / "index.jsonl").read_text().splitlines()]
    shapes = [line for line in index if line["status"] == "ok"]
    n_faces = sum(line["n_faces"] for line in shapes)
    n_bytes = sum((out / line["file"]).stat().st_size for line in shapes)
    thousands = len(files) / 1000
    return (
        f"| {folder.name} | {len(files)} | {sum(path.stat().st_size for path in files) / len(files) / 1000:.0f} "
        f"| {n_faces / len(shapes):.0f} | {len(files) / walls[1]:.0f} | {len(files) / walls[N_CORES]:.0f} "
        f"| {walls[1] / walls[N_CORES]:.2f} | {cpus[1] / thousands:.1f} | {cpus[N_CORES] / thousands:.1f} "
        f"| {n_bytes / len(shapes) / 1000:.0f} | {cpus[1] / thousands * 1000 / 3600:.1f} |"
    )


def main():
    program, *folders = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    print(
        f"| group | files | kB per file | faces per shape | files per s, 1 worker | {N_CORES} workers | speedup "
        f"| CPU s per 1 000 files, 1 worker | {N_CORES} workers | kB per carrier | CPU hours per million |"
    )
    print("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as scratch:
        for folder in folders:
            print(measure(program, folder, pathlib.Path(scratch)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
