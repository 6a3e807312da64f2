#!/usr/bin/env python3
"""Does our kernel read shapes that OpenCASCADE has just modeled, as OpenCASCADE reads them?

    pip install cadquery-ocp
    modeled.py OUT [--n 12] [--seed 0] [--only FAMILY...] [--timeout 60] [--partprobe partprobe] [--again]

In go a seed and a number of files for each family of `models.py`; assemblies are one more family, written with names,
colors, layers and nested places. Each shape is written as STEP with settings of its own: schema (AP203, AP214, AP242),
curves in parameter space or none, millimeters, inches or meters, the way in which the precision is stated, vertices, and
shapes that are not manifold. Out come OUT/files/FAMILY/NUMBER.step, OUT/reference.jsonl and OUT/volumes.jsonl
(OpenCASCADE's reading of them, as reference.py and volumes.py make it, but with the volumes that were modeled), and on
standard output each disagreement and the table of `partprobe verify`. The same seed gives the same shapes; a model that
fails, as modeling may, is tried again with the next random numbers. --again compares the files that are there, with
another partprobe.
"""
from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from random import Random

from reference import reference_row
from volumes import exact_row, exact_volume, in_a_process, mesh_volume

ATTEMPTS = 5
NEAR = 0.01
SCHEMAS = ("AP203", "AP214IS", "AP242DIS")
UNITS = ("MM", "MM", "INCH", "M")
COLORS = ((1.0, 0.2, 0.1), (0.1, 0.6, 0.2), (0.2, 0.3, 0.9))


def settings_of(rng):
    return {
        "write.step.schema": rng.choice(SCHEMAS),
        "write.step.unit": rng.choice(UNITS),
        "write.surfacecurve.mode": rng.choice((0, 1)),
        "write.precision.mode": rng.choice((-1, 0, 1)),
        "write.step.vertex.mode": rng.choice((0, 1)),
        "write.step.nonmanifold": rng.choice((0, 0, 1)),
    }


def apply(settings):
    """Settings are global in OpenCASCADE, and each file has a process of its own."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller

    STEPControl_Controller.Init_s()
    for name, value in settings.items():
        (Interface_Static.SetCVal_s if isinstance(value, str) else Interface_Static.SetIVal_s)(name, value)


def write_shape(shape, path):
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    check_written(writer.Write(str(path)))


def check_written(status):
    if "RetDone" not in str(status):
        raise ValueError("the file cannot be written")


def placement(rng):
    """A place for a component: turned and moved."""
    import models
    from OCP.gp import gp_Ax1, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(models.ORIGIN, models.direction(rng)), rng.uniform(0, models.TAU))
    move.SetTranslation(gp_Vec(*(rng.uniform(-60, 60) for _ in range(3))))
    return TopLoc_Location(move.Multiplied(turn))


def assembly(rng):
    """A document of parts and assemblies of them, three levels deep at most, each part placed several times."""
    import models
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.TCollection import TCollection_ExtendedString as Text
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

    document = TDocStd_Document(Text("XmlXCAF"))
    shapes, colors, layers = (tool(document.Main()) for tool in (
        XCAFDoc_DocumentTool.ShapeTool_s, XCAFDoc_DocumentTool.ColorTool_s, XCAFDoc_DocumentTool.LayerTool_s))
    placeable = []
    for i in range(rng.randrange(1, 4)):
        shape = rng.choice([models.plain, models.mirrored, models.compounds, models.tangent])(rng)
        label = shapes.AddShape(shape, False)
        TDataStd_Name.Set_s(label, Text(f"part {i}, Größe"))
        colors.SetColor(label, Quantity_Color(*rng.choice(COLORS), Quantity_TOC_sRGB), XCAFDoc_ColorGen)
        layers.SetLayer(label, Text(f"layer {i % 2}"))
        for face in models.faces_of(shape)[:3]:
            colored = shapes.AddSubShape(label, face)
            if not colored.IsNull():
                colors.SetColor(colored, Quantity_Color(*rng.choice(COLORS), Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        placeable.append(label)
    for level in range(rng.randrange(1, 4)):
        group = shapes.NewShape()
        TDataStd_Name.Set_s(group, Text(f"assembly {level}"))
        for label in rng.choices(placeable, k=rng.randrange(1, 4)):
            shapes.AddComponent(group, label, placement(rng))
        placeable.append(group)
    shapes.UpdateAssemblies()
    return document


def write_document(document, path):
    from OCP.STEPCAFControl import STEPCAFControl_Writer

    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    check_written(writer.Write(str(path)))


def volume_of(solid):
    """BRepGProp's volume, or where it leaves that of a fine mesh, as it does on long splines, the mesh's.

    Measured beside the origin: far from it digits are lost.
    """
    import models

    solid = models.beside_origin(solid)
    exact, (meshed, n_lacking) = exact_volume(solid), mesh_volume(solid)
    return exact if n_lacking or abs(exact - meshed) <= NEAR * abs(meshed) else meshed


def write_model(task):
    """Writes one file: (family, seed of its random numbers, path). Gives each solid's volume as it was modeled."""
    import models
    from OCP.TopoDS import TopoDS

    family, seed, path = task
    rng = Random(seed)
    apply(settings_of(rng))
    path.parent.mkdir(parents=True, exist_ok=True)
    if family == "assemblies":
        write_document(assembly(rng), path)
        return []
    shape = models.FAMILIES[family](rng)
    if shape.IsNull() or not models.faces_of(shape):
        raise ValueError("the model is empty")
    write_shape(shape, path)
    return [volume_of(TopoDS.Solid(solid)) for solid in models.solids_of(shape)]


