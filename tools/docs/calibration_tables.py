"""Prints the tables of docs/studies/calibration.md.

    calibration_tables.py FOLDER… --partprobe PROGRAM

The script runs `partprobe calibrate` on each folder, and once on all folders together.
Input: folders of STEP files. Each folder is a group of the tables.
Output: Markdown on stdout. A line on stderr says when a folder is done.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile


def calibration_of(partprobe, folders):
    """Runs `partprobe calibrate` on folders, and returns the JSON that it writes."""
    with tempfile.TemporaryDirectory(prefix="calibrate-") as out:
        command = [partprobe, "calibrate", *folders, "--out", out, "--jobs", "1"]
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        return json.loads((pathlib.Path(out) / "calibration.json").read_text())


def percent(count, total):
    return f"{100 * count / total:.2f} %" if total else "–"


def degrees(value):
    return f"{value:g}"


def range_text(found):
    """Returns a stable range of θ as text, or `none` if there is no such range."""
    return f"{degrees(found['low_deg'])}–{degrees(found['high_deg'])}°" if found else "none"


def print_table(header, alignment, rows):
    print(f"| {' | '.join(header)} |\n|{'|'.join(alignment)}|")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    print()


def shares(kind):
    """Returns three cells: the number of angles, the fraction of angles within θ, and the fraction of right angles."""
    return [str(kind["n"]), percent(kind["n_within_theta"], kind["n"]), percent(kind["n_right"], kind["n"])]


def share_of_type(result, name):
    """Returns the fraction of the edges of one surface type whose angle is within θ."""
    edges = next((entry["edges"] for entry in result["histogram"]["types"] if entry["type"] == name), None)
    return percent(edges["n_within_theta"], edges["n"]) if edges else "–"


def print_tables(results):
    """Prints all tables. `results` maps the name of a group to its calibration."""
    print_table(
        ["group (shapes)", "same-type edges", "≤ 8°", "85–95°", "pairs of faces", "≤ 8°", "85–95°"],
        ["---", *["---:"] * 6],
        ([f"{name} ({r['n_shapes']})", *shares(r["histogram"]["edges"]), *shares(r["histogram"]["pairs"])] for name, r in results.items()),
    )
    types = "plane cylinder cone sphere torus bspline revolution extrusion".split()
    print("At most 8°, share of the edges of each type:\n")
    print_table(
        ["group", *types],
        ["---", *["---:"] * len(types)],
        ([name, *(share_of_type(r, kind) for kind in types)] for name, r in results.items()),
    )
    print_table(
        ["group", "changed at 4°", "6°", "10°", "12°", "widest stable range", "widest around 8°"],
        ["---", *["---:"] * 6],
        (
            [
                name,
                *(f"{s['n_changed']} ({100 * s['changed']:.2f} %)" for s in r["sweep"] if s["theta_deg"] != 8),
                range_text(r["stable_range"]),
                range_text(r["range_around_theta"]),
            ]
            for name, r in results.items()
        ),
    )
    print_table(
        ["group", "θ", "P", "S", "D", "H"],
        ["---", *["---:"] * 5],
        (
            [
                name,
                f"{degrees(s['theta_deg'])}°",
                f"{s['n_parts']['mean']:.2f}",
                f"{s['sharpness_deg']['mean']:.2f}°",
                f"{s['deviation_deg']['mean']:.2f}°",
                f"{s['entropy']['mean']:.4f}",
            ]
            for name, r in results.items()
            if name != "all"
            for s in r["sweep"]
            if s["theta_deg"] in (4, 8, 12)
        ),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--partprobe", type=pathlib.Path, default="target/release/partprobe")
    arguments = parser.parse_args()
    results = {}
    for folder in arguments.folders:
        results[folder.name] = calibration_of(arguments.partprobe, [folder])
        print(f"{folder.name} is done", file=sys.stderr)
    results["all"] = calibration_of(arguments.partprobe, arguments.folders)
    print_tables(results)


if __name__ == "__main__":
    main()
