//! Writes shells as the text of an AP214 file. Entity numbers start at 1 and have no gaps.
//!
//! Numbers have the shortest digits that read back as the same value, so the text is the same on any machine.

mod header;
mod number;
mod topology;

pub(crate) use header::{AngleUnit, Body, Decoration, Document, LengthUnit, write};

use number::{point_list, real};
use partprobe_carrier::Point;
use std::fmt::Write as _;

/// The data section under construction.
#[derive(Default)]
struct Entities {
    text: String,
    n_entities: u64,
}

impl Entities {
    /// Writes one entity and returns its number.
    fn add(&mut self, entity: &str) -> u64 {
        self.n_entities += 1;
        let id = self.n_entities;
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "#{id}={entity};");
        id
    }

    fn point(&mut self, point: Point) -> u64 {
        self.add(&format!("CARTESIAN_POINT('',({}))", point_list(point)))
    }

    fn direction(&mut self, direction: Point) -> u64 {
        self.add(&format!("DIRECTION('',({}))", point_list(direction)))
    }

    fn placement(&mut self, origin: Point, z: Point, x: Point) -> u64 {
        let (origin, z, x) = (self.point(origin), self.direction(z), self.direction(x));
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"))
    }

    fn vector(&mut self, direction: Point, magnitude: f64) -> u64 {
        let direction = self.direction(direction);
        self.add(&format!("VECTOR('',#{direction},{})", real(magnitude)))
    }
}

/// Formats a list of references to entities, for example `(#1,#2)`.
fn references(ids: &[u64]) -> String {
    let names: Vec<String> = ids.iter().map(|id| format!("#{id}")).collect();
    format!("({})", names.join(","))
}
