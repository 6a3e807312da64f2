"""Random shapes, by OpenCASCADE's own modelling algorithms.

In goes a family's name and a random number generator, out comes a shape; `FAMILIES` names them. Nothing is written here
(`modelled.py` does that). A model may fail, as modelling does: OpenCASCADE's exceptions pass through.
"""
from __future__ import annotations

import math
from random import Random

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse, BRepAlgoAPI_Splitter
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_GTransform,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_NurbsConvert,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
    BRepBuilderAPI_TransitionMode as Transition,
)
from OCP.BRepFill import BRepFill
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepLib import BRepLib
from OCP.BRepOffset import BRepOffset_Mode
from OCP.BRepOffsetAPI import (
    BRepOffsetAPI_DraftAngle,
    BRepOffsetAPI_MakeEvolved,
    BRepOffsetAPI_MakeOffsetShape,
    BRepOffsetAPI_MakePipe,
    BRepOffsetAPI_MakePipeShell,
    BRepOffsetAPI_MakeThickSolid,
    BRepOffsetAPI_ThruSections,
)
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
    BRepPrimAPI_MakeWedge,
)
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_int,
    Array2_double,
    Array2_gp_Pnt,
    HArray1_gp_Pnt,
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap,
    List_TopoDS_Shape,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.Geom import (
    Geom_BezierSurface,
    Geom_BSplineSurface,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_OffsetSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
)
from OCP.Geom2d import Geom2d_Line
from OCP.GeomAbs import GeomAbs_C2, GeomAbs_JoinType
from OCP.GeomAPI import GeomAPI_Interpolate, GeomAPI_PointsToBSplineSurface
from OCP.GeomConvert import GeomConvert
from OCP.gp import (
    gp_Ax1,
    gp_Ax2,
    gp_Ax3,
    gp_Circ,
    gp_Dir,
    gp_Dir2d,
    gp_Elips,
    gp_GTrsf,
    gp_Pln,
    gp_Pnt,
    gp_Pnt2d,
    gp_Trsf,
    gp_Vec,
)
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideArea, ShapeUpgrade_ShapeDivideClosed, ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID, TopAbs_VERTEX
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Compound

TAU = 2 * math.pi
ORIGIN, X, Y, Z = gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0), gp_Dir(0, 1, 0), gp_Dir(0, 0, 1)
UP = gp_Ax2(ORIGIN, Z)
ROUND, SHARP = GeomAbs_JoinType.GeomAbs_Arc, GeomAbs_JoinType.GeomAbs_Intersection

# ------------------------------------------------------------------------------------------------ small pieces


def shapes_of(shape, kind):
    found = ShapeMap()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i + 1) for i in range(found.Extent())]


def faces_of(shape):
    return [TopoDS.Face(face) for face in shapes_of(shape, TopAbs_FACE)]


def edges_of(shape):
    edges = [TopoDS.Edge(edge) for edge in shapes_of(shape, TopAbs_EDGE)]
    return [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]


def listed(shapes):
    result = List_TopoDS_Shape()
    for shape in shapes:
        result.Append(shape)
    return result


def array(kind, values):
    result = kind(1, len(values))
    for i, value in enumerate(values):
        result.SetValue(i + 1, value)
    return result


def grid(kind, rows):
    result = kind(1, len(rows), 1, len(rows[0]))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            result.SetValue(i + 1, j + 1, value)
    return result


def compound(shapes):
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def moved(shape, vector=(0, 0, 0), axis=None, angle=0.0):
    move, turn = gp_Trsf(), gp_Trsf()
    move.SetTranslation(gp_Vec(*vector))
    if axis is not None:
        turn.SetRotation(gp_Ax1(ORIGIN, axis), angle)
    return BRepBuilderAPI_Transform(shape, move.Multiplied(turn), True).Shape()


def direction(rng: Random):
    z, turn = rng.uniform(-1, 1), rng.uniform(0, TAU)
    across = math.sqrt(1 - z * z)
    return gp_Dir(across * math.cos(turn), across * math.sin(turn), z)


def placed(rng: Random, shape, reach=4.0):
    """Somewhere near; along the axes half of the time."""
    at = [rng.uniform(-reach, reach) for _ in range(3)]
    if rng.random() < 0.5:
        return moved(shape, [round(x) for x in at], rng.choice([X, Y, Z]), rng.randrange(4) * math.pi / 2)
    return moved(shape, at, direction(rng), rng.uniform(0, TAU))


def box(a, b, c):
    return BRepPrimAPI_MakeBox(gp_Pnt(-a / 2, -b / 2, -c / 2), a, b, c).Shape()


def cylinder(radius, height, angle=TAU):
    return moved(BRepPrimAPI_MakeCylinder(radius, height, angle).Shape(), (0, 0, -height / 2))


