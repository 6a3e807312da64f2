#!/usr/bin/env python3
"""Checks whether a solid keeps its parts if another program writes it again.

    reauthor.py PATH... --out DIR [--n 200] [--seed 0] [--max-kb 400] [--timeout 60] [--partprobe partprobe]
    reauthor.py --out DIR --again        labels and compares the existing variants, for example with another version of partprobe

Input: STEP files and folders. The script takes a sample of the files by a fixed seed. Output: DIR/variants/<variant>/<number>.step;
DIR/written.json, which says where faces came from; DIR/labeled, a data set; DIR/rows.jsonl, with a line per model and variant; and a
Markdown table on stdout.
Needs cadquery-ocp, numpy and scipy.

OpenCASCADE writes variants of each file. partprobe labels all of them. The table has the fraction of the models whose partition is the
same in the variant, where a face that the variant has split counts as one face.

Every face of a variant is named after the face that it came from, so no face is matched by a guess. The faces of the original are matched
to those of OpenCASCADE by their order. If their numbers or areas do not fit in this order, the model is left out and counted.
"""
from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

THETA = 8.0 + 1e-6
# Lower codes are planes to tori. This code and all higher ones are free-form surfaces.
FREE_FORM = 5

VARIANTS = {
    "ap214": "read and written again, AP214",
    "ap242": "read and written again, AP242",
    "inch": "written in inches",
    "meter": "written in meters",
    "halves": "closed faces cut in two (ShapeUpgrade_ShapeDivideClosed)",
    "split": "every face cut in two (ShapeUpgrade_ShapeDivideArea)",
    "quarters": "turned faces cut at 90° (ShapeUpgrade_ShapeDivideAngle)",
    "revolution": "primitives as surfaces of revolution (ShapeCustom::ConvertToRevolution)",
    "nurbs": "every surface as a NURBS (BRepBuilderAPI_NurbsConvert)",
    "shuffled": "entities and faces in another order, other numbers (no OpenCASCADE)",
}


# ---------------------------------------------------------------------------------------------------- variants


def faces_of(shape):
    """Returns the distinct faces of a shape."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp

    found = ShapeMap()
    TopExp.MapShapes_s(shape, TopAbs_FACE, found)
    return [found.FindKey(i) for i in range(1, found.Extent() + 1)]


def area_of(face):
    """Returns the area of a face."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return properties.Mass()


def read_step(path):
    """Returns the shape of a STEP file. Raises ValueError if OpenCASCADE cannot read it."""
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    if "RetDone" not in str(reader.ReadFile(str(path))):
        raise ValueError("OpenCASCADE cannot read the file")
    reader.TransferRoots()
    return reader.OneShape()


def write_step(shape, faces, path, schema="AP214IS", unit="MM"):
    """Writes a shape. `faces` has pairs: a face of the shape, and the index of the face that it came from. The index becomes its name."""
    from OCP.Interface import Interface_Static
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TCollection import TCollection_HAsciiString

    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.schema", schema)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_AsIs)
    written = writer.WS().TransferWriter().FinderProcess()
    for face, index in faces:
        item = STEPConstruct.FindEntity_s(written, face)
        if item is None:
            raise ValueError("a face was not written")
        item.SetName(TCollection_HAsciiString(f"f{index}"))
    if "RetDone" not in str(writer.Write(str(path))):
        raise ValueError("OpenCASCADE cannot write the variant")


def divided(tool, faces):
    """Returns the result of a ShapeUpgrade tool, and the origin of its faces."""
    tool.Perform()
    context = tool.GetContext()
    origin = [(piece, i) for i, face in enumerate(faces) for piece in faces_of(context.Apply(face))]
    return tool.Result(), origin


def in_order(shape, faces):
    """Returns a converted shape and the origin of its faces. Conversions keep the order of the faces, and nothing else identifies them."""
    converted = faces_of(shape)
    if len(converted) != len(faces):
        raise ValueError("the conversion changed the number of faces")
    return shape, [(face, i) for i, face in enumerate(converted)]


