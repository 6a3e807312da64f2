//! Scores predicted clusters against reference labels, as arrays of one number per point.
//!
//! ```sh
//! cargo run --release -p partprobe-eval --example score_arrays
//! ```

use partprobe_eval::{ScoreError, score_clusters};

fn main() -> Result<(), ScoreError> {
    // Points with a negative reference label are ignored. The numbers of the clusters have no meaning, because clusters are
    // matched.
    let reference = [0, 0, 0, 0, 1, 1, 1, 2, 2, -1];
    let predicted = [7, 7, 7, 4, 4, 4, 4, 9, 9, 9];
    println!("{:#?}", score_clusters(&predicted, &reference)?);
    Ok(())
}