def primitive(rng: Random):
    size = lambda: rng.uniform(2, 8)
    kind = rng.randrange(6)
    if kind == 0:
        return box(size(), size(), size())
    if kind == 1:
        return cylinder(size() / 2, size(), rng.choice([TAU, TAU, rng.uniform(0.5, 6)]))
    if kind == 2:
        return BRepPrimAPI_MakeCone(size() / 2, rng.choice([0.0, size() / 2]), size()).Shape()
    if kind == 3:
        return BRepPrimAPI_MakeSphere(size() / 2).Shape()
    if kind == 4:
        minor = rng.uniform(0.4, 1.5)
        return BRepPrimAPI_MakeTorus(minor + rng.uniform(0.3, 3), minor).Shape()
    return BRepPrimAPI_MakeWedge(size(), size(), size(), rng.uniform(0.5, 2)).Shape()


def combined(operation, one, other):
    tool = operation(one, other)
    if not tool.IsDone() or not shapes_of(tool.Shape(), TopAbs_FACE):
        raise ValueError("the combination is empty")
    return tool.Shape()


def cut(one, other):
    return combined(BRepAlgoAPI_Cut, one, other)


def fuse(one, other):
    return combined(BRepAlgoAPI_Fuse, one, other)


def common(one, other):
    return combined(BRepAlgoAPI_Common, one, other)


def interpolated(points, is_periodic=False):
    held = HArray1_gp_Pnt(1, len(points))
    for i, point in enumerate(points):
        held.SetValue(i + 1, point)
    tool = GeomAPI_Interpolate(held, is_periodic, 1e-7)
    tool.Perform()
    return tool.Curve()


def edge_of(curve):
    return BRepBuilderAPI_MakeEdge(curve).Edge()


def wire_of(*edges):
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges:
        maker.Add(edge)
    return maker.Wire()


def polygon(points):
    maker = BRepBuilderAPI_MakePolygon()
    for point in points:
        maker.Add(point)
    maker.Close()
    return maker.Wire()


def ring(rng: Random, n, radius, z=0.0, spread=0.25, turn=0.0):
    """Points around the axis, unevenly far from it."""
    far = [radius * rng.uniform(1 - spread, 1 + spread) for _ in range(n)]
    return [gp_Pnt(r * math.cos(turn + TAU * i / n), r * math.sin(turn + TAU * i / n), z) for i, r in enumerate(far)]


def circle(radius, z=0.0):
    return wire_of(BRepBuilderAPI_MakeEdge(gp_Circ(gp_Ax2(gp_Pnt(0, 0, z), Z), radius)).Edge())


def section(rng: Random, z=0.0, radius=None, n=None):
    """A closed wire about the axis: polygon, spline, circle or ellipse."""
    radius, n = radius or rng.uniform(1.5, 4), n or rng.randrange(4, 8)
    kind = rng.randrange(4)
    if kind == 0:
        return polygon(ring(rng, n, radius, z))
    if kind == 1:
        return wire_of(edge_of(interpolated(ring(rng, n, radius, z), True)))
    if kind == 2:
        return circle(radius, z)
    return wire_of(BRepBuilderAPI_MakeEdge(gp_Elips(gp_Ax2(gp_Pnt(0, 0, z), Z, X), radius * 1.4, radius)).Edge())


def face_in(wire, *holes):
    maker = BRepBuilderAPI_MakeFace(wire, True)
    for hole in holes:
        maker.Add(TopoDS.Wire(hole.Reversed()))
    return maker.Face()


def prism(shape, x, y, z):
    return BRepPrimAPI_MakePrism(shape, gp_Vec(x, y, z)).Shape()


def helix(radius, pitch, turns, slope=0.0):
    """An edge along a helix, on a cylinder or on a cone."""
    axes = gp_Ax3(ORIGIN, Z)
    surface = Geom_ConicalSurface(axes, slope, radius) if slope else Geom_CylindricalSurface(axes, radius)
    rise = pitch / math.cos(slope)
    line = Geom2d_Line(gp_Pnt2d(0, 0), gp_Dir2d(TAU, rise))
    edge = BRepBuilderAPI_MakeEdge(line, surface, 0.0, turns * math.hypot(TAU, rise)).Edge()
    BRepLib.BuildCurves3d_s(edge)
    return edge


def base_solid(rng: Random):
    """Something plain with corners, to work on."""
    kind = rng.randrange(4)
    if kind == 0:
        return box(rng.uniform(4, 9), rng.uniform(4, 9), rng.uniform(4, 9))
    if kind == 1:
        return cylinder(rng.uniform(2, 5), rng.uniform(3, 8))
    if kind == 2:
        return prism(face_in(polygon(ring(rng, rng.randrange(5, 8), 4))), 0, 0, rng.uniform(3, 6))
    block = box(8, 8, rng.uniform(3, 6))
    return cut(block, moved(cylinder(rng.uniform(1, 2.5), 20), (rng.uniform(-1, 1), rng.uniform(-1, 1), 0)))