def make_variant(name, shape, faces):
    """Returns a variant: its shape, the origin of its faces, and the settings of the writer."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.ShapeCustom import ShapeCustom
    from OCP.ShapeUpgrade import (
        ShapeUpgrade_ShapeDivideAngle,
        ShapeUpgrade_ShapeDivideArea,
        ShapeUpgrade_ShapeDivideClosed,
    )

    same = (shape, [(face, i) for i, face in enumerate(faces)])
    if name == "ap214":
        return *same, {}
    if name == "ap242":
        return *same, {"schema": "AP242DIS"}
    if name == "inch":
        return *same, {"unit": "INCH"}
    if name == "meter":
        return *same, {"unit": "M"}
    if name == "halves":
        tool = ShapeUpgrade_ShapeDivideClosed(shape)
        tool.SetNbSplitPoints(1)
        return *divided(tool, faces), {}
    if name == "split":
        tool = ShapeUpgrade_ShapeDivideArea(shape)
        tool.SetSplittingByNumber(True)
        tool.NbParts = 2
        tool.SetNumbersUVSplits(2, 1)
        return *divided(tool, faces), {}
    if name == "quarters":
        return *divided(ShapeUpgrade_ShapeDivideAngle(np.pi / 2, shape), faces), {}
    if name == "revolution":
        return *in_order(ShapeCustom.ConvertToRevolution_s(shape), faces), {}
    if name == "nurbs":
        return *in_order(BRepBuilderAPI_NurbsConvert(shape, True).Shape(), faces), {}
    raise ValueError(name)


def statements(data):
    """Returns the instances of a DATA section. A `;` inside quotes does not end an instance."""
    pieces = re.findall(r"(?:[^';]|'[^']*')*;", data)
    return [piece.strip() for piece in pieces]


def outside_quotes(pattern, replace, text):
    """Replaces a pattern in the text, except inside quotes."""
    parts = re.split(r"('[^']*')", text)
    return "".join(part if part.startswith("'") else re.sub(pattern, replace, part) for part in parts)


def shuffled(text, rng):
    """Returns the file with its instances in another order under other numbers, and {new number: old number}."""
    text = outside_quotes(r"(?s)/\*.*?\*/", "", text)
    head, data, tail = re.match(r"(?s)(.*?DATA\s*;)(.*?)(ENDSEC\s*;\s*END-ISO.*)", text).groups()
    instances = statements(data)
    old = [int(re.match(r"#(\d+)", instance).group(1)) for instance in instances]
    numbers = rng.sample(range(1, 10 * len(old) + 10), len(old))
    new = dict(zip(old, numbers))

    def shuffled_list(match):
        faces = [face.strip() for face in match.group(2).split(",")]
        rng.shuffle(faces)
        return match.group(1) + ",".join(faces) + match.group(3)

    for i, instance in enumerate(instances):
        if re.match(r"#\d+\s*=\s*(CLOSED|OPEN)_SHELL", instance):
            instance = re.sub(r"(?s)(,\s*\()(.*?)(\)\s*\)\s*;)", shuffled_list, instance)
        instances[i] = outside_quotes(r"#(\d+)", lambda m: f"#{new.get(int(m.group(1)), 0)}", instance)
    rng.shuffle(instances)
    return head + "\n" + "\n".join(instances) + "\n" + tail, {new[number]: number for number in old}


def author(path, number, out, seed, report):
    """Writes every variant of one file. It runs in its own process, which may crash."""
    # OpenCASCADE prints messages on stdout, which has the table.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    failed = {}
    text = Path(path).read_bytes().decode("latin-1")
    (out / "original" / f"{number}.step").write_text(text, encoding="latin-1")
    try:
        rewritten, origin = shuffled(text, random.Random(f"{seed} {number}"))
        (out / "shuffled" / f"{number}.step").write_text(rewritten, encoding="latin-1")
    except Exception as error:  # noqa: BLE001 - the table counts every failure
        failed["shuffled"], origin = str(error), {}
    shape = read_step(path)
    faces = faces_of(shape)
    areas = [area_of(face) for face in faces]
    for name in VARIANTS:
        if name == "shuffled":
            continue
        try:
            variant, named, settings = make_variant(name, shape, faces)
            write_step(variant, named, out / name / f"{number}.step", **settings)
        except Exception as error:  # noqa: BLE001
            failed[name] = str(error)
    report.send({"areas": areas, "failed": failed, "origin": origin})


def author_with_timeout(path, number, out, seed, timeout):
    """Writes every variant of one file in a process. Returns its report, or `None` if it crashes or takes too long."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=author, args=(path, number, out, seed, sender))
    process.start()
    sender.close()
    answer = None
    if receiver.poll(timeout):
        try:
            answer = receiver.recv()
        except EOFError:
            pass
    process.kill()
    process.join()
    return answer


