"""Trains backbones on the same shapes for the same time, and prints the table of docs/studies/backbones.md.

    backbones.py DATASET OUT        or, which labels first: just study backbones FOLDER…

Input: the program, DATASET that `partprobe label` wrote, and OUT, a folder for the runs. A run that already exists there is read, and
not trained again.
Output: Markdown on stdout. The scores are means over the test shapes with 2 to 19 parts, against STEP-Parts.

Each row is one run of the config `hour` with another backbone. `partprobe bench step` measures the CPU time of an update. The number of
updates of a backbone follows from it, so that the updates of each training take `--minutes` of CPU time.
"""

import argparse
import json
import pathlib
import subprocess
import sys

from learning import spread, test_scores

ROWS = (
    ("ptv3", "micro"),
    ("ptv3", "tiny"),
    ("ptv3", "mini"),
    ("litept", "micro"),
    ("litept", "tiny"),
    ("ptx", "micro"),
    ("ptx", "tiny"),
)
SOURCE = "step-parts"
# A typical number of tokens of a training shape. A training draws this number log-uniformly from 384 to 1 536.
TOKENS, BATCH = 832, 4


def settings_of(backbone, preset):
    """Returns the settings of a backbone. The exchange between the tokens of a cell stays on for PTv3; other backbones do not have it."""
    return [f"net.backbone.type={backbone}", f"net.backbone.preset={preset}"]


def words(settings):
    """Returns the settings as arguments of the command line."""
    return [word for setting in settings for word in ("--set", setting)]


def measured(arguments, settings):
    """Returns the cost of an update, as the object that `bench step --json` prints."""
    command = [arguments.partprobe, "bench", "step", "--config", "hour", "--tokens", TOKENS, "--batch", BATCH, "--json"]
    done = subprocess.run([str(word) for word in command + words(settings)], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def run(arguments, name, settings):
    """Trains and scores a row, unless its run exists. Returns the run folder."""
    out = arguments.out / name
    if (out / "scores.jsonl").exists():
        return out
    out.parent.mkdir(parents=True, exist_ok=True)
    cost_file = arguments.out / f"{name}.json"
    if not cost_file.exists():
        cost_file.write_text(json.dumps(measured(arguments, settings)))
    cost = json.loads(cost_file.read_text())
    steps = round(arguments.minutes * 60_000 / cost["step_cpu_ms"])
    more = [
        f"compare.seeds={json.dumps(arguments.seeds)}",
        f'compare.references=["{SOURCE}"]',
        f"train.steps={steps}",
        f"train.valid_every={steps}",
    ]
    command = [arguments.partprobe, "run", "hour", "--data", arguments.data, "--out", out, "--jobs", "1"]
    if out.exists():
        command.append("--resume")
    print(f"{name}: {steps} updates", file=sys.stderr, flush=True)
    subprocess.run([str(word) for word in command + words(settings + more)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return out


def ends(out):
    """Returns the last line of each training in the log."""
    lines = (json.loads(line) for line in (out / "log.jsonl").read_text().splitlines())
    return [line for line in lines if line["event"] == "end"]


def scores(out, supervision):
    """Returns the cells of the three scores of a row."""
    plain, refined = (spread(test_scores(out, supervision, column, "miou")) for column in ("k-means", "mean-shift+k-means"))
    return f"{plain} | {refined} | {spread(test_scores(out, supervision, 'k-means', 'gtc_miou'))}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--partprobe", default="target/release/partprobe")
    parser.add_argument("--minutes", type=float, default=4.0, help="CPU minutes that the updates of each training may take")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    arguments = parser.parse_args()

    print(f"{arguments.minutes:g} CPU minutes of updates per training, seeds {arguments.seeds}:\n")
    print("| backbone | preset | parameters | CPU ms per update | updates | k-means mIoU | mean-shift+k-means mIoU | GTc mIoU |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for backbone, preset in ROWS:
        name = f"{backbone}-{preset}"
        out = run(arguments, name, settings_of(backbone, preset))
        cost = json.loads((arguments.out / f"{name}.json").read_text())
        parameters = f"{cost['parameters']:,}".replace(",", " ")
        updates = f"{ends(out)[0]['step']:,}".replace(",", " ")
        print(f"| `{backbone}` | `{preset}` | {parameters} | {cost['step_cpu_ms']:.0f} | {updates} | {scores(out, SOURCE)} |")


if __name__ == "__main__":
    main()
