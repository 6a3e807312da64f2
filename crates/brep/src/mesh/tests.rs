//! Tests meshes of small hand-made shapes: closed-form areas and volumes, closed solids, laws under rigid motion.

use super::*;
use crate::geometry::{BsplineSurface, Curve, Frame, Surface, Transform};
use crate::model::{BrepEdge, BrepFace, EdgeUse, Loop, Shell, Solid, Vertex};
use partprobe_shape::{FaceType, SolidMesh, Units, dot, solid_mesh, subtract, weld};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const UP: Frame = Frame {
    origin: [0.0; 3],
    x: [1.0, 0.0, 0.0],
    y: [0.0, 1.0, 0.0],
    z: [0.0, 0.0, 1.0],
};

fn shape(points: &[Point]) -> Brep {
    Brep {
        vertices: points
            .iter()
            .map(|&point| Vertex { step_id: 0, point })
            .collect(),
        edges: Vec::new(),
        faces: Vec::new(),
        shells: vec![Shell {
            step_id: 0,
            solid: Some(0),
            component: 0,
        }],
        solids: vec![Solid {
            step_id: 0,
            name: None,
        }],
        components: Vec::new(),
        lost: Vec::new(),
        notes: Vec::new(),
        units: Units {
            length: "mm".into(),
            mm_per_unit: 1.0,
            angle: "radian".into(),
            rad_per_unit: 1.0,
        },
    }
}

impl Brep {
    fn circle(mut self, vertex: u32, radius: f64, height: f64) -> Self {
        let frame = Frame {
            origin: [0.0, 0.0, height],
            ..UP
        };
        let curve = Curve::Ellipse {
            frame,
            rx: radius,
            ry: radius,
        };
        self.edges.push(BrepEdge {
            step_id: 0,
            start: vertex,
            end: vertex,
            curve: Arc::new(curve),
            same_sense: true,
        });
        self
    }

    fn arc(mut self, start: u32, end: u32, frame: Frame, radius: f64) -> Self {
        let curve = Arc::new(Curve::Ellipse {
            frame,
            rx: radius,
            ry: radius,
        });
        self.edges.push(BrepEdge {
            step_id: 0,
            start,
            end,
            curve,
            same_sense: true,
        });
        self
    }

    fn line(mut self, start: u32, end: u32) -> Self {
        let origin = self.vertices[start as usize].point;
        let direction = subtract(self.vertices[end as usize].point, origin);
        let curve = Arc::new(Curve::Line { origin, direction });
        self.edges.push(BrepEdge {
            step_id: 0,
            start,
            end,
            curve,
            same_sense: true,
        });
        self
    }

    /// Adds a face. Each loop holds edge numbers from 1. A number is negative if the edge is walked backwards.
    fn face(mut self, surface: Surface, same_sense: bool, loops: &[&[i32]]) -> Self {
        let walk = |edges: &&[i32]| {
            Loop::Edges(
                edges
                    .iter()
                    .map(|&e| EdgeUse {
                        edge: e.unsigned_abs() - 1,
                        forward: e > 0,
                    })
                    .collect(),
            )
        };
        self.faces.push(BrepFace {
            step_id: self.faces.len() as u64 + 1,
            surface: Arc::new(surface),
            face_type: FaceType::Plane,
            same_sense,
            flipped: false,
            loops: loops.iter().map(walk).collect(),
            shell: 0,
            name: None,
            color: None,
            layer: None,
        });
        self
    }

    fn moved(mut self, rigid: &Transform) -> Self {
        for vertex in &mut self.vertices {
            vertex.point = rigid.point(vertex.point);
        }
        for edge in &mut self.edges {
            edge.curve = Arc::new(edge.curve.transformed(rigid));
        }
        for face in &mut self.faces {
            face.surface = Arc::new(face.surface.transformed(rigid));
        }
        self
    }
}

const ALL: AttributeChoice = AttributeChoice {
    normal: true,
    uv: true,
    curvature: true,
};

fn mesh_of(brep: &Brep) -> BrepMesh {
    let chord_mm = 0.002 * diagonal(brep);
    mesh_brep(
        brep,
        &MeshSettings {
            chord_mm,
            angle_rad: 0.3,
            attributes: ALL,
            solid_volumes: true,
            volume_loss: 0.008,
            max_triangles: 1_000_000,
        },
    )
}

fn solid_of(tessellation: &BrepMesh) -> SolidMesh {
    solid_mesh(&tessellation.mesh, &weld(&tessellation.mesh), |_| true)
}

#[track_caller]
fn check_areas(brep: &Brep, expected: &[f64]) {
    let tessellation = mesh_of(brep);
    assert_eq!(tessellation.lost, []);
    for (face, (area, expected)) in tessellation.areas.iter().zip(expected).enumerate() {
        assert!(
            (area - expected).abs() <= 1e-4 * expected,
            "face {face}: {area}, expected {expected}"
        );
    }
    assert_eq!(tessellation.areas.len(), expected.len());
    check_normals(&tessellation.mesh);
}

#[track_caller]
fn check_solid(brep: &Brep, areas: &[f64], volume: f64) {
    check_areas(brep, areas);
    let tessellation = mesh_of(brep);
    let solid = solid_of(&tessellation);
    assert!(solid.manifold);
    assert!(
        (solid.volume - volume).abs() <= 0.01 * volume,
        "volume {}, expected {volume}",
        solid.volume
    );
    let exact = tessellation.solid_volumes[0];
    assert!(
        (exact - volume).abs() <= 1e-4 * volume,
        "true volume {exact}, expected {volume}"
    );
}

