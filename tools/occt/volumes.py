#!/usr/bin/env python3
"""Measures the exact volume of every solid of STEP files with OpenCASCADE. `partprobe verify --volumes` compares with these volumes.

    pip install cadquery-ocp
    volumes.py DIR --out volumes.jsonl [--only LIST.txt] [--timeout 60]
    volumes.py DIR --look LIST.txt [--partprobe partprobe]
    volumes.py DIR --meshes REF.jsonl --volumes volumes.jsonl --partprobe partprobe

Each file is read in its own process, by the default import with healing.

--out writes one line per file below DIR. A file that already has a line is not read again. A line is {"file", "solids"}, and a solid is
[# number, whether all its shells are closed, volume in cubic millimeters, whether BRepCheck_Analyzer calls it valid]. A solid that occurs
several times has one entry. The line is {"file", "error"} if OpenCASCADE fails or takes too long. The volume is that of
BRepGProp::VolumeProperties, a Gauss quadrature of the true surfaces. If its fixed form and its adaptive form differ by more than 0.1 %, the
volume is that of the adaptive form at 1e-6.

--look reads the files that LIST.txt names (paths below DIR). For each solid it prints the volumes by the fixed form and by the adaptive
form at 1e-6; the volume of OpenCASCADE's mesh at 2e-4 of the diagonal and 0.1 rad; the number of faces without a mesh; and with
--partprobe the volume that partprobe measures.

--meshes takes the files with a single closed solid. For OpenCASCADE and for partprobe, it counts the files whose mesh encloses the exact
volume within 1 %. The volume of OpenCASCADE's mesh is the "volume" of a reference line for `partprobe verify`. Both input files may be
.zst.
"""
from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import subprocess
import sys
from pathlib import Path

SUFFIXES = {".step", ".stp", ".p21"}
CHORD, ANGLE = 2e-4, 0.1
# The fixed form is wrong by up to a third on faces with long or uneven splines. The adaptive form is right, but may take minutes
# for a solid at 1e-6. So it runs with this accuracy only if the two forms differ by more than 1e-3.
ROUGH, EXACTNESS = 1e-3, 1e-6


def solids_of(path):
    """Returns each distinct solid of a file with its # number."""
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopoDS import TopoDS

    return [(number, TopoDS.Solid(shape)) for number, shape in distinct_shapes(path, TopAbs_SOLID, is_solid)]


def distinct_shapes(path, kind, is_wanted):
    """Returns each distinct shape of one kind with its # number, which is `None` if OpenCASCADE no longer knows it."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FORWARD
    from OCP.TopExp import TopExp
    from OCP.TopLoc import TopLoc_Location

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    found, distinct = ShapeMap(), ShapeMap()
    shape = reader.OneShape()
    if not shape.IsNull():
        TopExp.MapShapes_s(shape, kind, found)
    for i in range(1, found.Extent() + 1):
        distinct.Add(found.FindKey(i).Located(TopLoc_Location()).Oriented(TopAbs_FORWARD))
    number_of = numbers(path, reader, is_wanted)
    shapes = [distinct.FindKey(i) for i in range(1, distinct.Extent() + 1)]
    return [(number_of(shape), shape) for shape in shapes]


def numbers(path, reader, is_wanted):
    """Returns a function from a shape to its # number.

    OpenCASCADE numbers entities by their order among the records of the file, so the function reads the # numbers from the text.
    """
    text = Path(path).read_bytes().split(b"DATA;", 1)[-1]
    record = re.compile(rb"(?:^|;)\s*(?:/\*.*?\*/\s*)*#(\d+)\s*=\s*([A-Z_0-9]*)", re.S)
    records = [(int(number), keyword) for number, keyword in record.findall(text)]
    model = reader.StepModel()
    if model.NbEntities() != len(records):
        return lambda _: None
    # The list keeps the entities alive, because they are found by their identity.
    ranked = [(model.Value(i + 1), number) for i, (number, word) in enumerate(records) if is_wanted(word)]
    number_of = {id(entity): number for entity, number in ranked}
    transfer = reader.WS().TransferReader()

    def number(shape, _keep=ranked):
        entity = transfer.EntityFromShapeResult(shape, 1)
        return number_of.get(id(entity)) if entity is not None else None

    return number


def is_solid(keyword):
    """Returns whether a STEP keyword may be that of a solid. A complex instance has an empty keyword."""
    return keyword == b"" or b"BREP" in keyword or b"SOLID" in keyword


def is_closed(solid):
    """Returns whether all shells of a solid are closed."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_SHELL
    from OCP.TopExp import TopExp_Explorer

    shells = TopExp_Explorer(solid, TopAbs_SHELL)
    while shells.More():
        if not BRep_Tool.IsClosed_s(shells.Current()):
            return False
        shells.Next()
    return True


