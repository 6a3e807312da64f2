"""Makes random shapes by sweeping, revolving and lofting, and random free-form shapes.

Each function takes a random number generator and returns a shape.
"""
from __future__ import annotations

import math
from random import Random

from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_TransitionMode as Transition,
)
from OCP.BRepFill import BRepFill
from OCP.BRepOffsetAPI import (
    BRepOffsetAPI_MakeEvolved,
    BRepOffsetAPI_MakePipe,
    BRepOffsetAPI_MakePipeShell,
    BRepOffsetAPI_ThruSections,
)
from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
from OCP.collections import Array1_double, Array1_int, Array2_double, Array2_gp_Pnt
from OCP.GC import GC_MakeArcOfCircle
from OCP.Geom import (
    Geom_BSplineSurface,
    Geom_BezierSurface,
    Geom_OffsetSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
)
from OCP.GeomAbs import GeomAbs_C2
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax1, gp_Pnt

from pieces import (
    ORIGIN,
    ROUND,
    TAU,
    X,
    Z,
    array,
    box,
    circle,
    common,
    cut,
    cylinder,
    direction,
    edge_of,
    face_in,
    fuse,
    grid,
    helix,
    interpolated,
    moved,
    placed,
    polygon,
    prism,
    ring,
    section,
    sewn,
    wire_of,
)


def lofts(rng, is_ruled=False):
    """Returns a loft through two to four sections, which may end in a vertex."""
    maker = BRepOffsetAPI_ThruSections(rng.random() < 0.85, is_ruled)
    n, same = rng.randrange(3, 7), rng.random() < 0.6
    seed = rng.random()
    if rng.random() < 0.25:
        maker.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(0, 0, -3)).Vertex())
    for i in range(rng.randrange(2, 5)):
        # The sections have the same kind, or each has a random kind.
        maker.AddWire(section(Random(seed) if same else rng, 3.0 * i, rng.uniform(1.5, 4), n))
    if rng.random() < 0.25:
        maker.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(0.5, 0, 16)).Vertex())
    return maker.Shape()


def ruled_lofts(rng):
    """Returns a loft with ruled surfaces."""
    return lofts(rng, is_ruled=True)


def pipes(rng):
    """Returns a section that is swept along a spline, or along lines and an arc."""
    if rng.random() < 0.5:
        points = [gp_Pnt(rng.uniform(-3, 3), rng.uniform(-3, 3), 6.0 * i) for i in range(rng.randrange(3, 6))]
        spine = wire_of(edge_of(interpolated([ORIGIN, gp_Pnt(0, 0, 3), *points[1:]])))
    else:
        middle = gp_Pnt(4 - 4 * math.cos(0.8), 0, 10 + 4 * math.sin(0.8))
        bend = GC_MakeArcOfCircle(gp_Pnt(0, 0, 10), middle, gp_Pnt(4, 0, 14))
        spine = wire_of(BRepBuilderAPI_MakeEdge(ORIGIN, gp_Pnt(0, 0, 10)).Edge(), edge_of(bend.Value()),
                        BRepBuilderAPI_MakeEdge(gp_Pnt(4, 0, 14), gp_Pnt(12, 0, 14)).Edge())
    profile = section(rng, 0, rng.uniform(0.4, 1.2))
    if rng.random() < 0.5:
        return BRepOffsetAPI_MakePipe(spine, face_in(profile)).Shape()
    maker = BRepOffsetAPI_MakePipeShell(spine)
    maker.SetTransitionMode(rng.choice([Transition.BRepBuilderAPI_Transformed, Transition.BRepBuilderAPI_RightCorner,
                                        Transition.BRepBuilderAPI_RoundCorner]))
    maker.Add(profile)
    maker.Build()
    maker.MakeSolid()
    return maker.Shape()


def springs(rng):
    """Returns a section that is swept along a helix."""
    radius, thick = rng.uniform(2, 5), rng.uniform(0.2, 0.5)
    slope = rng.choice([0.0, 0.0, 0.2])
    maker = BRepOffsetAPI_MakePipeShell(wire_of(helix(radius, rng.uniform(3 * thick, 4), rng.uniform(0.6, 5), slope)))
    profile = section(rng, 0, thick, 4)
    maker.SetMode(True)
    maker.Add(moved(profile, (radius, 0, 0), X, math.pi / 2))
    maker.Build()
    if rng.random() < 0.85:
        maker.MakeSolid()
    return maker.Shape()


def threads(rng):
    """Returns a rod with a helical groove or ridge."""
    radius, pitch, turns = 4.0, rng.uniform(0.8, 1.5), rng.uniform(1.5, 4)
    deep = 0.3 * pitch
    out = rng.choice([1, -1])
    corners = [(radius - out * 0.1, -deep), (radius + out * deep, 0), (radius - out * 0.1, deep)]
    maker = BRepOffsetAPI_MakePipeShell(wire_of(helix(radius, pitch, turns)))
    maker.SetMode(True)
    maker.Add(polygon([gp_Pnt(x, 0, z) for x, z in corners]))
    maker.Build()
    maker.MakeSolid()
    rod = moved(cylinder(radius, pitch * (turns + 2)), (0, 0, pitch * turns / 2))
    return fuse(rod, maker.Shape()) if out == 1 else cut(rod, maker.Shape())