/// Checks that vertex normals have unit length and point to the outside of their triangles.
#[track_caller]
fn check_normals(mesh: &Mesh) {
    assert_eq!(mesh.vertex_normal.len(), mesh.vertices.len());
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        let normal = partprobe_shape::cross(subtract(b, a), subtract(c, a));
        for &corner in corners {
            let vertex_normal = mesh.vertex_normal[corner as usize].map(f64::from);
            assert!((dot(vertex_normal, vertex_normal) - 1.0).abs() < 1e-5);
            assert!(
                dot(vertex_normal, normal) >= 0.5 * partprobe_shape::norm(normal),
                "triangle {triangle}"
            );
        }
    }
}

/// Checks that the vertices of one face have the curvature of the surface seen from outside.
#[track_caller]
fn check_curvature(brep: &Brep, face: u32, expected: [f32; 2]) {
    let BrepMesh {
        mesh, attributes, ..
    } = mesh_of(brep);
    let surface = &brep.faces[face as usize].surface;
    let of_face = (0..mesh.vertices.len()).filter(|&vertex| mesh.vertex_face[vertex] == face);
    for vertex in of_face {
        let [u, v] = attributes.uv[vertex];
        assert!(partprobe_shape::distance(surface.point(u, v), mesh.vertices[vertex]) < 1e-9);
        for (k, expected) in attributes.curvature[vertex].iter().zip(expected) {
            assert!((k - expected).abs() < 1e-6, "{k}, expected {expected}");
        }
        let normal = mesh.vertex_normal[vertex].map(f64::from);
        for direction in attributes.direction[vertex] {
            assert!(dot(direction.map(f64::from), normal).abs() < 1e-6);
        }
    }
}

#[test]
fn vertices_have_the_curvatures_of_their_surfaces() {
    check_curvature(&cylinder(2.0, 3.0, true), 1, [0.0, 0.0]);
    check_curvature(&cylinder(2.0, 3.0, true), 2, [0.5, 0.0]);
    let mut hole = cylinder(2.0, 3.0, false);
    // The ends are removed, because a closed shell would be reversed.
    hole.faces.drain(..2);
    hole.faces[0].flipped = true;
    check_curvature(&hole, 0, [0.0, -0.5]);
    let ball = shape(&[]).face(
        Surface::Sphere {
            frame: UP,
            radius: 4.0,
        },
        true,
        &[],
    );
    check_curvature(&ball, 0, [0.25, 0.25]);
}

fn plane_at(height: f64) -> Surface {
    Surface::Plane(Frame {
        origin: [0.0, 0.0, height],
        ..UP
    })
}

fn box_of([a, b, c]: [f64; 3]) -> Brep {
    let corner = |i: usize| {
        [
            if i & 1 == 1 { a } else { 0.0 },
            if i & 2 == 2 { b } else { 0.0 },
            if i & 4 == 4 { c } else { 0.0 },
        ]
    };
    let pairs = [
        (0, 1),
        (1, 3),
        (3, 2),
        (2, 0),
        (4, 5),
        (5, 7),
        (7, 6),
        (6, 4),
        (0, 4),
        (1, 5),
        (3, 7),
        (2, 6),
    ];
    let brep = pairs.iter().fold(
        shape(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner)),
        |brep, &(i, j)| brep.line(i, j),
    );
    let side =
        |origin: Point, normal: Point| Surface::Plane(Frame::new(origin, Some(normal), None));
    brep.face(plane_at(0.0), false, &[&[-4, -3, -2, -1]])
        .face(plane_at(c), true, &[&[5, 6, 7, 8]])
        .face(side([0.0; 3], [0.0, -1.0, 0.0]), true, &[&[1, 10, -5, -9]])
        .face(
            side([a, 0.0, 0.0], [1.0, 0.0, 0.0]),
            true,
            &[&[2, 11, -6, -10]],
        )
        .face(
            side([a, b, 0.0], [0.0, 1.0, 0.0]),
            true,
            &[&[3, 12, -7, -11]],
        )
        .face(side([0.0; 3], [-1.0, 0.0, 0.0]), true, &[&[4, 9, -8, -12]])
}

/// A full cylinder. Its side has a seam, or two boundaries that wind.
fn cylinder(radius: f64, height: f64, has_seam: bool) -> Brep {
    let brep = shape(&[[radius, 0.0, 0.0], [radius, 0.0, height]])
        .circle(0, radius, 0.0)
        .circle(1, radius, height)
        .line(0, 1)
        .face(plane_at(0.0), false, &[&[-1]])
        .face(plane_at(height), true, &[&[2]]);
    let side = Surface::Cylinder { frame: UP, radius };
    if has_seam {
        brep.face(side, true, &[&[1, 3, -2, -3]])
    } else {
        brep.face(side, true, &[&[1], &[-2]])
    }
}

#[test]
fn a_box_is_exact() {
    let brep = box_of([1.0, 2.0, 3.0]);
    check_solid(&brep, &[2.0, 2.0, 3.0, 6.0, 3.0, 6.0], 6.0);
    assert_eq!(mesh_of(&brep).mesh.triangles.len(), 12);
}

#[test]
fn cylinders_close_with_and_without_seam_at_any_size() {
    for has_seam in [true, false] {
        for size in [1e-6, 1.0, 1e4] {
            let (radius, height) = (2.0 * size, 3.0 * size);
            let disc = PI * radius * radius;
            let areas = [disc, disc, TAU * radius * height];
            check_solid(&cylinder(radius, height, has_seam), &areas, disc * height);
        }
    }
}

