"""Proves that partprobe joins the results of PartField's clustering exactly: prove.py PARTFIELD PROGRAM DATASET OUT [--max-edge FRACTION]

Input: PARTFIELD, a checkout of nv-tlabs/PartField; PROGRAM, which is `partprobe`; DATASET, a labeled data set; and OUT, a folder for the
results. What already exists in OUT is not made again.
Output: a Markdown table on stdout.
Exit status: 1 if a join or a point is wrong.
Needs numpy, scipy, scikit-learn, trimesh, networkx, plyfile, matplotlib below 3.9, and open3d, which PartField's script imports.

The script exports the shapes with `partprobe export partfield-input`. It does not run PartField's network. Instead, it computes features
from the positions and normals of the triangles, and writes them in the format of PartField's inference script. PartField's own
`run_part_clustering.py` then clusters them with each of its methods. The results are checked in two ways:

- `partprobe check labels` must join every shape by index, at every level.
- `partprobe sample` gives labels to sampled points. The script itself finds the triangle of the exported mesh on which a point lies, with
  the parents in the export, and compares the labels. If a triangle with another label is closer than 1e-5 of the diagonal, the point is
  on a boundary, and is counted separately.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys

import numpy
import trimesh

N_FEATURES = 448
MAX_CLUSTERS = 20
N_POINTS = 1000
# Two triangles are equally near to a point on their boundary. Positions are stored in single precision, so this needs a tolerance.
BOUNDARY = 1e-5

# The clustering methods: the name, the options of run_part_clustering.py, and the levels that it writes.
WAYS = (
    ("agglomerative", ["--use_agglo", "True", "--option", "0"], range(1, MAX_CLUSTERS + 1)),
    ("agglomerative-knn", ["--use_agglo", "True", "--option", "1", "--with_knn", "True"], range(1, MAX_CLUSTERS + 1)),
    ("k-means", [], range(2, MAX_CLUSTERS)),
)


def run(*command, **options):
    """Runs a command and returns its standard output. Ends the script with the output if the command fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{command}: exit status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def load(path):
    """Reads a mesh as PartField's `load_mesh_util` does."""
    return trimesh.load(path, force="mesh", process=False)


def write_features(export, features, projection):
    """Writes the files that PartField's inference writes for one mesh: the normalized mesh, and one row of features per triangle."""
    mesh = load(export)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    mesh.vertices = (mesh.vertices - 0.5 * (low + high)) * (2.0 * 0.9 / (high - low).max())
    mesh.export(features / f"input_{export.stem}_0.ply")
    inputs = numpy.hstack([2.0 * mesh.triangles_center, mesh.face_normals, numpy.ones((len(mesh.faces), 1))])
    rows = numpy.tanh(inputs @ projection).astype(numpy.float32)
    numpy.save(features / f"part_feat_{export.stem}_0_batch.npy", rows)


def cluster(partfield, meshes, features, options):
    """Runs PartField's script on all meshes. Its output folder gets its final name only after the script has ended."""
    dump = features / "unfinished"
    shutil.rmtree(dump, ignore_errors=True)
    # PartField reads an empty text as `False`, so it writes no colored meshes, which would take minutes. It lists their folder in any case.
    (dump / "ply").mkdir(parents=True)
    script = partfield / "run_part_clustering.py"
    common = ["--root", features, "--dump_dir", dump, "--source_dir", meshes, "--max_num_clusters", MAX_CLUSTERS]
    run(sys.executable, script, *common, *options, "--export_mesh", "", env={**os.environ, "MPLBACKEND": "Agg"})
    dump.rename(features / "clustering")