def modeled(family, number, options):
    """The path of one file below OUT/files and its solids' volumes; None if every attempt failed."""
    path = Path(family) / f"{number:03}.step"
    for attempt in range(ATTEMPTS):
        task = family, f"{options.seed}/{family}/{number}/{attempt}", options.out / "files" / path
        volumes, _ = in_a_process(write_model, task, options.timeout)
        if volumes is not None:
            return path, volumes
    return None


def rows_of(path, volumes, options):
    """What OpenCASCADE reads in a file: the reference line and the line of volumes.

    Its import changes some shapes, so the volumes are those that were modeled wherever there are as many solids.
    """
    whole = options.out / "files" / path
    row, error = in_a_process(reference_row, whole, options.timeout)
    solids, _ = in_a_process(exact_row, whole, options.timeout)
    solids = solids or []
    if len(solids) == len(volumes):
        solids = [[*row[:2], volume, *row[3:]] for row, volume in zip(solids, volumes)]
    return {"file": str(path), **(row or {"status": error})}, {"file": str(path), "solids": solids}


def be_silent():
    """OpenCASCADE reports what it transfers on standard output, where our table goes."""
    from OCP.Message import Message, Message_Printer

    Message.DefaultMessenger_s().RemovePrinters(Message_Printer.get_type_descriptor_s())


def write_files(options):
    import models

    be_silent()
    families = options.only or [*models.FAMILIES, "assemblies"]
    options.out.mkdir(parents=True, exist_ok=True)
    n_failed = 0
    with (options.out / "reference.jsonl").open("w") as reference, (options.out / "volumes.jsonl").open("w") as volumes:
        for family in families:
            for number in range(options.n):
                model = modeled(family, number, options)
                n_failed += model is None
                for row, out in zip(rows_of(*model, options) if model else (), (reference, volumes)):
                    print(json.dumps(row, separators=(",", ":")), file=out, flush=True)
            print(f"{family} written", file=sys.stderr)
    print(f"{n_failed} models failed in each of {ATTEMPTS} attempts", file=sys.stderr)


def compare(options):
    command = [options.partprobe, "verify", "--reference", options.out / "reference.jsonl", "--volumes",
               options.out / "volumes.jsonl", options.out / "files", "--list", "--jobs", "1"]
    return subprocess.run(command, check=False).returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--n", type=int, default=12, help="files of each family")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", metavar="FAMILY")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for a model, and for each reading of it")
    parser.add_argument("--partprobe", default="partprobe")
    parser.add_argument("--again", action="store_true", help="compare what is there")
    options = parser.parse_args()
    if not options.again:
        write_files(options)
    sys.exit(compare(options))


if __name__ == "__main__":
    main()
