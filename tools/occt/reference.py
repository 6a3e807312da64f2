#!/usr/bin/env python3
"""Writes the reference lines for `partprobe verify`, from OpenCASCADE (`pip install cadquery-ocp`).

    reference.py DIR --out reference.jsonl [--only LIST.txt] [--timeout 60]

Input: the STEP files below DIR, or those that LIST.txt names.
Output: one JSON object per file, in millimeters:

- `file`: the path of the file below DIR.
- `status`: `ok`, or the reason why there are no faces, for example that OpenCASCADE crashed or took too long.
- `faces`: `[# number, occurrence, type, part, shell, area, mesh area]` for each face.
- `edges`: `[face, face, angle in degrees or null, null]` for each pair of faces with a common edge.

Faces, types, angles and parts come from an import with all of OpenCASCADE's repairs off, so that they are those of the file. Areas come
from its default import, because surfaces may lack their boundaries without the repairs. Two faces of one type are in the same part if
they meet at 8 degrees or less in the middle of an edge.
"""
from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

from volumes import SUFFIXES, in_a_process, numbers

THETA = 8.0 + 1e-6
CHORD, ANGLE = 0.002, 0.3
TYPES = "plane cylinder cone sphere torus bezier bspline revolution extrusion offset other".split()
# Positions on an edge, as fractions of its length in parameters. They are tried in this order until both faces have a normal.
PLACES = (0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875)
# The repairs of OpenCASCADE's import. Each of them has its own switch.
REPAIRS = """
FreeShell FreeFace FreeWire SameParameter Solid ShellOrientation CreateOpenSolid Shell FaceOrientation Face Wire
Orientation AddNaturalBound MissingSeam SmallAreaWire RemoveSmallAreaFace IntersectingWires LoopWires SplitFace
AutoCorrectPrecision ModifyTopology ModifyGeometry ClosedWire PreferencePCurve ReorderEdges SmallEdges Connected
EdgeCurves Degenerated Lacking SelfIntersection RemoveLoop Reversed2d RemovePCurve AddPCurve RemoveCurve3d
AddCurve3d Seam Shifted EdgeSameParameter NotchedEdges TailMode SelfIntersectingEdge IntersectingEdges
NonAdjacentIntersectingEdges VertexPosition VertexTolerance
""".split()


def read(path, is_repaired):
    """Returns the shape of a file, or `None` if there is none, and the reader, which knows the entity of each shape."""
    from OCP.collections import DataMap_TCollection_AsciiString_TCollection_AsciiString as Parameters
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TCollection import TCollection_AsciiString as Text

    reader = STEPControl_Reader()
    if "RetDone" not in str(reader.ReadFile(str(path))):
        return None, reader
    if not is_repaired:
        parameters = Parameters()
        for repair in REPAIRS:
            for name in (f"FixShape.Fix{repair}Mode", f"FixShape.{repair}Mode"):
                parameters.Bind(Text(name), Text("0"))
        reader.SetShapeFixParameters(parameters)
    reader.TransferRoots()
    shape = reader.OneShape()
    return (None if shape.IsNull() else shape), reader


def is_face(keyword):
    """Returns whether a STEP keyword may be that of a face. A complex instance has an empty keyword."""
    return keyword == b"" or keyword.endswith((b"FACE", b"SURFACE"))


def shapes_of(shape, kind):
    """Returns the distinct subshapes of one kind: as an indexed map, and as a list."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
    from OCP.TopExp import TopExp

    found = ShapeMap()
    TopExp.MapShapes_s(shape, kind, found)
    return found, [found.FindKey(i + 1) for i in range(found.Extent())]


def below(shape, kind):
    """Yields every occurrence of a kind of subshape."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


class Side:
    """A face, and its outward normals along its edges."""

    def __init__(self, shape):
        from OCP.BRepAdaptor import BRepAdaptor_Surface
        from OCP.TopAbs import TopAbs_REVERSED
        from OCP.TopoDS import TopoDS

        self.face = TopoDS.Face(shape)
        self.surface = BRepAdaptor_Surface(self.face, False)
        self.type = TYPES[min(int(self.surface.GetType()), len(TYPES) - 1)]
        self.sign = -1.0 if shape.Orientation() == TopAbs_REVERSED else 1.0

    def parameters(self, edge, place):
        """Returns the surface parameters of a position on an edge.

        They come from the edge's curve in the parameter plane of the face, or, without such a curve, from the nearest point of the surface.
        """
        from OCP.BRep import BRep_Tool
        from OCP.BRepAdaptor import BRepAdaptor_Curve
        from OCP.ShapeAnalysis import ShapeAnalysis_Surface

        flat = BRep_Tool.CurveOnSurface_s(edge, self.face, 0.0, 0.0)
        if flat is not None:
            first, last = BRep_Tool.Range_s(edge, self.face)
            return flat.Value(first + place * (last - first))
        curve = BRepAdaptor_Curve(edge)
        first, last = curve.FirstParameter(), curve.LastParameter()
        point = curve.Value(first + place * (last - first))
        return ShapeAnalysis_Surface(BRep_Tool.Surface_s(self.face)).ValueOfUV(point, 1e-7)

    def normal(self, edge, place):
        """Returns the outward unit normal at a position on an edge, or `None` where the surface is degenerate."""
        from OCP.gp import gp_Pnt, gp_Vec

        at, point, along_u, along_v = self.parameters(edge, place), gp_Pnt(), gp_Vec(), gp_Vec()
        self.surface.D1(at.X(), at.Y(), point, along_u, along_v)
        normal = along_u.Crossed(along_v)
        if normal.Magnitude() <= max(1e-30, 1e-9 * along_u.Magnitude() * along_v.Magnitude()):
            return None
        return normal.Multiplied(self.sign / normal.Magnitude())


