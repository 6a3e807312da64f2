//! Repeats the faces and triangles of a shape at every occurrence of its products in the assembly.
//!
//! A product is meshed once. Its occurrences have the same triangles, areas and angles, up to the rounding of the motion.

use crate::model::{Brep, BrepFace, InstanceStyle, LostEntity, LostKind};
use crate::motion::{Matrix, inverse, is_mirror, moved_direction, moved_point, product, scale_of};
use crate::tessellation::{Tessellation, TessellationOptions, tessellate};
use partprobe_shape::{Edge, Face, Instance, Mesh, Point, SurfaceAttributes, bounding_diagonal};

/// The first occurrence of each component, at which its faces are. [`partprobe_shape::Face::instance`] of a shape without
/// repetitions is an index into this list.
#[must_use]
pub fn first_instances(brep: &Brep) -> Vec<Instance> {
    brep.components
        .iter()
        .filter_map(|component| component.occurrences.first().cloned())
        .collect()
}

/// The shape with all occurrences, and the list of them that its faces refer to.
///
/// The faces of the plain shape come first and keep their order. The repeated faces follow, component by component. The chord
/// tolerance is that of the whole assembly's diagonal. Occurrences that would bring the mesh above `options.max_triangles` are
/// lost and counted.
#[must_use]
pub fn tessellate_instances(
    brep: &Brep,
    options: &TessellationOptions,
) -> (Tessellation, Vec<Instance>) {
    let grown = growth(brep);
    let options = TessellationOptions {
        chord_fraction: options.chord_fraction * grown,
        ..*options
    };
    let mut whole = tessellate(brep, &options);
    whole.diagonal_mm *= grown;
    let plain = Extent {
        n_faces: whole.graph.faces.len(),
        n_edges: whole.graph.edges.len(),
        mesh: whole.mesh.clone(),
        attributes: whole.attributes.clone(),
    };
    let mut instances = first_instances(brep);
    let mut n_left_out = 0;
    for (component, of) in (0u32..).zip(&brep.components) {
        let Some(motions) = motions_from_first(&of.occurrences) else {
            continue;
        };
        let piece = Piece::of(&whole, &plain, component);
        let further = of.occurrences.iter().zip(&of.styles).skip(1);
        for ((instance, style), motion) in further.zip(motions) {
            let n_triangles = (whole.mesh.triangles.len() + piece.triangles.len()) as u64;
            if n_triangles > options.max_triangles {
                n_left_out += 1;
                continue;
            }
            let first_face = whole.graph.faces.len();
            piece.repeat(&mut whole, &plain, instances.len() as u32, &motion);
            let sources = piece.faces.iter().map(|&face| &brep.faces[face as usize]);
            whole.graph.faces[first_face..]
                .iter_mut()
                .zip(sources)
                .for_each(|(face, of)| restyle(face, of, style));
            instances.push(instance.clone());
        }
    }
    whole.is_over_budget |= n_left_out > 0;
    if n_left_out > 0 {
        let reason = format!(
            "{n_left_out} occurrences were left out; raise the triangle budget or the tolerances"
        );
        whole.lost.push(LostEntity {
            kind: LostKind::Entity,
            step_id: 0,
            reason,
        });
    }
    (whole, instances)
}

/// The ratio of the diagonal with all occurrences to the diagonal with the first ones only.
fn growth(brep: &Brep) -> f64 {
    let mut corners: Vec<Vec<Point>> = vec![Vec::new(); brep.components.len()];
    for face in &brep.faces {
        let component = brep.shells[face.shell as usize].component as usize;
        for boundary in &face.loops {
            let points = &mut corners[component];
            match boundary {
                crate::model::Loop::Edges(uses) => points.extend(uses.iter().map(|edge_use| {
                    brep.vertices[brep.edges[edge_use.edge as usize].start as usize].point
                })),
                crate::model::Loop::Vertex(vertex) => {
                    points.push(brep.vertices[*vertex as usize].point)
                }
            }
        }
    }
    let once = bounding_diagonal(&corners.concat());
    for (points, component) in corners.iter_mut().zip(&brep.components) {
        let n_points = points.len();
        for motion in motions_from_first(&component.occurrences)
            .into_iter()
            .flatten()
        {
            points.extend_from_within(..n_points);
            let moved = points.len() - n_points;
            points[moved..]
                .iter_mut()
                .for_each(|point| *point = moved_point(&motion, *point));
        }
    }
    let all = bounding_diagonal(&corners.concat());
    if once > 0.0 && all.is_finite() {
        all / once
    } else {
        1.0
    }
}

/// The motions from the first occurrence to each further one. Returns `None` if the motion of the first one cannot be inverted.
fn motions_from_first(occurrences: &[Instance]) -> Option<Vec<Matrix>> {
    let back = inverse(&occurrences.first()?.transform)?;
    Some(
        occurrences[1..]
            .iter()
            .map(|instance| product(&instance.transform, &back))
            .collect(),
    )
}

