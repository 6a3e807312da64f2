#!/usr/bin/env python3
"""Compares the time and the inertia of the k-means of partprobe with those of scikit-learn on one core.

    python3 tools/kmeans/compare.py TIME_KMEANS [EMBEDDINGS.npz...]        or: just bench-kmeans [EMBEDDINGS.npz...]

Input: TIME_KMEANS, the built example of crates/cluster; and embeddings that `partprobe embed` or `eval.embeddings = true` wrote. Without
embeddings, the script generates 4 096 tokens of 128 numbers at three spreads.
Output: a Markdown table on stdout. In its heading, "ours" means partprobe.
Exit status: 1 if partprobe is less than three times as fast as scikit-learn, takes more than 0.3 s, or has a larger inertia.
Needs numpy and scikit-learn.

scikit-learn runs both of its algorithms with ten k-means++ restarts, and the faster one counts. All seconds are CPU seconds, so other
programs on the machine hardly change them. Rows of pure noise (spread 30) are shown, but they do not affect the exit status.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np  # noqa: E402
from sklearn.cluster import KMeans  # noqa: E402

N_TOKENS, DIM, K, RESTARTS = 4096, 128, 20, 10
# The time of scikit-learn is the shortest of this number of calls.
N_CALLS = 3
# An inertia that is larger by less than this fraction counts as equal, because both end in local optima of random starts.
TIE = 2e-3
MAX_SECONDS, LEAST_FACTOR = 0.3, 3.0
# These rows have no clusters. No shape is like this.
NOISE = "generated, spread 30.0"


def generated(spread):
    """Returns unit rows around K random directions. The sizes of the clusters are as unequal as the areas of the faces of real parts."""
    rng = np.random.default_rng(0)
    axes = rng.uniform(-1, 1, (K, DIM))
    share = (np.arange(N_TOKENS) / N_TOKENS) ** 2
    rows = axes[(share * K).astype(int)] + spread * rng.uniform(-1, 1, (N_TOKENS, DIM))
    return unit(rows)


def unit(rows):
    """Returns the rows scaled to length 1."""
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
    return np.ascontiguousarray(rows, dtype=np.float32)


def scikit(rows, algorithm):
    """Returns the shortest time in CPU seconds and the inertia of scikit-learn."""
    seconds, inertia = [], None
    for _ in range(N_CALLS):
        model = KMeans(K, n_init=RESTARTS, algorithm=algorithm, random_state=0)
        begun = time.process_time()
        model.fit(rows)
        seconds.append(time.process_time() - begun)
        inertia = model.inertia_
    return min(seconds), inertia


def ours(program, rows):
    """Returns the times and the objectives of partprobe, as the object that the example prints."""
    with tempfile.NamedTemporaryFile(suffix=".f32") as file:
        rows.astype("<f4").tofile(file.name)
        command = [program, file.name, str(rows.shape[1]), str(K), str(RESTARTS)]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def files_at(path):
    """Returns the npz files of a folder, or the given file."""
    return sorted(path.glob("*.npz")) if path.is_dir() else [path]


def main():
    program, *paths = sys.argv[1:]
    files = [file for path in paths for file in files_at(pathlib.Path(path))]
    cases = [(f"generated, spread {spread}", generated(spread)) for spread in (0.3, 1.5, 30.0)]
    if files:
        cases = [(os.path.basename(path), unit(np.load(path)["embeddings"])) for path in files]
    print("| rows | n | ours, s | spherical, s | scikit-learn lloyd, s | elkan, s | factor | our inertia / its |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    is_met = True
    for name, rows in cases:
        mine = ours(program, rows)
        found = {algorithm: scikit(rows, algorithm) for algorithm in ("lloyd", "elkan")}
        fastest = min(seconds for seconds, _ in found.values())
        least = min(inertia for _, inertia in found.values())
        factor = fastest / mine["euclidean_s"]
        ratio = mine["euclidean_objective"] / least
        print(
            f"| {name} | {len(rows)} | {mine['euclidean_s']:.3f} | {mine['spherical_s']:.3f} | {found['lloyd'][0]:.3f} | "
            f"{found['elkan'][0]:.3f} | {factor:.1f} | {ratio:.4f} |"
        )
        if name == NOISE:
            continue
        is_met &= factor >= LEAST_FACTOR and ratio <= 1 + TIE
        is_met &= max(mine["euclidean_s"], mine["spherical_s"]) <= MAX_SECONDS
    sys.exit(0 if is_met else 1)


if __name__ == "__main__":
    main()