/// A pin that is much longer than thick. The chord tolerance from its length has no effect, and the angle tolerance alone would
/// lose 1.5 %.
#[test]
fn round_faces_keep_their_volume_and_flat_faces_stay_coarse() {
    for (height, sides) in [(0.1, 21), (3.0, 30), (200.0, 30)] {
        let pin = mesh_of(&cylinder(1.0, height, true));
        let volume = solid_of(&pin).volume;
        let n_sides = pin.mesh.tri_face.iter().filter(|&&face| face == 2).count() / 2;
        assert!(volume >= (1.0 - 0.008) * PI * height, "{height}: {volume}");
        assert!(n_sides <= sides.max(48), "{height}: {n_sides}");
    }
    let settings = MeshSettings {
        chord_mm: 0.4,
        angle_rad: 0.3,
        attributes: AttributeChoice::default(),
        solid_volumes: false,
        volume_loss: 0.0,
        max_triangles: 1_000_000,
    };
    assert_eq!(
        mesh_brep(&cylinder(1.0, 200.0, true), &settings)
            .mesh
            .triangles
            .len(),
        2 * 21 + 2 * 19
    );
    // A surface without ends is not a solid, so it has no volume to keep.
    let mut open = cylinder(1.0, 200.0, true);
    open.faces.remove(0);
    assert_eq!(mesh_of(&open).mesh.triangles.len(), 2 * 21 + 19);
}

/// The volume between triangles and surfaces is the volume that the mesh lacks.
#[test]
fn meshes_and_the_volume_they_cut_off_add_up_to_the_true_volume() {
    let (major, minor) = (3.0, 1.0);
    let bodies = [
        (cylinder(1.0, 5.0, true), 5.0 * PI),
        (
            shape(&[]).face(
                Surface::Sphere {
                    frame: UP,
                    radius: 2.0,
                },
                true,
                &[],
            ),
            32.0 / 3.0 * PI,
        ),
        (
            shape(&[]).face(
                Surface::Torus {
                    frame: UP,
                    major,
                    minor,
                },
                true,
                &[],
            ),
            TAU * PI * major * minor * minor,
        ),
    ];
    for (brep, volume) in bodies {
        let settings = MeshSettings {
            chord_mm: 0.5,
            angle_rad: 0.5,
            attributes: AttributeChoice::default(),
            solid_volumes: false,
            volume_loss: 0.008,
            max_triangles: 1_000_000,
        };
        let meshes = adaptive::face_meshes(&brep, &settings, diagonal(&brep), &[]);
        let cut_off: f64 = meshes.iter().flatten().map(|mesh| mesh.cut_off).sum();
        let enclosed: f64 = shell_sides::shell_volumes(&brep, &meshes)
            .into_iter()
            .flatten()
            .sum();
        assert!(
            (enclosed + cut_off - volume).abs() < 0.1 * cut_off.abs(),
            "{enclosed} + {cut_off}, expected {volume}"
        );
    }
}

/// A fillet around a shaft. If circles and columns were divided according to their own radii, the two circles would have 35 steps
/// and the columns between them 36.
#[test]
fn a_thin_ring_has_as_many_columns_inside_as_on_its_circles() {
    let (major, minor) = (7.13, 0.069);
    let ring = shape(&[[major, 0.0, minor], [major - minor, 0.0, 0.0]])
        .circle(0, major, minor)
        .circle(1, major - minor, 0.0)
        .face(
            Surface::Torus {
                frame: UP,
                major,
                minor,
            },
            true,
            &[&[1], &[-2]],
        );
    let settings = MeshSettings {
        chord_mm: 0.0288,
        angle_rad: 0.2121,
        attributes: AttributeChoice::default(),
        solid_volumes: false,
        volume_loss: 0.008,
        max_triangles: 1_000_000,
    };
    let mesh = mesh_brep(&ring, &settings);
    let area: f64 = mesh.mesh.triangle_areas().iter().sum();
    assert!(
        (area - mesh.areas[0]).abs() < 0.03 * mesh.areas[0],
        "{area} of {}",
        mesh.areas[0]
    );
    // With 36 columns, the mesh is rough until it has 8 458 triangles.
    assert!(
        mesh.mesh.triangles.len() < 2500,
        "{}",
        mesh.mesh.triangles.len()
    );
}

#[test]
fn a_cone_closes_at_its_apex() {
    let (radius, height) = (2.0, 3.0);
    let cone = Surface::Cone {
        frame: UP,
        radius,
        slope: -radius / height,
    };
    let side = PI * radius * f64::hypot(radius, height);
    let disc = PI * radius * radius;
    let base = || {
        shape(&[[radius, 0.0, 0.0], [0.0, 0.0, height]])
            .circle(0, radius, 0.0)
            .line(0, 1)
            .face(plane_at(0.0), false, &[&[-1]])
    };
    check_solid(
        &base().face(cone.clone(), true, &[&[1]]),
        &[disc, side],
        disc * height / 3.0,
    );
    check_solid(
        &base().face(cone, true, &[&[1, 2, -2]]),
        &[disc, side],
        disc * height / 3.0,
    );
}

