"""Builds the small pieces of random models: points, curves, wires, faces and plain solids of OpenCASCADE.

`swept.py` and `models.py` combine these pieces.
"""
from __future__ import annotations

import math
from random import Random

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepLib import BRepLib
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
    BRepPrimAPI_MakeWedge,
)
from OCP.collections import (
    HArray1_gp_Pnt,
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap,
    List_TopoDS_Shape,
)
from OCP.Geom import Geom_ConicalSurface, Geom_CylindricalSurface
from OCP.Geom2d import Geom2d_Line
from OCP.GeomAbs import GeomAbs_JoinType
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Circ, gp_Dir, gp_Dir2d, gp_Elips, gp_Pnt, gp_Pnt2d, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Shell

TAU = 2 * math.pi
ORIGIN, X, Y, Z = gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0), gp_Dir(0, 1, 0), gp_Dir(0, 0, 1)
UP = gp_Ax2(ORIGIN, Z)
ROUND, SHARP = GeomAbs_JoinType.GeomAbs_Arc, GeomAbs_JoinType.GeomAbs_Intersection


def shapes_of(shape, kind):
    """Returns the distinct subshapes of one kind."""
    found = ShapeMap()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i + 1) for i in range(found.Extent())]


def faces_of(shape):
    """Returns the distinct faces of a shape."""
    return [TopoDS.Face(face) for face in shapes_of(shape, TopAbs_FACE)]


def edges_of(shape):
    """Returns the distinct edges of a shape, without degenerate ones."""
    edges = [TopoDS.Edge(edge) for edge in shapes_of(shape, TopAbs_EDGE)]
    return [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]


def listed(shapes):
    """Returns the shapes as a list of OpenCASCADE."""
    result = List_TopoDS_Shape()
    for shape in shapes:
        result.Append(shape)
    return result


def array(kind, values):
    """Returns the values as an array of OpenCASCADE of this type."""
    result = kind(1, len(values))
    for i, value in enumerate(values):
        result.SetValue(i + 1, value)
    return result


def grid(kind, rows):
    """Returns the rows of values as a two-dimensional array of OpenCASCADE of this type."""
    result = kind(1, len(rows), 1, len(rows[0]))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            result.SetValue(i + 1, j + 1, value)
    return result


def compound(shapes):
    """Returns a compound of the shapes."""
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def moved(shape, vector=(0, 0, 0), axis=None, angle=0.0):
    """Returns the shape, rotated around an axis through the origin and then translated."""
    move, turn = gp_Trsf(), gp_Trsf()
    move.SetTranslation(gp_Vec(*vector))
    if axis is not None:
        turn.SetRotation(gp_Ax1(ORIGIN, axis), angle)
    return BRepBuilderAPI_Transform(shape, move.Multiplied(turn), True).Shape()


def direction(rng: Random):
    """Returns a random direction, uniform on the sphere."""
    z, turn = rng.uniform(-1, 1), rng.uniform(0, TAU)
    across = math.sqrt(1 - z * z)
    return gp_Dir(across * math.cos(turn), across * math.sin(turn), z)


def placed(rng: Random, shape, reach=4.0):
    """Returns the shape at a random location near the origin. Half of the time, its axes are parallel to the coordinate axes."""
    at = [rng.uniform(-reach, reach) for _ in range(3)]
    if rng.random() < 0.5:
        return moved(shape, [round(x) for x in at], rng.choice([X, Y, Z]), rng.randrange(4) * math.pi / 2)
    return moved(shape, at, direction(rng), rng.uniform(0, TAU))


def box(a, b, c):
    """Returns a box with these edge lengths, centered on the origin."""
    return BRepPrimAPI_MakeBox(gp_Pnt(-a / 2, -b / 2, -c / 2), a, b, c).Shape()


def cylinder(radius, height, angle=TAU):
    """Returns a cylinder around the z axis, centered on the origin."""
    return moved(BRepPrimAPI_MakeCylinder(radius, height, angle).Shape(), (0, 0, -height / 2))


