"""Executes the code blocks of README.md, CONTRIBUTING.md and the pages in docs/.

    run_blocks.py [PAGE…] --partprobe PROGRAM        or: .ci/doc-blocks [PAGE…]

Input: the program, and a Python that has numpy, trimesh, py7zr and `just` (`.ci/doc-blocks` installs them).
Output: one line per block, and a count.
Exit status: 1 if a block fails.

- Each page runs in a fresh folder. The folder has the files that the commands of the page name: STEP files that `partprobe synth`
  generates, archives of them, and a point cloud.
- Shell blocks run in bash and stop at the first error. Python blocks run as a script. A TOML block becomes `my.toml`, which is the name
  that the page uses. A text block is output and is not executed.
- Commands that would take hours run with smaller numbers (`SMALLER`).
- Commands that cannot run here are listed with the reason (`ELSEWHERE`).
- A block in another language is an error, so that no block is skipped by accident.
"""

import argparse
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass

ROOT = pathlib.Path(__file__).resolve().parents[2]

# A command that starts with a key of this table is not executed here. The value is the reason.
ELSEWHERE = {
    "cargo run --release -- run smoke": "`.ci/run` has a step that runs it",
    "partprobe run smoke": "`.ci/run` has a step that runs it",
    "cargo test --release": "`.ci/run` has a step that runs it",
    "cargo install": "it compiles the whole program again",
    "cargo build --release -p partprobe-truck": "`.ci/run` builds and tests this crate in a step of its own",
    "xargs -n 1 timeout 60 target/release/examples/agreement": "it needs the program of the line above",
    "partprobe label parts/ --out by-truck/": "it needs a program with the feature `truck`",
    "python tools/torch/parity.py": "it needs PyTorch; `just parity` installs and runs it",
    "python partfield_inference.py": "it needs PartField and a GPU; tools/partfield/stand_in.py writes results before the blocks run",
    "python run_part_clustering.py": "it needs PartField; `just prove-partfield` runs it",
    "just prove-partfield": "it needs a checkout of PartField, and takes minutes",
    "python tools/torch/pointcept.py": "it needs PyTorch; `just prove-pointcept` installs and runs it",
    "partprobe weights from-pointcept": "it needs weights of Pointcept; crates/net/src/pointcept/tests.rs and `just prove-pointcept` run it",
    "partprobe weights to-pointcept": "it needs the file of the line above",
    "partprobe train my.toml --data dataset/ --supervision step-parts --init pretrained": "it needs the file of a block above",
    "pip install": "the environment of this script has the package",
    "partprobe verdict": "it needs at least ten held-out files; crates/cli/tests/verdict.rs runs it",
    "partprobe label abc assemblies": "it needs the folders of a study; tools/docs/studies.py runs it",
    "partprobe run hour --data solids": "it trains for an hour; tools/docs/studies.py runs it",
    "partprobe run configs/label-sources.toml": "it trains for an hour and a half; tools/docs/studies.py runs it",
    "partprobe run configs/label-controls.toml": "it trains for hours; tools/docs/studies.py runs it",
    "partprobe label mfcad": "it needs the folders of a study; tools/docs/studies.py runs it",
    "partprobe run configs/field-mfcad.toml": "it needs the labels of a study; tools/docs/studies.py runs it",
    "partprobe run configs/label-field.toml": "it trains for a quarter of an hour; tools/docs/studies.py runs it",
    "just study": "a study takes minutes to hours; `just studies` says which ones are out of date",
    "just check-mesh-sources": "it installs CGAL and libigl, and takes minutes",
    "just bench-": "a benchmark needs a quiet machine",
}

# These commands exit with 1 if two kernels disagree about a file. This is a result and not a failure.
COMPARES = ("just modeled", "python tools/occt/modeled.py", "partprobe verify --reference")

# Replacements that make a command fast. They change only numbers.
SMALLER = (
    (r"^(partprobe (?:run|train) (?!.*trial).*)$", r"\1 {small_training}"),
    (r"--set train\.steps=4000", "--set train.steps=4"),
    (r"-n (?:60|220|4000)\b", "-n 12"),
    (r"--n 220", "--n 2"),
    (r"--n-archives 18 --n-files 10000", "--n-archives 2 --n-files 8"),
    (r"n = 160", "n = 24"),
    (r"steps = 60\\n", r"steps = 4\\n"),
    (r"^just modeled OUT", "just modeled OUT --n 1"),
)
SMALL_TRAINING = (
    "--set train.steps=4 --set train.valid_every=4 --set sample.n_points=2000 "
    "--set tokens.train_tokens=128 --set tokens.test_tokens=128 --set eval.restarts=1"
)

