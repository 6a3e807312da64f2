"""Trains the main pair of docs/studies/pair.md, and scores it under other conditions.

    pair.py AAGNET FEATURES FOLDER OUT --partprobe PROGRAM

Input:

- AAGNET: the labels that AAGNet gives to the faces.
- FEATURES: the classes of the faces of MFCAD and of Fusion 360.
- FOLDER: the folder of the groups of STEP files: abc, assemblies, conformance, electronics, fusion, mechanical and mfcad.
- OUT: the folder for the data sets and the runs. What already exists there is not made again.

Output: Markdown on stdout: the learning curve, the primary endpoints of the whole training, the other endpoints, and the scores on
machining features.

The whole training has five seeds. The learning curve has two more points, with fewer updates or with fewer shapes.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
CONFIG = ROOT / "configs/label-pair.toml"
GROUPS = ("abc", "assemblies", "conformance", "electronics", "fusion", "mechanical")
SOURCES = ("step-parts", "aagnet")
# Data sets by name: the groups that are labeled, and the settings.
DATASETS = {
    "solids": (GROUPS, ("label.unit=solid",)),
    "t1": (GROUPS, ("label.unit=solid", "label.chord_fraction=0.001", "label.angle_rad=0.15")),
    "t2": (GROUPS, ("label.unit=solid", "label.chord_fraction=0.004", "label.angle_rad=0.6")),
    "analytic": (GROUPS, ("label.unit=solid", 'label.attributes=["normal"]')),
    "mfcad": (("mfcad",), ()),
    "fusion": (("fusion",), ()),
}
SEEDS = "compare.seeds=[0,1,2]"
# This setting applies only to the endpoints. It is the same for all backbones.
RESTARTS = "eval.restarts=3"
# The points of the learning curve, with the settings that differ from the whole training.
CURVE = {
    "quarter-of-updates": (SEEDS, "train.steps=625", "train.valid_every=625"),
    "quarter-of-shapes": (SEEDS, "split.train_share=0.25"),
}
# The data sets of shapes with features. The values are the largest number of shapes (0: all), and whether there are enough groups for
# a probe. All files of Fusion 360 belong to one repository, which is too few groups.
FEATURES = {"mfcad": (150, True), "fusion": (0, False)}


def endpoints(out):
    """Returns the conditions of the endpoints, as a setting."""
    tables = [
        {"name": "T1", "data": str(out / "t1")},
        {"name": "T2", "data": str(out / "t2")},
        {"name": "analytic-normals", "data": str(out / "analytic"), "normals": "analytic"},
        {"name": "positions-only", "normals": "none"},
        {"name": "noise", "position_noise": 0.005, "normal_noise_deg": 10.0},
        {"name": "plain-voxels", "voxels": "plain"},
    ]
    for name, (max_shapes, has_probe) in FEATURES.items():
        source = f"{name}-features"
        probe = {"probe": source} if has_probe else {}
        tables.append({"name": name, "data": str(out / name), "shapes": "all", "max_shapes": max_shapes, "references": [source], **probe})
    toml = ", ".join("{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }" for table in tables)
    return f"endpoints=[{toml}]"


def call(program, groups, verb, *words, settings=()):
    """Runs a command of the program. `groups` is the folder of the groups of STEP files."""
    command = [program, verb, *words, *(word for setting in settings for word in ("--set", setting))]
    # `label` runs in the folder of the groups, because their names become part of the ids. The other commands run in the root of the
    # repository, because the path of the manifest in a config is relative to it.
    folder = groups if verb == "label" else ROOT
    result = subprocess.run([str(word) for word in command], cwd=folder, stdout=subprocess.DEVNULL)
    # `label` exits with 1 if it could not read some files. This does not stop the study.
    if result.returncode not in ((0, 1) if verb == "label" else (0,)):
        raise SystemExit(f"{verb} ended with {result.returncode}")


class Study:
    """The steps of the study: labeling, training and scoring. Each step keeps the results of an earlier call."""

    def __init__(self, arguments):
        self.program, self.out, self.groups = arguments.partprobe, arguments.out, arguments.folder
        self.sources = (
            f"sources.aagnet.path={arguments.aagnet}",
            f'sources.mfcad-features={{ type = "faces", path = "{arguments.features}", instances = true, background = "15" }}',
            f'sources.fusion-features={{ type = "faces", path = "{arguments.features}", instances = true }}',
        )

    def call(self, verb, *words, settings=()):
        call(self.program, self.groups, verb, *words, settings=settings)

    def label(self):
        """Labels all data sets that do not exist."""
        for name, (groups, settings) in DATASETS.items():
            if not (self.out / name / "index.jsonl").exists():
                self.call("label", *groups, "--out", self.out / name, "--quiet", settings=settings)

    def run(self, name, settings):
        """Makes or resumes a run, unless it is finished, and returns its folder."""
        folder = self.out / name
        if not (folder / "report.html").exists():
            resume = ["--resume"] if folder.exists() else []
            data = ["--data", self.out / "solids", "--jobs", "1", "--out", folder, *resume]
            self.call("run", CONFIG, *data, settings=(*self.sources[:1], *settings))
        return folder

    def report(self, folder, *words):
        """Returns the output of `partprobe report` for a finished run, with statistics that are computed now."""
        return subprocess.run([str(self.program), "report", str(folder), *words], check=True, capture_output=True, text=True).stdout

    def tables(self, folder):
        """Returns the tables of a finished run."""
        return json.loads(self.report(folder, "--json"))["tables"]

    def score_endpoints(self, run):
        """Copies a run, scores its backbones of three seeds under all conditions, and returns the folder of the copy."""
        folder = self.out / "conditions"
        if not folder.exists():
            shutil.copytree(run, folder, ignore=shutil.ignore_patterns("predictions", "test", "scores.jsonl", "report.html"))
        if not (folder / "endpoints" / "fusion" / "tables.json").exists():
            self.call("eval", folder, "--jobs", "1", settings=(*self.sources, SEEDS, RESTARTS, endpoints(self.out)))
        return folder


def tables_of(folder):
    """Returns the tables of an endpoint."""
    return json.loads((folder / "tables.json").read_text())


def found(entries, **wanted):
    """Returns the first entry with these values, or `None` if there is none."""
    return next((entry for entry in entries if all(entry.get(key) == value for key, value in wanted.items())), None)


def row_of(tables, supervision, reference, clusterer):
    """Returns the row of a supervision, a reference and a clusterer, or `None` if there is none."""
    return found(tables["rows"], supervision=supervision, reference=reference, clusterer=clusterer)


def shown(value):
    """Returns a score with three decimals, or a dash for `None`."""
    return "–" if value is None else f"{value:.3f}"


def mean_of(tables, supervision, reference, clusterer, metric="miou"):
    """Returns the mean of a metric as text."""
    row = row_of(tables, supervision, reference, clusterer)
    return shown(row and row["means"].get(metric))


def difference_of(tables, reference, clusterer, metric="miou"):
    """Returns the mean difference of the pair with its interval, as text."""
    entry = found(tables["differences"], reference=reference, clusterer=clusterer, compared=list(SOURCES))
    difference = entry and entry["differences"].get(metric)
    if not difference:
        return "–"
    interval = difference["interval"]
    bounds = f" [{interval['low']:+.3f}, {interval['high']:+.3f}]" if interval else ""
    return f"{difference['mean']:+.3f}{bounds}"


def print_curve(study, runs):
    """Prints the table of the learning curve."""
    print("Learning curve, mIoU by k-means with the true number of parts:\n")
    print("| training shapes | updates | seeds | scored against | `step-parts` | `aagnet` | Δ | Δ behind mean shift |")
    print("|---:|---:|---:|---|---:|---:|---:|---:|")
    for folder in runs:
        tables = study.tables(folder)
        n_shapes = len(json.loads((folder / "split.json").read_text())["train"])
        n_updates = max(json.loads(line).get("step", 0) for line in (folder / "log.jsonl").open())
        for reference in SOURCES:
            means = " | ".join(mean_of(tables, source, reference, "k-means") for source in SOURCES)
            n_seeds = row_of(tables, SOURCES[0], reference, "k-means")["n_seeds"]
            differences = " | ".join(difference_of(tables, reference, clusterer) for clusterer in ("k-means", "mean-shift+k-means"))
            print(f"| {n_shapes} | {n_updates} | {n_seeds} | `{reference}` | {means} | {differences} |")
    print()


def print_endpoints(study, folder):
    """Prints the table of the endpoints with the pair as references."""
    print("Endpoints, mIoU by k-means with the true number of parts:\n")
    print("| endpoint | scored against | `step-parts` | `aagnet` | Δ | `growing-20` | `no-network` | `untrained` | shapes |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    names = ("T1", "T2", "analytic-normals", "positions-only", "noise", "plain-voxels")
    for name, place in [("as trained", folder), *((name, folder / "endpoints" / name) for name in names)]:
        if not (place / "tables.json").exists():
            print(f"{name} was not scored", file=sys.stderr)
            continue
        tables = study.tables(place) if place == folder else tables_of(place)
        for reference in SOURCES:
            means = [mean_of(tables, source, reference, "k-means") for source in (*SOURCES, "growing-20", "no-network", "untrained")]
            cells = " | ".join([*means[:2], difference_of(tables, reference, "k-means"), *means[2:]])
            n_shapes = row_of(tables, SOURCES[0], reference, "k-means")["n_shapes"]
            print(f"| {name} | `{reference}` | {cells} | {n_shapes} |")
    print()


def print_features(folder):
    """Prints the table of the endpoints with machining features and modeling steps as references."""
    print("Machining features and modeling steps, which no source knows. ASA: achievable segmentation accuracy.\n")
    print("| data | supervision | ASA | mIoU | linear probe | nearest-face probe | linear, balanced | faces learned, scored | shapes |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for name in FEATURES:
        place = folder / "endpoints" / name
        if not (place / "tables.json").exists():
            print(f"{name} was not scored", file=sys.stderr)
            continue
        probe_file = place / "probe.json"
        tables, probes = tables_of(place), json.loads(probe_file.read_text())["rows"] if probe_file.exists() else []
        if probes:
            majority = probes[0]["scores"]["majority"]
            cells = [shown(majority["accuracy"])] * 2 + [shown(majority["balanced_accuracy"])]
            print(f"| {name} | the most frequent class | – | – | {' | '.join(cells)} | – | – |")
        for supervision in (*SOURCES, "untrained", "random-fourier", "no-network", "growing-20"):
            row = row_of(tables, supervision, f"{name}-features", "k-means")
            scores = [probe["scores"] for probe in probes if probe["supervision"] == supervision]
            mean = lambda kind, key: shown(sum(score[kind][key] for score in scores) / len(scores) if scores else None)
            cells = [shown(row["means"].get("asa")), shown(row["means"]["miou"]), mean("linear", "accuracy"), mean("nearest", "accuracy")]
            cells += [mean("linear", "balanced_accuracy"), f"{scores[0]['n_learned']}, {scores[0]['n_scored']}" if scores else "–"]
            print(f"| {name} | `{supervision}` | {' | '.join(cells)} | {row['n_shapes']} |")
    print()


def print_primary(study, folder):
    """Prints the primary endpoints from the report, up to the line that explains the means."""
    lines = study.report(folder).splitlines()
    start = next(idx for idx, line in enumerate(lines) if line.startswith("Primary endpoints"))
    end = next(idx for idx, line in enumerate(lines) if line.startswith("Means are over"))
    print("\n".join(lines[start : end + 1]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("aagnet", "features", "folder", "out"):
        parser.add_argument(name, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    study = Study(arguments)
    study.label()
    whole = study.run("whole", ())
    runs = [study.run(name, settings) for name, settings in CURVE.items()]
    conditions = study.score_endpoints(whole)

    print_curve(study, [*runs, whole])
    print_primary(study, whole)
    print()
    print_endpoints(study, conditions)
    print_features(conditions)
    return 0


if __name__ == "__main__":
    sys.exit(main())