# --------------------------------------------------------------------------------------------------- families


def booleans(rng):
    shape = placed(rng, primitive(rng), 1)
    for _ in range(rng.randrange(1, 5)):
        operation = rng.choice([BRepAlgoAPI_Cut, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse, BRepAlgoAPI_Fuse, BRepAlgoAPI_Common])
        shape = combined(operation, shape, placed(rng, primitive(rng), 3))
    return shape


def tangent(rng):
    """Two that touch along a curve or in a point, exactly or by a hair."""
    off = rng.choice([0.0, 0.0, 1e-6, 1e-4, -1e-4, 1e-2, -1e-2])
    radius = rng.uniform(1, 3)
    tube = cylinder(radius, 8)
    kind = rng.randrange(7)
    if kind == 0:
        pair = box(8, 6, 4), moved(tube, (4 - radius + off, 0, 0))
    elif kind == 1:
        pair = tube, moved(BRepPrimAPI_MakeSphere(radius + off).Shape(), (0, 0, 4))
    elif kind == 2:
        pair = tube, moved(cylinder(radius + off, 9), axis=rng.choice([X, Y]), angle=math.pi / 2)
    elif kind == 3:
        bend = BRepPrimAPI_MakeTorus(5 + off, radius, math.pi / 2).Shape()
        pair = bend, moved(tube, (5, -4, 0), X, math.pi / 2)
    elif kind == 4:
        half = rng.uniform(0.2, 0.6)
        low = radius * math.cos(half)
        cone = BRepPrimAPI_MakeCone(low + off, 0, low / math.tan(half)).Shape()
        pair = moved(cone, (0, 0, radius * math.sin(half))), BRepPrimAPI_MakeSphere(radius).Shape()
    elif kind == 5:
        pair = tube, moved(cylinder(radius / 2, 6), (radius / 2 + off, 0, 0))
    else:
        pair = BRepPrimAPI_MakeTorus(4, radius).Shape(), moved(box(14, 14, 4), (0, 0, 2 + radius + off - rng.choice([0, 4])))
    return combined(rng.choice([BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse, BRepAlgoAPI_Fuse]), *pair)


def fillets(rng):
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeFillet(shape)
    edges = edges_of(shape)
    radius = rng.uniform(0.1, 0.7)
    for edge in rng.sample(edges, rng.randrange(1, len(edges) + 1)):
        maker.Add(radius, edge)
    return maker.Shape()


def variable_fillets(rng):
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in rng.sample(edges_of(shape), 2):
        maker.Add(rng.uniform(0.1, 0.5), rng.uniform(0.5, 1.0), edge)
    return maker.Shape()


def chamfers(rng):
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeChamfer(shape)
    edges = edges_of(shape)
    for edge in rng.sample(edges, rng.randrange(1, len(edges) + 1)):
        maker.Add(rng.uniform(0.1, 0.6), edge)
    return maker.Shape()


def hollowed(rng):
    """A shell: a solid whose faces, but one or two, are offset."""
    shape = fillets(rng) if rng.random() < 0.4 else base_solid(rng)
    opened = rng.sample(faces_of(shape), rng.choice([1, 1, 2]))
    maker = BRepOffsetAPI_MakeThickSolid()
    thick = rng.choice([-0.3, -0.15, 0.25])
    maker.MakeThickSolidByJoin(shape, listed(opened), thick, 1e-4, BRepOffset_Mode.BRepOffset_Skin, False, False,
                               rng.choice([ROUND, SHARP]))
    return maker.Shape()


def lofts(rng, is_ruled=False):
    maker = BRepOffsetAPI_ThruSections(rng.random() < 0.85, is_ruled)
    n, same = rng.randrange(3, 7), rng.random() < 0.6
    seed = rng.random()
    if rng.random() < 0.25:
        maker.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(0, 0, -3)).Vertex())
    for i in range(rng.randrange(2, 5)):
        # The same kind of section each time, or any.
        maker.AddWire(section(Random(seed) if same else rng, 3.0 * i, rng.uniform(1.5, 4), n))
    if rng.random() < 0.25:
        maker.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(0.5, 0, 16)).Vertex())
    return maker.Shape()


def ruled_lofts(rng):
    return lofts(rng, is_ruled=True)