def squared_distances(point, corners):
    """Returns the squared distance from a point to each of many triangles."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    best = numpy.full(len(corners), numpy.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length = numpy.maximum((side * side).sum(1), 1e-300)
        along = numpy.clip(((point - start) * side).sum(1) / length, 0.0, 1.0)
        best = numpy.minimum(best, ((point - start - along[:, None] * side) ** 2).sum(1))
    normal = numpy.cross(b - a, c - a)
    doubled = (normal * normal).sum(1)
    inside = doubled > 0.0
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (numpy.cross(end - start, point - start) * normal).sum(1) >= 0.0
    height = ((point - a) * normal).sum(1) ** 2 / numpy.maximum(doubled, 1e-300)
    return numpy.where(inside, numpy.minimum(best, height), best)


class Shape:
    """One exported shape: its triangles, and for each of them its parent, which is a triangle of the carrier."""

    def __init__(self, root, name, entry):
        self.name, self.id = name, entry["id"]
        mesh = load(root / entry["mesh"])
        self.corners = numpy.asarray(mesh.vertices)[mesh.faces]
        self.parents = numpy.load(root / entry["parents"])
        self.diagonal = numpy.linalg.norm(mesh.vertices.max(0) - mesh.vertices.min(0))
        order = numpy.argsort(self.parents, kind="stable")
        self.tiles_of = dict(zip(*self._groups(order)))

    def _groups(self, order):
        """Returns the parents, and for each parent the indices of its triangles."""
        parents, starts = numpy.unique(self.parents[order], return_index=True)
        return parents, numpy.split(order, starts[1:])

    def near(self, points, triangles):
        """Returns, for each point, the nearest exported triangle, and all of them within the width of a boundary."""
        found = []
        for point, triangle in zip(points.astype(float), triangles):
            tiles = self.tiles_of[triangle]
            distances = numpy.sqrt(squared_distances(point, self.corners[tiles]))
            found.append((tiles[distances.argmin()], tiles[distances <= BOUNDARY * self.diagonal]))
        return found


def compared(near, labels, theirs):
    """Returns the number of points whose labels are equal, that are on a boundary, and whose labels differ."""
    equal, boundary, different = 0, 0, 0
    for (tile, around), label in zip(near, theirs):
        if labels[tile] == label:
            equal += 1
        elif label in labels[around]:
            boundary += 1
        else:
            different += 1
    return numpy.array([equal, boundary, different])


def check_level(args, settings, level, shapes, near, clusters):
    """Joins one level of all shapes. Returns the number of shapes that are joined by index, and the counts of the points."""
    labels = run(
        args.program, "check", "labels", settings["path"], "--data", args.dataset, "--type", "partfield",
        "--set", f"map={settings['map']}", "--set", f"k={level}", "--json",
    )
    joins = {shape["id"]: shape.get("join", {}).get("by", shape) for shape in json.loads(labels)[0]["shapes"]}
    by_index = sum(joins[shape.id] == f"index, level {level}" for shape in shapes)
    points = args.out / "points" / f"{pathlib.Path(settings['path']).name}-{level:02}"
    sets = [f"sources.pf.{key}={value}" for key, value in {**settings, "type": "partfield", "k": level}.items()]
    run(
        args.program, "sample", args.dataset, "--out", points, "--format", "npz", "--n-points", N_POINTS, "--source", "pf",
        *[word for assignment in sets for word in ("--set", assignment)],
    )
    counts = numpy.zeros(3, int)
    for shape in shapes:
        sample = numpy.load(points / f"{shape.id}.npz")
        if shape.id not in near:
            near[shape.id] = shape.near(sample["points"], sample["triangles"])
        of_triangle = numpy.load(clusters / f"{shape.name}_0_{level:02}.npy").reshape(-1).astype(int)
        counts += compared(near[shape.id], of_triangle, sample["label_pf"])
    return by_index, counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("partfield", "program", "dataset", "out"):
        parser.add_argument(name, type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--max-edge", default="0.02", help="longest edge of the exported meshes; k-means is slow if it is small")
    args = parser.parse_args()

    export, results = args.out / "export", args.out / "results"
    args.out.mkdir(exist_ok=True)
    if not (export / "map.json").exists():
        print(run(args.program, "export", "partfield-input", args.dataset, "--out", export, "--max-edge", args.max_edge).strip())
    entries = json.loads((export / "map.json").read_text())["shapes"]
    shapes = [Shape(export, name, entry) for name, entry in entries.items()]
    n_triangles = sum(entry["n_triangles"] for entry in entries.values())
    projection = numpy.random.default_rng(0).normal(size=(7, N_FEATURES)) * 0.7

    print("| way | shapes | levels | triangles | joined by index | points equal | on a boundary | different |")
    print("|---|---|---|---|---|---|---|---|")
    near, n_wrong = {}, 0
    for way, options, levels in WAYS:
        folder = results / way
        if not (folder / "clustering").exists():
            folder.mkdir(parents=True, exist_ok=True)
            for entry in entries.values():
                write_features(export / entry["mesh"], folder, projection)
            cluster(args.partfield, export / "meshes", folder, options)
        settings = {"path": str(folder), "map": str(export)}
        n_joined, counts = 0, numpy.zeros(3, int)
        for level in levels:
            joined, compared_points = check_level(
                args, settings, level, shapes, near, folder / "clustering" / "cluster_out"
            )
            n_joined += joined
            counts += compared_points
        n_expected = len(shapes) * len(levels)
        n_wrong += n_expected - n_joined + counts[2]
        print(
            f"| {way} | {len(shapes)} | {levels[0]}–{levels[-1]} | {n_triangles} | {n_joined} of {n_expected} | "
            f"{counts[0]} | {counts[1]} | {counts[2]} |",
            flush=True,
        )
    if n_wrong:
        sys.exit(f"{n_wrong} joins or points are wrong")


if __name__ == "__main__":
    main()
