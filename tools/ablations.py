"""Trains the ablations of docs/studies/ablations.md. Each row of the table changes one factor.

    ablations.py OUT [--rows NAME…]        or: just ablations OUT

Input: the program, and OUT, a folder for the runs. A run that already exists there is read, and not trained again.
Output: a Markdown table on stdout. A row is printed when its training ends. For each supervision it has the validation scores against that
supervision, and the test score against STEP-Parts.
If a training fails, its error goes to stderr and its row is left out.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import time

SUPERVISIONS = ("step-parts", "normal-kmeans-20")
ROWS = (
    ("defaults", ()),
    ("no xCPE", ("net.backbone.xcpe=false",)),
    ("no attention", ("net.backbone.attention=false",)),
    ("one order (z)", ('net.backbone.orders=["z"]',)),
    ("plain voxels", ("tokens.voxels=plain",)),
    ("patch 32", ("net.backbone.patch=32",)),
    ("256 tokens in training", ("tokens.train_tokens=256",)),
    ("1 024 tokens in training", ("tokens.train_tokens=1024",)),
    ("push margin 0", ("loss.push_margin=0.0",)),
    ("no prototype CE", ("loss.proto_ce_weight=0.0",)),
    ("prototype CE alone", ("loss.pull_weight=0.0", "loss.push_weight=0.0")),
    ("learning rate 3e-3", ("optim.learning_rate=0.003",)),
    ("batch 2, 800 steps", ("train.batch_shapes=2", "train.steps=800")),
    ("pointnet", ('net.backbone={ type = "pointnet", widths = [64, 128, 256] }',)),
    ("orders not shuffled", ("net.backbone.shuffle_orders=false",)),
    ("patch 512", ("net.backbone.patch=512",)),
    ("pull margin 0.02", ("loss.pull_margin=0.02",)),
    ("hinge squared", ("loss.hinge=squared",)),
    ("weight by point", ("loss.weight=point",)),
    ("batch norm", ("net.backbone.norm=batch",)),
    ("no free rotation", ("augment.free_rotation_probability=0.0",)),
    ("tiny", ("net.backbone.preset=tiny",)),
)


def run(arguments, name, settings, data):
    """Trains and scores a row, unless its run exists. Returns the run folder and the seconds that the run took."""
    out = arguments.out / name.replace(" ", "-").replace("(", "").replace(")", "")
    if (out / "scores.jsonl").exists():
        return out, json.loads((out / "seconds.json").read_text())
    command = [arguments.partprobe, "run", arguments.config, "--out", out, "--jobs", arguments.jobs, *data]
    if out.exists():
        command.append("--resume")
    for setting in settings:
        command += ["--set", setting]
    begun = time.monotonic()
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = time.monotonic() - begun
    (out / "seconds.json").write_text(json.dumps(seconds))
    return out, seconds


def validation(out, supervision):
    """Returns the mIoU and the GTc mIoU of the last validation."""
    last = json.loads((out / f"checkpoints/{supervision}-0/validations.json").read_text())["validations"][-1]
    return last["miou"], last["gtc_miou"]


def test_score(out, supervision):
    """Returns the mean k-means mIoU against STEP-Parts over the test shapes with 2 to 19 parts."""
    rows = [json.loads(line) for line in (out / "scores.jsonl").read_text().splitlines()]
    wanted = {"supervision": supervision, "reference": "step-parts", "clusterer": "k-means"}
    scores = [r["miou"] for r in rows if all(r[key] == value for key, value in wanted.items()) and 2 <= r["k"] <= 19]
    return sum(scores) / len(scores)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--partprobe", default="target/release/partprobe")
    parser.add_argument("--config", default="configs/ablation.toml")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--rows", nargs="+", metavar="NAME", help="train only `defaults` and these rows, for example `tiny` `pointnet`")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("| row | settings | step-parts: own mIoU, GTc | normal-kmeans-20: own mIoU, GTc | test, by STEP-Parts | s |")
    print("|---|---|---:|---:|---:|---:|")
    data = []
    for name, settings in ROWS:
        if arguments.rows and name not in ("defaults", *arguments.rows):
            continue
        try:
            out, seconds = run(arguments, name, settings, data)
        except subprocess.CalledProcessError as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        # All rows use the parts that the first row generated.
        data = ["--data", out / "data/carriers"] if not data else data
        own = " | ".join("{:.3f}, {:.3f}".format(*validation(out, supervision)) for supervision in SUPERVISIONS)
        scores = ", ".join(f"{test_score(out, supervision):.3f}" for supervision in SUPERVISIONS)
        shown = " ".join(f"`{setting}`" for setting in settings) or "–"
        print(f"| {name} | {shown} | {own} | {scores} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
