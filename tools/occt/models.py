"""Makes random shapes with the modeling algorithms of OpenCASCADE.

`FAMILIES` maps the name of a family to its function. The function takes a random number generator and returns a shape. Nothing is
written here; `modeled.py` writes the files. Modeling may fail, and then the exception of OpenCASCADE passes through.
"""
from __future__ import annotations

import math

from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Splitter
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_GTransform,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_NurbsConvert,
    BRepBuilderAPI_Transform,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepOffset import BRepOffset_Mode
from OCP.BRepOffsetAPI import BRepOffsetAPI_DraftAngle, BRepOffsetAPI_MakeOffsetShape, BRepOffsetAPI_MakeThickSolid
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_GTrsf, gp_Pln, gp_Pnt, gp_Trsf, gp_Vec
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideArea, ShapeUpgrade_ShapeDivideClosed, ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from pieces import (
    ORIGIN,
    ROUND,
    SHARP,
    TAU,
    X,
    Y,
    Z,
    base_solid,
    box,
    common,
    compound,
    cut,
    cylinder,
    direction,
    edges_of,
    face_in,
    faces_of,
    fuse,
    listed,
    moved,
    placed,
    polygon,
    primitive,
    prism,
    ring,
    section,
    sewn,
    shapes_of,
)
from swept import (
    evolved,
    extruded,
    free_forms,
    gears,
    lofts,
    pipes,
    revolved,
    revolved_sections,
    ruled,
    ruled_lofts,
    springs,
    swept_surfaces,
    threads,
)


def booleans(rng):
    """Returns a random boolean combination of two to five primitives."""
    shape = placed(rng, primitive(rng), 1)
    for _ in range(rng.randrange(1, 5)):
        operation = rng.choice([cut, cut, fuse, fuse, common])
        shape = operation(shape, placed(rng, primitive(rng), 3))
    return shape


def tangent(rng):
    """Returns a combination of two solids that touch along a curve or in a point, either exactly or within a small distance."""
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
        lid = moved(box(14, 14, 4), (0, 0, 2 + radius + off - rng.choice([0, 4])))
        pair = BRepPrimAPI_MakeTorus(4, radius).Shape(), lid
    return rng.choice([cut, fuse, fuse])(*pair)


def fillets(rng):
    """Returns a solid with fillets of one radius on some of its edges."""
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeFillet(shape)
    edges = edges_of(shape)
    radius = rng.uniform(0.1, 0.7)
    for edge in rng.sample(edges, rng.randrange(1, len(edges) + 1)):
        maker.Add(radius, edge)
    return maker.Shape()


def variable_fillets(rng):
    """Returns a solid with two fillets whose radius changes along the edge."""
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in rng.sample(edges_of(shape), 2):
        maker.Add(rng.uniform(0.1, 0.5), rng.uniform(0.5, 1.0), edge)
    return maker.Shape()


def chamfers(rng):
    """Returns a solid with chamfers on some of its edges."""
    shape = base_solid(rng)
    maker = BRepFilletAPI_MakeChamfer(shape)
    edges = edges_of(shape)
    for edge in rng.sample(edges, rng.randrange(1, len(edges) + 1)):
        maker.Add(rng.uniform(0.1, 0.6), edge)
    return maker.Shape()


def hollowed(rng):
    """Returns a hollow solid: its walls have a thickness, and one or two of its faces are removed."""
    shape = fillets(rng) if rng.random() < 0.4 else base_solid(rng)
    opened = rng.sample(faces_of(shape), rng.choice([1, 1, 2]))
    maker = BRepOffsetAPI_MakeThickSolid()
    thick = rng.choice([-0.3, -0.15, 0.25])
    maker.MakeThickSolidByJoin(shape, listed(opened), thick, 1e-4, BRepOffset_Mode.BRepOffset_Skin, False, False,
                               rng.choice([ROUND, SHARP]))
    return maker.Shape()


def drafts(rng):
    """Returns a prism or cylinder with some of its side faces inclined."""
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
    """Returns a solid whose faces are all offset."""
    shape = rng.choice([base_solid, extruded, revolved, booleans])(rng)
    maker = BRepOffsetAPI_MakeOffsetShape()
    maker.PerformByJoin(shape, rng.choice([0.3, -0.2, 0.1]), 1e-4, BRepOffset_Mode.BRepOffset_Skin, False, False,
                        rng.choice([ROUND, SHARP]))
    return maker.Shape()


