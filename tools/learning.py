"""Trains the rows of docs/studies/learning.md, one change of the training each, and prints its tables.

In: the program, a data set that `partprobe label` made, and a folder for the runs; rows that are there already are read and not
trained again. Each row is one run of `real-small` with two label sources and three seeds.
Out: Markdown on stdout. The first table decides: a change becomes a default if the validation mIoU of both sources rises by
0.02 or more and their GTc mIoU falls by 0.02 or less. The second table has the scores of the test shapes.
Run it by `just study learning DATASET`.
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
    # The defaults before this study, with which each change is compared.
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
    """Trains and scores a row, unless it was done before. Returns the folder of its run."""
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
    """For each seed, the last validation of a source against itself."""
    of_seed = (json.loads((out / f"checkpoints/{source}-{seed}/validations.json").read_text()) for seed in SEEDS)
    return [found["validations"][-1] for found in of_seed]


def test_scores(out, source, clusterer, metric):
    """For each seed, the mean of a metric against STEP-Parts over the test shapes with 2 to 19 parts."""
    rows = [json.loads(line) for line in (out / "scores.jsonl").read_text().splitlines()]
    wanted = {"supervision": source, "reference": "step-parts", "clusterer": clusterer}
    rows = [row for row in rows if all(row[key] == value for key, value in wanted.items()) and 2 <= row["k"] <= 19]
    return [statistics.mean(row[metric] for row in rows if row["seed"] == seed) for seed in sorted({row["seed"] for row in rows})]


def spread(values):
    deviation = f" ± {statistics.stdev(values):.3f}" if len(values) > 1 else ""
    return f"{statistics.mean(values):.3f}{deviation}"


def changes(out, first, source):
    """The differences of the means of validation mIoU and GTc mIoU from those of the first row."""
    mean = lambda folder, metric: statistics.mean(found[metric] for found in validations(folder, source))
    return [mean(out, metric) - mean(first, metric) for metric in ("miou", "gtc_miou")]


def verdict(out, first):
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
    parser.add_argument("--rows", nargs="+", metavar="CHANGE", choices=names, default=names, help="the first is compared with")
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
