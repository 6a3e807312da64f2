#!/usr/bin/env python3
"""Compares where `partprobe label --instances` and OpenCASCADE's XCAF import place the faces of assemblies.

    pip install cadquery-ocp numpy
    placements.py DIR [--partprobe partprobe] [--only TEXT]

Input: the STEP files below DIR, or those whose name contains TEXT. partprobe labels each file with every occurrence, and
STEPCAFControl_Reader of OpenCASCADE reads it. Output: one line per file: the fraction of OpenCASCADE's faces that agree, the numbers of
faces of OpenCASCADE and of partprobe, and the name of the file. The last line has the number of files in which more than 99.5 % agree.

Two faces agree if their bounding boxes agree within 2 % of the diagonal of the face plus 1e-4 of the diagonal of the shape. Each face is
used at most once.
"""
from __future__ import annotations

import argparse
import multiprocessing
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SUFFIXES = {".step", ".stp", ".p21"}
CHORD, ANGLE = 0.002, 0.3
OF_FACE, OF_SHAPE = 0.02, 1e-4
AGREES = 0.995


def boxes_of_xcaf(path):
    """Returns the bounding box of the mesh of each placed face, as OpenCASCADE reads it: [face, 6]."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS
    from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.ReadFile(str(path))
    reader.Transfer(document)
    roots = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    shapes = [XCAFDoc_ShapeTool.GetShape_s(roots.Value(i + 1)) for i in range(roots.Length())]
    chord = CHORD * diagonal_of(shapes)
    boxes = []
    for shape in shapes:
        BRepMesh_IncrementalMesh(shape, chord, False, ANGLE, False)
        faces = TopExp_Explorer(shape, TopAbs_FACE)
        while faces.More():
            face = TopoDS.Face(faces.Current())
            faces.Next()
            location = TopLoc_Location()
            mesh = BRep_Tool.Triangulation_s(face, location)
            if mesh is None or mesh.NbTriangles() == 0:
                continue
            placed = location.Transformation()
            nodes = [mesh.Node(i + 1).Transformed(placed) for i in range(mesh.NbNodes())]
            places = np.array([(node.X(), node.Y(), node.Z()) for node in nodes])
            boxes.append((*places.min(0), *places.max(0)))
    return np.array(boxes).reshape(-1, 6)


def diagonal_of(shapes):
    """Returns the diagonal of the bounding box of all shapes."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    for shape in shapes:
        BRepBndLib.Add_s(shape, box)
    return 0.0 if box.IsVoid() else box.SquareExtent() ** 0.5


def boxes_of_partprobe(program, path):
    """Returns the bounding box of the mesh of each face, as partprobe labels it: [face, 6]."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "label", str(path), "--out", f"{folder}/d", "--instances", "--jobs", "1"]
        subprocess.run(command, check=True, capture_output=True)
        carrier = np.load(next(Path(folder).rglob("*.npz")))
        vertices, triangles, tri_face = (carrier[name] for name in ("vertices", "triangles", "tri_face"))
    corners = vertices[triangles].reshape(-1, 3)
    face_of_corner = np.repeat(tri_face, 3)
    order = np.argsort(face_of_corner, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(face_of_corner[order]) > 0])
    low, high = np.minimum.reduceat(corners[order], starts), np.maximum.reduceat(corners[order], starts)
    return np.hstack([low, high])


def n_agreeing(theirs, ours):
    """Returns how many boxes of OpenCASCADE have an agreeing box of partprobe. Each box of partprobe is used at most once."""
    size = np.linalg.norm(theirs[:, 3:].max(0) - theirs[:, :3].min(0))
    used = np.zeros(len(ours), bool)
    found = 0
    for box in theirs:
        gap = np.abs(ours - box).max(1)
        gap[used] = np.inf
        nearest = int(gap.argmin()) if len(gap) else -1
        reach = OF_FACE * np.linalg.norm(box[3:] - box[:3]) + OF_SHAPE * size
        if nearest >= 0 and gap[nearest] <= reach:
            used[nearest] = True
            found += 1
    return found


def compare(job):
    """Returns the path of a file, the fraction that agrees, and the numbers of faces; `None` and the error if a program cannot read it."""
    program, path = job
    try:
        theirs, ours = boxes_of_xcaf(path), boxes_of_partprobe(program, path)
        return path, n_agreeing(theirs, ours) / len(theirs) if len(theirs) else 1.0, len(theirs), len(ours)
    except Exception as error:  # The file is reported, and the other files are still compared.
        return path, None, str(error), 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--partprobe", default="partprobe")
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    files = sorted(path for path in args.folder.rglob("*") if path.suffix.lower() in SUFFIXES and args.only in path.name)
    shares = []
    # Each file has its own process, because OpenCASCADE would keep the memory of earlier files.
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for path, share, n_theirs, n_ours in pool.imap(compare, [(args.partprobe, path) for path in files]):
            if share is None:
                print(f"failed  {path.name}: {n_theirs}", flush=True)
                continue
            shares.append(share)
            print(f"{100 * share:6.2f} %  {n_theirs} {n_ours}  {path.name}", flush=True)
    print(f"{sum(share > AGREES for share in shares)} of {len(shares)} files above {100 * AGREES} %")


if __name__ == "__main__":
    sys.exit(main())
