"""Writes result files as PartField's scripts do, with labels that say nothing: stand_in.py EXPORT RESULTS

EXPORT is a folder of `partprobe export partfield-input`. The labels of a level are slabs along the x axis. The blocks of the
documentation need such files; `prove.py` makes real ones with a checkout of PartField.
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
