"""Scores the backbones of docs/studies/sources.md on all solids of the collections that they have not seen.

    held_out.py AAGNET FOLDER OUT --partprobe PROGRAM

The study of five sources scores a solid only if each source has two labels for it. AAGNet has none for some files, and one label for many
solids with few parts, so few test shapes have 2 to 4 parts. Here every solid with 2 to 20 STEP parts counts that is in a collection
without a training or validation shape. AAGNET holds the labels that AAGNet gives to the faces. FOLDER holds the groups of STEP files:
abc, assemblies, conformance, electronics, fusion and mechanical. OUT gets the data sets and the run; those that are there already are not
made again. Prints Markdown: which solids take part, and the tables against `step-parts`.
"""

import argparse
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
GROUPS = ("abc", "assemblies", "conformance", "electronics", "fusion", "mechanical")
CONFIG = ROOT / "configs/label-sources.toml"
MANIFEST = ROOT / "docs/studies/sources/manifest.jsonl"
ENDPOINT = "all-held-out"
# Only the endpoint is read here, so the test shapes of the run are scored against one reference, with few restarts.
QUICK = ('compare.references=["step-parts"]', "compare.primary=[]", "compare.score_against_supervisions=false", "eval.restarts=3")


def collection(name):
    """The owner and repository of a file `owner+repository__part.step`."""
    return name.split("__")[0]


def unseen_files(folder):
    """The STEP files of all collections that have no shape on the training or the validation side of the manifest."""
    lines = map(json.loads, MANIFEST.read_text().splitlines())
    # An id begins with its group.
    seen = {collection(line["id"].split("__", 1)[1]) for line in lines if line["side"] != "test"}
    files = (path for group in GROUPS for path in sorted((folder / group).rglob("*")) if path.is_file())
    return [path.relative_to(folder) for path in files if collection(path.name) not in seen]


class Study:
    def __init__(self, arguments):
        self.program, self.out, self.folder = arguments.partprobe, arguments.out, arguments.folder
        self.aagnet = ("--set", f"sources.aagnet.path={arguments.aagnet}")

    def call(self, verb, *words):
        command = [str(word) for word in (self.program, verb, *words)]
        # The names of the groups become part of the ids.
        folder = self.folder if verb == "label" else ROOT
        result = subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL)
        # Files that cannot be read do not stop the study.
        if result.returncode not in ((0, 1) if verb == "label" else (0,)):
            raise SystemExit(f"{verb} ended with {result.returncode}")

    def label(self, name, *inputs):
        if not (self.out / name / "index.jsonl").exists():
            self.call("label", *inputs, "--unit", "solid", "--out", self.out / name, "--quiet")

    def label_held_out(self):
        # The name of the list becomes part of the ids, on which the points depend.
        paths = self.out / "held.txt"
        paths.write_text("".join(f"{path}\n" for path in unseen_files(self.folder)))
        self.label("held-out", "--list", paths)

    def train(self):
        run = self.out / "run"
        if not (run / "report.html").exists():
            resume = ["--resume"] if run.exists() else []
            self.call("run", CONFIG, "--data", self.out / "solids", "--jobs", "1", "--out", run, *resume, *self.aagnet)
        return run

    def score(self, run):
        place = run / "endpoints" / ENDPOINT
        if not (place / "tables.json").exists():
            endpoint = {"name": ENDPOINT, "data": str(self.out / "held-out"), "shapes": "all", "min_parts": 2, "max_parts": 20}
            table = ", ".join(f"{key} = {json.dumps(value)}" for key, value in endpoint.items())
            settings = (*QUICK, f"endpoints=[{{ {table} }}]")
            self.call("eval", run, "--jobs", "1", *self.aagnet, *(word for setting in settings for word in ("--set", setting)))
        return place


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("aagnet", "folder", "out"):
        parser.add_argument(name, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    study = Study(arguments)
    study.label("solids", *GROUPS)
    study.label_held_out()
    tables = (study.score(study.train()) / "tables.md").read_text()
    # Each table has its sentence before it. Further scores, and the rows A/A, are in the folder of the endpoint.
    paragraphs = tables.split("\n\n")
    print(paragraphs[1])
    for sentence, table in zip(paragraphs, paragraphs[1:], strict=False):
        if sentence.startswith("Scored against"):
            rows = [row for row in table.splitlines() if not row.startswith("| A/A")]
            print(f"\n{sentence}\n\n" + "\n".join(rows))
        if table.startswith("Means are over"):
            print(f"\n{table}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