def angle_between(one, other, edges):
    """Returns the angle between two faces in degrees, at the first position on their edge where both have a normal."""
    for place in PLACES:
        a, b = one.normal(edges[0], place), other.normal(edges[1], place)
        if a is not None and b is not None:
            return math.degrees(math.atan2(a.Crossed(b).Magnitude(), a.Dot(b)))
    return None


def uses_of_edges(faces):
    """Returns, for each edge, the faces that use it, in order, each with the edge as the face uses it.

    Degenerate edges are left out.
    """
    from OCP.BRep import BRep_Tool
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    edges, uses = ShapeMap(), []
    for i, face in enumerate(faces):
        for shape in below(face, TopAbs_EDGE):
            edge = TopoDS.Edge(shape)
            if BRep_Tool.Degenerated_s(edge):
                continue
            rank = edges.Add(edge)
            if rank > len(uses):
                uses.append({})
            uses[rank - 1].setdefault(i, edge)
    return uses


def edges_between(sides, faces):
    """Returns the rows of `edges`: one for each pair of faces with a common edge."""
    rows = []
    for use in uses_of_edges(faces):
        among = sorted(use)
        for x, a in enumerate(among):
            for b in among[x + 1:]:
                rows.append([a, b, angle_between(sides[a], sides[b], (use[a], use[b])), None])
    return rows


def parts(types, edges):
    """Returns the part of each face. Parts are numbered in the order of their first faces."""
    root = list(range(len(types)))

    def find(i):
        while root[i] != i:
            i = root[i]
        return i

    for a, b, angle, _ in edges:
        if types[a] == types[b] and angle is not None and angle <= THETA:
            one, other = sorted((find(a), find(b)))
            root[other] = one
    ranks = {}
    return [ranks.setdefault(find(i), len(ranks)) for i in range(len(types))]


def areas(path):
    """Returns the area and the mesh area of each face of the repaired import, by # number."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopoDS import TopoDS

    shape, reader = read(path, is_repaired=True)
    if shape is None:
        return {}
    number_of = numbers(path, reader, is_face)
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    BRepMesh_IncrementalMesh(shape, CHORD * max(box.SquareExtent() ** 0.5, 1e-9), False, ANGLE, False)
    found = {}
    for face in shapes_of(shape, TopAbs_FACE)[1]:
        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, properties)
        found.setdefault(bare_number(number_of, face), (properties.Mass(), mesh_area(TopoDS.Face(face))))
    return found


def bare_number(number_of, face):
    """Returns the # number of a face. OpenCASCADE knows the face either without or with the placement of its product."""
    from OCP.TopLoc import TopLoc_Location

    return number_of(face.Located(TopLoc_Location())) or number_of(face)


def mesh_area(face):
    """Returns the area of the mesh of a face, or 0 if the face has no mesh."""
    from OCP.BRep import BRep_Tool
    from OCP.gp import gp_Vec
    from OCP.TopLoc import TopLoc_Location

    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    if mesh is None:
        return 0.0
    nodes = [mesh.Node(i + 1) for i in range(mesh.NbNodes())]
    total = 0.0
    for i in range(mesh.NbTriangles()):
        a, b, c = (nodes[k - 1] for k in mesh.Triangle(i + 1).Get())
        total += gp_Vec(a, b).Crossed(gp_Vec(a, c)).Magnitude() / 2
    return total


def reference_row(path):
    """Returns the reference line of one file, without its path."""
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL

    shape, reader = read(path, is_repaired=False)
    if shape is None:
        return {"status": "no_shape"}
    found, faces = shapes_of(shape, TopAbs_FACE)
    if not faces:
        return {"status": "no_faces"}
    shell_of = {}
    for rank, shell in enumerate(below(shape, TopAbs_SHELL)):
        for face in below(shell, TopAbs_FACE):
            shell_of.setdefault(found.FindIndex(face) - 1, rank)
    number_of = numbers(path, reader, is_face)
    sides = [Side(face) for face in faces]
    types = [side.type for side in sides]
    edges = edges_between(sides, faces)
    occurrences, rows, area_of = {}, [], areas(path)
    for i, (face, part) in enumerate(zip(faces, parts(types, edges))):
        number = bare_number(number_of, face)
        occurrence = occurrences[number] = occurrences.get(number, -1) + 1
        rows.append([number, occurrence, types[i], part, shell_of.get(i, -1), *area_of.get(number, (None, None))])
    return {"status": "ok", "faces": rows, "edges": edges}


def line_of(path, dir, timeout):
    """Returns the reference line of one file as JSON."""
    row, error = in_a_process(reference_row, dir / path, timeout)
    return json.dumps({"file": str(path), **(row or {"status": error})}, separators=(",", ":"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", type=Path, help="file with paths below DIR, one per line; other files are left out")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds that OpenCASCADE may take for a file")
    options = parser.parse_args()
    paths = sorted(path.relative_to(options.dir) for path in options.dir.rglob("*") if path.suffix.lower() in SUFFIXES)
    if options.only:
        wanted = set(options.only.read_text().splitlines())
        paths = [path for path in paths if str(path) in wanted]
    with options.out.open("w") as out:
        for i, path in enumerate(paths):
            print(line_of(path, options.dir, options.timeout), file=out, flush=True)
            print(f"\r{i + 1} of {len(paths)}", end="", file=sys.stderr)


if __name__ == "__main__":
    main()