/// A plane parallel to its axis cuts a cone in a hyperbola that comes near the apex.
#[test]
fn a_cone_that_a_plane_cuts_keeps_its_volume() {
    let (radius, height, cut) = (2.0_f64, 3.0, 0.5);
    let y = (radius * radius - cut * cut).sqrt();
    let frame = Frame {
        origin: [cut, 0.0, height],
        x: [0.0, 0.0, -1.0],
        y: [0.0, 1.0, 0.0],
        z: [1.0, 0.0, 0.0],
    };
    let hyperbola = Arc::new(Curve::Hyperbola {
        frame,
        a: cut * height / radius,
        b: cut,
    });
    let mut brep = shape(&[[cut, y, 0.0], [cut, -y, 0.0]]).arc(0, 1, UP, radius);
    brep.edges.push(BrepEdge {
        step_id: 0,
        start: 1,
        end: 0,
        curve: hyperbola,
        same_sense: true,
    });
    let brep = brep
        .line(0, 1)
        .face(
            Surface::Cone {
                frame: UP,
                radius,
                slope: -radius / height,
            },
            true,
            &[&[1, 2]],
        )
        .face(
            Surface::Plane(Frame::new([cut, 0.0, 0.0], Some([1.0, 0.0, 0.0]), None)),
            true,
            &[&[-3, -2]],
        )
        .face(plane_at(0.0), false, &[&[-1, 3]]);
    let tessellation = mesh_of(&brep);
    let (solid, volume) = (solid_of(&tessellation), tessellation.solid_volumes[0]);
    assert!(
        solid.manifold && (solid.volume - volume).abs() < 0.01 * volume,
        "{} of {volume}",
        solid.volume
    );
}

#[test]
fn full_spheres_and_half_spheres_are_closed() {
    let sphere = Surface::Sphere {
        frame: UP,
        radius: 2.0,
    };
    let ball = 4.0 / 3.0 * PI * 8.0;
    check_solid(
        &shape(&[]).face(sphere.clone(), true, &[]),
        &[16.0 * PI],
        ball,
    );
    let mut with_vertex = shape(&[[0.0, 0.0, 2.0]]).face(sphere.clone(), true, &[]);
    with_vertex.faces[0].loops.push(Loop::Vertex(0));
    check_solid(&with_vertex, &[16.0 * PI], ball);
    let half = shape(&[[2.0, 0.0, 0.0]]).circle(0, 2.0, 0.0);
    let half = half
        .face(plane_at(0.0), false, &[&[-1]])
        .face(sphere, true, &[&[1]]);
    check_solid(&half, &[4.0 * PI, 8.0 * PI], ball / 2.0);
}

#[test]
fn an_octant_of_a_sphere_may_touch_the_pole() {
    let quarter = |x: Point, y: Point| Frame {
        origin: [0.0; 3],
        x,
        y,
        z: partprobe_shape::cross(x, y),
    };
    let [x, y, z] = [UP.x, UP.y, UP.z];
    let octant = shape(&[x, y, z])
        .arc(0, 1, quarter(x, y), 1.0)
        .arc(1, 2, quarter(y, z), 1.0)
        .arc(2, 0, quarter(z, x), 1.0);
    check_areas(
        &octant.face(
            Surface::Sphere {
                frame: UP,
                radius: 1.0,
            },
            true,
            &[&[1, 2, 3]],
        ),
        &[FRAC_PI_2],
    );
}

#[test]
fn full_tori_and_both_bands_are_closed() {
    let (major, minor) = (3.0, 1.0);
    let torus = Surface::Torus {
        frame: UP,
        major,
        minor,
    };
    let whole = 4.0 * PI * PI * major * minor;
    check_solid(
        &shape(&[]).face(torus.clone(), true, &[]),
        &[whole],
        2.0 * PI * PI * major * minor * minor,
    );
    // The outer equator and the upper ring bound a quarter of the tube, or the other three quarters.
    let quarter = TAU * minor * (major * FRAC_PI_2 + minor);
    let rings = || {
        shape(&[[major + minor, 0.0, 0.0], [major, 0.0, minor]])
            .circle(0, major + minor, 0.0)
            .circle(1, major, minor)
    };
    check_areas(
        &rings().face(torus.clone(), true, &[&[1], &[-2]]),
        &[quarter],
    );
    check_areas(
        &rings().face(torus, true, &[&[-1], &[2]]),
        &[whole - quarter],
    );
}

/// A band around the tube, from a circle to a boundary with a deep dent, which lies on both sides of its own mean. The seam connects
/// the dent and the circle.
#[test]
fn a_seam_finds_the_band_of_a_torus_although_its_boundary_has_a_dent() {
    let (major, minor) = (3.0, 1.0);
    let (shallow, deep, half_width) = (-0.1, -0.8, 0.5);
    let tube = |u: f64| {
        let (sin, cos) = u.sin_cos();
        Frame {
            origin: [major * cos, major * sin, 0.0],
            x: [cos, sin, 0.0],
            y: UP.z,
            z: [sin, -cos, 0.0],
        }
    };
    let at = |u: f64, v: f64| tube(u).point(minor * v.cos(), minor * v.sin(), 0.0);
    let parallel = |v: f64| Frame {
        origin: [0.0, 0.0, minor * v.sin()],
        ..UP
    };
    let radius = |v: f64| major + minor * v.cos();
    let band = shape(&[
        at(shallow, half_width),
        at(shallow, -half_width),
        at(deep, -half_width),
        at(deep, 0.0),
        at(deep, half_width),
        at(0.0, 0.0),
    ])
    .arc(0, 1, tube(shallow), minor)
    .arc(2, 1, parallel(-half_width), radius(half_width))
    .arc(2, 3, tube(deep), minor)
    .arc(3, 4, tube(deep), minor)
    .arc(4, 0, parallel(half_width), radius(half_width))
    .arc(3, 5, parallel(0.0), radius(0.0))
    .arc(5, 5, tube(0.0), minor);
    let torus = Surface::Torus {
        frame: UP,
        major,
        minor,
    };
    let ring = -shallow * minor * TAU * major;
    let dent =
        (shallow - deep) * minor * (2.0 * half_width * major + 2.0 * minor * half_width.sin());
    check_areas(
        &band.face(torus, true, &[&[-3, 2, -1, -5, -4, 6, 7, -6]]),
        &[ring + dent],
    );
}

