//! Takes the label of the nearest labeled point: channel `nn-point`.

use crate::box_tree::{Bounds, BoxTree};
use crate::query::{Limits, Nearest, Query, normals_agree};
use crate::surface::TransferError;
use partprobe_carrier::{Point, dot, subtract};

/// A cloud that is prepared for searches of its nearest point.
#[derive(Clone, Debug)]
pub struct NearestPoint {
    tree: BoxTree,
    positions: Vec<Point>,
    /// The normal of each point. The list is empty if the cloud has none.
    normals: Vec<Point>,
}

impl NearestPoint {
    /// Prepares a cloud. `normals` has one unit normal per point, or is empty. Without normals, no point satisfies a limit on
    /// angles.
    ///
    /// # Errors
    /// If there are normals, but not one per point.
    pub fn new(positions: &[Point], normals: &[Point]) -> Result<Self, TransferError> {
        if !normals.is_empty() && normals.len() != positions.len() {
            return Err(TransferError::PointCount {
                list: "normals",
                n_points: positions.len(),
                found: normals.len(),
            });
        }
        let bounds: Vec<Bounds> = positions
            .iter()
            .map(|&point| Bounds::around(&[point]))
            .collect();
        Ok(Self {
            tree: BoxTree::new(&bounds),
            positions: positions.to_vec(),
            normals: normals.to_vec(),
        })
    }

    /// The nearest point within the limits. At equal distances, the lowest one is returned.
    #[must_use]
    pub fn nearest(&self, query: &Query, limits: &Limits) -> Option<Nearest> {
        let min_cosine = limits.min_cosine();
        let squared_distance = |_, point: u32| {
            let normal = self.normals.get(point as usize).copied();
            let agrees = normals_agree(query, normal.unwrap_or_default(), min_cosine);
            agrees.then(|| {
                let apart = subtract(query.position, self.positions[point as usize]);
                dot(apart, apart)
            })
        };
        let max_squared = limits.max_distance * limits.max_distance;
        let found = self
            .tree
            .nearest(query.position, max_squared, None, squared_distance)?;
        Some(Nearest {
            item: found.item,
            distance: found.squared_distance.sqrt(),
        })
    }
}
