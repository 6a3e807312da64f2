"""Publishes what a run measured per label source: the time of its trainings, the scores of every shape, and charts.

    arms.py RUN FOLDER --partprobe PROGRAM [--charts NAME…]

Input: RUN, the folder of a scored run; FOLDER, a folder below docs/.
Output: in FOLDER, `scores/SOURCE.csv` with the scores of each test shape, for each trained label source; and the charts of the run with
these names, as SVG files (without `--charts`: `means` and `curve-valid-miou`). Older files of these kinds are removed. On stdout,
Markdown with the charts and with the hours of each label source, for a page in the folder above FOLDER.
"""

import argparse
import csv
import json
import pathlib
import re
import subprocess
import tempfile

# The scores that are published, of the clusterer of the first table.
METRICS = ("miou", "accuracy", "gtc_miou", "ari")


def json_lines(path):
    """Yields the objects of a file with one JSON object per line."""
    with path.open() as lines:
        yield from map(json.loads, lines)


def trainings(run):
    """Returns the last `end` line of each training, by label source and seed, in the order of the log."""
    found = {}
    for line in json_lines(run / "log.jsonl"):
        if line["event"] == "end":
            found[line["supervision"], line["seed"]] = line
    return found


def print_hours(run):
    """Prints one row per label source: seeds, updates, hours of training, and the shapes that are learned per second."""
    ends = trainings(run)
    record = json.loads((run / "run.json").read_text())
    stages, threads = record["stage_seconds"], record["threads"]
    print("| label source | seeds | updates per training | hours of training | shapes per second |")
    print("|---|---:|---:|---:|---:|")
    for source in dict.fromkeys(source for source, _ in ends):
        own = [end for (name, _), end in ends.items() if name == source]
        updates, seconds, shapes = own[0]["step"], sum(end["seconds"] for end in own), sum(end["shapes"] for end in own)
        print(f"| `{source}` | {len(own)} | {updates} | {seconds / 3600:.2f} | {shapes / seconds:.1f} |")
    of_trainings = sum(end["seconds"] for end in ends.values()) / 3600
    of_scoring = sum(seconds for stage, seconds in stages if stage == "evaluate") / 3600
    print(f"\nAll trainings took {of_trainings:.2f} hours, and scoring took {of_scoring:.2f} hours (threads: {threads}).")


def write_scores(run, folder):
    """Writes the scores of each shape, one file per label source: one row per shape and reference, one column per score and seed."""
    sources = list(dict.fromkeys(source for source, _ in trainings(run)))
    rows = [row for row in json_lines(run / "scores.jsonl") if row["supervision"] in sources]
    clusterer = rows[0]["clusterer"]
    for source in sources:
        own = [row for row in rows if row["supervision"] == source and row["clusterer"] == clusterer]
        seeds = sorted({row["seed"] for row in own})
        by_shape = {}
        for row in own:
            by_shape.setdefault((row["shape"], row["reference"], row["k"]), {})[row["seed"]] = row
        with (folder / f"{source}.csv").open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["shape", "reference", "k", *(f"{metric}_seed{seed}" for metric in METRICS for seed in seeds)])
            for (shape, reference, k), of_seeds in by_shape.items():
                scores = (of_seeds[seed].get(metric) if seed in of_seeds else None for metric in METRICS for seed in seeds)
                table.writerow([shape, reference, k, *("" if score is None else f"{score:.4f}" for score in scores)])


def write_charts(run, folder, names, partprobe):
    """Writes the charts with these names, and prints them as images of Markdown with their captions."""
    with tempfile.TemporaryDirectory() as scratch:
        subprocess.run([str(partprobe), "report", str(run), "--charts", scratch, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        for name in names:
            svg = pathlib.Path(scratch, f"{name}.svg").read_text()
            (folder / f"{name}.svg").write_text(svg)
            caption = " ".join(re.findall(r'<text class="caption"[^>]*>(.*?)</text>', svg))
            print(f"![{caption}]({folder.name}/{name}.svg)\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--charts", nargs="+", default=["means", "curve-valid-miou"])
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    scores = arguments.folder / "scores"
    scores.mkdir(parents=True, exist_ok=True)
    for old in [*scores.glob("*.csv"), *arguments.folder.glob("*.svg")]:
        old.unlink()

    write_scores(arguments.run, scores)
    write_charts(arguments.run, arguments.folder, arguments.charts, arguments.partprobe)
    print_hours(arguments.run)


if __name__ == "__main__":
    main()