def revolved(rng):
    """Returns a profile on or near the axis that is revolved fully or partly."""
    on_axis, n = rng.random() < 0.5, rng.randrange(4, 7)
    heights = [6.0 * i / (n - 1) for i in range(n)]
    radii = [rng.uniform(1.5, 4) for _ in heights]
    if on_axis:
        radii[0] = radii[-1] = 0.0
    profile = interpolated([gp_Pnt(r, 0, z) for r, z in zip(radii, heights)])
    ends = [BRepBuilderAPI_MakeEdge(gp_Pnt(radii[0], 0, 0), gp_Pnt(0.8, 0, 0)).Edge(),
            BRepBuilderAPI_MakeEdge(gp_Pnt(0.8, 0, 0), gp_Pnt(0.8, 0, 6)).Edge(),
            BRepBuilderAPI_MakeEdge(gp_Pnt(0.8, 0, 6), gp_Pnt(radii[-1], 0, 6)).Edge()]
    if on_axis:
        ends = [BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 6), gp_Pnt(0, 0, 0)).Edge()]
    face = face_in(wire_of(edge_of(profile), *ends))
    angle = rng.choice([TAU, TAU, rng.uniform(0.3, 6)])
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(ORIGIN, Z), angle).Shape()


def revolved_sections(rng):
    """Returns a closed section that is revolved. The section is beside the axis, touches it, or crosses it, as for tori."""
    radius = rng.uniform(0.5, 2)
    far = rng.choice([radius + rng.uniform(0.2, 4), radius, radius * rng.uniform(0.2, 0.9)])
    if far >= radius * 0.999 and rng.random() < 0.6:
        kind = rng.randrange(3)
        flat = (circle(radius) if kind == 0 else polygon(ring(rng, 5, radius, spread=0.0)) if kind == 1
                else wire_of(edge_of(interpolated(ring(rng, 6, radius * 0.8, spread=0.2), True))))
        section_face = moved(moved(face_in(flat), axis=X, angle=math.pi / 2), (far, 0, 0))
    else:
        # The outer or inner piece of a disc that the axis divides. It gives the outer or inner surface of a self-intersecting torus.
        disc = moved(moved(face_in(circle(radius)), axis=X, angle=math.pi / 2), (far, 0, 0))
        side = rng.choice([moved(box(20, 1, 20), (10, 0, 0)), moved(box(20, 1, 20), (-10, 0, 0))])
        section_face = common(disc, side)
    return BRepPrimAPI_MakeRevol(section_face, gp_Ax1(ORIGIN, Z), rng.choice([TAU, rng.uniform(0.4, 6)])).Shape()


def extruded(rng):
    """Returns an extruded section, with or without a hole, or an extruded curve."""
    outer = section(rng, 0, 4)
    holes = [section(rng, 0, 0.9)] if rng.random() < 0.6 else []
    if rng.random() < 0.3:
        curve = interpolated([gp_Pnt(2.0 * i, rng.uniform(-2, 2), 0) for i in range(5)])
        return prism(edge_of(curve), 0, rng.uniform(0, 2), 5)
    return prism(face_in(outer, *holes), rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(2, 6))


def ruled(rng):
    """Returns a ruled surface between two open curves, or between two closed wires."""
    if rng.random() < 0.5:
        points = lambda z: [gp_Pnt(2.0 * i, rng.uniform(-2, 2), z + rng.uniform(-1, 1)) for i in range(4)]
        return BRepFill.Face_s(*(edge_of(interpolated(points(z))) for z in (0, 5)))
    seed = rng.random()
    return BRepFill.Shell_s(section(Random(seed), 0, 2), section(Random(seed), rng.uniform(2, 5), 3.5))


def wavy(rng, n=5, m=5):
    """Returns a grid of points with random heights."""
    return [[gp_Pnt(2.0 * i, 2.0 * j, rng.uniform(-1, 1)) for j in range(m)] for i in range(n)]


def wavy_surface(rng):
    """Returns a B-spline surface through a grid of points with random heights."""
    return GeomAPI_PointsToBSplineSurface(grid(Array2_gp_Pnt, wavy(rng)), 3, 8, GeomAbs_C2, 1e-3).Surface()


def bulgy(rng, n, m, radius=5.0):
    """Returns the control points of a closed band around the axis."""
    around = lambda i, j: (radius * rng.uniform(0.8, 1.2), TAU * i / n, 2.0 * j)
    polar = [[around(i, j) for j in range(m)] for i in range(n)]
    return [[gp_Pnt(r * math.cos(t), r * math.sin(t), z) for r, t, z in row] for row in polar]


