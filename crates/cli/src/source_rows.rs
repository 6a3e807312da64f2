//! Measures the labels of a source on one shape, for the card of a set of sources.
//!
//! A carrier and labels go in, and the rows of `partprobe_eval`'s card come out. Nothing here reads or writes files.

use partprobe_carrier::{Carrier, WeldedMesh, weld};
use partprobe_eval::{
    CardRow, Confusion, PairRow, adjusted_rand_index, label_borders, length_of_borders,
    size_entropy,
};
use partprobe_sources::SourceLabels;

/// A carrier with the data for measuring every source.
pub(crate) struct MeasuredSurface {
    id: String,
    welded: WeldedMesh,
    areas: Vec<f64>,
    diagonal: f64,
}

impl MeasuredSurface {
    pub(crate) fn of(carrier: &Carrier) -> Self {
        let mesh = carrier.mesh();
        Self {
            id: carrier.meta().id.clone(),
            welded: weld(mesh),
            areas: mesh.triangle_areas(),
            diagonal: mesh.diagonal(),
        }
    }

    /// The row of one source. `group` is the group of related shapes.
    pub(crate) fn row(&self, source: &str, labels: &SourceLabels, group: &str) -> CardRow {
        let of_triangles = labels.of_triangles().of_triangle();
        let borders = label_borders(&self.welded, of_triangles);
        CardRow {
            shape: self.id.clone(),
            group: group.to_owned(),
            source: source.to_owned(),
            n_labels: labels.n_labels(),
            size_entropy: size_entropy(of_triangles, &self.areas),
            border_length: length_of_borders(&borders) / self.diagonal,
        }
    }
}

/// The index of each pair of sources on the points of a shape.
pub(crate) fn pair_rows(of_points: &[(&str, &[i32])], shape: &str, group: &str) -> Vec<PairRow> {
    let mut pairs = Vec::new();
    for (idx, (first, labels)) in of_points.iter().enumerate() {
        for (second, others) in &of_points[idx + 1..] {
            // If no point has a label of both, there is nothing to compare.
            let Ok(confusion) = Confusion::of_labels(others, labels) else {
                continue;
            };
            pairs.push(PairRow {
                shape: shape.to_owned(),
                group: group.to_owned(),
                sources: [(*first).to_owned(), (*second).to_owned()],
                ari: adjusted_rand_index(&confusion),
            });
        }
    }
    pairs
}
