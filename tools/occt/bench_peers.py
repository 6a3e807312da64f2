"""Compares the CPU seconds of partprobe, OpenCASCADE and step2glb on the same STEP files.

    pip install cadquery-ocp
    python tools/occt/bench_peers.py --partprobe target/release/partprobe --step2glb PATH -n 60 DIR...

Input: folders of STEP files. Each folder is a group. The script takes a sample of its files by a fixed seed.
Output: a Markdown table on stdout, with the user and system time of each program, and their ratios to partprobe.

All programs read the same files in turns, with a chord of 0.002 of the diagonal of the bounding box and an angle of 0.3 rad:

    partprobe    the whole process with its worker, `partprobe label --jobs 1`: parts, mesh, carriers on disk
    OpenCASCADE  the default import and BRepMesh inside one Python process; no labels, and nothing is written
    step2glb     one process per file with one thread, without its optional pass over the vertices: mesh, GLB on disk

The column `partprobe` has the time with `label.volume_loss=0`: like the other programs, it then considers only the chord and the angle.
The column `volumes kept` has the time of partprobe at its defaults. step2glb starts a process for each file. The column `of it start` has
the time that these starts take, measured with `step2glb --version`.

step2glb (github.com/vegarringdal/step2glb, pure Rust) is not on crates.io, so you build it and pass its path. Without `--step2glb`, only
OpenCASCADE is measured.

If one of the programs gets no triangle from a file, the file is left out for all of them. The last column has the numbers of such files.
"""

import argparse
import json
import math
import random
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from bench_occt import ANGLE, CHORD, CHORD_AND_ANGLE, TURN, OpenCascade, children_seconds, label, step_files

# The mode of OpenCASCADE, one of those in bench_occt.py.
OCCT_MODE = "healed+mesh"