def quadrature(solid, exactness=None):
    """Returns the volume by BRepGProp: by the fixed form, or by the adaptive form to the relative accuracy `exactness`."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    if exactness is None:
        BRepGProp.VolumeProperties_s(solid, properties)
    else:
        BRepGProp.VolumeProperties_s(solid, properties, exactness, False, False)
    return properties.Mass()


def exact_volume(solid):
    """Returns the volume of the fixed form if a rough adaptive one confirms it, and otherwise that of the exact adaptive form."""
    fixed, rough = quadrature(solid), quadrature(solid, ROUGH)
    return fixed if abs(fixed - rough) <= ROUGH * abs(rough) else quadrature(solid, EXACTNESS)


def mesh_volume(solid):
    """Returns the volume that the mesh of a solid encloses, and the number of faces without a mesh."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(solid, box, False, False)
    BRepMesh_IncrementalMesh(solid, CHORD * box.SquareExtent() ** 0.5, False, ANGLE, False)
    total, n_lacking = 0.0, 0
    faces = TopExp_Explorer(solid, TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face(faces.Current())
        faces.Next()
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face, location)
        if mesh is None:
            n_lacking += 1
            continue
        placed = location.Transformation()
        nodes = [mesh.Node(i + 1).Transformed(placed) for i in range(mesh.NbNodes())]
        places = [(node.X(), node.Y(), node.Z()) for node in nodes]
        side = -1 if face.Orientation() == TopAbs_REVERSED else 1
        for i in range(mesh.NbTriangles()):
            total += side * determinant(*(places[k - 1] for k in mesh.Triangle(i + 1).Get())) / 6
    return total, n_lacking


def determinant(p, q, r):
    return (p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0])
            + p[2] * (q[0] * r[1] - q[1] * r[0]))


def exact_row(path):
    """Returns the entries of the solids of one file for volumes.jsonl."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return [[number, is_closed(solid), exact_volume(solid), BRepCheck_Analyzer(solid).IsValid()]
            for number, solid in solids_of(path)]


def looked_at_row(path):
    """Returns the volumes of the solids of one file for --look."""
    return [[number, quadrature(solid), quadrature(solid, EXACTNESS), *mesh_volume(solid)]
            for number, solid in solids_of(path)]


def import_once():
    """Imports OpenCASCADE. The processes of the files are forked from this one, so they do not import it again."""
    import OCP.BRepCheck, OCP.BRepGProp, OCP.BRepMesh, OCP.STEPControl  # noqa: E401, F401


def answer(pipe, row, path):
    """Runs in the process of a file: sends the row."""
    pipe.send(row(path))


def in_a_process(row, path, timeout):
    """Returns the row of one file and `None`, or `None` and the reason.

    The row is computed in a process, because OpenCASCADE may crash or never end.
    """
    forked = multiprocessing.get_context("fork")
    ours, theirs = forked.Pipe(duplex=False)
    process = forked.Process(target=answer, args=(theirs, row, path))
    process.start()
    theirs.close()
    try:
        return (ours.recv(), None) if ours.poll(timeout) else (None, "timeout")
    except EOFError:
        return None, "crash"
    finally:
        process.kill()
        process.join()


def write_volumes(options):
    """Writes the lines of the files that have none."""
    paths = [str(path.relative_to(options.dir)) for path in sorted(options.dir.rglob("*"))
             if path.suffix.lower() in SUFFIXES]
    if options.only:
        wanted = set(options.only.read_text().splitlines())
        paths = [path for path in paths if path in wanted]
    done = set()
    if options.out.exists():
        done = {json.loads(line)["file"] for line in options.out.open()}
    with options.out.open("a") as out:
        for i, path in enumerate(paths):
            if path in done:
                continue
            solids, error = in_a_process(exact_row, options.dir / path, options.timeout)
            print(json.dumps({"file": path, "solids": solids} if error is None else {"file": path, "error": error}),
                  file=out, flush=True)
            print(f"\r{i + 1} of {len(paths)}", end="", file=sys.stderr)


def our_volumes(partprobe, path):
    """Returns the volume that partprobe measures for each solid, by its # number, from `partprobe inspect --json`."""
    run = subprocess.run([partprobe, "inspect", "--json", str(path)], capture_output=True, text=True, check=True)
    return {solid["step_id"]: solid["volume"] for solid in json.loads(run.stdout)["mesh"]["solids"]}


