//! Chooses the sheet or the patch of a surface on which a face lies, if the surface covers itself or consists of patches.

use super::implicit_bounds::revolved_between_ends;
use super::surface_table::SharedSurface;
use super::topology::{ShellContext, TopologyBuilder};
use crate::geometry::{
    Curve, Frame, Surface, half_of_covered_twice, revolution_sheets, revolved_sphere,
};
use crate::model::Loop;
use partprobe_shape::{Point, bounding_diagonal, dot};
use std::f64::consts::PI;
use std::sync::Arc;

/// Number of pieces of each edge whose ends must lie on a patch. It is odd, because half of an edge may follow the side of a
/// patch.
const POINTS_ON_PATCH: usize = 5;

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// The surface of one half of a revolved curve that covers its surface twice, such as an ellipse around its own axis. For a
    /// circle it is a sphere. A face without edges keeps the surface of the whole curve.
    pub(super) fn covered_once(
        &self,
        context: ShellContext<'s, 'a>,
        shared: SharedSurface,
        id: u64,
        loops: &[Loop],
    ) -> SharedSurface {
        let Surface::Revolution { axis, curve } = &*shared.surface else {
            return shared;
        };
        if curve.period().is_none()
            || loops
                .iter()
                .all(|boundary| matches!(boundary, Loop::Vertex(_)))
        {
            return shared;
        }

        // If the file trims the curve, the middle of the trimmed piece decides which half is used.
        let record = self.source.record(id).ok();
        let ended = record
            .and_then(|record| revolved_between_ends(&context.reader, &shared.surface, record));
        let middle = ended.and_then(|surface| match surface {
            Surface::Revolution { curve, .. } => middle_of_arc(&curve),
            _ => None,
        });
        if let Some((sphere, is_outward)) = revolved_sphere(axis, curve, middle) {
            return SharedSurface {
                surface: Arc::new(sphere),
                same_sense: shared.same_sense == is_outward,
                ..shared
            };
        }
        match half_of_covered_twice(axis, curve, middle) {
            Some(half) => SharedSurface {
                surface: Arc::new(half),
                ..shared
            },
            None => shared,
        }
    }

    /// The sheet of a torus that meets itself. Such a torus has two sheets. The corners of the face decide on which sheet it
    /// lies, because the parameters do not.
    pub(super) fn on_its_sheet(
        &self,
        shared: SharedSurface,
        same_sense: bool,
        loops: &[Loop],
    ) -> SharedSurface {
        if let Surface::Revolution { axis, curve } = &*shared.surface {
            let Some(sheets) = revolution_sheets(axis, curve) else {
                return shared;
            };
            return if loops
                .iter()
                .all(|boundary| matches!(boundary, Loop::Vertex(_)))
            {
                let looks_outward = same_sense == shared.same_sense;
                let sheet = sheets
                    .into_iter()
                    .find(|sheet| faces_away(axis, sheet) == looks_outward);
                sheet.map_or(shared.clone(), |sheet| SharedSurface {
                    surface: Arc::new(sheet),
                    ..shared
                })
            } else {
                self.on_nearer_sheet(shared, sheets, loops)
            };
        }
        let Surface::Torus {
            frame,
            major,
            minor,
        } = *shared.surface
        else {
            return shared;
        };
        if major <= 0.0 || major >= minor {
            return shared;
        }
        let corners: Vec<Point> = loops
            .iter()
            .flat_map(|boundary| self.edges.corners(boundary))
            .collect();
        let gap = |surface: &Surface| {
            corners
                .iter()
                .map(|&corner| surface.project(corner, None).distance)
                .fold(0.0, f64::max)
        };
        let inner = Surface::Torus {
            frame,
            major: -major,
            minor,
        };
        // The sheets meet at the tips, where neither of them is nearer.
        let outer_gap = gap(&shared.surface);
        if outer_gap > 1e-6 * minor && gap(&inner) < 0.5 * outer_gap {
            // On the inner sheet, `∂u × ∂v` of the whole torus has the opposite direction.
            SharedSurface {
                surface: Arc::new(inner),
                same_sense: !shared.same_sense,
                ..shared
            }
        } else {
            shared
        }
    }

    /// The sheet of a surface of revolution on which the face's edges lie. If neither sheet is nearer, it is the whole surface.
    pub(super) fn on_nearer_sheet(
        &self,
        shared: SharedSurface,
        sheets: [Surface; 2],
        loops: &[Loop],
    ) -> SharedSurface {
        let along = |boundary| self.edges.points_along(boundary, POINTS_ON_PATCH);
        let points: Vec<Point> = loops.iter().flat_map(along).collect();
        let gap = |sheet: &Surface| {
            points
                .iter()
                .map(|&point| sheet.project(point, None).distance)
                .fold(0.0, f64::max)
        };
        let [one, other] = sheets;
        let (beside_one, beside_other) = (gap(&one), gap(&other));
        let size = bounding_diagonal(&points);
        match [
            (beside_one, beside_other, one),
            (beside_other, beside_one, other),
        ]
        .into_iter()
        .find(|(near, far, _)| *far > 1e-6 * size && *near < 0.5 * far)
        {
            Some((_, _, sheet)) => SharedSurface {
                surface: Arc::new(sheet),
                ..shared
            },
            None => shared,
        }
    }

    /// The surface of the patch on which a face lies, if it lies on a single patch of a composite.
    pub(super) fn on_its_patch(&self, shared: SharedSurface, loops: &[Loop]) -> SharedSurface {
        let Surface::Composite(composite) = &*shared.surface else {
            return shared;
        };
        let along = |boundary| self.edges.points_along(boundary, POINTS_ON_PATCH);
        let points: Vec<Point> = loops.iter().flat_map(along).collect();
        match composite
            .patches
            .iter()
            .find(|patch| !points.is_empty() && patch.covers(&points))
        {
            Some(patch) => SharedSurface {
                surface: Arc::new(patch.surface.clone()),
                face_type: patch.face_type,
                same_sense: shared.same_sense != patch.is_reversed(),
            },
            None => shared,
        }
    }
}

/// The parameter of the basis in the middle of a curve that consists of one piece of at most half a turn. A longer arc is in both
/// halves.
fn middle_of_arc(curve: &Curve) -> Option<f64> {
    let Curve::Composite(segments) = curve else {
        return None;
    };
    let [segment] = &segments[..] else {
        return None;
    };
    let is_in_one_half = (segment.end - segment.start).abs() <= PI + 1e-6;
    is_in_one_half.then_some(0.5 * (segment.start + segment.end))
}

/// Whether the normal `∂u × ∂v` of a revolved arc points away from the axis. A face without an edge is the sheet that has
/// material inside: a whole apple or a whole lemon.
fn faces_away(axis: &Frame, sheet: &Surface) -> bool {
    let [x, y, _] = axis.local(sheet.point(0.0, 0.5));
    sheet
        .unit_normal(0.0, 0.5)
        .is_some_and(|normal| dot(normal, axis.vector(x, y, 0.0)) > 0.0)
}