#[test]
fn holes_and_patches_have_closed_forms() {
    let ring = shape(&[[2.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        .circle(0, 2.0, 0.0)
        .circle(1, 1.0, 0.0);
    check_areas(&ring.face(plane_at(0.0), true, &[&[1], &[-2]]), &[3.0 * PI]);
    let wall = shape(&[
        [2.0, 0.0, 0.0],
        [-2.0, 0.0, 0.0],
        [-2.0, 0.0, 5.0],
        [2.0, 0.0, 5.0],
    ])
    .arc(0, 1, UP, 2.0)
    .line(1, 2)
    .arc(
        3,
        2,
        Frame {
            origin: [0.0, 0.0, 5.0],
            ..UP
        },
        2.0,
    )
    .line(3, 0);
    let half = PI * 2.0 * 5.0;
    check_areas(
        &wall.clone().face(
            Surface::Cylinder {
                frame: UP,
                radius: 2.0,
            },
            true,
            &[&[1, 2, -3, 4]],
        ),
        &[half],
    );
    let profile = Box::new(Curve::Ellipse {
        frame: UP,
        rx: 2.0,
        ry: 2.0,
    });
    let extruded = Surface::Extrusion {
        curve: profile,
        direction: UP.z,
    };
    check_areas(
        &wall.clone().face(extruded, true, &[&[1, 2, -3, 4]]),
        &[half],
    );
    let meridian = Box::new(Curve::Line {
        origin: [2.0, 0.0, 0.0],
        direction: UP.z,
    });
    check_areas(
        &wall.face(
            Surface::Revolution {
                axis: UP,
                curve: meridian,
            },
            true,
            &[&[1, 2, -3, 4]],
        ),
        &[half],
    );
}

/// A quarter of a cylinder of radius 1 and height 1 as a rational B-spline.
fn quarter_spline() -> Surface {
    let w = 0.5_f64.sqrt();
    let pole = |x: f64, y: f64, z: f64, w: f64| [x * w, y * w, z * w, w];
    let row = |x: f64, y: f64, w: f64| [pole(x, y, 0.0, w), pole(x, y, 1.0, w)];
    let poles = [row(1.0, 0.0, 1.0), row(1.0, 1.0, w), row(0.0, 1.0, 1.0)].concat();
    let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    Surface::Bspline(Box::new(
        BsplineSurface::new([2, 1], knots, [3, 2], poles).unwrap(),
    ))
}

#[test]
fn a_spline_patch_has_the_area_of_what_it_describes() {
    let top = Frame {
        origin: [0.0, 0.0, 1.0],
        ..UP
    };
    let patch = shape(&[
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 1.0],
        [1.0, 0.0, 1.0],
    ])
    .arc(0, 1, UP, 1.0)
    .line(1, 2)
    .arc(3, 2, top, 1.0)
    .line(3, 0);
    check_areas(
        &patch.face(quarter_spline(), true, &[&[1, 2, -3, 4]]),
        &[FRAC_PI_2],
    );
}

#[test]
fn a_lens_between_arc_and_chord_is_not_lost() {
    let (sin, cos) = 0.1_f64.sin_cos();
    let lens = shape(&[[1.0, 0.0, 0.0], [cos, sin, 0.0], [9.0, 9.0, 0.0]])
        .arc(0, 1, UP, 1.0)
        .line(1, 0);
    check_areas(
        &lens.face(plane_at(0.0), true, &[&[1, 2]]),
        &[0.5 * (0.1 - sin)],
    );
}

#[test]
fn an_edge_that_the_file_exchanged_is_repaired() {
    let mut brep = box_of([1.0, 1.0, 1.0]);
    let edge = &mut brep.edges[4];
    std::mem::swap(&mut edge.start, &mut edge.end);
    let repaired = repaired(&brep);
    assert_eq!((repaired.edges[4].start, repaired.edges[4].end), (4, 5));
    assert!(solid_of(&mesh_of(&repaired)).watertight);
}

/// Each face in turn contradicts its neighbors: its normal is reversed, or its normal and its boundary are.
#[test]
fn faces_that_contradict_their_neighbors_are_reversed() {
    for face in 0..6 {
        for with_boundary in [false, true] {
            let mut brep = box_of([1.0, 2.0, 3.0]);
            brep.faces[face].same_sense = !brep.faces[face].same_sense;
            if with_boundary {
                for bound in &mut brep.faces[face].loops {
                    let Loop::Edges(uses) = bound else { continue };
                    uses.reverse();
                    uses.iter_mut()
                        .for_each(|use_| use_.forward = !use_.forward);
                }
            }
            let tessellation = mesh_of(&brep);
            let solid = solid_of(&tessellation);
            assert!(
                solid.manifold && (solid.volume - 6.0).abs() < 1e-12,
                "face {face}: {solid:?}"
            );
            assert!((tessellation.solid_volumes[0] - 6.0).abs() < 1e-12);
            check_normals(&tessellation.mesh);
        }
    }
}

/// A box with a void, whose shell is written in both orientations, and a box that is written inside out.
#[test]
fn shells_are_oriented_outward_for_any_flags() {
    let (outer, inner) = (box_of([3.0, 3.0, 3.0]), box_of([1.0, 1.0, 1.0]));
    for flipped in [[false, false], [false, true], [true, false], [true, true]] {
        let mut brep = outer.clone();
        let (n_vertices, n_edges) = (outer.vertices.len() as u32, outer.edges.len() as u32);
        brep.vertices
            .extend(inner.vertices.iter().map(|vertex| Vertex {
                point: vertex.point.map(|x| x + 1.0),
                ..*vertex
            }));
        let moved = inner.clone().moved(&Transform {
            rotation: [UP.x, UP.y, UP.z],
            translation: [1.0; 3],
        });
        brep.edges
            .extend(moved.edges.into_iter().map(|edge| BrepEdge {
                start: edge.start + n_vertices,
                end: edge.end + n_vertices,
                ..edge
            }));
        brep.faces.extend(moved.faces.into_iter().map(|mut face| {
            face.shell = 1;
            for bound in &mut face.loops {
                let Loop::Edges(uses) = bound else { continue };
                uses.iter_mut().for_each(|use_| use_.edge += n_edges);
            }
            face
        }));
        brep.shells.push(brep.shells[0].clone());
        for face in &mut brep.faces {
            face.flipped = flipped[face.shell as usize];
        }
        let tessellation = mesh_of(&brep);
        assert!(
            (solid_of(&tessellation).volume - 26.0).abs() < 1e-12,
            "{flipped:?}"
        );
        assert!(
            (tessellation.solid_volumes[0] - 26.0).abs() < 1e-12,
            "{flipped:?}"
        );
    }
}

#[test]
fn a_revolution_ends_at_its_vertices() {
    // The meridian is a whole circle. The half between its two points on the axis makes a sphere.
    let frame = Frame {
        origin: [0.0; 3],
        x: UP.x,
        y: UP.z,
        z: [0.0, -1.0, 0.0],
    };
    let curve = Box::new(Curve::Ellipse {
        frame,
        rx: 2.0,
        ry: 2.0,
    });
    let sphere = shape(&[[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]]).face(
        Surface::Revolution { axis: UP, curve },
        true,
        &[],
    );
    let mut sphere = sphere;
    sphere.faces[0].loops = vec![Loop::Vertex(0), Loop::Vertex(1)];
    let areas = mesh_of(&sphere).areas;
    assert!((areas[0] - 16.0 * PI).abs() < 1e-3, "{areas:?}");
    assert!(solid_of(&mesh_of(&sphere)).manifold);
}

#[test]
fn a_cone_has_a_second_nappe_beyond_its_apex() {
    let cone = Surface::Cone {
        frame: UP,
        radius: 1.0,
        slope: 1.0,
    };
    let brep = shape(&[[2.0, 0.0, -3.0]])
        .circle(0, 2.0, -3.0)
        .face(plane_at(-3.0), false, &[&[-1]])
        .face(cone, true, &[&[1]]);
    check_solid(
        &brep,
        &[4.0 * PI, 2.0 * PI * 8.0_f64.sqrt()],
        8.0 * PI / 3.0,
    );
}

/// A plate whose outline runs along a line and back, so that it touches itself there.
#[test]
fn a_boundary_that_touches_itself_still_closes() {
    let base = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 2.0],
        [1.0, 2.0],
        [1.0, 0.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    let corners: Vec<Point> = [0.0, 1.0]
        .iter()
        .flat_map(|&z| base.iter().map(move |&[x, y]| [x, y, z]))
        .collect();
    let n = base.len() as u32;
    let mut brep = shape(&corners);
    for i in 0..n {
        brep = brep
            .line(i, (i + 1) % n)
            .line(n + i, n + (i + 1) % n)
            .line(i, n + i);
    }
    let edge = |i: u32, kind: u32| (3 * (i % n) + kind + 1) as i32;
    let bottom: Vec<i32> = (0..n).rev().map(|i| -edge(i, 0)).collect();
    let top: Vec<i32> = (0..n).map(|i| edge(i, 1)).collect();
    brep = brep
        .face(plane_at(0.0), false, &[&bottom])
        .face(plane_at(1.0), true, &[&top]);
    for i in 0..n {
        let [from, to] = [base[i as usize], base[((i + 1) % n) as usize]];
        let normal = [to[1] - from[1], from[0] - to[0], 0.0];
        let plane = Surface::Plane(Frame::new([from[0], from[1], 0.0], Some(normal), None));
        brep = brep.face(
            plane,
            true,
            &[&[edge(i, 0), edge(i + 1, 2), -edge(i, 1), -edge(i, 2)]],
        );
    }
    let tessellation = mesh_of(&brep);
    assert_eq!(tessellation.lost, []);
    assert!(solid_of(&tessellation).watertight);
    assert!((solid_of(&tessellation).volume - 4.0).abs() < 1e-12);
}

/// A pipe with a short and a long thread of steps along it: the chart of a ring must not fold.
#[test]
fn a_long_ring_of_a_free_form_is_not_folded() {
    let (radius, bend) = (1.0, 40.0);
    let torus = Surface::Torus {
        frame: UP,
        major: bend,
        minor: radius,
    };
    let ring = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        Frame {
            origin: [bend * cos, bend * sin, 0.0],
            x: [cos, sin, 0.0],
            y: UP.z,
            z: [sin, -cos, 0.0],
        }
    };
    let point = |frame: &Frame| frame.point(radius, 0.0, 0.0);
    let ends = [ring(0.0), ring(3.0)];
    let mut brep = shape(&[point(&ends[0]), point(&ends[1])]);
    for (vertex, frame) in (0..).zip(ends) {
        brep = brep.arc(vertex, vertex, frame, radius);
    }
    let brep = brep.face(torus, true, &[&[-1], &[2]]);
    let mesh = mesh_of(&brep);
    let area: f64 = mesh.mesh.triangle_areas().iter().sum();
    let expected = 3.0 * bend * TAU * radius;
    assert!(
        (area - expected).abs() < 0.05 * expected,
        "mesh {area}, expected {expected}"
    );
    assert!((mesh.areas[0] - expected).abs() < 1e-3 * expected);
}

#[track_caller]
fn check_lost(brep: &Brep, max_triangles: u64, reason: &str) {
    let settings = MeshSettings {
        chord_mm: 0.01,
        angle_rad: 0.3,
        attributes: AttributeChoice::default(),
        solid_volumes: false,
        volume_loss: 0.0,
        max_triangles,
    };
    let lost = mesh_brep(brep, &settings).lost;
    assert!(
        lost.iter()
            .any(|loss| loss.step_id == 1 && loss.reason.contains(reason)),
        "{lost:?}"
    );
}

#[test]
fn what_has_no_triangles_is_named() {
    check_lost(
        &shape(&[]).face(plane_at(0.0), true, &[]),
        100,
        "no boundary",
    );
    check_lost(&cylinder(1.0, 1.0, true), 3, "budget");
    let nowhere =
        shape(&[[f64::NAN, 0.0, 0.0]])
            .circle(0, 1.0, 0.0)
            .face(plane_at(0.0), true, &[&[1]]);
    check_lost(&nowhere, 100, "finite");
    let far = Surface::Cylinder {
        frame: UP,
        radius: f64::INFINITY,
    };
    let far = shape(&[[1.0, 0.0, 0.0]])
        .circle(0, 1.0, 0.0)
        .face(far, true, &[&[1]]);
    check_lost(&far, 100, "no triangles");
    check_lost(
        &shape(&[[0.0; 3], [1.0, 0.0, 0.0]])
            .line(0, 1)
            .line(1, 0)
            .face(plane_at(0.0), true, &[&[1, 2]]),
        100,
        "encloses",
    );
    check_lost(&shape(&[]).face(plane_at(0.0), true, &[&[7]]), 100, "edge");
}

/// A face that may not have more triangles is named if the triangles follow its surface badly.
#[test]
fn a_face_at_the_cap_of_triangles_is_named() {
    #[track_caller]
    fn check(n_triangles: usize, area: f64, expected: Option<&str>) {
        let mesh = FaceMesh {
            points: vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]; n_triangles],
            area,
            ..FaceMesh::default()
        };
        let brep = shape(&[]).face(plane_at(0.0), true, &[]);
        let reason = lost_description(&brep, &brep.faces[0], &Ok(mesh), 1.0);
        assert_eq!(reason.is_some(), expected.is_some(), "{reason:?}");
        if let (Some(reason), Some(expected)) = (reason, expected) {
            assert!(
                reason.contains(expected) && reason.contains("lower the tolerances"),
                "{reason}"
            );
        }
    }
    let most = adaptive::MOST_TRIANGLES;
    let area = most as f64;
    check(most, area / 0.9, Some("10.0 % less area"));
    check(most + 1000, (area + 1000.0) / 1.05, Some("5.0 % more area"));
    check(most, area / 0.99, None);
    check(most - 1, area / 0.9, None);
}