def pipes(rng):
    """A section along a spline, or along lines and arcs."""
    if rng.random() < 0.5:
        points = [gp_Pnt(rng.uniform(-3, 3), rng.uniform(-3, 3), 6.0 * i) for i in range(rng.randrange(3, 6))]
        spine = wire_of(edge_of(interpolated([ORIGIN, gp_Pnt(0, 0, 3), *points[1:]])))
    else:
        bend = GC_MakeArcOfCircle(gp_Pnt(0, 0, 10), gp_Pnt(4 - 4 * math.cos(0.8), 0, 10 + 4 * math.sin(0.8)), gp_Pnt(4, 0, 14))
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
    """A rod with a helical groove or ridge on it."""
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
    """A profile beside or on the axis, turned in full or in part."""
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
    """A closed section beside, touching or crossing the axis: tori and their kin."""
    radius = rng.uniform(0.5, 2)
    far = rng.choice([radius + rng.uniform(0.2, 4), radius, radius * rng.uniform(0.2, 0.9)])
    if far >= radius * 0.999 and rng.random() < 0.6:
        kind = rng.randrange(3)
        flat = (circle(radius) if kind == 0 else polygon(ring(rng, 5, radius, spread=0.0)) if kind == 1
                else wire_of(edge_of(interpolated(ring(rng, 6, radius * 0.8, spread=0.2), True))))
        section_face = moved(moved(face_in(flat), axis=X, angle=math.pi / 2), (far, 0, 0))
    else:
        # The part of a disc on one side of the axis, outside or inside: an apple or a lemon.
        disc = moved(moved(face_in(circle(radius)), axis=X, angle=math.pi / 2), (far, 0, 0))
        side = rng.choice([moved(box(20, 1, 20), (10, 0, 0)), moved(box(20, 1, 20), (-10, 0, 0))])
        section_face = common(disc, side)
    return BRepPrimAPI_MakeRevol(section_face, gp_Ax1(ORIGIN, Z), rng.choice([TAU, rng.uniform(0.4, 6)])).Shape()


def extruded(rng):
    outer = section(rng, 0, 4)
    holes = [section(rng, 0, 0.9)] if rng.random() < 0.6 else []
    if rng.random() < 0.3:
        curve = interpolated([gp_Pnt(2.0 * i, rng.uniform(-2, 2), 0) for i in range(5)])
        return prism(edge_of(curve), 0, rng.uniform(0, 2), 5)
    return prism(face_in(outer, *holes), rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(2, 6))


def drafts(rng):
    shape = prism(face_in(polygon(ring(rng, rng.randrange(4, 7), 4))), 0, 0, 5)
    if rng.random() < 0.4:
        shape = cylinder(3, 5)
    maker = BRepOffsetAPI_DraftAngle(shape)
    neutral = gp_Pln(ORIGIN, Z)
    for face in faces_of(shape):
        normal = BRep_Tool.Surface_s(face)
        try:
            is_side = abs(normal.Pln().Axis().Direction().Z()) < 0.5
        except AttributeError:
            is_side = True
        if is_side and rng.random() < 0.8:
            maker.Add(face, Z, rng.uniform(0.02, 0.2), neutral)
            if not maker.AddDone():
                maker.Remove(face)
    maker.Build()
    return maker.Shape()


def offsets(rng):
    shape = rng.choice([base_solid, extruded, revolved, booleans])(rng)
    maker = BRepOffsetAPI_MakeOffsetShape()
    maker.PerformByJoin(shape, rng.choice([0.3, -0.2, 0.1]), 1e-4, BRepOffset_Mode.BRepOffset_Skin, False, False,
                        rng.choice([ROUND, SHARP]))
    return maker.Shape()


def ruled(rng):
    """A surface between two curves: open, or between closed wires."""
    if rng.random() < 0.5:
        curves = [interpolated([gp_Pnt(2.0 * i, rng.uniform(-2, 2), z + rng.uniform(-1, 1)) for i in range(4)]) for z in (0, 5)]
        return BRepFill.Face_s(*map(edge_of, curves))
    seed = rng.random()
    return BRepFill.Shell_s(section(Random(seed), 0, 2), section(Random(seed), rng.uniform(2, 5), 3.5))


def wavy(rng, n=5, m=5):
    return [[gp_Pnt(2.0 * i, 2.0 * j, rng.uniform(-1, 1)) for j in range(m)] for i in range(n)]


def bulgy(rng, n, m, radius=5.0):
    """Poles of a closed band about the axis."""
    around = lambda i, j: (radius * rng.uniform(0.8, 1.2), TAU * i / n, 2.0 * j)
    polar = [[around(i, j) for j in range(m)] for i in range(n)]
    return [[gp_Pnt(r * math.cos(t), r * math.sin(t), z) for r, t, z in row] for row in polar]