def nurbs(rng):
    """Returns a shape whose surfaces are all converted to NURBS."""
    family = rng.choice([booleans, tangent, fillets, revolved, revolved_sections, seams, poles, apexes, extruded])
    return BRepBuilderAPI_NurbsConvert(family(rng), True).Shape()


def divided(rng):
    """Returns a shape that a plane divides into pieces with common faces, or one whose closed or large faces are divided."""
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
    """Returns a shell from which one to three faces of a solid are missing."""
    shape = rng.choice([booleans, fillets, lofts, seams])(rng)
    faces = faces_of(shape)
    return sewn(*rng.sample(faces, max(1, len(faces) - rng.randrange(1, 4))))


def compounds(rng):
    """Returns a compound of two to four shapes side by side."""
    family = [booleans, fillets, revolved, free_forms, seams, poles, open_shells]
    return compound(moved(rng.choice(family)(rng), (25.0 * i, 0, 0)) for i in range(rng.randrange(2, 5)))


def touching_wires(rng):
    """Returns a plate with holes whose wires touch each other, or the outer wire, in a vertex."""
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
    """Returns a tube, cone, torus or sphere that is cut along, through and across the seam of its closed face."""
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
    """Returns a sphere that is trimmed over, at and near its poles."""
    kind = rng.randrange(6)
    low, high = sorted((rng.uniform(-1.5, 1.5), rng.choice([math.pi / 2, rng.uniform(-1, 1.5)])))
    if kind == 0:
        return BRepPrimAPI_MakeSphere(gp_Ax2(ORIGIN, Z), 4, low, high, rng.choice([TAU, 2.0, math.pi])).Shape()
    axis, angle = rng.choice([X, Y, Z]), rng.choice([0.0, math.pi / 2, rng.uniform(0, 6)])
    ball = moved(BRepPrimAPI_MakeSphere(4).Shape(), axis=axis, angle=angle)
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
    """Returns a cone that ends in its apex, or one that is cut at or near it."""
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
    """Returns a body of revolution with holes all around."""
    body = rng.choice([lambda: cylinder(3, 10), lambda: BRepPrimAPI_MakeCone(4, 2, 8).Shape(), lambda: revolved(rng),
                       lambda: BRepPrimAPI_MakeTorus(5, 2).Shape(), lambda: BRepPrimAPI_MakeSphere(4).Shape(),
                       lambda: BRepPrimAPI_MakeTorus(5, 2).Shape()])()
    if rng.random() < 0.3:
        body = BRepBuilderAPI_NurbsConvert(body, True).Shape()
    n, depth = rng.randrange(3, 9), rng.uniform(3, 6)
    for i in range(n):
        hole = moved(BRepPrimAPI_MakeCylinder(rng.uniform(0.3, 0.9), 10).Shape(), axis=Y, angle=rng.uniform(0.7, 2.4))
        hole = moved(hole, (depth if rng.random() < 0.7 else 1.0, 0, rng.uniform(-1, 2)))
        body = cut(body, moved(hole, axis=Z, angle=TAU * i / n + rng.uniform(0, 0.3)))
    return body


def blended(rng):
    """Returns fillets and chamfers between curved faces, some of which consume a whole face."""
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
    """Returns a loft, pipe or free form with one or two boolean combinations."""
    shape = rng.choice([lofts, ruled_lofts, pipes, springs, revolved_sections, evolved, extruded])(rng)
    if not solids_of(shape):
        raise ValueError("there is nothing to carve")
    for _ in range(rng.randrange(1, 3)):
        shape = rng.choice([cut, cut, fuse])(shape, placed(rng, primitive(rng), 3))
    return shape


def embossed(rng):
    """Returns a body of revolution with stamps of random outlines that are cut into it or added to it."""
    body = rng.choice([cylinder(4, 10), BRepPrimAPI_MakeSphere(4.5).Shape(), BRepPrimAPI_MakeCone(5, 3, 8).Shape()])
    stamp = moved(prism(face_in(section(rng, 0, rng.uniform(0.5, 1.2))), 0, 0, 3), (3, 0, 1), Y, math.pi / 2)
    for i in range(rng.randrange(1, 4)):
        body = rng.choice([cut, fuse])(body, moved(stamp, axis=Z, angle=i * 1.3 + rng.choice([0, 0.4])))
    return body