mod off_surface;
mod sweeps;
mod touching;

/// A flat B-spline over the square of side 10 with arbitrary poles and knots.
fn flat_spline(degree: [usize; 2], poles: [&[f64]; 2], knots: [&[f64]; 2]) -> Surface {
    let clamped = |axis: usize| -> Vec<f64> {
        let ends = |end: f64| std::iter::repeat_n(end, degree[axis] + 1);
        let n_inner = poles[axis].len() - degree[axis] - 1;
        ends(0.0)
            .chain(knots[axis].iter().copied().take(n_inner))
            .chain(ends(1.0))
            .collect()
    };
    let grid = poles[0]
        .iter()
        .flat_map(|&x| poles[1].iter().map(move |&y| [x, y, 0.0, 1.0]))
        .collect();
    let spline = BsplineSurface::new(
        degree,
        [clamped(0), clamped(1)],
        [poles[0].len(), poles[1].len()],
        grid,
    );
    Surface::Bspline(Box::new(spline.unwrap()))
}

/// The triangle below the diagonal of the square, and a disc in its middle.
fn triangle_and_disc(surface: &Surface) -> Brep {
    let triangle = shape(&[
        [0.0; 3],
        [10.0, 0.0, 0.0],
        [10.0, 10.0, 0.0],
        [8.0, 5.0, 0.0],
    ]);
    let frame = Frame {
        origin: [5.0, 5.0, 0.0],
        ..UP
    };
    let brep = triangle
        .line(0, 1)
        .line(1, 2)
        .line(2, 0)
        .arc(3, 3, frame, 3.0);
    brep.face(surface.clone(), true, &[&[1, 2, 3]])
        .face(surface.clone(), true, &[&[4]])
}