def free_forms(rng):
    """Faces on Bezier and B-spline surfaces, rational and periodic ones, trimmed or whole."""
    kind = rng.randrange(5)
    weights = lambda n, m: grid(Array2_double, [[rng.uniform(0.5, 2) for _ in range(m)] for _ in range(n)])
    if kind == 0:
        rows = wavy(rng, rng.randrange(2, 6), rng.randrange(2, 6))
        poles = grid(Array2_gp_Pnt, rows)
        surface = Geom_BezierSurface(poles, weights(len(rows), len(rows[0]))) if rng.random() < 0.5 else Geom_BezierSurface(poles)
    elif kind == 1:
        surface = GeomAPI_PointsToBSplineSurface(grid(Array2_gp_Pnt, wavy(rng)), 3, 8, GeomAbs_C2, 1e-3).Surface()
    elif kind == 2:
        n, m = 8, 4
        knots, times = array(Array1_double, [float(i) for i in range(n + 1)]), array(Array1_int, [1] * (n + 1))
        up, up_times = array(Array1_double, [0.0, 1.0]), array(Array1_int, [4, 4])
        surface = Geom_BSplineSurface(grid(Array2_gp_Pnt, bulgy(rng, n, m)), weights(n, m), knots, up, times, up_times, 3, 3, True, False)
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
        surface = Geom_OffsetSurface(GeomAPI_PointsToBSplineSurface(grid(Array2_gp_Pnt, wavy(rng)), 3, 8, GeomAbs_C2, 1e-3).Surface(), 0.4)
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    if kind in (0, 1, 4) and rng.random() < 0.5:
        thick = prism(face, 0, 0, 3)
        return cut(thick, moved(cylinder(1.2, 30), (4, 4, 0))) if rng.random() < 0.5 else thick
    if kind == 3 and rng.random() < 0.7:
        solid = BRepBuilderAPI_MakeSolid(sewn(face)).Solid()
        return cut(solid, placed(rng, box(3, 3, 3), 6)) if rng.random() < 0.5 else solid
    return face


def sewn(*shapes):
    from OCP.TopAbs import TopAbs_SHELL

    tool = BRepBuilderAPI_Sewing(1e-6)
    for shape in shapes:
        tool.Add(shape)
    tool.Perform()
    if shapes_of(tool.SewedShape(), TopAbs_SHELL):
        return TopoDS.Shell(shapes_of(tool.SewedShape(), TopAbs_SHELL)[0])
    builder = BRep_Builder()
    from OCP.TopoDS import TopoDS_Shell

    shell = TopoDS_Shell()
    builder.MakeShell(shell)
    builder.Add(shell, tool.SewedShape())
    return shell


def swept_surfaces(rng):
    """Surfaces of extrusion and of revolution about splines and conics, also closed, oblique, and offset."""
    closed = rng.random() < 0.5
    spline = interpolated(ring(rng, 6, 3), True) if closed else interpolated([gp_Pnt(2.0 * i, rng.uniform(-1, 1), 0) for i in range(5)])
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


def nurbs(rng):
    family = rng.choice([booleans, tangent, fillets, revolved, revolved_sections, seams, poles, apexes, extruded])
    return BRepBuilderAPI_NurbsConvert(family(rng), True).Shape()


def divided(rng):
    """Solids in pieces that share faces, and closed faces cut open."""
    shape = rng.choice([booleans, revolved, base_solid, tangent, free_forms])(rng)
    kind = rng.randrange(3)
    if kind == 0:
        tool = BRepAlgoAPI_Splitter()
        tool.SetArguments(listed([shape]))
        across = BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0.3, 0.2, 0.5), direction(rng)), -30, 30, -30, 30).Face()
        tool.SetTools(listed([across]))
        tool.Build()
        return tool.Shape()
    if kind == 1:
        tool = ShapeUpgrade_ShapeDivideClosed(shape)
        tool.SetNbSplitPoints(rng.randrange(1, 4))
    else:
        tool = ShapeUpgrade_ShapeDivideArea(shape)
        tool.MaxArea = rng.uniform(5, 20)
    tool.Perform()
    return tool.Result()


def open_shells(rng):
    shape = rng.choice([booleans, fillets, lofts, seams])(rng)
    faces = faces_of(shape)
    return sewn(*rng.sample(faces, max(1, len(faces) - rng.randrange(1, 4))))


def compounds(rng):
    family = [booleans, fillets, revolved, free_forms, seams, poles, open_shells]
    return compound(moved(rng.choice(family)(rng), (25.0 * i, 0, 0)) for i in range(rng.randrange(2, 5)))


