//! Measures the transfer ceiling: the agreement of labels with themselves after a channel.
//!
//! If the agreement is 0.6 and the ceiling of the channel is 0.65, the labels are nearly equal. Therefore every table of
//! agreements also contains the ceiling.

use crate::channel::{Channel, Target, TransferredLabels, carry};
use crate::query::{Limits, Query};
use crate::surface::{LabeledSurface, TransferError};

/// Labels, and the same labels after a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Ceiling {
    /// The label of each point by its own triangle.
    pub own: Vec<i32>,
    /// The label of each point after the channel.
    pub carried: TransferredLabels,
}

impl Ceiling {
    /// The fraction of the labeled points whose label came through unchanged; 1 if no point has a label.
    ///
    /// A score that renames labels, such as the accuracy after Hungarian matching, can be computed from `own` and `carried`. It
    /// is at least as large as this agreement.
    #[must_use]
    pub fn agreement(&self) -> f64 {
        let labeled = self.own.iter().zip(&self.carried.labels);
        let (mut n_labeled, mut n_equal) = (0usize, 0usize);
        for (own, carried) in labeled.filter(|&(&own, _)| own >= 0) {
            n_labeled += 1;
            n_equal += usize::from(own == carried);
        }
        if n_labeled == 0 {
            1.0
        } else {
            n_equal as f64 / n_labeled as f64
        }
    }
}

/// Sends the labels of a surface through a channel to points of the same surface.
///
/// # Errors
/// If there are more or fewer triangles than points, or a triangle of a point does not exist.
pub fn ceiling(
    channel: Channel,
    labeled: &LabeledSurface<'_>,
    points: &[Query],
    triangles: &[u32],
    limits: &Limits,
) -> Result<Ceiling, TransferError> {
    let target = Target {
        surface: labeled.surface(),
        points,
        triangles,
    };
    let own = carry(Channel::Index, labeled, &target, limits)?;
    Ok(Ceiling {
        own: own.labels,
        carried: carry(channel, labeled, &target, limits)?,
    })
}
