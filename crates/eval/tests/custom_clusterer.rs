//! Defines a clusterer outside the workspace's libraries, using only their public functions and types.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_carrier::Embeddings;
use partprobe_cluster::{ClusterError, Clusterer, ClustererFactory, ClustererSettings, Clusters};
use partprobe_eval::{OracleError, TokenizedShape, score_oracle_k};

/// Cuts the rows into runs at the `k - 1` widest gaps between their first entries.
struct WidestGaps;

const FACTORY: ClustererFactory = ClustererFactory {
    name: "widest-gaps",
    make: |_settings| Box::new(WidestGaps),
};
const SETTINGS: ClustererSettings = ClustererSettings {
    restarts: 1,
    max_iterations: 1,
    tolerance: 0.0,
};

impl Clusterer for WidestGaps {
    fn name(&self) -> &'static str {
        FACTORY.name
    }

    fn cluster(
        &self,
        rows: &Embeddings,
        weights: &[u32],
        k: usize,
        _seed: u64,
        _key: &str,
    ) -> Result<Clusters, ClusterError> {
        Clusters::check_input(rows, weights, k)?;

        let mut order: Vec<usize> = (0..rows.n_rows()).collect();
        order.sort_by(|&a, &b| rows.row(a)[0].total_cmp(&rows.row(b)[0]));
        let gap = |place: usize| rows.row(order[place])[0] - rows.row(order[place - 1])[0];
        let mut cuts: Vec<usize> = (1..order.len()).filter(|&place| gap(place) > 0.0).collect();
        cuts.sort_by(|&a, &b| gap(b).total_cmp(&gap(a)));
        cuts.truncate(k - 1);

        let mut groups = vec![0; rows.n_rows()];
        for (place, &row) in order.iter().enumerate() {
            groups[row] = cuts.iter().filter(|&&cut| cut <= place).count() as u32;
        }
        Ok(Clusters::numbered(&groups, 0.0))
    }
}

#[test]
fn a_clusterer_of_another_crate_is_scored_like_those_of_the_list() {
    let embeddings = Embeddings::new(1, vec![9.0, 1.0, 1.5, 9.5, 4.0]).unwrap();
    let shape = TokenizedShape {
        id: "a",
        embeddings: &embeddings,
        multiplicity: &[1, 1, 2, 1, 1],
        token_of_point: &[0, 1, 2, 2, 3, 4],
    };
    let clusterer = (FACTORY.make)(&SETTINGS);

    let found = score_oracle_k(&shape, &[0, 1, 1, 1, 0, 2], clusterer.as_ref(), 0).unwrap();
    assert_eq!(found.predicted, [0, 1, 1, 1, 0, 2]);
    assert_eq!(
        (found.scores.k, found.scores.miou, found.scores.accuracy),
        (3, 1.0, 1.0)
    );

    // Two parts: the widest gap lies between 4 and 9, and the third part's point joins the lower run.
    let found = score_oracle_k(&shape, &[0, 1, 1, 1, 0, 0], clusterer.as_ref(), 0).unwrap();
    assert_eq!(found.predicted, [0, 1, 1, 1, 0, 1]);
    assert_eq!(found.scores.accuracy, 5.0 / 6.0);
}

#[test]
fn refusals_of_a_clusterer_reach_the_caller() {
    let embeddings = Embeddings::new(1, vec![0.0, f32::NAN]).unwrap();
    let shape = TokenizedShape {
        id: "a",
        embeddings: &embeddings,
        multiplicity: &[1, 1],
        token_of_point: &[0, 1],
    };
    let error = score_oracle_k(&shape, &[0, 1], &WidestGaps, 0).unwrap_err();
    assert_eq!(
        error,
        OracleError::Cluster(ClusterError::NotFinite { row: 1 })
    );
}