def primitive(rng: Random):
    """Returns a random box, cylinder, cone, sphere, torus or wedge."""
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
    """Returns the result of a boolean operation. Raises ValueError if it is empty."""
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
    """Returns a spline through the points."""
    held = HArray1_gp_Pnt(1, len(points))
    for i, point in enumerate(points):
        held.SetValue(i + 1, point)
    tool = GeomAPI_Interpolate(held, is_periodic, 1e-7)
    tool.Perform()
    return tool.Curve()


def edge_of(curve):
    """Returns an edge along a whole curve."""
    return BRepBuilderAPI_MakeEdge(curve).Edge()


def wire_of(*edges):
    """Returns a wire of the edges."""
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges:
        maker.Add(edge)
    return maker.Wire()


def polygon(points):
    """Returns a closed wire of lines through the points."""
    maker = BRepBuilderAPI_MakePolygon()
    for point in points:
        maker.Add(point)
    maker.Close()
    return maker.Wire()


def ring(rng: Random, n, radius, z=0.0, spread=0.25, turn=0.0):
    """Returns points around the z axis at random distances from it."""
    far = [radius * rng.uniform(1 - spread, 1 + spread) for _ in range(n)]
    return [gp_Pnt(r * math.cos(turn + TAU * i / n), r * math.sin(turn + TAU * i / n), z) for i, r in enumerate(far)]


def circle(radius, z=0.0):
    """Returns a circle around the z axis as a wire."""
    return wire_of(BRepBuilderAPI_MakeEdge(gp_Circ(gp_Ax2(gp_Pnt(0, 0, z), Z), radius)).Edge())


def section(rng: Random, z=0.0, radius=None, n=None):
    """Returns a closed wire around the z axis: a polygon, spline, circle or ellipse."""
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
    """Returns the plane face inside a wire, without the holes."""
    maker = BRepBuilderAPI_MakeFace(wire, True)
    for hole in holes:
        maker.Add(TopoDS.Wire(hole.Reversed()))
    return maker.Face()


def prism(shape, x, y, z):
    """Returns the shape that is swept along a vector."""
    return BRepPrimAPI_MakePrism(shape, gp_Vec(x, y, z)).Shape()


def helix(radius, pitch, turns, slope=0.0):
    """Returns an edge along a helix on a cylinder, or on a cone if there is a slope."""
    axes = gp_Ax3(ORIGIN, Z)
    surface = Geom_ConicalSurface(axes, slope, radius) if slope else Geom_CylindricalSurface(axes, radius)
    rise = pitch / math.cos(slope)
    line = Geom2d_Line(gp_Pnt2d(0, 0), gp_Dir2d(TAU, rise))
    edge = BRepBuilderAPI_MakeEdge(line, surface, 0.0, turns * math.hypot(TAU, rise)).Edge()
    BRepLib.BuildCurves3d_s(edge)
    return edge


def base_solid(rng: Random):
    """Returns a plain solid with edges, to which other operations are applied."""
    kind = rng.randrange(4)
    if kind == 0:
        return box(rng.uniform(4, 9), rng.uniform(4, 9), rng.uniform(4, 9))
    if kind == 1:
        return cylinder(rng.uniform(2, 5), rng.uniform(3, 8))
    if kind == 2:
        return prism(face_in(polygon(ring(rng, rng.randrange(5, 8), 4))), 0, 0, rng.uniform(3, 6))
    block = box(8, 8, rng.uniform(3, 6))
    return cut(block, moved(cylinder(rng.uniform(1, 2.5), 20), (rng.uniform(-1, 1), rng.uniform(-1, 1), 0)))


def sewn(*shapes):
    """Returns one shell of the faces. Edges at the same position become one edge."""
    tool = BRepBuilderAPI_Sewing(1e-6)
    for shape in shapes:
        tool.Add(shape)
    tool.Perform()
    if shapes_of(tool.SewedShape(), TopAbs_SHELL):
        return TopoDS.Shell(shapes_of(tool.SewedShape(), TopAbs_SHELL)[0])
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    builder.Add(shell, tool.SewedShape())
    return shell
