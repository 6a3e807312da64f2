"""Compares the CPU seconds of partprobe and of OpenCASCADE on the same STEP files.

    pip install cadquery-ocp
    python tools/occt/bench_occt.py --partprobe target/release/partprobe -n 60 DIR...        or: just bench-occt [-n FILES] DIR...

Input: folders of STEP files. Each folder is a group. The script takes a sample of its files by a fixed seed.
Output: a Markdown table on stdout. The ratios are the seconds of OpenCASCADE divided by those of partprobe.

Both programs read the same files in turns, and mesh them with a chord of 0.002 of the diagonal of the bounding box and an angle of 0.3
rad. A file is left out for both if OpenCASCADE crashes, hangs, or finds no face in it.

- partprobe: the user and system time of the whole process and its worker, `partprobe label --jobs 1`. It reads, partitions and
  tessellates the files, and writes carriers.
- OpenCASCADE: the time inside one Python process, from opening a file to the end. Starting Python and importing the bindings is not
  counted, and nothing is written.

OpenCASCADE is measured in four modes:

    healed+mesh      the default import and the mesh, without labels
    pcurves+mesh     an import with only the repairs that the mesher needs (curves in the parameter plane, seams), and the mesh; without
                     these repairs most faces that are not planes get no triangle
    unhealed+labels  an import without healing and without a mesh; then primitive types, dihedral angles and parts, by a loop in Python
    unhealed         only the import, without healing

In these columns, partprobe runs with `label.volume_loss=0`: like the mesher of OpenCASCADE, it then considers only the chord and the
angle. By default, partprobe also refines the mesh of a solid whose volume would change too much. The column `volumes kept` compares
`healed+mesh` with this default. The last column compares `unhealed+labels` with partprobe without a mesh, `partprobe label --emit labels
--set label.tau_min=0`.
"""

import argparse
import json
import math
import queue
import random
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

CHORD, ANGLE = 0.002, 0.3
MODES = ["healed+mesh", "pcurves+mesh", "unhealed+labels", "unhealed"]
# The mode that does the same work as partprobe with WITHOUT_MESH.
LABELS_ALONE = "unhealed+labels"
# τ_min is off, because it counts triangles and so needs a mesh. The loop in Python does not apply it either.
WITHOUT_MESH = ["--emit", "labels", "--set", "label.tau_min=0"]
# The tolerances that both meshers have.
CHORD_AND_ANGLE = ["--set", "label.volume_loss=0"]
THETA_DEG = 8.0
# The repairs without which BRepMesh_IncrementalMesh does not find the boundaries of the faces.
MESHABLE = "FreeFace FreeShell Solid Shell Face Wire EdgeCurves AddPCurve Seam MissingSeam Lacking Degenerated".split()
# The number of files that one program reads before the other program reads them.
TURN = 100
SUFFIXES = {".step", ".stp", ".p21"}


def switch_healing_off(reader, kept):
    """Sets all modes of ShapeFix to 0 except the kept ones.

    The Python bindings cannot pass the flags themselves, so this function sets the parameters.
    """
    from OCP.collections import DataMap_TCollection_AsciiString_TCollection_AsciiString as Parameters
    from OCP.TCollection import TCollection_AsciiString as Text

    modes = """AddCurve3d AddNaturalBound AddPCurve AutoCorrectPrecision ClosedWire Connected CreateOpenSolid
        Degenerated EdgeCurves EdgeSameParameter Face FaceOrientation FreeFace FreeShell FreeWire IntersectingEdges
        IntersectingWires Lacking LoopWires MissingSeam ModifyGeometry ModifyTopology NonAdjacentIntersectingEdges
        NotchedEdges Orientation PreferencePCurve RemoveCurve3d RemoveLoop RemovePCurve RemoveSmallAreaFace
        ReorderEdges Reversed2d SameParameter Seam SelfIntersectingEdge SelfIntersection Shell ShellOrientation
        Shifted SmallAreaWire SmallEdges Solid SplitFace TailMode VertexPosition VertexTolerance Wire"""
    parameters = Parameters()
    for mode in set(modes.split()).difference(kept):
        for name in (f"FixShape.Fix{mode}Mode", f"FixShape.{mode}Mode"):
            parameters.Bind(Text(name), Text("0"))
    reader.SetShapeFixParameters(parameters)