def touching_wires(rng):
    """Faces whose bounds touch in vertices, or that touch themselves."""
    plate = box(8, 8, 2)
    kind = rng.randrange(4)
    if kind == 0:
        return cut(plate, moved(cylinder(2, 10), (rng.choice([2.0, 2.0, -2.0]), 0, 0)))
    if kind == 1:
        corner = rng.uniform(2, 3)
        return cut(plate, moved(box(corner, corner, 10), (4 - corner / math.sqrt(2), 0, 0), Z, math.pi / 4))
    if kind == 2:
        return cut(cut(plate, moved(cylinder(1.5, 10), (-1.5, 0, 0))), moved(cylinder(1.5, 10), (1.5, 0, 0)))
    return cut(cut(plate, moved(box(2, 2, 10), (-1, -1, 0))), moved(box(2, 2, 10), (1, 1, 0)))


def seams(rng):
    """Closed faces cut along, through and across their seam."""
    tube = rng.choice([lambda: cylinder(3, 10), lambda: BRepPrimAPI_MakeCone(4, 2, 8).Shape(),
                       lambda: BRepPrimAPI_MakeTorus(5, 2).Shape(), lambda: BRepPrimAPI_MakeSphere(4).Shape()])()
    for _ in range(rng.randrange(1, 4)):
        kind = rng.randrange(5)
        if kind == 0:
            tool = moved(box(20, 20, 20), (0, rng.choice([-10, 10]), 0))
        elif kind == 1:
            tool = moved(cylinder(rng.uniform(0.4, 1), 20), (5, 0, rng.uniform(-2, 2)), Y, math.pi / 2)
        elif kind == 2:
            tool = moved(box(20, 20, 20), (10, rng.choice([-10, 10]), 0))
        elif kind == 3:
            tool = moved(box(4, rng.uniform(0.5, 2), 2), (4, rng.choice([0.0, 0.3, -0.25]), rng.uniform(-2, 3)))
        else:
            tool = moved(box(30, 30, 30), (0, 0, 16 + rng.uniform(-1, 3)), X, rng.uniform(-0.4, 0.4))
        tube = cut(tube, tool)
    return tube


def poles(rng):
    """Spheres trimmed over, at and beside their poles."""
    kind = rng.randrange(6)
    low, high = sorted((rng.uniform(-1.5, 1.5), rng.choice([math.pi / 2, rng.uniform(-1, 1.5)])))
    if kind == 0:
        return BRepPrimAPI_MakeSphere(gp_Ax2(ORIGIN, Z), 4, low, high, rng.choice([TAU, 2.0, math.pi])).Shape()
    ball = moved(BRepPrimAPI_MakeSphere(4).Shape(), axis=rng.choice([X, Y, Z]), angle=rng.choice([0.0, math.pi / 2, rng.uniform(0, 6)]))
    if kind == 1:
        return cut(ball, moved(cylinder(rng.uniform(0.5, 2), 20), (rng.choice([0.0, 0.6, 2.0]), 0, 0)))
    if kind == 2:
        return cut(ball, moved(box(20, 20, 20), (10, 10, 10)))
    if kind == 3:
        return common(ball, moved(box(3, 3, 20), (rng.choice([0.0, 1.5]), rng.choice([0.0, 1.5]), 0)))
    if kind == 4:
        return cut(ball, placed(rng, box(4, 4, 4), 3))
    return cut(BRepPrimAPI_MakeSphere(4).Shape(), moved(BRepPrimAPI_MakeSphere(3.5).Shape(), (rng.uniform(0, 2), 0, 1)))


def apexes(rng):
    cone = BRepPrimAPI_MakeCone(rng.uniform(2, 4), 0, rng.uniform(2, 8), rng.choice([TAU, TAU, 2.0])).Shape()
    kind = rng.randrange(4)
    if kind == 0:
        return cone
    if kind == 1:
        return cut(cone, moved(box(20, 20, 20), (10, rng.choice([0.0, 10.0]), 0)))
    if kind == 2:
        return cut(cone, moved(cylinder(0.5, 30), (rng.choice([0.0, 0.5, 0.7]), 0, 0)))
    return cut(cone, moved(cylinder(0.5, 20), (1, 0, 1), rng.choice([X, Y]), math.pi / 2))


def drilled(rng):
    """A turned body with holes all around."""
    body = rng.choice([lambda: cylinder(3, 10), lambda: BRepPrimAPI_MakeCone(4, 2, 8).Shape(), lambda: revolved(rng),
                       lambda: BRepPrimAPI_MakeTorus(5, 2).Shape(), lambda: BRepPrimAPI_MakeSphere(4).Shape(),
                       lambda: BRepPrimAPI_MakeTorus(5, 2).Shape()])()
    if rng.random() < 0.3:
        body = BRepBuilderAPI_NurbsConvert(body, True).Shape()
    n, depth = rng.randrange(3, 9), rng.uniform(3, 6)
    for i in range(n):
        hole = moved(BRepPrimAPI_MakeCylinder(rng.uniform(0.3, 0.9), 10).Shape(), axis=Y, angle=rng.uniform(0.7, 2.4))
        hole = moved(moved(hole, (depth if rng.random() < 0.7 else 1.0, 0, rng.uniform(-1, 2))), axis=Z, angle=TAU * i / n + rng.uniform(0, 0.3))
        body = cut(body, hole)
    return body