# ---------------------------------------------------------------------------------------------------- comparison


def partition(carrier, types):
    """Returns the part of each face, if the faces have these types."""
    n = len(types)
    pairs, phi = carrier["edge_faces"], carrier["edge_phi"]
    joins = (types[pairs[:, 0]] == types[pairs[:, 1]]) & (phi <= THETA) if len(pairs) else np.zeros(0, bool)
    a, b = pairs[joins].T if joins.any() else (np.zeros(0, int), np.zeros(0, int))
    return connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)[1]


TYPE_RULES = {
    "file's types": lambda carrier: carrier["face_type"],
    "canonical": lambda carrier: carrier["face_canonical_type"],
    "canonical, free-form as one": lambda carrier: np.minimum(carrier["face_canonical_type"], FREE_FORM),
}


def verdict(before, after):
    """Compares two labelings of the same faces. Returns `kept`, `finer`, `coarser` or `other`."""
    pairs = len(set(zip(before.tolist(), after.tolist())))
    n_before, n_after = len(set(before.tolist())), len(set(after.tolist()))
    if pairs == n_before == n_after:
        return "kept"
    if pairs == n_after:
        return "finer"
    return "coarser" if pairs == n_before else "other"


def origins(carrier, name, authored, original):
    """Returns, for each face of a variant, the index of the original's face."""
    if name == "shuffled":
        index = {int(step): i for i, step in enumerate(original["face_step_id"])}
        return np.array([index[int(authored["origin"][str(int(step))])] for step in carrier["face_step_id"]])
    return np.array([int(text[1:]) for text in carrier["face_name"]])


def compare(original, carrier, name, authored):
    """Returns the verdict for each rule of types, or `faces lost` if a face is missing."""
    try:
        origin = origins(carrier, name, authored, original)
    except (KeyError, ValueError):
        return {rule: "faces lost" for rule in TYPE_RULES}
    if set(origin.tolist()) != set(range(len(original["face_type"]))):
        return {rule: "faces lost" for rule in TYPE_RULES}
    row = {}
    for rule, types in TYPE_RULES.items():
        row[rule] = verdict(partition(original, types(original))[origin], partition(carrier, types(carrier)))
    return row


def is_mapped(original, areas):
    """Returns whether the faces of OpenCASCADE are those of partprobe in the same order.

    Their number must be the same, and at least 95 % of them must have the same area within 2 %.
    """
    ours = original["face_area"]
    if len(ours) != len(areas):
        return False
    return np.mean(np.isclose(ours, areas, rtol=0.02, atol=1e-6 * max(areas, default=1.0))) >= 0.95


# ---------------------------------------------------------------------------------------------------- the study


def chosen_files(paths, n, seed, max_kb):
    """Returns up to `n` STEP files that are not larger than `max_kb`, in an order that depends on the seed and their names."""
    files = []
    for path in map(Path, paths):
        found = sorted(path.rglob("*")) if path.is_dir() else [path]
        files += [f for f in found if f.suffix.lower() in (".step", ".stp", ".p21") and f.stat().st_size <= max_kb << 10]
    files.sort(key=lambda f: hashlib.sha256(f"{seed} {f.name}".encode()).hexdigest())
    return files[:n]


