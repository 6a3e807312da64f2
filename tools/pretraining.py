"""Tests whether weights that were first trained on other parts help a short training on real parts.

    pretraining.py SOLIDS MFCAD OUT --partprobe PROGRAM

Run it in the root of the repository, because the path of the split in the config is relative to it.
Input: SOLIDS, the data set of the study label-sources; MFCAD, a data set of the machined parts of MFCAD; and OUT, a folder for the runs.
`partprobe label --unit solid` makes both data sets. Runs that already exist in OUT are not made again.
Output: a Markdown table on stdout, with means over the test shapes with 2 to 19 parts, and standard deviations over seeds.

Each backbone is trained only on `step-parts`, in both trainings.
"""

import argparse
import pathlib
import subprocess

from learning import spread, test_scores

CONFIG = pathlib.Path(__file__).resolve().parents[1] / "configs/label-pair.toml"
ALONE = ('compare.supervision=["step-parts"]', 'compare.references=["step-parts"]', "compare.primary=[]")
N_GENERATED = 1000
BEFORE, AFTER = 1250, 625
SEEDS = "compare.seeds=[0,1,2]"


class Study:
    """The runs of the study. A run that is finished is not made again."""

    def __init__(self, program, out):
        self.program, self.out = program, out

    def call(self, *words):
        subprocess.run([str(word) for word in (self.program, *words)], check=True, stdout=subprocess.DEVNULL)

    def run(self, name, data, updates, *settings):
        """Makes or resumes a run, unless it is finished, and returns its folder."""
        folder = self.out / name
        if not (folder / "report.html").exists():
            resume = ["--resume"] if folder.exists() else []
            updates = (f"train.steps={updates}", f"train.valid_every={updates}")
            overrides = [word for setting in (*ALONE, *updates, *settings) for word in ("--set", setting)]
            self.call("run", CONFIG, "--data", data, "--jobs", "1", "--out", folder, *resume, *overrides)
        return folder

    def weights(self, name, data):
        """Trains on a data set with its own split, and returns the path of the weights."""
        folder = self.run(f"before-{name}", data, BEFORE, 'split.manifest=""', "compare.seeds=[0]", "eval.restarts=1")
        return folder / "checkpoints/step-parts-0/model.safetensors"

    def generated(self):
        """Returns the data set of generated parts. It makes the data set unless it exists."""
        folder = self.out / "generated"
        if not (folder / "dataset/index.jsonl").exists():
            self.call("synth", "--out", folder / "parts", "-n", N_GENERATED, "--seed", 1, "--quiet")
            self.call("label", folder / "parts", "--unit", "solid", "--out", folder / "dataset", "--quiet")
        return folder / "dataset"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("solids", "mfcad", "out"):
        parser.add_argument(name, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--partprobe", type=lambda path: pathlib.Path(path).resolve(), default="target/release/partprobe")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    study = Study(arguments.partprobe, arguments.out)

    starts = {
        "random weights": None,
        f"{N_GENERATED} generated parts": study.weights("generated", study.generated()),
        "machined parts of MFCAD": study.weights("mfcad", arguments.mfcad),
    }
    columns = [("k-means", "miou"), ("mean-shift+k-means", "miou"), ("k-means", "gtc_miou")]
    print(f"| trained before, {BEFORE} updates | k-means mIoU | mean shift + k-means mIoU | GTc mIoU |")
    print("|---|---:|---:|---:|")
    for number, (name, weights) in enumerate(starts.items()):
        init = [f'train.init="{weights}"'] if weights else []
        folder = study.run(f"after-{number}", arguments.solids, AFTER, SEEDS, *init)
        cells = [spread(test_scores(folder, "step-parts", *column)) for column in columns]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
