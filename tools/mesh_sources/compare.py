"""Compares `sdf` and `ransac` with libigl and CGAL on shapes: compare.py PROGRAM [STEP...]

PROGRAM is the example `mesh_sources` of crates/sources. Without files it generates 20 parts. The table goes to stdout.

- Thickness: libigl's `shape_diameter_function` with 64 rays at the centroid of each triangle of the refined mesh. It takes the plain
  mean over a half space, while ours is a robust mean over a cone of 120 degrees, so that values differ by design. The rank
  correlation says whether both find the same places thick.
- Primitives: CGAL's `efficient_RANSAC` (planes, spheres, cylinders, cones) on the same 20 000 points and normals, with the same
  tolerances and the same smallest primitive as ours. ARI compares the labels of the points to which CGAL gives a primitive.
"""

import json
import subprocess
import sys

import igl
import numpy
from CGAL.CGAL_Kernel import Point_3, Vector_3
from CGAL.CGAL_Point_set_3 import Point_set_3
from CGAL.CGAL_Shape_detection import efficient_RANSAC

MIN_PERMILLE = 10
# The constants of crates/sources/src/ransac.rs.
MAX_DISTANCE = 0.002
MIN_COSINE = numpy.cos(numpy.radians(10.0))
# CGAL joins points into one piece over this distance, in fractions of the diagonal: its own default.
CLUSTER_DISTANCE = 0.01
N_RAYS = 64


def ranks(values):
    """The rank of each value; equal values have the mean of their ranks."""
    order = numpy.argsort(values, kind="stable")
    found = numpy.empty(len(values))
    found[order] = numpy.arange(len(values))
    _, inverse, counts = numpy.unique(values, return_inverse=True, return_counts=True)
    return (numpy.bincount(inverse, found) / counts)[inverse]


def rank_correlation(a, b):
    """Spearman's rank correlation; not a number if one side is constant."""
    with numpy.errstate(invalid="ignore", divide="ignore"):
        return numpy.corrcoef(ranks(a), ranks(b))[0, 1]


def adjusted_rand_index(a, b):
    """Hubert and Arabie's index of two labelings of the same points."""
    pairs = lambda counts: (counts * (counts - 1.0) / 2.0).sum()
    _, a = numpy.unique(a, return_inverse=True)
    _, b = numpy.unique(b, return_inverse=True)
    table = numpy.bincount(a * (b.max() + 1) + b, minlength=(a.max() + 1) * (b.max() + 1))
    both, of_a, of_b = pairs(table), pairs(numpy.bincount(a)), pairs(numpy.bincount(b))
    expected = of_a * of_b / (len(a) * (len(a) - 1.0) / 2.0)
    largest = 0.5 * (of_a + of_b)
    return 1.0 if largest == expected else (both - expected) / (largest - expected)


def diameters(vertices, triangles):
    """libigl's shape diameter at the centroid of each triangle; it shoots against the normal."""
    corners = vertices[triangles]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = numpy.linalg.norm(normals, axis=1, keepdims=True)
    normals = numpy.divide(normals, lengths, out=numpy.zeros_like(normals), where=lengths > 0)
    centroids = corners.mean(axis=1)
    return igl.shape_diameter_function(vertices, triangles, centroids, normals, N_RAYS)


def primitives(points, normals, diagonal):
    """CGAL's primitive of each point; -1 where it has found none."""
    cloud = Point_set_3()
    cloud.add_normal_map()
    for point, normal in zip(points.tolist(), normals.tolist()):
        cloud.insert(Point_3(*point), Vector_3(*normal))
    shape_map = cloud.add_int_map("shape")
    min_points = len(points) * MIN_PERMILLE // 1000
    efficient_RANSAC(
        cloud, shape_map, min_points, MAX_DISTANCE * diagonal, CLUSTER_DISTANCE * diagonal,
        MIN_COSINE, 0.05, True, True, True, True, False,
    )
    return numpy.array([shape_map.get(index) for index in cloud.indices()])


def compare(shape):
    """The row of one shape."""
    vertices, triangles = numpy.array(shape["vertices"]), numpy.array(shape["triangles"])
    ours = numpy.array([numpy.nan if value is None else value for value in shape["diameters"]])
    theirs = diameters(vertices, triangles)
    both = numpy.isfinite(ours) & numpy.isfinite(theirs) & (theirs > 0)
    ours, theirs = ours[both], theirs[both]

    points, normals = numpy.array(shape["points"]), numpy.array(shape["normals"])
    labels = numpy.array(shape["labels"])
    diagonal = numpy.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0))
    found = primitives(points, normals, diagonal)
    has_one = found >= 0
    return {
        "name": shape["name"],
        "triangles": len(triangles),
        "rank": rank_correlation(ours, theirs),
        "apart": numpy.median(numpy.abs(ours - theirs) / theirs),
        "ours": len(numpy.unique(labels)),
        "theirs": len(numpy.unique(found[has_one])),
        "covered": has_one.mean(),
        "ari": adjusted_rand_index(labels[has_one], found[has_one]),
    }


def main():
    program, *files = sys.argv[1:]
    command = [program, f"ransac-{MIN_PERMILLE}", *files]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    rows = [compare(json.loads(line)) for line in lines]
    print("| shape | triangles | rank correlation | median difference | labels, ours | labels, CGAL | points with a primitive of CGAL | ARI there |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    for row in rows:
        print(
            f"| {row['name']} | {row['triangles']} | {row['rank']:.3f} | {row['apart']:.3f} | {row['ours']} "
            f"| {row['theirs']} | {row['covered']:.3f} | {row['ari']:.3f} |"
        )
    median = lambda key: numpy.nanmedian([row[key] for row in rows])
    print(
        f"| **median** | {median('triangles'):.0f} | **{median('rank'):.3f}** | **{median('apart'):.3f}** "
        f"| {median('ours'):.0f} | {median('theirs'):.0f} | {median('covered'):.3f} | **{median('ari'):.3f}** |"
    )


if __name__ == "__main__":
    main()