/// The sizes and the mesh of the plain shape.
struct Extent {
    n_faces: usize,
    n_edges: usize,
    mesh: Mesh,
    attributes: SurfaceAttributes,
}

/// The faces of one component, with their edges, vertices and triangles.
struct Piece {
    /// Indices of the faces in the plain shape.
    faces: Vec<u32>,
    /// For each face of the plain shape, its index in `faces`.
    face_index: Vec<Option<u32>>,
    edges: Vec<Edge>,
    vertices: Vec<u32>,
    /// For each vertex of the plain mesh, its index in `vertices`.
    vertex_index: Vec<u32>,
    triangles: Vec<u32>,
}

impl Piece {
    fn of(whole: &Tessellation, plain: &Extent, component: u32) -> Self {
        let mut face_index = vec![None; plain.n_faces];
        let mut faces = Vec::new();
        for (idx, face) in (0u32..).zip(&whole.graph.faces[..plain.n_faces]) {
            if face.instance == component {
                face_index[idx as usize] = Some(faces.len() as u32);
                faces.push(idx);
            }
        }
        let is_here = |face: u32| face_index[face as usize].is_some();
        let edges = whole.graph.edges[..plain.n_edges]
            .iter()
            .filter(|edge| edge.faces.into_iter().all(is_here));
        let edges = edges.copied().collect();
        let mut vertex_index = vec![0; plain.mesh.vertices.len()];
        let mut vertices = Vec::new();
        for (idx, &face) in (0u32..).zip(&plain.mesh.vertex_face) {
            if is_here(face) {
                vertex_index[idx as usize] = vertices.len() as u32;
                vertices.push(idx);
            }
        }
        let triangles = (0u32..)
            .zip(&plain.mesh.tri_face)
            .filter(|&(_, &face)| is_here(face));
        let triangles = triangles.map(|(idx, _)| idx).collect();
        Self {
            faces,
            face_index,
            edges,
            vertices,
            vertex_index,
            triangles,
        }
    }

    /// Adds a moved copy of the piece.
    fn repeat(&self, whole: &mut Tessellation, plain: &Extent, instance: u32, motion: &Matrix) {
        let scale = scale_of(motion);
        let first_face = whole.graph.faces.len() as u32;
        for &face in &self.faces {
            let face = &whole.graph.faces[face as usize];
            let repeated = Face {
                instance,
                area: face.area * scale * scale,
                ..face.clone()
            };
            whole.graph.faces.push(repeated);
        }
        let new_face = |face: u32| first_face + self.face_index[face as usize].unwrap_or(0);
        let moved = self.edges.iter().map(|edge| Edge {
            faces: edge.faces.map(new_face),
            length: edge.length * scale,
            ..*edge
        });
        whole.graph.edges.extend(moved);
        let first_vertex = whole.mesh.vertices.len() as u32;
        for &vertex in &self.vertices {
            let vertex = vertex as usize;
            whole
                .mesh
                .vertices
                .push(moved_point(motion, plain.mesh.vertices[vertex]));
            whole
                .mesh
                .vertex_face
                .push(new_face(plain.mesh.vertex_face[vertex]));
            if let Some(&normal) = plain.mesh.vertex_normal.get(vertex) {
                whole
                    .mesh
                    .vertex_normal
                    .push(moved_direction(motion, scale, normal));
            }
            repeat_attributes(&mut whole.attributes, &plain.attributes, vertex, motion);
        }
        let is_mirror = is_mirror(motion);
        for &triangle in &self.triangles {
            let triangle = triangle as usize;
            let corner = |corner: u32| first_vertex + self.vertex_index[corner as usize];
            let [a, b, c] = plain.mesh.triangles[triangle].map(corner);
            whole
                .mesh
                .triangles
                .push(if is_mirror { [a, c, b] } else { [a, b, c] });
            whole
                .mesh
                .tri_face
                .push(new_face(plain.mesh.tri_face[triangle]));
        }
    }
}

/// Gives a repeated face the style of its occurrence if the face in the file has no style.
fn restyle(face: &mut Face, source: &BrepFace, style: &InstanceStyle) {
    face.color = source.color.or(style.color);
    face.layer = source.layer.clone().or_else(|| style.layer.clone());
}

