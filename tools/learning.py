"""Trains the rows of docs/studies/learning.md, and prints the tables. Each row changes one setting of the training.

    learning.py DATASET OUT [--rows CHANGE…]        or, which labels first: just study learning FOLDER…

Input: the program, DATASET that `partprobe label` wrote, and OUT, a folder for the runs. A run that already exists there is read, and
not trained again. Each row is one run of the config `real-small` with two label sources and three seeds.
Output: Markdown on stdout. The first table decides: a change becomes a default if it raises the validation mIoU of both sources by 0.02 or
more, and lowers their GTc mIoU by 0.02 or less. The second table has the scores of the test shapes.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import time

SOURCES = ("step-parts", "normal-kmeans-20")
SEEDS = (0, 1, 2)
COMMON = (
    f"compare.supervision={json.dumps(SOURCES)}",
    f"compare.seeds={json.dumps(SEEDS)}",
    'compare.references=["step-parts"]',
    "train.steps=1500",
    "train.valid_every=1500",
    'net.refine={ type = "mean-shift", kappa = 20.0, steps = 8 }',
    # The values that were the defaults before this study. Each change is compared with them.
    "loss.pull_weight=1.0",
    "loss.pull_margin=0.1",
)
ROWS = (
    ("defaults", ()),
    ("chord pull", ('loss.pull="chord"', "loss.pull_weight=2.0")),
    ("pull without a margin", ("loss.pull_weight=2.0", "loss.pull_margin=0.0")),
    ("384 to 1536 tokens in training", ("tokens.train_tokens=[384, 1536]",)),
    ("tokens of a cell exchange", ("net.backbone.cell_exchange=true",)),
)
# The limits for accepting a change.
LEAST_GAIN, MOST_LOSS = 0.02, 0.02


def run(arguments, name, settings):
    """Trains and scores a row, unless its run exists. Returns the run folder."""
    out = arguments.out / name.replace(",", "").replace(" ", "-")
    if (out / "scores.jsonl").exists():
        return out
    command = [arguments.partprobe, "run", arguments.config, "--data", arguments.data, "--out", out, "--jobs", arguments.jobs]
    if out.exists():
        command.append("--resume")
    for setting in COMMON + settings:
        command += ["--set", setting]
    begun = time.monotonic()
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print(f"{name}: {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    return out


def validations(out, source):
    """Returns, for each seed, the last validation of a source against itself."""
    of_seed = (json.loads((out / f"checkpoints/{source}-{seed}/validations.json").read_text()) for seed in SEEDS)
    return [found["validations"][-1] for found in of_seed]


def test_scores(out, source, clusterer, metric):
    """Returns, for each seed, the mean of a metric against STEP-Parts over the test shapes with 2 to 19 parts."""
    rows = [json.loads(line) for line in (out / "scores.jsonl").read_text().splitlines()]
    wanted = {"supervision": source, "reference": "step-parts", "clusterer": clusterer}
    rows = [row for row in rows if all(row[key] == value for key, value in wanted.items()) and 2 <= row["k"] <= 19]
    return [statistics.mean(row[metric] for row in rows if row["seed"] == seed) for seed in sorted({row["seed"] for row in rows})]


def spread(values):
    """Returns the mean and the standard deviation as text."""
    deviation = f" ± {statistics.stdev(values):.3f}" if len(values) > 1 else ""
    return f"{statistics.mean(values):.3f}{deviation}"


def changes(out, first, source):
    """Returns by how much the mean validation mIoU and the mean GTc mIoU differ from those of the first row."""
    mean = lambda folder, metric: statistics.mean(found[metric] for found in validations(folder, source))
    return [mean(out, metric) - mean(first, metric) for metric in ("miou", "gtc_miou")]


def verdict(out, first):
    """Returns `yes` if the change is accepted, and `no` if not."""
    each = [changes(out, first, source) for source in SOURCES]
    accepted = all(miou >= LEAST_GAIN and gtc >= -MOST_LOSS for miou, gtc in each)
    return "yes" if accepted else "no"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--partprobe", default="target/release/partprobe")
    parser.add_argument("--config", default="real-small")
    parser.add_argument("--jobs", type=int, default=2)
    names = [name for name, _ in ROWS]
    parser.add_argument("--rows", nargs="+", metavar="CHANGE", choices=names, default=names, help="the rows; the first is the baseline")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = [(name, settings) for name, settings in ROWS if name in arguments.rows]
    folders = [(name, settings, run(arguments, name, settings)) for name, settings in chosen]
    first = folders[0][2]

    print("Validation, each source against itself (mean ± standard deviation over three seeds):\n")
    print("| change | settings | " + " | ".join(f"`{source}`: mIoU | GTc mIoU" for source in SOURCES) + " | accepted |")
    print("|---|---|" + "---:|---:|" * len(SOURCES) + "---|")
    for name, settings, out in folders:
        shown = " ".join(f"`{setting}`" for setting in settings) or "–"
        cells = []
        for source in SOURCES:
            found = validations(out, source)
            cells += [spread([one[metric] for one in found]) for metric in ("miou", "gtc_miou")]
        print(f"| {name} | {shown} | {' | '.join(cells)} | {verdict(out, first) if out != first else '–'} |")

    print("\nTest shapes with 2 to 19 parts, against `step-parts`:\n")
    print("| trained on | change | k-means mIoU | mean-shift+k-means mIoU | GTc mIoU |")
    print("|---|---|---:|---:|---:|")
    for source in SOURCES + ("untrained", "no-network", "growing-20", "token-ceiling"):
        for name, _, out in folders if source in SOURCES else folders[:1]:
            plain, refined = (test_scores(out, source, column, "miou") for column in ("k-means", "mean-shift+k-means"))
            has_gtc = source in SOURCES + ("untrained",)
            nearest = spread(test_scores(out, source, "k-means", "gtc_miou")) if has_gtc else "–"
            change = name if source in SOURCES else "–"
            print(f"| `{source}` | {change} | {spread(plain)} | {spread(refined)} | {nearest} |")


if __name__ == "__main__":
    main()