#[track_caller]
fn check_flat(degree: [usize; 2], poles: [&[f64]; 2], knots: [&[f64]; 2]) {
    let brep = triangle_and_disc(&flat_spline(degree, poles, knots));
    let tessellation = mesh_of(&brep);
    assert_eq!(tessellation.lost, []);
    for (area, expected) in tessellation.areas.iter().zip([50.0, 9.0 * PI]) {
        assert!(
            (area - expected).abs() <= 1e-4 * expected,
            "{area}, expected {expected}"
        );
    }
}

/// In the parameter plane of these surfaces, straight lines and circles are bent by as much as the face is wide.
#[test]
fn areas_do_not_depend_on_how_a_surface_is_parametrised() {
    let even: &[f64] = &[0.0, 10.0];
    check_flat([1, 1], [even, even], [&[], &[]]);
    check_flat([1, 1], [even, &[0.0, 5.0, 10.0]], [&[], &[0.1]]);
    check_flat(
        [1, 1],
        [&[0.0, 9.0, 10.0], &[0.0, 1.0, 9.5, 10.0]],
        [&[0.5], &[0.3, 0.4]],
    );
    // Between equal poles, a surface of degree 1 has no extent, and a search stops there.
    check_flat([1, 1], [&[0.0, 0.5, 0.5, 10.0], even], [&[0.05, 0.25], &[]]);
    check_flat(
        [1, 1],
        [&[0.0, 5.0, 5.0, 10.0], &[0.0, 5.5, 5.5, 10.0]],
        [&[0.05, 0.25], &[0.3, 0.6]],
    );
    let (halves, fast) = (
        &[0.0, 0.5, 0.5, 0.5, 5.8, 5.9, 10.0],
        &[0.05, 0.05, 0.25, 0.2503, 0.346],
    );
    check_flat([1, 1], [halves, even], [fast, &[]]);
    check_flat(
        [1, 1],
        [halves, &[0.0, 0.5, 0.5, 10.0]],
        [fast, &[0.05, 0.8]],
    );
    check_flat([1, 1], [halves, halves], [fast, fast]);
    check_flat([1, 3], [halves, &[0.0, 5.0, 5.0, 10.0]], [fast, &[]]);
    check_flat([1, 3], [even, &[0.0, 0.1, 0.2, 10.0]], [&[], &[]]);
    check_flat([1, 3], [even, &[0.0, 0.0, 5.0, 10.0]], [&[], &[]]);
    check_flat([1, 3], [even, &[0.0, 0.0, 0.0, 10.0]], [&[], &[]]);
    check_flat([1, 3], [even, &[0.0, 1e-5, 5.0, 10.0]], [&[], &[]]);
    check_flat(
        [2, 3],
        [&[0.0, 9.0, 10.0], &[0.0, 5.0, 5.0, 10.0]],
        [&[], &[]],
    );
    check_flat(
        [3, 2],
        [&[0.0, 0.0, 10.0, 10.0], &[0.0, 2.0, 3.0, 10.0]],
        [&[], &[0.8]],
    );
    check_flat(
        [5, 4],
        [
            &[0.0, 0.0, 1.0, 1.0, 9.0, 10.0],
            &[0.0, 1.0, 2.0, 3.0, 10.0],
        ],
        [&[], &[]],
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn quadrature_mesh_and_closed_form_agree_on_any_knots(
        degree in prop::array::uniform2(1_usize..6),
        mut poles in prop::array::uniform2(prop::collection::vec(0.5_f64..9.5, 8)),
        mut knots in prop::array::uniform2(prop::collection::vec(0.05_f64..0.95, 8)),
    ) {
        for axis in [0, 1] {
            poles[axis].extend([0.0, 10.0]);
            poles[axis].sort_by(f64::total_cmp);
            knots[axis].sort_by(f64::total_cmp);
        }
        let surface = flat_spline(degree, [&poles[0], &poles[1]], [&knots[0], &knots[1]]);
        let brep = triangle_and_disc(&surface);
        let fine = MeshSettings {
            chord_mm: 1e-4,
            angle_rad: 0.05,
            attributes: AttributeChoice::default(),
            solid_volumes: false,
            volume_loss: 0.0,
            max_triangles: 1_000_000,
        };
        let BrepMesh { mesh, areas, .. } = mesh_brep(&brep, &fine);
        for (face, (area, expected)) in areas.iter().zip([50.0, 9.0 * PI]).enumerate() {
            prop_assert!((area - expected).abs() <= 1e-3 * expected, "{area}, expected {expected}");
            let of_face = mesh.triangle_areas().into_iter().zip(&mesh.tri_face).filter(|(_, of)| **of == face as u32);
            let mesh_area: f64 = of_face.map(|(area, _)| area).sum();
            prop_assert!((mesh_area - expected).abs() <= 1e-3 * expected, "mesh {mesh_area}, expected {expected}");
        }
    }

    #[test]
    fn rigid_motion_leaves_areas_and_closure_alone(
        axis in prop::array::uniform3(-1.0_f64..1.0), turn in prop::array::uniform3(-1.0_f64..1.0),
        translation in prop::array::uniform3(-50.0_f64..50.0), has_seam: bool,
    ) {
        let frame = Frame::new([0.0; 3], Some(axis), Some(turn));
        let rigid = Transform { rotation: [frame.x, frame.y, frame.z], translation };
        let (before, after) = (cylinder(2.0, 3.0, has_seam), cylinder(2.0, 3.0, has_seam).moved(&rigid));
        let (before, after) = (mesh_of(&before), mesh_of(&after));
        for (a, b) in before.areas.iter().zip(&after.areas) {
            prop_assert!((a - b).abs() < 1e-4 * a);
        }
        prop_assert!(solid_of(&after).watertight);
    }

    #[test]
    fn boxes_of_any_proportion_close(sides in prop::array::uniform3(0.001_f64..1000.0)) {
        let solid = solid_of(&mesh_of(&box_of(sides)));
        let volume = sides.iter().product::<f64>();
        prop_assert!(solid.watertight && (solid.volume - volume).abs() < 1e-9 * volume);
    }
}
