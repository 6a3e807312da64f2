//! Describes the path of a wall as steps in a plane. The coordinates are the offset from the profile, and the height.

use crate::frame::Planar;
use crate::side::{PlacedSide, Side};

/// An open line in the plane whose first axis is the offset to the right of the profile and whose second is the height.
///
/// A station is a corner of the line. Invariant: there is one more station than steps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Path {
    pub(crate) stations: Vec<Planar>,
    pub(crate) steps: Vec<Side>,
}

/// The direction of a quarter circle at its start. At its end it has the other direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leaves {
    /// It starts vertically, for example where a wall ends.
    Upright,
    /// It starts horizontally, for example where a floor ends.
    Flat,
}

impl Path {
    /// Starts a path on the profile itself, at this height.
    pub(crate) fn at(height: f64) -> Self {
        Self {
            stations: vec![[0.0, height]],
            steps: Vec::new(),
        }
    }

    /// The offset and height at which the path starts.
    pub(crate) fn start(&self) -> Planar {
        self.stations[0]
    }

    /// The offset and height at which the path currently ends.
    pub(crate) fn end(&self) -> Planar {
        self.stations[self.stations.len() - 1]
    }

    /// Goes straight to a station.
    pub(crate) fn to(mut self, station: Planar) -> Self {
        self.stations.push(station);
        self.steps.push(Side::Line);
        self
    }

    /// Goes straight by this offset and height.
    pub(crate) fn by(self, offset: f64, height: f64) -> Self {
        let [out, z] = self.end();
        self.to([out + offset, z + height])
    }

    /// Goes along an arc to a station.
    pub(crate) fn arc_to(mut self, station: Planar, center: Planar, ccw: bool) -> Self {
        self.stations.push(station);
        self.steps.push(Side::Arc { center, ccw });
        self
    }

    /// Goes along a quarter circle by this offset and height, which must be equal except for their signs.
    pub(crate) fn round(self, offset: f64, height: f64, leaves: Leaves) -> Self {
        let [out, z] = self.end();
        let center = match leaves {
            Leaves::Upright => [out + offset, z],
            Leaves::Flat => [out, z + height],
        };
        let ccw = (offset * height > 0.0) == (leaves == Leaves::Flat);
        self.arc_to([out + offset, z + height], center, ccw)
    }

    /// Goes along a spline. Its control points are the last station and these points.
    pub(crate) fn spline_through(mut self, controls: &[Planar]) -> Self {
        let mut all = vec![self.end()];
        all.extend_from_slice(controls);
        self.stations.extend(controls.last());
        self.steps.push(Side::Spline(all));
        self
    }

    /// Step `i` with its ends.
    pub(crate) fn step(&self, i: usize) -> PlacedSide<'_> {
        PlacedSide {
            start: self.stations[i],
            end: self.stations[i + 1],
            side: &self.steps[i],
        }
    }
}