def json_lines(path):
    """Returns the objects of a file of JSON lines, which may be compressed."""
    is_packed = path.suffix == ".zst"
    text = subprocess.run(["zstd", "-dc", path], capture_output=True, check=True).stdout if is_packed else path.read_bytes()
    return [json.loads(line) for line in text.splitlines()]


def our_mesh_volume(partprobe, path):
    """Returns the volume that the meshes of partprobe enclose, or 0 if partprobe cannot read the file."""
    run = subprocess.run([partprobe, "inspect", "--json", str(path)], capture_output=True, text=True)
    return sum(solid["mesh_volume"] for solid in json.loads(run.stdout)["mesh"]["solids"]) if run.returncode == 0 else 0.0


def compare_meshes(options):
    """Prints how many meshes of OpenCASCADE and of partprobe enclose the exact volume."""
    solids = {row["file"]: row["solids"] for row in json_lines(options.volumes) if "solids" in row}
    n_files, theirs, ours = 0, 0, 0
    for row in json_lines(options.meshes):
        of_file = solids.get(row["file"], [])
        if row["status"] != "ok" or row["n_shells"] != 1 or len(of_file) != 1 or not of_file[0][1]:
            continue
        exact = of_file[0][2]
        is_near = lambda volume: abs(volume - exact) <= 0.01 * abs(exact)
        n_files += 1
        theirs += is_near(row["volume"])
        ours += is_near(our_mesh_volume(options.partprobe, options.dir / row["file"]))
    print(
        f"{n_files} files of one closed solid; within 1 %: mesh of OpenCASCADE {100 * theirs / n_files:.2f} %, "
        f"mesh of partprobe {100 * ours / n_files:.2f} %"
    )


def look(options):
    """Prints the table of --look."""
    print("| file | solid | BRepGProp | adaptive, 1e-6 | mesh | faces without mesh | partprobe |\n|---|---|---:|---:|---:|---:|---:|")
    for path in options.look.read_text().splitlines():
        ours = our_volumes(options.partprobe, options.dir / path) if options.partprobe else {}
        rows, error = in_a_process(looked_at_row, options.dir / path, options.timeout)
        for number, exact, adaptive, mesh, n_lacking in rows or []:
            mine = ours.get(number, float("nan"))
            print(f"| {path} | #{number} | {exact:.6g} | {adaptive:.6g} | {mesh:.6g} | {n_lacking} | {mine:.6g} |", flush=True)
        if error:
            print(f"| {path} | {error} | | | | | |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", type=Path, help="file with paths below DIR, one per line; other files are left out")
    parser.add_argument("--look", type=Path, help="file with paths below DIR, one per line")
    parser.add_argument("--meshes", type=Path, help="the reference lines of `partprobe verify`")
    parser.add_argument("--volumes", type=Path, help="the file that --out wrote, for --meshes")
    parser.add_argument("--partprobe")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds that OpenCASCADE may take for a file")
    options = parser.parse_args()
    if [options.out, options.look, options.meshes].count(None) != 2:
        parser.error("give exactly one of --out, --look and --meshes")
    if options.meshes:
        if not options.volumes or not options.partprobe:
            parser.error("--meshes needs --volumes and --partprobe")
        return compare_meshes(options)
    import_once()
    write_volumes(options) if options.out else look(options)


if __name__ == "__main__":
    main()
