//! Writes small STEP texts for this crate's tests, by code.

use partprobe_shape::{Point, cross, subtract};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The entities of a STEP file under construction.
#[derive(Clone, Default)]
pub(crate) struct StepText {
    entities: Vec<String>,
}

impl StepText {
    /// A file whose `#1` is a context in millimeters and radians.
    pub(crate) fn in_millimeters() -> Self {
        Self::with_units(
            "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))",
            "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
        )
    }

    /// A file whose `#1` is a context with these units, which may refer to entities from `#4` on.
    pub(crate) fn with_units(length: &str, angle: &str) -> Self {
        let mut text = Self::default();
        text.add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''))",
        );
        text.add(length);
        text.add(angle);
        text
    }

    /// Adds an entity and returns its number.
    pub(crate) fn add(&mut self, entity: impl Into<String>) -> usize {
        self.entities.push(entity.into());
        self.entities.len()
    }

    pub(crate) fn point(&mut self, [x, y, z]: Point) -> usize {
        self.add(format!("CARTESIAN_POINT('',({x:?},{y:?},{z:?}))"))
    }

    pub(crate) fn direction(&mut self, [x, y, z]: Point) -> usize {
        self.add(format!("DIRECTION('',({x:?},{y:?},{z:?}))"))
    }

    pub(crate) fn axes(&mut self, origin: Point, z: Point, x: Point) -> usize {
        let (origin, z, x) = (self.point(origin), self.direction(z), self.direction(x));
        self.add(format!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"))
    }

    pub(crate) fn vertex(&mut self, at: Point) -> usize {
        let point = self.point(at);
        self.add(format!("VERTEX_POINT('',#{point})"))
    }

    /// A straight edge between two vertices.
    pub(crate) fn straight_edge(&mut self, [a, b]: [usize; 2], [from, to]: [Point; 2]) -> usize {
        let (origin, direction) = (self.point(from), self.direction(subtract(to, from)));
        let vector = self.add(format!("VECTOR('',#{direction},1.)"));
        let line = self.add(format!("LINE('',#{origin},#{vector})"));
        self.add(format!("EDGE_CURVE('',#{a},#{b},#{line},.T.)"))
    }

    /// A face with one loop of edges. Each edge has the flag of its direction.
    pub(crate) fn face(
        &mut self,
        surface: usize,
        same_sense: &str,
        walk: &[(usize, &str)],
    ) -> usize {
        let uses: Vec<String> = walk
            .iter()
            .map(|(edge, flag)| {
                format!(
                    "#{}",
                    self.add(format!("ORIENTED_EDGE('',*,*,#{edge},{flag})"))
                )
            })
            .collect();
        let edge_loop = self.add(format!("EDGE_LOOP('',({}))", uses.join(",")));
        let bound = self.add(format!("FACE_OUTER_BOUND('',#{edge_loop},.T.)"));
        self.add(format!(
            "ADVANCED_FACE('',(#{bound}),#{surface},{same_sense})"
        ))
    }

    /// The faces of a polyhedron. The corners of each polygon are counter-clockwise seen from outside.
    pub(crate) fn polyhedron(&mut self, corners: &[Point], polygons: &[&[usize]]) -> Vec<usize> {
        let vertices: Vec<usize> = corners.iter().map(|&corner| self.vertex(corner)).collect();
        let mut edges = BTreeMap::new();
        let mut faces = Vec::new();
        for polygon in polygons {
            let mut walk = Vec::new();
            for (i, &a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let (low, high) = (a.min(b), a.max(b));
                let edge = *edges.entry((low, high)).or_insert_with(|| {
                    self.straight_edge(
                        [vertices[low], vertices[high]],
                        [corners[low], corners[high]],
                    )
                });
                walk.push((edge, if a == low { ".T." } else { ".F." }));
            }
            let [a, b, c] = [
                corners[polygon[0]],
                corners[polygon[1]],
                corners[polygon[2]],
            ];
            let axes = self.axes(a, cross(subtract(b, a), subtract(c, b)), subtract(b, a));
            let plane = self.add(format!("PLANE('',#{axes})"));
            faces.push(self.face(plane, ".T.", &walk));
        }
        faces
    }

    /// A solid of these faces, listed in a representation with the context `#1`. Returns the numbers of the shell and the solid.
    pub(crate) fn solid(&mut self, faces: &[usize]) -> [usize; 2] {
        let shell = self.add(format!("CLOSED_SHELL('',({}))", references(faces)));
        let solid = self.add(format!("MANIFOLD_SOLID_BREP('body',#{shell})"));
        self.add(format!(
            "ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#1)"
        ));
        [shell, solid]
    }

    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut text = "ISO-10303-21;\nHEADER;\nFILE_NAME('test',$);\nENDSEC;\nDATA;\n".to_owned();
        for (id, entity) in (1..).zip(&self.entities) {
            writeln!(text, "#{id}={entity};").unwrap();
        }
        text.push_str("ENDSEC;\nEND-ISO-10303-21;\n");
        text.into_bytes()
    }
}

/// `#1,#2,…`.
pub(crate) fn references(ids: &[usize]) -> String {
    ids.iter()
        .map(|id| format!("#{id}"))
        .collect::<Vec<_>>()
        .join(",")
}

pub(crate) const CUBE_POLYGONS: [&[usize]; 6] = [
    &[0, 3, 2, 1],
    &[4, 5, 6, 7],
    &[0, 1, 5, 4],
    &[1, 2, 6, 5],
    &[2, 3, 7, 6],
    &[3, 0, 4, 7],
];

/// The corners of a box from the origin, the lower four first.
pub(crate) fn box_corners([x, y, z]: Point) -> [Point; 8] {
    let lower = [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]];
    std::array::from_fn(|i| {
        [
            lower[i % 4][0],
            lower[i % 4][1],
            if i < 4 { 0.0 } else { z },
        ]
    })
}

/// A box from the origin with these sides.
pub(crate) fn cuboid(sides: Point) -> StepText {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners(sides), &CUBE_POLYGONS);
    text.solid(&faces);
    text
}

/// A cylinder with a seam, standing on the origin: bottom, top, side.
pub(crate) fn cylinder(radius: f64, height: f64) -> StepText {
    let mut text = StepText::in_millimeters();
    let (up, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let foot = [[radius, 0.0, 0.0], [radius, 0.0, height]];
    let vertices = foot.map(|at| text.vertex(at));
    let axes = [0.0, height].map(|z| text.axes([0.0, 0.0, z], up, x));
    let rims = [0, 1].map(|i| {
        let circle = text.add(format!("CIRCLE('',#{},{radius:?})", axes[i]));
        text.add(format!(
            "EDGE_CURVE('',#{0},#{0},#{circle},.T.)",
            vertices[i]
        ))
    });
    let seam = text.straight_edge(vertices, foot);
    let planes = axes.map(|axes| text.add(format!("PLANE('',#{axes})")));
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{},{radius:?})", axes[0]));
    let faces = [
        text.face(planes[0], ".F.", &[(rims[0], ".F.")]),
        text.face(planes[1], ".T.", &[(rims[1], ".T.")]),
        text.face(
            side,
            ".T.",
            &[
                (rims[0], ".T."),
                (seam, ".T."),
                (rims[1], ".F."),
                (seam, ".F."),
            ],
        ),
    ];
    text.solid(&faces);
    text
}