def table(rows, unmapped, n_files):
    """Returns the summary and the table as Markdown."""
    lines = [
        f"{n_files} files; {unmapped} were left out: OpenCASCADE cannot read them, or does not see the same faces.",
        "",
        "| variant | models | " + " | ".join(f"kept, {rule}" for rule in TYPE_RULES) + " | finer / coarser / other, "
        + " | ".join(list(TYPE_RULES)[:1]) + " | faces lost | not written |",
        "|---|---:|" + "---:|" * (len(TYPE_RULES) + 3),
    ]
    for name, meaning in VARIANTS.items():
        mine = [row for row in rows if row["variant"] == name]
        done = [row for row in mine if row["status"] == "labeled"]
        first = next(iter(TYPE_RULES))
        count = lambda rule, what: sum(row[rule] == what for row in done)  # noqa: E731
        share = lambda rule: f"{100 * count(rule, 'kept') / max(len(done), 1):.1f} %"  # noqa: E731
        changes = " / ".join(str(count(first, what)) for what in ("finer", "coarser", "other"))
        cells = [meaning, str(len(done)), *map(share, TYPE_RULES), changes, str(count(first, "faces lost"))]
        lines.append("| " + " | ".join(cells + [str(len(mine) - len(done))]) + " |")
    return "\n".join(lines)


def write_variants(args, variants, record):
    """Writes the variants of all chosen files, and the record of where their faces came from."""
    for name in ["original", *VARIANTS]:
        (variants / name).mkdir(parents=True, exist_ok=True)
    files = chosen_files(args.paths, args.n, args.seed, args.max_kb)
    # Loading OpenCASCADE takes longer than most files. Processes that are forked afterward inherit it.
    from OCP import BRepBuilderAPI, BRepGProp, ShapeCustom, ShapeUpgrade, STEPConstruct, STEPControl  # noqa: F401

    authored = {}
    for i, path in enumerate(files):
        number = f"{i:04}"
        authored[number] = author_with_timeout(str(path), number, variants, args.seed, args.timeout)
        print(f"\r{i + 1}/{len(files)} files written again", end="", file=sys.stderr)
    print(file=sys.stderr)
    record.write_text(json.dumps([[path.name for path in files], authored]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*")
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--n", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--max-kb", type=int, default=400)
    parser.add_argument("--timeout", type=float, default=60.0)
    parser.add_argument("--partprobe", default="partprobe")
    parser.add_argument("--again", action="store_true")
    args = parser.parse_args()
    if shutil.which(args.partprobe) is None:
        sys.exit(f"{args.partprobe} is not a program; give the path of partprobe with --partprobe")
    variants, record = args.out / "variants", args.out / "written.json"
    if args.again:
        shutil.rmtree(args.out / "labeled", ignore_errors=True)
    elif not args.paths:
        parser.error("give STEP files or folders, or --again")
    elif args.out.exists() and any(args.out.iterdir()):
        sys.exit(f"{args.out} is not empty; choose another --out")
    else:
        write_variants(args, variants, record)
    names, authored = json.loads(record.read_text())

    labeled = args.out / "labeled"
    command = [args.partprobe, "label", str(variants), "--out", str(labeled), "--set", "label.tau_min=0"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    entries = [json.loads(line) for line in (labeled / "index.jsonl").read_text().splitlines()]
    carriers = {e["id"].removeprefix("variants__"): e["file"] for e in entries if e["file"]}

    rows, unmapped = [], 0
    for number, answer in authored.items():
        file = carriers.get(f"original__{number}")
        original = np.load(labeled / file) if file else None
        if answer is None or original is None or not is_mapped(original, answer["areas"]):
            unmapped += 1
            continue
        for name in VARIANTS:
            row = {"file": names[int(number)], "variant": name}
            variant = carriers.get(f"{name}__{number}")
            if name in answer["failed"]:
                row |= {"status": "not written", "reason": answer["failed"][name]}
            elif variant is None:
                row |= {"status": "not labeled"}
            else:
                row |= {"status": "labeled", **compare(original, np.load(labeled / variant), name, answer)}
            rows.append(row)
    (args.out / "rows.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    print(table(rows, unmapped, len(names)))


if __name__ == "__main__":
    main()