def bosses(rng):
    """Returns a hollow case with bosses and holes, made by booleans on a hollow solid."""
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
    """Returns the lowest z of a face's bounding box."""
    around = Bnd_Box()
    BRepBndLib.Add_s(face, around)
    return around.CornerMin().Z()


def conics(rng):
    """Returns a cone that a tilted plane cuts, so that edges are ellipses, parabolas or hyperbolas."""
    cone = BRepPrimAPI_MakeCone(4, 0, 6).Shape()
    half = math.atan2(4, 6)
    tilt = rng.choice([0.0, half, math.pi / 2 - rng.uniform(0.1, 0.5), rng.uniform(0, 1.5)])
    return cut(cone, moved(box(20, 20, 20), (10 + rng.uniform(0.3, 1.5), 0, 2), Y, tilt))


def voids(rng):
    """Returns a solid with one or two cavities."""
    outer = rng.choice([box(10, 10, 10), cylinder(6, 10), BRepPrimAPI_MakeSphere(7).Shape()])
    inner = rng.choice([box(2, 2, 2), BRepPrimAPI_MakeSphere(1.5).Shape(), BRepPrimAPI_MakeTorus(2, 0.7).Shape()])
    inner = moved(inner, (0.5, 0.3, rng.uniform(-1, 1)))
    shape = cut(outer, inner)
    return cut(shape, moved(BRepPrimAPI_MakeSphere(0.6).Shape(), (-3, -2, -2))) if rng.random() < 0.5 else shape


def non_manifold(rng):
    """Returns solids that touch in an edge or a point, or pieces that share a face."""
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
    """Returns a boolean result whose faces on the same surface are joined. Such faces can be closed and have several bounds."""
    shape = rng.choice([booleans, tangent, seams, divided])(rng)
    tool = ShapeUpgrade_UnifySameDomain(shape, True, True, rng.random() < 0.3)
    tool.Build()
    return tool.Shape()


def stretched(rng):
    """Returns a shape that is scaled unevenly, so that its circles become splines."""
    stretch = gp_GTrsf()
    for i in range(3):
        stretch.SetValue(i + 1, i + 1, rng.uniform(0.4, 2))
    return BRepBuilderAPI_GTransform(rng.choice([booleans, poles, seams, fillets])(rng), stretch, True).Shape()


def mirrored(rng):
    """Returns a mirrored shape."""
    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(1, 2, 3), direction(rng)))
    shape = rng.choice([booleans, fillets, revolved, springs, seams])(rng)
    return BRepBuilderAPI_Transform(shape, mirror, True).Shape()


def scaled(shape, factor, far=0.0):
    """Returns a shape that is scaled, and moved by a distance."""
    transform = gp_Trsf()
    transform.SetScale(ORIGIN, factor)
    return moved(BRepBuilderAPI_Transform(shape, transform, True).Shape(), (far, -far, far / 2))


def plain(rng):
    """Returns a shape of a common family."""
    return rng.choice([booleans, fillets, revolved, seams, poles, lofts, extruded])(rng)


def tiny(rng):
    """Returns a shape that is scaled down by 1e3 to 1e5."""
    return scaled(plain(rng), rng.choice([1e-3, 1e-4, 1e-5]))


def huge(rng):
    """Returns a shape that is scaled up by 1e4 or 1e5."""
    return scaled(plain(rng), rng.choice([1e4, 1e5]))


def far_away(rng):
    """Returns a shape that is moved far from the origin."""
    return scaled(plain(rng), 1.0, rng.choice([1e4, 1e6]))


def beside_origin(solid):
    """Returns the solid, moved so that its bounding box starts at the origin."""
    around, move = Bnd_Box(), gp_Trsf()
    BRepBndLib.Add_s(solid, around)
    move.SetTranslation(gp_Vec(around.CornerMin(), ORIGIN))
    return TopoDS.Solid(solid.Moved(TopLoc_Location(move)))


def solids_of(shape):
    """Returns the distinct solids of a shape."""
    return shapes_of(shape, TopAbs_SOLID)


FAMILIES = {family.__name__: family for family in (
    booleans, tangent, fillets, variable_fillets, chamfers, hollowed, lofts, ruled_lofts, pipes, springs,
    threads, revolved, revolved_sections, extruded, drafts, offsets, ruled, free_forms, swept_surfaces, nurbs,
    divided, open_shells, compounds, touching_wires, seams, drilled, blended, carved, embossed, gears, bosses,
    poles, apexes, conics, voids, non_manifold, unified, stretched, mirrored, evolved, tiny, huge, far_away)}
