#!/usr/bin/env python3
"""Faces whose area `partprobe verify` finds to differ, looked at again with OpenCASCADE's finer means.

    pip install cadquery-ocp
    partprobe verify --reference REF.jsonl.zst DIR --list > listed.txt
    areas.py DIR listed.txt --out areas.jsonl [--timeout 60]

For each face that listed.txt names with a differing area: BRepGProp::SurfaceProperties as it is and in its adaptive form
at 1e-5, and the area of the mesh at 2e-4 of the face's diagonal and 0.1 rad. A line of areas.jsonl is {"file", "face", "type",
"ours", "default", "adaptive", "mesh"}, areas in square millimeters. At the end it counts the faces by who agrees with whom
within 1 %.
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
    return keyword == b"" or keyword.endswith((b"FACE", b"SURFACE"))


def area(face, adaptive=None):
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    arguments = () if adaptive is None else (adaptive,)
    BRepGProp.SurfaceProperties_s(face, properties, *arguments)
    return properties.Mass()


def mesh_area(face):
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
    """The areas of some faces of one file, by their numbers."""
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopoDS import TopoDS

    path, wanted = job
    found = defaultdict(list)
    for number, shape in distinct_shapes(path, TopAbs_FACE, is_face):
        if number in wanted:
            found[number].append(TopoDS.Face(shape))
    # A face that healing has broken into pieces is the sum of them.
    measures = (area, lambda face: area(face, 1e-5), lambda face: mesh_area(face) or 0.0)
    return {number: [sum(map(measure, faces)) for measure in measures] for number, faces in found.items()}


def within(ours, theirs):
    return abs(ours - theirs) <= 0.01 * abs(theirs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=Path)
    parser.add_argument("listed", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for a file")
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
    if theirs is None:
        return "not found again, or no answer in time"
    if max(theirs) <= 0.0:
        return "no area there by any of the three"
    if any(within(ours, area) for area in theirs):
        return "agrees with one of the three"
    _, adaptive, mesh = theirs
    return "adaptive and mesh agree, and differ from ours" if within(adaptive, mesh) else "adaptive and mesh differ, all from ours"


if __name__ == "__main__":
    main()
