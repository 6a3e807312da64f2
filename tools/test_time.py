"""Scores a trained backbone with more tokens, or in more poses, than a default evaluation does.

    test_time.py RUN OUT --partprobe PROGRAM

Input: RUN, a run folder with backbones that were trained on `step-parts`; and OUT, a folder for copies of it. Each row of the table has a
copy, which `partprobe eval` scores again. A copy that already has scores is not scored again.
Output: a Markdown table on stdout, with means over the test shapes with 2 to 19 parts, against `step-parts`, and standard deviations over
seeds.
"""

import argparse
import pathlib
import shutil
import subprocess

from learning import spread, test_scores

ROWS = {
    "1 024 tokens, as trained": [],
    "2 048 tokens": ["tokens.test_tokens=2048"],
    "8 poses, embeddings side by side": ["tokens.test_poses=8"],
}
# These settings score only the backbones of one source, against one reference.
ALONE = [
    'compare.supervision=["step-parts"]',
    'compare.references=["step-parts"]',
    "compare.primary=[]",
    "endpoints=[]",
]


def scored(run, out, settings, program):
    """Scores a copy of the run with these settings, unless it has scores, and returns the folder of the copy."""
    if (out / "scores.jsonl").exists():
        return out
    if not out.exists():
        shutil.copytree(run, out, ignore=shutil.ignore_patterns("predictions", "test", "scores.jsonl"))
    overrides = [word for setting in [*ALONE, *settings] for word in ("--set", setting)]
    subprocess.run([program, "eval", out, "--jobs", "1", *overrides], check=True, stdout=subprocess.DEVNULL)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--partprobe", default="target/release/partprobe")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    columns = [("k-means", "miou"), ("mean-shift+k-means", "miou"), ("k-means", "gtc_miou")]
    print("| scored with | k-means mIoU | mean shift + k-means mIoU | GTc mIoU | token ceiling |")
    print("|---|---:|---:|---:|---:|")
    for idx, (name, settings) in enumerate(ROWS.items()):
        folder = scored(arguments.run, arguments.out / str(idx), settings, arguments.partprobe)
        cells = [spread(test_scores(folder, "step-parts", *column)) for column in columns]
        ceiling = spread(test_scores(folder, "token-ceiling", "k-means", "miou"))
        print(f"| {name} | " + " | ".join([*cells, ceiling]) + " |")


if __name__ == "__main__":
    main()