class Step2glb:
    """The program step2glb, which converts a STEP file to a GLB file."""

    def __init__(self, program, timeout):
        self.program, self.timeout = program, timeout

    def seconds(self, path, diagonal_mm):
        """Returns the CPU seconds of one process, or `None` if it fails or writes no triangle."""
        with tempfile.TemporaryDirectory() as folder:
            glb = Path(folder, "out.glb")
            command = [self.program, path, "--output", glb, "--threads", 1, "--no-optimize"]
            command += ["--deflection", CHORD * diagonal_mm, "--max-angle", math.degrees(ANGLE)]
            before = children_seconds()
            try:
                done = subprocess.run(
                    [str(word) for word in command],
                    timeout=self.timeout,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            except subprocess.TimeoutExpired:
                return None
            seconds = children_seconds() - before
            return seconds if done.returncode == 0 and has_triangles(glb) else None

    def start_seconds(self, n=20):
        """Returns the mean CPU seconds of a process that starts and ends without work."""
        before = children_seconds()
        for _ in range(n):
            subprocess.run([self.program, "--version"], check=True, stdout=subprocess.DEVNULL)
        return (children_seconds() - before) / n


def has_triangles(glb):
    """Returns whether a GLB file has a primitive with at least three indices."""
    try:
        data = glb.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        scene = json.loads(data[20 : 20 + length])
    except (OSError, struct.error, ValueError):
        return False
    accessors = scene.get("accessors", [])
    primitives = [primitive for mesh in scene.get("meshes", []) for primitive in mesh["primitives"]]
    return any(accessors[primitive["indices"]]["count"] >= 3 for primitive in primitives if "indices" in primitive)


def diagonals(program, files):
    """Returns the diagonal in millimeters of each file that partprobe can label."""
    with tempfile.TemporaryDirectory() as folder:
        links, out = Path(folder, "files"), Path(folder, "out")
        links.mkdir()
        for number, file in enumerate(files):
            Path(links, f"{number}.step").symlink_to(file.resolve())
        command = [program, "label", links, "--out", out, "--jobs", "1", "--emit", "labels"]
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        entries = [json.loads(line) for line in Path(out, "index.jsonl").read_text().splitlines()]
        labeled = [entry for entry in entries if entry.get("labels_file")]
        return {files[int(Path(entry["source"]).stem)]: diagonal_of(Path(out, entry["labels_file"])) for entry in labeled}


def diagonal_of(labels_file):
    """Returns the diagonal in millimeters that a labels file records."""
    with zipfile.ZipFile(labels_file) as archive:
        member = archive.read("meta.npy")
    # The member is an NPY header, which ends with the first line, followed by JSON.
    return json.loads(member[member.index(b"\n") + 1 :])["diagonal_mm"]


def sample(options, folder):
    """Returns the sampled STEP files of a folder."""
    files = step_files(folder)
    if options.n:
        files = sorted(random.Random(options.seed).sample(files, min(options.n, len(files))))
    return files


def measure(options, folder):
    """Returns a row of the table: the number and size of the files that all programs read, and the seconds of each program."""
    files = sample(options, folder)
    diagonal_of_file = diagonals(options.partprobe, files)
    occt = OpenCascade(options.timeout)
    step2glb = Step2glb(options.step2glb, options.timeout) if options.step2glb else None
    row = {"group": Path(folder).name, "files": 0, "megabytes": 0.0, "partprobe_s": 0.0, "partprobe_default_s": 0.0}
    row |= {"occt_s": 0.0, "step2glb_s": 0.0, "step2glb_start_s": 0.0}
    failed = {"partprobe": len(files) - len(diagonal_of_file), "OpenCASCADE": 0, "step2glb": 0}
    labeled = [file for file in files if file in diagonal_of_file]
    # The programs run in turns, so that other work of the machine slows all of them equally.
    for first in range(0, len(labeled), TURN):
        kept = []
        for file in labeled[first : first + TURN]:
            by_occt = occt.seconds(file, OCCT_MODE)
            by_step2glb = step2glb.seconds(file, diagonal_of_file[file]) if step2glb else 0.0
            failed["OpenCASCADE"] += by_occt is None
            failed["step2glb"] += by_step2glb is None
            if by_occt is not None and by_step2glb is not None:
                kept.append(file)
                row["occt_s"] += by_occt
                row["step2glb_s"] += by_step2glb
        if kept:
            row["partprobe_s"] += label(options.partprobe, kept, *CHORD_AND_ANGLE)
            row["partprobe_default_s"] += label(options.partprobe, kept)
            row["files"] += len(kept)
            row["megabytes"] += sum(file.stat().st_size for file in kept) / 1e6
            row["step2glb_start_s"] += len(kept) * step2glb.start_seconds() if step2glb else 0.0
    occt.stop()
    return row | {"failed": failed}


def table(rows):
    """Returns the rows as a Markdown table. If there are several groups, a last row has their sums."""
    numbers = [key for key in rows[0] if key not in ("group", "failed")]
    total = {key: sum(row[key] for row in rows) for key in numbers}
    failed = {name: sum(row["failed"][name] for row in rows) for name in rows[0]["failed"]}
    rows = rows + [{"group": "together", **total, "failed": failed}] if len(rows) > 1 else rows
    lines = [
        "| group | files | MB | partprobe, CPU s | volumes kept, CPU s | OpenCASCADE, CPU s | step2glb, CPU s | of it start "
        "| over OpenCASCADE | volumes kept | over step2glb | volumes kept | left out: partprobe, OpenCASCADE, step2glb |",
        "|---|" + "---:|" * 12,
    ]
    for row in rows:
        ours = [row["partprobe_s"], row["partprobe_default_s"]]
        seconds = " | ".join(f"{x:.2f}" for x in [*ours, row["occt_s"], row["step2glb_s"], row["step2glb_start_s"]])
        ratios = [row[peer] / mine if mine else math.nan for peer in ("occt_s", "step2glb_s") for mine in ours]
        lines.append(
            f"| {row['group']} | {row['files']} | {row['megabytes']:.1f} | {seconds} | "
            + " | ".join(f"{ratio:.1f}×" for ratio in ratios)
            + f" | {', '.join(str(count) for count in row['failed'].values())} |"
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", help="folders of STEP files; each is a group")
    parser.add_argument("--partprobe", default="target/release/partprobe", help="path of the program")
    parser.add_argument("--step2glb", help="path of the program step2glb")
    parser.add_argument("-n", type=int, default=60, help="number of files of each group; 0 takes all")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample")
    parser.add_argument("--timeout", type=float, default=120, help="seconds that OpenCASCADE or step2glb may take for a file")
    parser.add_argument("--json", help="also write the seconds to this file")
    options = parser.parse_args()
    rows = []
    for folder in options.folders:
        rows.append(measure(options, folder))
        print(table(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
    print(table(rows))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
