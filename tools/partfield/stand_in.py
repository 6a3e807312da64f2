"""Writes result files in the format of PartField's scripts, with arbitrary labels.

    stand_in.py EXPORT RESULTS

Input: EXPORT, a folder that `partprobe export partfield-input` wrote.
Output: RESULTS, a folder of result files. The labels of a level are slabs along the x axis.
Needs numpy and trimesh.

The code blocks of the documentation need such files. `prove.py` makes real results with a checkout of PartField.
"""

import pathlib
import sys

import numpy
import trimesh

export, results = (pathlib.Path(argument) for argument in sys.argv[1:])
clusters = results / "clustering" / "cluster_out"
clusters.mkdir(parents=True)
for path in sorted((export / "meshes").glob("*.obj")):
    mesh = trimesh.load(path, force="mesh", process=False)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    mesh.vertices = (mesh.vertices - 0.5 * (low + high)) * (1.8 / (high - low).max())
    mesh.export(results / f"input_{path.stem}_0.ply")
    x = mesh.triangles_center[:, 0]
    position = (x - x.min()) / max(x.max() - x.min(), 1e-12)
    for level in range(1, 21):
        labels = numpy.minimum((position * level).astype(numpy.int64), level - 1)
        numpy.save(clusters / f"{path.stem}_0_{level:02}.npy", labels)