def part_of_each_face(shape):
    """Returns the part of each face. Two faces of one type join if the dihedral angle in the middle of a shared edge is small."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.ShapeAnalysis import ShapeAnalysis_Surface
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS

    faces, edges, uses = ShapeMap(), ShapeMap(), {}
    TopExp.MapShapes_s(shape, TopAbs_FACE, faces)
    surfaces = []
    for index in range(1, faces.Extent() + 1):
        face = TopoDS.Face(faces.FindKey(index))
        surfaces.append((face, BRepAdaptor_Surface(face, False)))
        explorer = TopExp_Explorer(face, TopAbs_EDGE)
        while explorer.More():
            uses.setdefault(edges.Add(explorer.Current()), {})[index - 1] = None
            explorer.Next()

    def normal(face, place):
        """Returns the outward normal of a face at a point, not scaled."""
        shape, surface = surfaces[face]
        uv = ShapeAnalysis_Surface(BRep_Tool.Surface_s(shape)).ValueOfUV(place, 1e-6)
        du, dv = gp_Vec(), gp_Vec()
        surface.D1(uv.X(), uv.Y(), gp_Pnt(), du, dv)
        across = du.Crossed(dv)
        return across.Reversed() if shape.Orientation() == TopAbs_REVERSED else across

    parent = list(range(len(surfaces)))

    def root(face):
        """Returns the face that represents the part of a face so far."""
        while parent[face] != face:
            face = parent[face] = parent[parent[face]]
        return face

    for index, users in uses.items():
        pair = sorted(users)
        edge = TopoDS.Edge(edges.FindKey(index))
        if len(pair) != 2 or surfaces[pair[0]][1].GetType() != surfaces[pair[1]][1].GetType():
            continue
        if BRep_Tool.Degenerated_s(edge):
            continue
        curve = BRepAdaptor_Curve(edge)
        place = curve.Value(0.5 * (curve.FirstParameter() + curve.LastParameter()))
        a, b = (normal(face, place) for face in pair)
        if a.Magnitude() > 0 and b.Magnitude() > 0 and math.degrees(a.Angle(b)) <= THETA_DEG + 1e-6:
            parent[root(pair[0])] = root(pair[1])
    return [root(face) for face in range(len(surfaces))]


def seconds_of(path, mode):
    """Returns the CPU seconds of OpenCASCADE for one file, or `None` if it reads no face."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer

    started = time.process_time()
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        return None
    if not mode.startswith("healed"):
        switch_healing_off(reader, MESHABLE if mode.startswith("pcurves") else [])
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape.IsNull() or not TopExp_Explorer(shape, TopAbs_FACE).More():
        return None
    if mode.endswith("+labels"):
        part_of_each_face(shape)
    if mode.endswith("+mesh"):
        box = Bnd_Box()
        BRepBndLib.Add_s(shape, box, False)
        diagonal = box.CornerMin().Distance(box.CornerMax())
        BRepMesh_IncrementalMesh(shape, CHORD * diagonal, False, ANGLE, False)
    return time.process_time() - started


def serve():
    """Runs in the child process: reads one request per line from stdin, and writes one answer per line to stdout."""
    out = open(1, "w", closefd=False)
    import OCP.STEPControl  # noqa: F401  (imported before the first file, so that it is not part of its time)
    from OCP.Message import Message, Message_PrinterOStream

    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    for line in sys.stdin:
        path, mode = json.loads(line)
        out.write("@" + json.dumps(seconds_of(path, mode)) + "\n")
        out.flush()


class OpenCascade:
    """A child process that reads files with OpenCASCADE. If a file ends the process, the next file starts a new one."""

    def __init__(self, timeout):
        self.timeout, self.child, self.answers = timeout, None, None

    def start(self):
        command = [sys.executable, __file__, "--serve"]
        self.child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.answers = queue.Queue()
        threading.Thread(target=self.listen, args=(self.child, self.answers), daemon=True).start()

    @staticmethod
    def listen(child, answers):
        """Runs in a thread: moves the answers of the child to a queue."""
        for line in child.stdout:
            if line.startswith("@"):
                answers.put(json.loads(line[1:]))
        answers.put("ended")

    def seconds(self, path, mode):
        """Returns the CPU seconds for a file; `None` if the file has no face, or if OpenCASCADE hangs or crashes."""
        if self.child is None:
            self.start()
        self.child.stdin.write(json.dumps([str(path), mode]) + "\n")
        self.child.stdin.flush()
        try:
            answer = self.answers.get(timeout=self.timeout)
        except queue.Empty:
            answer = "ended"
        if answer == "ended":
            self.stop()
            return None
        return answer

    def stop(self):
        if self.child is not None:
            self.child.kill()
            self.child.wait()
            self.child = None