# Shell commands that make what the blocks of a page assume. They run before the blocks.
BEFORE = {
    "docs/reference/formats.md": (
        "partprobe label part.step --out carriers",
        "partprobe export ply part.step --out exported",
        "partprobe export obj part.step --out exported-obj",
        "cp exported/part.ply exported-obj/part.fidx .",
    ),
    "docs/guide/partfield.md": (
        "partprobe label parts/ --out dataset/",
        "partprobe export partfield-input dataset/ --out exported",
        "python tools/partfield/stand_in.py exported exp_results/cad",
    ),
    "docs/studies/pytorch.md": ("partprobe run trial.toml --set net.backbone.norm=batch --out trained", "cp trained/checkpoints/*/model.safetensors ."),
    "docs/studies/kernel.md": ("python tools/occt/reference.py DIR --out REF.jsonl && zstd -q REF.jsonl",),
    "docs/studies/calibration.md": ("partprobe label parts/ --out dataset/",),
}

FENCE = re.compile(r"^( *)```(\S*)\s*$")


@dataclass(frozen=True)
class Block:
    """A fenced code block: its page, its first line, its language and its text."""

    page: str
    line: int
    language: str
    text: str


def blocks_of(page, text):
    """Returns the fenced blocks of a page, in order."""
    found, opened = [], None
    for number, line in enumerate(text.splitlines(), start=1):
        fence = FENCE.match(line)
        if fence and opened is None:
            opened = (number, len(fence.group(1)), fence.group(2), [])
        elif fence:
            start, _, language, lines = opened
            found.append(Block(page, start, language, "\n".join(lines) + "\n"))
            opened = None
        elif opened is not None:
            opened[3].append(line[opened[1]:] if line[: opened[1]].isspace() else line)
    if opened is not None:
        raise ValueError(f"{page}:{opened[0]}: a code block is not closed")
    return found


def smaller(command):
    """Returns the command with smaller numbers."""
    for pattern, replacement in SMALLER:
        command = re.sub(pattern, replacement, command)
    return command.replace("{small_training}", SMALL_TRAINING)


def shell_script(block):
    """Returns the commands of a block that run here, and a note for each command that does not."""
    commands, notes = [], []
    joined = block.text.replace("\\\n", " ")
    for command in joined.splitlines():
        stripped = command.strip()
        reason = next((why for start, why in ELSEWHERE.items() if stripped.startswith(start)), None)
        if reason:
            notes.append(f"not executed here: `{stripped.split('  ')[0]}`: {reason}")
        else:
            accepts = " || test $? -eq 1" if stripped.startswith(COMPARES) else ""
            commands.append(smaller(stripped.split("  #")[0]) + accepts)
    return "\n".join(commands) + "\n", notes