def blended(rng):
    """Fillets and chamfers between curved faces, up to faces that vanish."""
    kind = rng.randrange(5)
    if kind == 0:
        shape = fuse(cylinder(3, 10), moved(cylinder(rng.uniform(1, 2.5), 8), (4, 0, 0), Y, math.pi / 2))
    elif kind == 1:
        shape = fuse(box(9, 9, 3), moved(cylinder(2, 6), (rng.uniform(-1, 1), 0, 3)))
    elif kind == 2:
        shape = cut(BRepPrimAPI_MakeSphere(5).Shape(), moved(cylinder(2, 20), (rng.uniform(0, 1.5), 0, 0)))
    elif kind == 3:
        shape = fuse(BRepPrimAPI_MakeCone(4, 1, 6).Shape(), moved(box(10, 2, 2), (2, 0, 2)))
    else:
        shape, radius = box(6, 6, 3), rng.choice([1.5, 1.5 - 1e-4, 1.0])
        maker = BRepFilletAPI_MakeFillet(shape)
        for edge in edges_of(shape):
            maker.Add(radius, edge)
        return maker.Shape()
    maker = (BRepFilletAPI_MakeFillet if rng.random() < 0.7 else BRepFilletAPI_MakeChamfer)(shape)
    for edge in rng.sample(edges_of(shape), rng.randrange(1, 3)):
        maker.Add(rng.uniform(0.2, 0.8), edge)
    return maker.Shape()


def carved(rng):
    """Lofts, pipes and free forms, cut and joined."""
    shape = rng.choice([lofts, ruled_lofts, pipes, springs, revolved_sections, evolved, extruded])(rng)
    if not solids_of(shape):
        raise ValueError("there is nothing to carve")
    for _ in range(rng.randrange(1, 3)):
        shape = combined(rng.choice([BRepAlgoAPI_Cut, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse]), shape, placed(rng, primitive(rng), 3))
    return shape


def embossed(rng):
    """Spline outlines pressed into a turned face or raised on it."""
    body = rng.choice([cylinder(4, 10), BRepPrimAPI_MakeSphere(4.5).Shape(), BRepPrimAPI_MakeCone(5, 3, 8).Shape()])
    stamp = moved(prism(face_in(section(rng, 0, rng.uniform(0.5, 1.2))), 0, 0, 3), (3, 0, 1), Y, math.pi / 2)
    for i in range(rng.randrange(1, 4)):
        body = combined(rng.choice([BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse]), body, moved(stamp, axis=Z, angle=i * 1.3 + rng.choice([0, 0.4])))
    return body


def gears(rng):
    """Many flanks, a bore, a keyway; straight or helical."""
    n, points = rng.randrange(8, 20), []
    for i in range(n):
        for part, reach in ((0.0, 4.0), (0.25, 4.1), (0.35, 5.0), (0.65, 5.0), (0.75, 4.1)):
            turn = TAU * (i + part) / n
            points.append(gp_Pnt(reach * math.cos(turn), reach * math.sin(turn), 0))
    outline = polygon(points) if rng.random() < 0.5 else wire_of(edge_of(interpolated(points, True)))
    blank = prism(face_in(outline), 0, 0, rng.uniform(1, 4))
    bored = cut(blank, cylinder(1.5, 20))
    return cut(bored, moved(box(1, 1, 20), (1.5, 0, 0)))


def bosses(rng):
    """A hollow case with ribs and bosses: booleans on a shell."""
    case = BRepOffsetAPI_MakeThickSolid()
    block = box(10, 8, 5)
    maker = BRepFilletAPI_MakeFillet(block)
    for edge in rng.sample(edges_of(block), 5):
        maker.Add(0.8, edge)
    block = maker.Shape()
    top = max(faces_of(block), key=top_of)
    case.MakeThickSolidByJoin(block, listed([top]), -0.4, 1e-4, BRepOffset_Mode.BRepOffset_Skin, False, False, ROUND)
    shape = case.Shape()
    for x in (-3, 3):
        shape = fuse(shape, moved(cylinder(rng.uniform(0.5, 1), 4), (x, rng.uniform(-1, 1), -0.5)))
        shape = cut(shape, moved(cylinder(0.3, 20), (x, rng.uniform(-1, 1), 0)))
    return shape