def free_forms(rng):
    """Returns a face or solid with a Bezier, B-spline or offset surface: rational or periodic, trimmed or whole."""
    kind = rng.randrange(5)
    weights = lambda n, m: grid(Array2_double, [[rng.uniform(0.5, 2) for _ in range(m)] for _ in range(n)])
    if kind == 0:
        rows = wavy(rng, rng.randrange(2, 6), rng.randrange(2, 6))
        poles = grid(Array2_gp_Pnt, rows)
        is_rational = rng.random() < 0.5
        surface = Geom_BezierSurface(poles, *([weights(len(rows), len(rows[0]))] if is_rational else []))
    elif kind == 1:
        surface = wavy_surface(rng)
    elif kind == 2:
        n, m = 8, 4
        knots, times = array(Array1_double, [float(i) for i in range(n + 1)]), array(Array1_int, [1] * (n + 1))
        up, up_times = array(Array1_double, [0.0, 1.0]), array(Array1_int, [4, 4])
        shape = grid(Array2_gp_Pnt, bulgy(rng, n, m)), weights(n, m)
        surface = Geom_BSplineSurface(*shape, knots, up, times, up_times, 3, 3, True, False)
    elif kind == 3:
        around = lambda t, s: (6 + 2 * math.cos(s) * rng.uniform(0.8, 1.2), t, 2 * math.sin(s))
        polar = [[around(TAU * i / 6, TAU * j / 5) for j in range(5)] for i in range(6)]
        poles = grid(Array2_gp_Pnt, [[gp_Pnt(r * math.cos(t), r * math.sin(t), z) for r, t, z in row] for row in polar])
        flat = lambda n: (array(Array1_double, [float(i) for i in range(n + 1)]), array(Array1_int, [1] * (n + 1)))
        (u, u_times), (v, v_times) = flat(6), flat(5)
        surface = Geom_BSplineSurface(poles, u, v, u_times, v_times, 3, 3, True, True)
        if rng.random() < 0.5:
            surface.SetUNotPeriodic()
    else:
        surface = Geom_OffsetSurface(wavy_surface(rng), 0.4)
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    if kind in (0, 1, 4) and rng.random() < 0.5:
        thick = prism(face, 0, 0, 3)
        return cut(thick, moved(cylinder(1.2, 30), (4, 4, 0))) if rng.random() < 0.5 else thick
    if kind == 3 and rng.random() < 0.7:
        solid = BRepBuilderAPI_MakeSolid(sewn(face)).Solid()
        return cut(solid, placed(rng, box(3, 3, 3), 6)) if rng.random() < 0.5 else solid
    return face


def swept_surfaces(rng):
    """Returns a face on a surface of extrusion or of revolution along a spline: also closed, oblique and offset ones."""
    closed = rng.random() < 0.5
    points = ring(rng, 6, 3) if closed else [gp_Pnt(2.0 * i, rng.uniform(-1, 1), 0) for i in range(5)]
    spline = interpolated(points, closed)
    if rng.random() < 0.5:
        surface = Geom_SurfaceOfLinearExtrusion(spline, direction(rng) if rng.random() < 0.3 else Z)
        limits = (*surface.Bounds()[:2], -2.0, 4.0)
    else:
        standing = interpolated([gp_Pnt(rng.uniform(2, 4), 0, 1.5 * i) for i in range(5)])
        surface = Geom_SurfaceOfRevolution(standing, gp_Ax1(ORIGIN, Z))
        limits = (0.0, rng.choice([TAU, rng.uniform(1, 6)]), *surface.Bounds()[2:])
    if rng.random() < 0.4:
        surface = Geom_OffsetSurface(surface, rng.choice([0.3, -0.3]))
    face = BRepBuilderAPI_MakeFace(surface, *limits, 1e-6).Face()
    return common(face, placed(rng, box(7, 7, 7), 2)) if rng.random() < 0.4 else face


def gears(rng):
    """Returns a gear with many flanks, a bore and a keyway."""
    n, points = rng.randrange(8, 20), []
    for i in range(n):
        for part, reach in ((0.0, 4.0), (0.25, 4.1), (0.35, 5.0), (0.65, 5.0), (0.75, 4.1)):
            turn = TAU * (i + part) / n
            points.append(gp_Pnt(reach * math.cos(turn), reach * math.sin(turn), 0))
    outline = polygon(points) if rng.random() < 0.5 else wire_of(edge_of(interpolated(points, True)))
    blank = prism(face_in(outline), 0, 0, rng.uniform(1, 4))
    bored = cut(blank, cylinder(1.5, 20))
    return cut(bored, moved(box(1, 1, 20), (1.5, 0, 0)))


def evolved(rng):
    """Returns a profile that is swept along a polygon."""
    spine = polygon(ring(rng, 4, 6, spread=0.1))
    profile = wire_of(BRepBuilderAPI_MakeEdge(ORIGIN, gp_Pnt(0.8, 0.0, 0.5)).Edge(),
                      BRepBuilderAPI_MakeEdge(gp_Pnt(0.8, 0.0, 0.5), gp_Pnt(0.8, 0, 2)).Edge())
    return BRepOffsetAPI_MakeEvolved(spine, profile, ROUND, True, rng.random() < 0.5).Shape()
