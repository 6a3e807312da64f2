"""Compares the label sources `sdf` and `ransac` with libigl, CGAL and Open3D.

    compare.py PROGRAM [STEP...]        or: just check-mesh-sources [STEP...]

Input: PROGRAM, the built example `mesh_sources` of crates/sources; and STEP files. Without STEP files, the example generates 20 parts.
Output: two Markdown tables on stdout, a row per shape. In their headings, "ours" means partprobe.
Needs numpy, CGAL, cgal-pybind, libigl and Open3D. Open3D needs the system's libusb-1.0 (`apt install libusb-1.0-0` on Debian).

The tables compare:

- Thickness: `sdf` with libigl's `shape_diameter_function`, with 64 rays at the centroid of each triangle of the refined mesh, and with
  CGAL's `sdf_values`. libigl takes the plain mean over a half space. CGAL takes a mean without outliers over a cone of 120 degrees, as
  `sdf` does, and then smooths it. The rank correlation is high if both find the same regions thick.
- Labels of `sdf-5`: with CGAL's `segmentation_from_sdf_values` at its default of 5 clusters, on the same triangles. The ARI weights each
  triangle by its area.
- Primitives: `ransac` with CGAL's `efficient_RANSAC` (planes, spheres, cylinders, cones), on the same 20 000 points and normals, with the
  same tolerances and the same smallest primitive. The ARI compares the labels of the points to which CGAL gives a primitive. The search
  of CGAL has no seed, so it runs several times, and the column is the median of the runs. The agreement of the runs with each other shows
  how reliable a single run is.
- Planes: `ransac` with Open3D's `segment_plane`, which finds the plane with the most points, again and again. A plane keeps the points
  whose normal agrees, and DBSCAN divides them into connected pieces. Such a piece may also be a strip of a cylinder that is near a plane.
  So a piece is left out if its normals differ. The ARI compares the labels of the points in the other pieces.
"""

import itertools
import json
import subprocess
import sys

import cgal_pybind
import igl
import numpy
import open3d
from CGAL.CGAL_Kernel import Point_3, Vector_3
from CGAL.CGAL_Point_set_3 import Point_set_3
from CGAL.CGAL_Shape_detection import efficient_RANSAC

MIN_PERMILLE = 10
# The default number of clusters of CGAL's segmentation. The Python package cannot set another number.
N_CLUSTERS = 5
# The constants of crates/sources/src/ransac.rs.
MAX_DISTANCE = 0.002
MIN_COSINE = numpy.cos(numpy.radians(10.0))
# CGAL joins points that are closer than this, in fractions of the diagonal. This is its default.
CLUSTER_DISTANCE = 0.01
N_RAYS = 64
N_RUNS = 5
# DBSCAN joins points that are closer than this. 20 000 points are about 0.01 of the diagonal apart, so neighbors are certainly joined.
PLANE_CLUSTER_DISTANCE = 0.03
PLANE_TRIALS = 1000
# A piece is flat if nearly all of its normals are this close to their mean.
MIN_FLAT_COSINE = numpy.cos(numpy.radians(1.0))
FLAT_SHARE = 0.95


def ranks(values):
    """Returns the rank of each value. Equal values get the mean of their ranks."""
    order = numpy.argsort(values, kind="stable")
    found = numpy.empty(len(values))
    found[order] = numpy.arange(len(values))
    _, inverse, counts = numpy.unique(values, return_inverse=True, return_counts=True)
    return (numpy.bincount(inverse, found) / counts)[inverse]


def rank_correlation(a, b):
    """Returns Spearman's rank correlation over the entries that are known in both; NaN if one of them is constant."""
    both = numpy.isfinite(a) & numpy.isfinite(b)
    with numpy.errstate(invalid="ignore", divide="ignore"):
        return numpy.corrcoef(ranks(a[both]), ranks(b[both]))[0, 1]


def adjusted_rand_index(a, b, weights=None):
    """Returns the index of Hubert and Arabie for two labelings of the same points, or of the same areas if there are weights."""
    if len(a) == 0:
        return numpy.nan
    _, a = numpy.unique(a, return_inverse=True)
    _, b = numpy.unique(b, return_inverse=True)
    own = numpy.ones(len(a)) if weights is None else weights / weights.sum()
    table = numpy.bincount(a * (b.max() + 1) + b, own, minlength=(a.max() + 1) * (b.max() + 1))
    alone = 1.0 if weights is None else 0.0
    pairs = lambda counts: (counts * (counts - alone) / 2.0).sum()
    both, of_a, of_b = pairs(table), pairs(numpy.bincount(a, own)), pairs(numpy.bincount(b, own))
    expected = of_a * of_b / pairs(own.sum(keepdims=True))
    largest = 0.5 * (of_a + of_b)
    return 1.0 if numpy.isclose(largest, expected, rtol=1e-12) else (both - expected) / (largest - expected)


def triangle_normals(vertices, triangles):
    """Returns the normal of each triangle, with twice the area of the triangle as its length."""
    corners = vertices[triangles]
    return numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def igl_diameters(vertices, triangles):
    """Returns libigl's shape diameter at the centroid of each triangle. libigl shoots its rays against the normal."""
    normals = triangle_normals(vertices, triangles)
    lengths = numpy.linalg.norm(normals, axis=1, keepdims=True)
    normals = numpy.divide(normals, lengths, out=numpy.zeros_like(normals), where=lengths > 0)
    centroids = vertices[triangles].mean(axis=1)
    found = igl.shape_diameter_function(vertices, triangles, centroids, normals, N_RAYS)
    return numpy.where(found > 0, found, numpy.nan)


