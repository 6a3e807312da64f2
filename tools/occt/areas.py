#!/usr/bin/env python3
"""Measures faces again with OpenCASCADE, if `partprobe verify` reports that their areas differ from the reference.

    pip install cadquery-ocp
    partprobe verify --reference REF.jsonl.zst DIR --list > listed.txt
    areas.py DIR listed.txt --out areas.jsonl [--timeout 60]

Input: the STEP files below DIR, and listed.txt, which names the faces. Output: areas.jsonl, with one line per face: {"file", "face",
"type", "ours", "default", "adaptive", "mesh"}, in square millimeters. "ours" is the area of partprobe. "default" is that of
BRepGProp::SurfaceProperties, and "adaptive" is that of its adaptive form at 1e-5. "mesh" is the area of a mesh at 2e-4 of the face's
diagonal and 0.1 rad. At the end, stdout has the number of faces for each case: which of the areas agree within 1 %.
"""
from __future__ import annotations

import argparse
import json
import re
import sys
from collections import defaultdict
from pathlib import Path

from volumes import ANGLE, CHORD, distinct_shapes, import_once, in_a_process

LISTED = re.compile(r"(.*?): area: #(\d+) \((\w+)\) has (\S+) mm², reference ")


def is_face(keyword):
    """Returns whether a STEP keyword may be that of a face. A complex instance has an empty keyword."""
    return keyword == b"" or keyword.endswith((b"FACE", b"SURFACE"))


def area(face, adaptive=None):
    """Returns the area of a face by BRepGProp, with the adaptive form if `adaptive` gives its tolerance."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    arguments = () if adaptive is None else (adaptive,)
    BRepGProp.SurfaceProperties_s(face, properties, *arguments)
    return properties.Mass()


def mesh_area(face):
    """Returns the area of a fine mesh of a face, or `None` if the face has no mesh."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopLoc import TopLoc_Location

    box = Bnd_Box()
    BRepBndLib.Add_s(face, box, False)
    BRepMesh_IncrementalMesh(face, CHORD * max(box.SquareExtent() ** 0.5, 1e-6), False, ANGLE, False)
    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    if mesh is None:
        return None
    nodes = [mesh.Node(i + 1) for i in range(mesh.NbNodes())]
    total = 0.0
    for i in range(mesh.NbTriangles()):
        a, b, c = (nodes[k - 1] for k in mesh.Triangle(i + 1).Get())
        u, v = (b.X() - a.X(), b.Y() - a.Y(), b.Z() - a.Z()), (c.X() - a.X(), c.Y() - a.Y(), c.Z() - a.Z())
        across = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        total += 0.5 * sum(x * x for x in across) ** 0.5
    return total


def looked_at(job):
    """Returns the three areas of some faces of one file, by the numbers of the faces."""
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopoDS import TopoDS

    path, wanted = job
    found = defaultdict(list)
    for number, shape in distinct_shapes(path, TopAbs_FACE, is_face):
        if number in wanted:
            found[number].append(TopoDS.Face(shape))
    # Healing may break a face into pieces. Its area is then the sum of the pieces.
    measures = (area, lambda face: area(face, 1e-5), lambda face: mesh_area(face) or 0.0)
    return {number: [sum(map(measure, faces)) for measure in measures] for number, faces in found.items()}


def within(ours, theirs):
    """Returns whether two areas agree within 1 %."""
    return abs(ours - theirs) <= 0.01 * abs(theirs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=Path)
    parser.add_argument("listed", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds that OpenCASCADE may take for a file")
    options = parser.parse_args()
    import_once()
    by_file = defaultdict(dict)
    for line in options.listed.read_text().splitlines():
        if match := LISTED.match(line):
            by_file[match[1]][int(match[2])] = (match[3], float(match[4]))
    counts = defaultdict(int)
    with options.out.open("w") as out:
        for i, (file, faces) in enumerate(sorted(by_file.items())):
            rows, _ = in_a_process(looked_at, (options.dir / file, set(faces)), options.timeout)
            for number, (kind, ours) in faces.items():
                theirs = (rows or {}).get(number)
                row = dict(zip(("default", "adaptive", "mesh"), theirs or (None,) * 3))
                print(json.dumps({"file": file, "face": number, "type": kind, "ours": ours, **row}), file=out, flush=True)
                counts[verdict(ours, theirs)] += 1
            print(f"\r{i + 1} of {len(by_file)}", end="", file=sys.stderr)
    print("\n".join(f"{n:5}  {what}" for what, n in sorted(counts.items())))


def verdict(ours, theirs):
    """Returns the case of a face as text."""
    if theirs is None:
        return "OpenCASCADE did not find the face, or did not answer in time"
    if max(theirs) <= 0.0:
        return "all three areas of OpenCASCADE are zero"
    if any(within(ours, area) for area in theirs):
        return "partprobe agrees with one of the three"
    _, adaptive, mesh = theirs
    return (
        "adaptive and mesh agree, and partprobe differs"
        if within(adaptive, mesh)
        else "adaptive and mesh differ, and partprobe differs from all three"
    )


if __name__ == "__main__":
    main()
