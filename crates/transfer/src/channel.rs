//! Lists the channels from a labeled surface to points, and carries labels through them.

use crate::nearest_surface::NearestSurface;
use crate::nearest_vertex::NearestVertex;
use crate::query::{Limits, Query, for_all_from};
use crate::surface::{LabeledSurface, Surface, TransferError};
use crate::triangle_match::match_triangles;
use partprobe_carrier::IGNORE;
use std::fmt;

/// A way to carry labels from the triangles of one surface to points of another.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Channel {
    /// Both surfaces have the same triangles in the same order. Nothing is lost.
    Index,
    /// Triangles with the same corners correspond, within a tolerance in the unit of the positions.
    Triangle {
        /// The largest distance between two corners that count as the same.
        tolerance: f64,
    },
    /// The label of the nearest point of the labeled surface.
    NnSurface,
    /// The label that most triangles at the nearest vertex have. The paper uses this channel for its comparison.
    NnVertex,
}

impl Channel {
    /// The name in tables and settings.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Index => "index",
            Self::Triangle { .. } => "triangle",
            Self::NnSurface => "nn-surface",
            Self::NnVertex => "nn-vertex",
        }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The points that need labels, and the surface from which they were drawn.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// The surface of the points.
    pub surface: Surface<'a>,
    /// The points.
    pub points: &'a [Query],
    /// The triangle of each point.
    pub triangles: &'a [u32],
}

/// The labels after a channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransferredLabels {
    /// The label of each point, or [`IGNORE`] if the point got no label.
    pub labels: Vec<i32>,
    /// How many points have no label.
    pub n_unlabeled: usize,
}

impl TransferredLabels {
    fn new(labels: Vec<i32>) -> Self {
        let n_unlabeled = labels.iter().filter(|&&label| label < 0).count();
        Self {
            labels,
            n_unlabeled,
        }
    }
}

/// Carries labels through a channel. Only the channels that search for a nearest item use the limits.
///
/// # Errors
/// If the lists of the target do not fit each other, or the channel is `index` and the surfaces have different numbers of
/// triangles.
pub fn carry(
    channel: Channel,
    labeled: &LabeledSurface<'_>,
    target: &Target<'_>,
    limits: &Limits,
) -> Result<TransferredLabels, TransferError> {
    check_target(target)?;
    let labels = match channel {
        Channel::Index => by_index(labeled, target)?,
        Channel::Triangle { tolerance } => by_triangle(labeled, target, tolerance),
        Channel::NnSurface => {
            let nearest = NearestSurface::new(labeled.surface());
            for_all_from(target.points, |query, start| {
                let found = nearest.nearest_from(query, limits, start);
                found.map_or(IGNORE, |found| labeled.labels()[found.item as usize])
            })
        }
        Channel::NnVertex => {
            let nearest = NearestVertex::new(labeled);
            for_all_from(target.points, |query, start| {
                let label = nearest.label_from(query, limits, start);
                label.unwrap_or(IGNORE)
            })
        }
    };
    Ok(TransferredLabels::new(labels))
}

fn check_target(target: &Target<'_>) -> Result<(), TransferError> {
    let n_triangles = target.surface.triangles().len();
    if target.triangles.len() != target.points.len() {
        return Err(TransferError::PointCount {
            list: "triangles",
            n_points: target.points.len(),
            found: target.triangles.len(),
        });
    }
    match target
        .triangles
        .iter()
        .find(|&&triangle| triangle as usize >= n_triangles)
    {
        Some(&triangle) => Err(TransferError::Corner {
            triangle: triangle as usize,
            n_vertices: target.surface.vertices().len(),
        }),
        None => Ok(()),
    }
}

fn by_index(labeled: &LabeledSurface<'_>, target: &Target<'_>) -> Result<Vec<i32>, TransferError> {
    let n_labeled = labeled.labels().len();
    let n_triangles = target.surface.triangles().len();
    if n_labeled != n_triangles {
        return Err(TransferError::OtherCount {
            n_labeled,
            n_triangles,
        });
    }
    let of_triangle = |&triangle: &u32| labeled.labels()[triangle as usize];
    Ok(target.triangles.iter().map(of_triangle).collect())
}

/// A triangle gets no label if several labeled triangles have its corners and their labels differ.
fn by_triangle(labeled: &LabeledSurface<'_>, target: &Target<'_>, tolerance: f64) -> Vec<i32> {
    let matched = match_triangles(labeled.surface(), target.surface, tolerance);
    let label_of = |source: u32| labeled.labels()[source as usize];
    let mut label_of_triangle: Vec<i32> = matched
        .source_of
        .iter()
        .map(|source| source.map_or(IGNORE, label_of))
        .collect();
    for (triangle, sources) in &matched.several {
        let first = label_of_triangle[*triangle as usize];
        if sources.iter().any(|&source| label_of(source) != first) {
            label_of_triangle[*triangle as usize] = IGNORE;
        }
    }
    let of_point = |&triangle: &u32| label_of_triangle[triangle as usize];
    target.triangles.iter().map(of_point).collect()
}
