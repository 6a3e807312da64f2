#!/usr/bin/env python3
"""Checks whether partprobe reads STEP files of shapes that OpenCASCADE models as OpenCASCADE reads them.

    pip install cadquery-ocp
    modeled.py OUT [--n 12] [--seed 0] [--only FAMILY...] [--timeout 60] [--partprobe partprobe] [--again]

Input: a seed, and the number of files for each family of shapes in `models.py`. Assemblies are another family. They have names, colors,
layers and nested placements. Output: OUT/files/FAMILY/NUMBER.step; OUT/reference.jsonl and OUT/volumes.jsonl, in the formats of
reference.py and volumes.py; and on stdout each disagreement and the table of `partprobe verify`. The two JSON files have what OpenCASCADE
reads from the STEP files, but the volumes are those of the shapes before they were written.
Exit status: that of `partprobe verify`.

Each file is written with random settings: the schema (AP203, AP214, AP242), whether there are curves in parameter space, the unit
(millimeters, inches or meters), how the precision is stated, vertices, and shapes that are not manifold. The same seed gives the same
shapes. Modeling may fail; then the script tries again with the next random numbers. With --again, it compares the existing files, for
example with another version of partprobe.
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
    """Returns random settings of OpenCASCADE's STEP writer."""
    return {
        "write.step.schema": rng.choice(SCHEMAS),
        "write.step.unit": rng.choice(UNITS),
        "write.surfacecurve.mode": rng.choice((0, 1)),
        "write.precision.mode": rng.choice((-1, 0, 1)),
        "write.step.vertex.mode": rng.choice((0, 1)),
        "write.step.nonmanifold": rng.choice((0, 0, 1)),
    }


def apply(settings):
    """Sets the settings of the writer. They are global in OpenCASCADE, so each file is written in its own process."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller

    STEPControl_Controller.Init_s()
    for name, value in settings.items():
        (Interface_Static.SetCVal_s if isinstance(value, str) else Interface_Static.SetIVal_s)(name, value)


def write_shape(shape, path):
    """Writes a shape as a STEP file."""
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    check_written(writer.Write(str(path)))


def check_written(status):
    """Raises an error if OpenCASCADE did not write the file."""
    if "RetDone" not in str(status):
        raise ValueError("the file cannot be written")


def placement(rng):
    """Returns a random location of a component: a rotation and a translation."""
    import models
    from OCP.gp import gp_Ax1, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(models.ORIGIN, models.direction(rng)), rng.uniform(0, models.TAU))
    move.SetTranslation(gp_Vec(*(rng.uniform(-60, 60) for _ in range(3))))
    return TopLoc_Location(move.Multiplied(turn))


def assembly(rng):
    """Returns a document with parts and assemblies. Assemblies nest up to three levels deep, and a part may occur several times."""
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
    """Writes a document as a STEP file."""
    from OCP.STEPCAFControl import STEPCAFControl_Writer

    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    check_written(writer.Write(str(path)))


def volume_of(solid):
    """Returns the volume of a solid: that of BRepGProp, or that of a fine mesh if the two differ.

    BRepGProp can be wrong on long splines. The volume is measured near the origin, because far from it digits are lost.
    """
    import models

    solid = models.beside_origin(solid)
    exact, (meshed, n_lacking) = exact_volume(solid), mesh_volume(solid)
    return exact if n_lacking or abs(exact - meshed) <= NEAR * abs(meshed) else meshed


def write_model(task):
    """Writes one file. `task` is the family, the seed of its random numbers, and the path. Returns the volume of each modeled solid."""
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
    """Returns the path of one file below OUT/files and the volumes of its solids, or `None` if every attempt failed."""
    path = Path(family) / f"{number:03}.step"
    for attempt in range(ATTEMPTS):
        task = family, f"{options.seed}/{family}/{number}/{attempt}", options.out / "files" / path
        volumes, _ = in_a_process(write_model, task, options.timeout)
        if volumes is not None:
            return path, volumes
    return None


def rows_of(path, volumes, options):
    """Returns what OpenCASCADE reads from a file: the line for reference.jsonl and the line for volumes.jsonl.

    The import of OpenCASCADE changes some shapes. So the volumes are the modeled ones, if the number of solids is the same.
    """
    whole = options.out / "files" / path
    row, error = in_a_process(reference_row, whole, options.timeout)
    solids, _ = in_a_process(exact_row, whole, options.timeout)
    solids = solids or []
    if len(solids) == len(volumes):
        solids = [[*row[:2], volume, *row[3:]] for row, volume in zip(solids, volumes)]
    return {"file": str(path), **(row or {"status": error})}, {"file": str(path), "solids": solids}


def be_silent():
    """Stops OpenCASCADE from printing messages on stdout, which has the table."""
    from OCP.Message import Message, Message_Printer

    Message.DefaultMessenger_s().RemovePrinters(Message_Printer.get_type_descriptor_s())


def write_files(options):
    """Models and writes all files, with their lines of references and volumes."""
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
    print(f"{n_failed} models failed in all {ATTEMPTS} attempts", file=sys.stderr)


def compare(options):
    """Runs `partprobe verify` on the files, and returns its exit status."""
    command = [options.partprobe, "verify", "--reference", options.out / "reference.jsonl", "--volumes",
               options.out / "volumes.jsonl", options.out / "files", "--list", "--jobs", "1"]
    return subprocess.run(command, check=False).returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--n", type=int, default=12, help="number of files of each family")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", metavar="FAMILY")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds that modeling a shape, and each reading of its file, may take")
    parser.add_argument("--partprobe", default="partprobe")
    parser.add_argument("--again", action="store_true", help="compare the files that exist, and write none")
    options = parser.parse_args()
    if not options.again:
        write_files(options)
    sys.exit(compare(options))


if __name__ == "__main__":
    main()