class Stage:
    """A folder with the files that the pages name, and an environment that finds `partprobe` and `just`."""

    def __init__(self, partprobe, folder):
        self.folder = folder
        self.tools = folder / "tools"
        self.material = folder / "material"
        self.tools.mkdir()
        self.target = partprobe.parent.parent
        for name in ("partprobe", "OTHER"):
            (self.tools / name).symlink_to(partprobe)
        self._write_tool("cargo", f'cd "{ROOT}" && exec "{shutil.which("cargo")}" "$@"')
        environment = dict(os.environ)
        path = [str(self.tools), str(pathlib.Path(sys.executable).parent), environment["PATH"]]
        environment["PATH"] = os.pathsep.join(path)
        environment["CARGO_TARGET_DIR"] = str(self.target)
        self.environment = environment
        self._make_material()

    def _write_tool(self, name, body):
        tool = self.tools / name
        tool.write_text(f"#!/usr/bin/env bash\n{body}\n")
        tool.chmod(0o755)

    def _make_material(self):
        """Makes the STEP files, the archives and the point cloud that the pages name."""
        import py7zr

        material = self.material
        material.mkdir()
        self.run(material, "partprobe synth --out steps -n 24 --seed 3 --min-parts 3 --max-parts 20", "material")
        steps = sorted((material / "steps").glob("*.step"))
        parts = material / "parts"
        parts.mkdir()
        for number, step in enumerate(steps[:14]):
            name = {0: "bracket", 1: "flange"}.get(number, step.stem)
            shutil.copy(step, parts / f"{name}.step")
        for folder, chosen in (("more", 14), ("abc", 0), ("fusion", 4), ("mechanical", 8), ("mfcad", 12), ("DIR", 16)):
            (material / folder).mkdir()
            for step in steps[chosen:chosen + 8]:
                shutil.copy(step, material / folder)
        for name in ("part.step", "bracket.step"):
            shutil.copy(steps[2], material / name)
        for archive in ("abc_0000.7z", "abc_0000_step_v00.7z"):
            with py7zr.SevenZipFile(material / archive, "w") as packed:
                packed.writeall(parts, "0000")
        shutil.rmtree(material / "steps")
        self.run(material, "partprobe sample part.step --out sampled --format ply && cp sampled/part.ply scan.ply", "material")
        (material / "trial.toml").write_text(
            'base = "base.toml"\n[data]\nsource = "synth"\n[synth]\nn = 16\n[compare]\nsupervision = ["step-parts"]\n'
            "[train]\nsteps = 2\nbatch_shapes = 2\nvalid_every = 0\n[eval]\nrestarts = 1\n"
        )

    def page_folder(self, page):
        """Makes a fresh folder for the blocks of one page, and returns it."""
        place = self.folder / page.replace("/", "__")
        shutil.copytree(self.material, place)
        for name in ("tools", "justfile", "configs"):
            (place / name).symlink_to(ROOT / name)
        (place / "target").symlink_to(self.target)
        (place / "docs").mkdir()
        return place

    def run(self, place, script, what):
        """Runs a shell script. Raises RuntimeError with its output if it fails."""
        command = ["bash", "-euo", "pipefail", "-c", script]
        self._call(place, command, what)

    def run_python(self, place, text, what):
        """Runs a Python script whose warnings are errors. Raises RuntimeError with its output if it fails."""
        self._call(place, [sys.executable, "-W", "error", "-c", text], what)

    def _call(self, place, command, what):
        done = subprocess.run(command, cwd=place, env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{what}: exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-4000:]}")


def execute(stage, place, block):
    """Runs a block and returns its notes."""
    where = f"{block.page}:{block.line}"
    if block.language in ("sh", "bash"):
        script, notes = shell_script(block)
        if script.strip():
            stage.run(place, script, where)
        return notes
    if block.language == "python":
        stage.run_python(place, block.text, where)
        return []
    if block.language == "toml":
        return ["written to my.toml before the page's other blocks"]
    if block.language == "text":
        return []
    raise RuntimeError(f"{where}: the language {block.language!r} of a code block is not one of sh, bash, python, toml, text")


def run_page(stage, page, blocks):
    """Runs the blocks of a page. Returns the lines to print, and the number of failures."""
    place = stage.page_folder(page)
    lines = []
    for block in blocks:
        if block.language == "toml":
            (place / "my.toml").write_text(block.text)
    for command in BEFORE.get(page, ()):
        stage.run(place, command, f"{page}: preparation of its blocks")
    failed = 0
    for block in blocks:
        try:
            notes = execute(stage, place, block)
            lines.append(f"{block.page}:{block.line}: ok")
            lines.extend(f"    {note}" for note in notes)
        except RuntimeError as error:
            lines.append(f"FAILED {error}")
            failed += 1
    shutil.rmtree(place)
    return lines, failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--partprobe", type=pathlib.Path, default=ROOT / "target/release/partprobe")
    parser.add_argument("pages", nargs="*", help="execute only these pages, for example docs/reference/formats.md")
    arguments = parser.parse_args()
    pages = ["README.md", "CONTRIBUTING.md", *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").rglob("*.md"))]
    wanted = arguments.pages or pages
    found = {page: blocks_of(page, (ROOT / page).read_text()) for page in wanted}
    with tempfile.TemporaryDirectory(prefix="doc-blocks-") as folder:
        stage = Stage(arguments.partprobe.resolve(), pathlib.Path(folder))
        failed = 0
        # Many commands use one core only, so two pages run at a time. Their output is printed in the order of the pages.
        with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
            outcomes = pool.map(lambda item: run_page(stage, *item), [(page, blocks) for page, blocks in found.items() if blocks])
            for lines, n_failed in outcomes:
                print("\n".join(lines), flush=True)
                failed += n_failed
    total = sum(len(blocks) for blocks in found.values())
    print(f"code blocks: {total - failed} passed, {failed} failed")
    return 1 if failed or total == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
