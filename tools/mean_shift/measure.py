#!/usr/bin/env python3
"""Measures the mean shift of the shipped configs on embeddings of real shapes, in seconds on one core.

    python3 tools/mean_shift/measure.py TIME_MEAN_SHIFT EMBEDDINGS.npz...        or: just bench-mean-shift EMBEDDINGS.npz...

Input: TIME_MEAN_SHIFT, the built example of crates/net; and embeddings that `partprobe embed --set net.refine=none` wrote.
Output: a Markdown table on stdout, with the mean, the median and the longest time below it.
Exit status: 1 if the mean over the shapes is above 0.2 s.
Needs numpy.

When two rows have moved to the same position, mean shift moves them as one row. So embeddings of parts take less time than the same
number of random rows. The last column has the time without this effect.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np

MAX_SECONDS = 0.2


def measured(program, rows):
    """Returns the times of the mean shift of these rows on one thread, as the object that the example prints."""
    with tempfile.NamedTemporaryFile(suffix=".f32") as file:
        rows.astype("<f4").tofile(file.name)
        command = [program, file.name, str(rows.shape[1])]
        one_thread = {**os.environ, "RAYON_NUM_THREADS": "1"}
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=one_thread).stdout)


def files_at(path):
    """Returns the npz files of a folder, or the given file."""
    return sorted(path.glob("*.npz")) if path.is_dir() else [path]


def main():
    program, *paths = sys.argv[1:]
    files = [file for path in paths for file in files_at(pathlib.Path(path))]
    print("| shape | tokens | numbers | s | s, if no rows met |")
    print("|---|---:|---:|---:|---:|")
    seconds = []
    for path in files:
        rows = np.load(path)["embeddings"]
        found = measured(program, rows)
        seconds.append(found["joined_s"])
        name = pathlib.Path(path).stem
        print(f"| {name} | {len(rows)} | {rows.shape[1]} | {found['joined_s']:.3f} | {found['apart_s']:.3f} |", flush=True)
    mean, median = statistics.mean(seconds), statistics.median(seconds)
    print(f"\nMean {mean:.3f} s, median {median:.3f} s, longest {max(seconds):.3f} s over {len(seconds)} shapes.")
    sys.exit(0 if mean <= MAX_SECONDS else 1)


if __name__ == "__main__":
    main()