def cgal_segments(vertices, triangles):
    """Returns CGAL's thickness and segment of each triangle, or `None` if the mesh is not a closed manifold."""
    try:
        polyhedron = cgal_pybind.Polyhedron()
        polyhedron.build(vertices, triangles.astype(numpy.uint64))
        return polyhedron.segmentation()
    except RuntimeError:
        return None


def cgal_primitives(points, normals, diagonal):
    """Returns CGAL's primitive of each point; -1 if CGAL found none for it."""
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
    # CGAL shuffles the order of `cloud.indices()`, but each point keeps its index.
    return numpy.array([shape_map.get(index) for index in range(len(points))])


def is_flat(normals):
    """Returns whether nearly all normals have the same direction."""
    mean = normals.mean(axis=0)
    length = numpy.linalg.norm(mean)
    return length > 0 and (normals @ mean / length >= MIN_FLAT_COSINE).mean() >= FLAT_SHARE


def open3d_planes(points, normals, diagonal):
    """Returns the connected piece of an Open3D plane of each point; -1 if the point is in none."""
    open3d.utility.random.seed(0)
    min_points = len(points) * MIN_PERMILLE // 1000
    found = numpy.full(len(points), -1)
    free = numpy.arange(len(points))
    n_pieces = 0
    while len(free) >= min_points:
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[free]))
        plane, inside = cloud.segment_plane(MAX_DISTANCE * diagonal, 3, PLANE_TRIALS)
        inside = numpy.array(inside)
        agrees = numpy.abs(normals[free[inside]] @ plane[:3]) >= MIN_COSINE
        on_plane = free[inside[agrees]]
        if len(on_plane) < min_points:
            break
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[on_plane]))
        pieces = numpy.array(cloud.cluster_dbscan(PLANE_CLUSTER_DISTANCE * diagonal, 1))
        for piece in range(pieces.max() + 1):
            of_piece = on_plane[pieces == piece]
            if len(of_piece) >= min_points and is_flat(normals[of_piece]):
                found[of_piece] = n_pieces
                n_pieces += 1
        free = numpy.setdiff1d(free, on_plane)
    return found


def compare_thickness(shape):
    """Returns the row of one shape in the table of thickness."""
    vertices, triangles = numpy.array(shape["vertices"]), numpy.array(shape["triangles"])
    ours = numpy.array([numpy.nan if value is None else value for value in shape["diameters"]])
    labels = numpy.array(shape["triangle_labels"])
    igls = igl_diameters(vertices, triangles)
    values, segments = cgal_segments(vertices, triangles) or (numpy.full(len(ours), numpy.nan), None)
    areas = numpy.linalg.norm(triangle_normals(vertices, triangles), axis=1)
    known = numpy.isfinite(ours) & numpy.isfinite(igls)
    return {
        "shape": shape["name"],
        "triangles": len(triangles),
        "rank correlation with libigl": rank_correlation(ours, igls),
        "median difference from libigl": numpy.median(numpy.abs(ours - igls)[known] / igls[known]),
        "rank correlation with CGAL": rank_correlation(ours, values),
        "labels, ours": len(numpy.unique(labels)),
        "segments, CGAL": numpy.nan if segments is None else len(numpy.unique(segments)),
        "ARI": numpy.nan if segments is None else adjusted_rand_index(labels, segments, areas),
    }


def compare_primitives(shape):
    """Returns the row of one shape in the table of primitives."""
    vertices = numpy.array(shape["vertices"])
    points, normals = numpy.array(shape["points"]), numpy.array(shape["normals"])
    labels = numpy.array(shape["labels"])
    diagonal = numpy.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0))
    agreement = lambda a, b, where: adjusted_rand_index(a[where], b[where])

    runs = [cgal_primitives(points, normals, diagonal) for _ in range(N_RUNS)]
    with_ours = [agreement(labels, run, run >= 0) for run in runs]
    pairs = list(itertools.combinations(runs, 2))
    among = [agreement(a, b, (a >= 0) & (b >= 0)) for a, b in pairs]
    planes = open3d_planes(points, normals, diagonal)
    on_plane = planes >= 0
    return {
        "shape": shape["name"],
        "labels, ours": len(numpy.unique(labels)),
        "labels, CGAL": numpy.median([run.max() + 1 for run in runs]),
        "points with a primitive of CGAL": numpy.median([(run >= 0).mean() for run in runs]),
        "ARI with CGAL": numpy.median(with_ours),
        "least of the runs": min(with_ours),
        "ARI of CGAL with itself": numpy.median(among),
        "least of the pairs": min(among),
        "planes, Open3D": planes.max() + 1,
        "points on them": on_plane.mean(),
        "ARI with Open3D": agreement(labels, planes, on_plane),
    }


def cell(name, value):
    """Returns a count unchanged, and a measurement with three decimals."""
    is_count = name.startswith(("triangles", "labels", "segments", "planes"))
    return value if isinstance(value, str) else f"{value:g}" if is_count else f"{value:.3f}"


def print_table(rows):
    """Prints rows as a Markdown table, with the median of each column."""
    names = list(rows[0])
    print("| " + " | ".join(names) + " |")
    print("|---|" + "---:|" * (len(names) - 1))
    for row in rows:
        print("| " + " | ".join(cell(name, row[name]) for name in names) + " |")
    medians = [cell(name, numpy.nanmedian([row[name] for row in rows])) for name in names[1:]]
    print("| **median** | " + " | ".join(f"**{median}**" for median in medians) + " |")


def main():
    program, *files = sys.argv[1:]
    command = [program, f"ransac-{MIN_PERMILLE}", f"sdf-{N_CLUSTERS}", *files]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    shapes = [json.loads(line) for line in lines]
    print_table([compare_thickness(shape) for shape in shapes])
    print()
    print_table([compare_primitives(shape) for shape in shapes])


if __name__ == "__main__":
    main()