def children_seconds():
    """Returns the CPU seconds of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def label(program, files, *arguments):
    """Returns the CPU seconds of one run of partprobe. Raises an error if a file cannot be labeled."""
    with tempfile.TemporaryDirectory() as folder:
        names = Path(folder, "files.txt")
        names.write_text("".join(f"{file}\n" for file in files))
        tolerances = ["--set", f"label.chord_fraction={CHORD}", "--set", f"label.angle_rad={ANGLE}"]
        command = [program, "label", names, "--out", Path(folder, "out"), "--jobs", "1", *arguments, *tolerances]
        before = children_seconds()
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        return children_seconds() - before


def step_files(folder):
    """Returns the STEP files below a folder, sorted by path."""
    return sorted(path for path in Path(folder).rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())


def measure(options, folder):
    """Returns a row of the table: the number and size of the files, and the seconds of partprobe and of each mode of OpenCASCADE."""
    files = step_files(folder)
    if options.n:
        files = sorted(random.Random(options.seed).sample(files, min(options.n, len(files))))
    occt = OpenCascade(options.timeout)
    kept, ours, ours_by_default, ours_without_mesh, theirs = [], 0.0, 0.0, 0.0, [0.0] * len(MODES)
    # The programs run in turns, so that other work of the machine slows both of them equally.
    for first in range(0, len(files), TURN):
        answers = {}
        for file in files[first : first + TURN]:
            answer = [occt.seconds(file, mode) for mode in MODES]
            if None not in answer:
                answers[file] = answer
        if answers:
            ours += label(options.partprobe, answers, *CHORD_AND_ANGLE)
            ours_by_default += label(options.partprobe, answers)
            ours_without_mesh += label(options.partprobe, answers, *WITHOUT_MESH)
            kept += answers
            theirs = [sum(column) for column in zip(theirs, *answers.values())]
    occt.stop()
    return {
        "group": Path(folder).name,
        "files": len(kept),
        "left_out": len(files) - len(kept),
        "megabytes": sum(file.stat().st_size for file in kept) / 1e6,
        "partprobe_s": ours,
        "partprobe_default_s": ours_by_default,
        "partprobe_labels_s": ours_without_mesh,
        **{f"{mode}_s": seconds for mode, seconds in zip(MODES, theirs)},
    }


def table(rows):
    """Returns the rows as a Markdown table."""
    lines = [
        "| group | files | MB | partprobe, CPU s | files per CPU s | " + " | ".join(MODES) + " | volumes kept | labels against labels |",
        "|---|---:|---:|---:|---:|" + "---:|" * (len(MODES) + 2),
    ]
    for row in rows:
        ours = row["partprobe_s"]
        ratios = " | ".join(f"{row[f'{mode}_s'] / ours:.1f}×" for mode in MODES)
        lines.append(
            f"| {row['group']} | {row['files']} | {row['megabytes']:.1f} | {ours:.2f} | {row['files'] / ours:.0f} | {ratios} "
            f"| {row['healed+mesh_s'] / row['partprobe_default_s']:.1f}× "
            f"| {row[f'{LABELS_ALONE}_s'] / row['partprobe_labels_s']:.1f}× |"
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", help="folders of STEP files; each is a group")
    parser.add_argument("--partprobe", default="target/release/partprobe", help="path of the program")
    parser.add_argument("-n", type=int, default=60, help="number of files of each group; 0 takes all")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample")
    parser.add_argument("--timeout", type=float, default=120, help="seconds that OpenCASCADE may take for a file")
    parser.add_argument("--json", help="also write the seconds to this file")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        return serve()
    if not options.folders:
        parser.error("name at least one folder of STEP files")
    rows = []
    for folder in options.folders:
        rows.append(measure(options, folder))
        print(table(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
    print(table(rows))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