def top_of(face):
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    around = Bnd_Box()
    BRepBndLib.Add_s(face, around)
    return around.CornerMin().Z()


def conics(rng):
    """Cones and cylinders cut askew: ellipses, parabolas, hyperbolas for edges."""
    cone = BRepPrimAPI_MakeCone(4, 0, 6).Shape()
    half = math.atan2(4, 6)
    tilt = rng.choice([0.0, half, math.pi / 2 - rng.uniform(0.1, 0.5), rng.uniform(0, 1.5)])
    return cut(cone, moved(box(20, 20, 20), (10 + rng.uniform(0.3, 1.5), 0, 2), Y, tilt))


def voids(rng):
    outer = rng.choice([box(10, 10, 10), cylinder(6, 10), BRepPrimAPI_MakeSphere(7).Shape()])
    inner = moved(rng.choice([box(2, 2, 2), BRepPrimAPI_MakeSphere(1.5).Shape(), BRepPrimAPI_MakeTorus(2, 0.7).Shape()]),
                  (0.5, 0.3, rng.uniform(-1, 1)))
    shape = cut(outer, inner)
    return cut(shape, moved(BRepPrimAPI_MakeSphere(0.6).Shape(), (-3, -2, -2))) if rng.random() < 0.5 else shape


def non_manifold(rng):
    """Solids that touch in an edge or in a point, and pieces that share a face."""
    other = moved(box(4, 4, 4), rng.choice([(4, 4, 0), (4, 4, 4), (4, 1, 1)]))
    kind = rng.randrange(3)
    if kind == 0:
        return fuse(box(4, 4, 4), other)
    if kind == 1:
        return fuse(cylinder(2, 4), moved(cylinder(2, 4), (4, 0, 0)))
    tool = BRepAlgoAPI_Splitter()
    tool.SetArguments(listed([box(6, 6, 6)]))
    tool.SetTools(listed([placed(rng, cylinder(2, 20), 1)]))
    tool.Build()
    return tool.Shape()


def unified(rng):
    """Boolean results whose faces of one surface are joined: full faces with several bounds."""
    shape = rng.choice([booleans, tangent, seams, divided])(rng)
    tool = ShapeUpgrade_UnifySameDomain(shape, True, True, rng.random() < 0.3)
    tool.Build()
    return tool.Shape()


def stretched(rng):
    """Scaled unevenly, so that circles become splines."""
    stretch = gp_GTrsf()
    for i in range(3):
        stretch.SetValue(i + 1, i + 1, rng.uniform(0.4, 2))
    return BRepBuilderAPI_GTransform(rng.choice([booleans, poles, seams, fillets])(rng), stretch, True).Shape()


def mirrored(rng):
    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(1, 2, 3), direction(rng)))
    return BRepBuilderAPI_Transform(rng.choice([booleans, fillets, revolved, springs, seams])(rng), mirror, True).Shape()


def evolved(rng):
    spine = polygon(ring(rng, 4, 6, spread=0.1))
    profile = wire_of(BRepBuilderAPI_MakeEdge(ORIGIN, gp_Pnt(0.8, 0.0, 0.5)).Edge(),
                      BRepBuilderAPI_MakeEdge(gp_Pnt(0.8, 0.0, 0.5), gp_Pnt(0.8, 0, 2)).Edge())
    return BRepOffsetAPI_MakeEvolved(spine, profile, ROUND, True, rng.random() < 0.5).Shape()


def scaled(shape, factor, far=0.0):
    transform = gp_Trsf()
    transform.SetScale(ORIGIN, factor)
    return moved(BRepBuilderAPI_Transform(shape, transform, True).Shape(), (far, -far, far / 2))


def plain(rng):
    return rng.choice([booleans, fillets, revolved, seams, poles, lofts, extruded])(rng)


def tiny(rng):
    return scaled(plain(rng), rng.choice([1e-3, 1e-4, 1e-5]))


def huge(rng):
    return scaled(plain(rng), rng.choice([1e4, 1e5]))


def far_away(rng):
    return scaled(plain(rng), 1.0, rng.choice([1e4, 1e6]))


def solids_of(shape):
    return shapes_of(shape, TopAbs_SOLID)


FAMILIES = {family.__name__: family for family in (
    booleans, tangent, fillets, variable_fillets, chamfers, hollowed, lofts, ruled_lofts, pipes, springs, threads, revolved,
    revolved_sections, extruded, drafts, offsets, ruled, free_forms, swept_surfaces, nurbs, divided, open_shells, compounds,
    touching_wires, seams, drilled, blended, carved, embossed, gears, bosses, poles, apexes, conics, voids, non_manifold, unified, stretched, mirrored, evolved, tiny, huge,
    far_away)}