/// Adds the attributes of a moved copy of a vertex. Parameters stay the same, and curvatures are divided by the scale.
fn repeat_attributes(
    all: &mut SurfaceAttributes,
    plain: &SurfaceAttributes,
    vertex: usize,
    motion: &Matrix,
) {
    let scale = scale_of(motion);
    all.uv.extend(plain.uv.get(vertex));
    all.curvature.extend(
        plain
            .curvature
            .get(vertex)
            .map(|rows| rows.map(|k| (f64::from(k) / scale) as f32)),
    );
    let directions = plain.direction.get(vertex);
    all.direction
        .extend(directions.map(|rows| rows.map(|row| moved_direction(motion, scale, row))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{CUBE_POLYGONS, StepText, box_corners};
    use crate::read::{ReadBudget, read};

    const UP: Point = [0.0, 0.0, 1.0];

    /// Adds the product whose shape is a representation.
    fn product_of(text: &mut StepText, representation: usize, name: &str) {
        let product = text.add(format!("PRODUCT('{name}','{name}','',())"));
        let formation = text.add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let definition = text.add(format!("PRODUCT_DEFINITION('','',#{formation},$)"));
        let shape = text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        text.add(format!(
            "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"
        ));
    }

    /// A representation that holds another one at each of these positions, with `x` rotated into the given direction.
    fn holder(text: &mut StepText, child: usize, points: &[(Point, Point)]) -> usize {
        let origin = text.axes([0.0; 3], UP, [1.0, 0.0, 0.0]);
        let map = text.add(format!("REPRESENTATION_MAP(#{origin},#{child})"));
        let point = |&(at, x): &(Point, Point)| {
            let target = text.axes(at, UP, x);
            format!("#{}", text.add(format!("MAPPED_ITEM('',#{map},#{target})")))
        };
        let items: Vec<String> = points.iter().map(point).collect();
        text.add(format!("SHAPE_REPRESENTATION('',({}),#1)", items.join(",")))
    }

    /// A unit cube twice in a pair, and the pair twice in a whole.
    fn pairs_of_cubes() -> Brep {
        let mut text = StepText::in_millimeters();
        let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
        let [_, solid] = text.solid(&faces);
        let cube = solid + 1;
        let pair = holder(
            &mut text,
            cube,
            &[
                ([0.0; 3], [1.0, 0.0, 0.0]),
                ([5.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ],
        );
        let whole = holder(
            &mut text,
            pair,
            &[
                ([0.0; 3], [1.0, 0.0, 0.0]),
                ([0.0, 0.0, 9.0], [1.0, 0.0, 0.0]),
            ],
        );
        for (representation, name) in [(cube, "cube"), (pair, "a/pair"), (whole, "whole")] {
            product_of(&mut text, representation, name);
        }
        read(&text.bytes(), &ReadBudget::default()).unwrap()
    }

    fn center(shape: &Tessellation, instance: u32) -> Point {
        let is_here = |face: &u32| shape.graph.faces[*face as usize].instance == instance;
        let mesh = &shape.mesh;
        let here = mesh
            .vertices
            .iter()
            .zip(&mesh.vertex_face)
            .filter(|(_, face)| is_here(face));
        let points: Vec<Point> = here.map(|(&point, _)| point).collect();
        [0, 1, 2]
            .map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64)
    }

    #[test]
    fn every_occurrence_has_its_position_and_its_path() {
        let brep = pairs_of_cubes();
        let (shape, instances) = tessellate_instances(&brep, &TessellationOptions::default());
        assert_eq!(shape.graph.faces.len(), 24);
        assert_eq!(
            (shape.graph.edges.len(), shape.mesh.triangles.len()),
            (48, 48)
        );
        assert!(
            instances
                .iter()
                .all(|instance| instance.path == "whole/a_pair/cube")
        );
        // The second cube is rotated by 90° about its corner at x = 5.
        let expected = [
            [0.5, 0.5, 0.5],
            [4.5, 0.5, 0.5],
            [0.5, 0.5, 9.5],
            [4.5, 0.5, 9.5],
        ];
        let mut found: Vec<Point> = (0..4).map(|instance| center(&shape, instance)).collect();
        found.sort_by(|a, b| a[2].total_cmp(&b[2]).then(a[0].total_cmp(&b[0])));
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                partprobe_shape::distance(*found, expected) < 1e-12,
                "{found:?}"
            );
        }
        assert!(
            (shape.diagonal_mm - f64::sqrt(25.0 + 1.0 + 100.0)).abs() < 1e-9,
            "{}",
            shape.diagonal_mm
        );
        assert!((shape.chord_mm - 0.002 * shape.diagonal_mm).abs() < 1e-12);
        for pair in shape.graph.edges.windows(2) {
            assert!(pair[0].faces <= pair[1].faces);
        }
    }

    #[test]
    fn the_plain_shape_stands_at_the_first_occurrence() {
        let brep = pairs_of_cubes();
        let instances = first_instances(&brep);
        assert_eq!(
            (instances.len(), instances[0].product.as_deref()),
            (1, Some("cube"))
        );
        let plain = tessellate(&brep, &TessellationOptions::default());
        let (whole, all) = tessellate_instances(&brep, &TessellationOptions::default());
        assert_eq!(all[0], instances[0]);
        assert_eq!(whole.graph.faces[..6], plain.graph.faces);
        assert_eq!(
            partprobe_shape::distance(center(&plain, 0), center(&whole, 0)),
            0.0
        );
    }

    #[test]
    fn occurrences_beyond_the_budget_are_counted() {
        let options = TessellationOptions {
            max_triangles: 30,
            ..TessellationOptions::default()
        };
        let (shape, instances) = tessellate_instances(&pairs_of_cubes(), &options);
        assert_eq!((instances.len(), shape.mesh.triangles.len()), (2, 24));
        assert!(
            shape.lost[0].reason.contains("2 occurrences were left out"),
            "{:?}",
            shape.lost
        );
    }
}
