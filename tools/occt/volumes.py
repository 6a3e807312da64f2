#!/usr/bin/env python3
"""The exact volume of every solid of STEP files by OpenCASCADE: what `partprobe verify --volumes` compares with.

    pip install cadquery-ocp
    volumes.py DIR --out volumes.jsonl [--only LIST.txt] [--timeout 60]      a line for each file below DIR
    volumes.py DIR --look LIST.txt [--partprobe partprobe]                   both of OpenCASCADE's volumes beside ours
    volumes.py DIR --meshes REF.jsonl --volumes volumes.jsonl --partprobe partprobe     what both kernels' meshes enclose

The import is the default one, with healing. A line of volumes.jsonl is {"file", "solids": [[# of the solid, whether all
its shells are closed, volume in cubic millimeters, whether BRepCheck_Analyzer calls it valid]]}, a solid that stands in
several places once; {"file", "error"} where OpenCASCADE fails or takes too long. The volume is that of
BRepGProp::VolumeProperties, a Gauss quadrature of the true surfaces: of its adaptive form at 1e-6 wherever the fixed one differs
from the adaptive one by more than 0.1 %. Each file is read in a process of its own. With --out
a file that has a line already is not read again.

--look reads the files that LIST.txt names (paths below DIR) and prints for each solid what BRepGProp says by its fixed
quadrature, what its adaptive form says at 1e-6, what OpenCASCADE's own mesh encloses at 2e-4 of the diagonal and 0.1 rad, how many faces that
mesh lacks, and with --partprobe what we say.

--meshes takes the files of a single closed solid, and counts those whose mesh encloses the exact volume within 1 %:
OpenCASCADE's, which is the "volume" of a reference line for `partprobe verify`, and ours. Both files may be .zst.
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
# The fixed quadrature is wrong by up to a third on faces with long or uneven splines. The adaptive one is right and may take
# minutes for a solid at 1e-6, so that it is asked so exactly only where the two differ by more than 1e-3.
ROUGH, EXACTNESS = 1e-3, 1e-6


def solids_of(path):
    """Each distinct solid of a file with its # number."""
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopoDS import TopoDS

    return [(number, TopoDS.Solid(shape)) for number, shape in distinct_shapes(path, TopAbs_SOLID, is_solid)]


def distinct_shapes(path, kind, is_wanted):
    """Each distinct shape of one kind with its # number, null where OpenCASCADE does not know it any more."""
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
    """A function from a shape to its # number: entities are known by their rank among the file's records."""
    text = Path(path).read_bytes().split(b"DATA;", 1)[-1]
    record = re.compile(rb"(?:^|;)\s*(?:/\*.*?\*/\s*)*#(\d+)\s*=\s*([A-Z_0-9]*)", re.S)
    records = [(int(number), keyword) for number, keyword in record.findall(text)]
    model = reader.StepModel()
    if model.NbEntities() != len(records):
        return lambda _: None
    # Entities are kept alive: it is by identity that one is found again.
    ranked = [(model.Value(i + 1), number) for i, (number, word) in enumerate(records) if is_wanted(word)]
    number_of = {id(entity): number for entity, number in ranked}
    transfer = reader.WS().TransferReader()

    def number(shape, _keep=ranked):
        entity = transfer.EntityFromShapeResult(shape, 1)
        return number_of.get(id(entity)) if entity is not None else None

    return number


def is_solid(keyword):
    return keyword == b"" or b"BREP" in keyword or b"SOLID" in keyword


def is_closed(solid):
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
    """BRepGProp's volume: by the fixed quadrature, or by the adaptive one to a part of it."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    if exactness is None:
        BRepGProp.VolumeProperties_s(solid, properties)
    else:
        BRepGProp.VolumeProperties_s(solid, properties, exactness, False, False)
    return properties.Mass()


def exact_volume(solid):
    """The fixed quadrature's volume where a rough adaptive one confirms it, and the exact adaptive one elsewhere."""
    fixed, rough = quadrature(solid), quadrature(solid, ROUGH)
    return fixed if abs(fixed - rough) <= ROUGH * abs(rough) else quadrature(solid, EXACTNESS)


def mesh_volume(solid):
    """What the mesh of a solid encloses, and how many faces have none."""
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
    from OCP.BRepCheck import BRepCheck_Analyzer

    return [[number, is_closed(solid), exact_volume(solid), BRepCheck_Analyzer(solid).IsValid()]
            for number, solid in solids_of(path)]


def looked_at_row(path):
    return [[number, quadrature(solid), quadrature(solid, EXACTNESS), *mesh_volume(solid)]
            for number, solid in solids_of(path)]


def import_once():
    """The processes of the files start from this one, with OpenCASCADE in memory."""
    import OCP.BRepCheck, OCP.BRepGProp, OCP.BRepMesh, OCP.STEPControl  # noqa: E401, F401


def answer(pipe, row, path):
    pipe.send(row(path))


def in_a_process(row, path, timeout):
    """The row of one file, or why there is none: OpenCASCADE may crash or never end."""
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
    """Volume of each solid by its # number, from `partprobe inspect --json`."""
    run = subprocess.run([partprobe, "inspect", "--json", str(path)], capture_output=True, text=True, check=True)
    return {solid["step_id"]: solid["volume"] for solid in json.loads(run.stdout)["mesh"]["solids"]}


def json_lines(path):
    is_packed = path.suffix == ".zst"
    text = subprocess.run(["zstd", "-dc", path], capture_output=True, check=True).stdout if is_packed else path.read_bytes()
    return [json.loads(line) for line in text.splitlines()]


def our_mesh_volume(partprobe, path):
    run = subprocess.run([partprobe, "inspect", "--json", str(path)], capture_output=True, text=True)
    return sum(solid["mesh_volume"] for solid in json.loads(run.stdout)["mesh"]["solids"]) if run.returncode == 0 else 0.0


def compare_meshes(options):
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
    print(f"{n_files} files of one closed solid; within 1 %: OpenCASCADE's mesh {100 * theirs / n_files:.2f} %, ours {100 * ours / n_files:.2f} %")


def look(options):
    print("| file | solid | BRepGProp | adaptive, 1e-6 | mesh | faces without mesh | ours |\n|---|---|---:|---:|---:|---:|---:|")
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
    parser.add_argument("--only", type=Path, help="a list of paths below DIR; others are left out")
    parser.add_argument("--look", type=Path, help="a list of paths below DIR")
    parser.add_argument("--meshes", type=Path, help="the reference lines of `partprobe verify`")
    parser.add_argument("--volumes", type=Path, help="what --out wrote, for --meshes")
    parser.add_argument("--partprobe")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for a file")
    options = parser.parse_args()
    if [options.out, options.look, options.meshes].count(None) != 2:
        parser.error("say --out, --look or --meshes")
    if options.meshes:
        if not options.volumes or not options.partprobe:
            parser.error("--meshes needs --volumes and --partprobe")
        return compare_meshes(options)
    import_once()
    write_volumes(options) if options.out else look(options)


if __name__ == "__main__":
    main()
