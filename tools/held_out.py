"""Scores the backbones of docs/studies/sources.md on all solids that they were not trained on.

    held_out.py AAGNET FOLDER OUT --partprobe PROGRAM

Input: AAGNET, the labels that AAGNet gives to the faces; FOLDER, which has the groups of STEP files: abc, assemblies, conformance,
electronics, fusion and mechanical; and OUT, a folder for the data sets and the run. What already exists there is not made again.
Output: Markdown on stdout: which solids are scored, and the tables against `step-parts`.

A study scores a solid only if each source has two labels for it. AAGNet has no labels for some files, and one label for many solids with
few parts, so few test shapes have 2 to 4 parts. This script scores every solid with 2 to 20 STEP parts. The solid must be in a collection
without a training or validation shape (endpoint `unseen-collections`), or at least in a file without one (endpoint `unseen-files`).
"""

import argparse
import json
import pathlib
import sys

from pair import GROUPS, ROOT, call

MANIFEST = ROOT / "docs/studies/sources/manifest.jsonl"
ENDPOINTS = ("unseen-collections", "unseen-files")
# This script reads only the endpoints, so the test shapes of the run are scored fast: against one reference, with few restarts.
QUICK = ('compare.references=["step-parts"]', "compare.primary=[]", "compare.score_against_supervisions=false", "eval.restarts=3")


def collection(name):
    """Returns the owner and the repository from a file name `owner+repository__part.step`."""
    return name.split("__")[0]


def step_files(folder):
    """Returns the files of all groups, relative to their folder."""
    return [path.relative_to(folder) for group in GROUPS for path in sorted((folder / group).rglob("*")) if path.is_file()]


def unseen_files(folder):
    """Returns, for each endpoint, the STEP files without a training or validation shape in the manifest.

    `unseen-collections` has the files of collections without such a shape. `unseen-files` has the files that contain no such shape.
    """
    lines = map(json.loads, MANIFEST.read_text().splitlines())
    # An id is `group__owner+repository__part__s4`: the group, the name of the file, and the number of the solid.
    seen = {line["id"].rsplit("__s", 1)[0] for line in lines if line["side"] != "test"}
    seen_collections = {collection(name.split("__", 1)[1]) for name in seen}
    files = step_files(folder)
    return {
        "unseen-collections": [path for path in files if collection(path.name) not in seen_collections],
        "unseen-files": [path for path in files if f"{path.parts[0]}__{path.stem}" not in seen],
    }


class Study:
    """The steps of the study: labeling, training and scoring. Each step keeps the results of an earlier call."""

    def __init__(self, arguments):
        self.program, self.out, self.folder = arguments.partprobe, arguments.out, arguments.folder
        self.config = ROOT / f"configs/{arguments.config}.toml"
        self.endpoints = (arguments.only,) if arguments.only else ENDPOINTS
        # `net.refine` would add a second clustering.
        self.settings = (*QUICK, "net.refine=none") if arguments.only else QUICK
        self.aagnet = f"sources.aagnet.path={arguments.aagnet}"

    def call(self, verb, *words, settings=()):
        call(self.program, self.folder, verb, *words, settings=settings)

    def label(self, name, *inputs):
        """Labels the inputs as the data set `name`, unless the data set exists."""
        if not (self.out / name / "index.jsonl").exists():
            self.call("label", *inputs, "--unit", "solid", "--out", self.out / name, "--quiet")

    def label_unseen(self):
        """Labels the unseen files as one data set per endpoint."""
        for name, files in unseen_files(self.folder).items():
            # The name of the list is part of the ids, and the sampled points depend on the ids. So do not change it.
            paths = self.out / f"{name}.txt"
            paths.write_text("".join(f"{path}\n" for path in files))
            self.label(name, "--list", paths)

    def train(self):
        """Makes or resumes the run, and returns its folder."""
        run = self.out / "run"
        if not (run / "report.html").exists():
            resume = ["--resume"] if run.exists() else []
            self.call("run", self.config, "--data", self.out / "solids", "--jobs", "1", "--out", run, *resume, settings=(self.aagnet,))
        return run

    def score(self, run):
        """Scores the endpoints of the run, unless they are scored already."""
        if all((run / "endpoints" / name / "tables.json").exists() for name in self.endpoints):
            return
        of_all = {"shapes": "all", "min_parts": 2, "max_parts": 20}
        tables = ({"name": name, "data": str(self.out / name), **of_all} for name in self.endpoints)
        texts = ("{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }" for table in tables)
        settings = (self.aagnet, *self.settings, f"endpoints=[{', '.join(texts)}]")
        self.call("eval", run, "--jobs", "1", settings=settings)


def print_tables(place):
    """Prints which shapes are scored, and the first table of each clusterer. Further scores and the rows A/A are in the folder."""
    paragraphs = (place / "tables.md").read_text().split("\n\n")
    # "data set PATH; 352 of 998 labeled shapes take part; …"
    which = paragraphs[1].split("; ", 1)[1]
    print(f"**{place.name}**: {which}")
    # The paragraph before a table describes it.
    for sentence, table in zip(paragraphs, paragraphs[1:], strict=False):
        if sentence.startswith("Scored against"):
            rows = [row for row in table.splitlines() if not row.startswith("| A/A")]
            print(f"\n{sentence}\n\n" + "\n".join(rows))
        if table.startswith("Means are over"):
            print(f"\n{table}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--config", default="label-sources", help="the config in configs/ whose backbones are scored")
    parser.add_argument("--only", choices=ENDPOINTS, help="score only this endpoint, and only with k-means, to save time")
    for name in ("aagnet", "folder", "out"):
        parser.add_argument(name, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    study = Study(arguments)
    study.label("solids", *GROUPS)
    study.label_unseen()
    run = study.train()
    study.score(run)
    for name in study.endpoints:
        print_tables(run / "endpoints" / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
