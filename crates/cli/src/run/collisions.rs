//! Counts the points whose voxel has another label, for each source. They limit the scores of networks with tokens.

use super::folder::RunFolder;
use anyhow::Result;
use partprobe_carrier::PointSample;
use partprobe_net::Voxels;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// The file of a run folder with the fractions.
const FILE: &str = "collisions.json";

/// The fractions of a run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct Collisions {
    format_version: u32,
    pub(crate) train: SplitCollisions,
    pub(crate) test: SplitCollisions,
}

/// The fractions of the shapes of one split.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct SplitCollisions {
    /// The approximate number of tokens of a shape.
    tokens: usize,
    /// The mean fraction over the shapes, by label source.
    share: BTreeMap<String, f64>,
}

impl SplitCollisions {
    /// Divides each shape, without rotation, into about `tokens` tokens, and counts. `shape_at` gives its points and, by source,
    /// their labels.
    ///
    /// # Errors
    /// If the points of a shape cannot be read, or not be divided into tokens.
    pub(crate) fn of<'a>(
        n_shapes: usize,
        tokens: usize,
        voxels: Voxels,
        shape_at: impl Fn(usize) -> Result<(Cow<'a, PointSample>, &'a BTreeMap<String, Vec<i32>>)>
        + Sync,
    ) -> Result<Self> {
        let each: Vec<BTreeMap<&str, f64>> = (0..n_shapes)
            .into_par_iter()
            .map(|idx| {
                let (sample, labels) = shape_at(idx)?;
                let cut = partprobe_net::tokenize(&sample, tokens, voxels)?;
                Ok(labels
                    .iter()
                    .map(|(source, labels)| (source.as_str(), cut.label_collisions(labels)))
                    .collect())
            })
            .collect::<Result<_>>()?;
        let mut share: BTreeMap<String, f64> = BTreeMap::new();
        for (source, own) in each.iter().flatten() {
            *share.entry((*source).to_owned()).or_default() += own / each.len() as f64;
        }
        Ok(Self { tokens, share })
    }
}

impl Collisions {
    pub(crate) fn new(train: SplitCollisions, test: SplitCollisions) -> Self {
        Self {
            format_version: partprobe_formats::FORMAT_VERSION,
            train,
            test,
        }
    }

    /// The collisions in the run folder. Returns `None` if the file does not exist.
    pub(crate) fn read(folder: &RunFolder) -> Result<Option<Self>> {
        if !folder.path(FILE).exists() {
            return Ok(None);
        }
        folder
            .read_json(FILE, "remove the file, and it is made again")
            .map(Some)
    }

    pub(crate) fn write(&self, folder: &RunFolder) -> Result<()> {
        folder.write_json(FILE, self)
    }
}

impl fmt::Display for Collisions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "points whose token has another label: ")?;
        for (idx, (source, train)) in self.train.share.iter().enumerate() {
            let test = self.test.share.get(source).copied().unwrap_or(0.0);
            let before = if idx == 0 { "" } else { "; " };
            write!(
                f,
                "{before}{source} {:.2} % in training, {:.2} % at test",
                100.0 * train,
                100.0 * test
            )?;
        }
        write!(
            f,
            " ({} and {} tokens)",
            self.train.tokens, self.test.tokens
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sides of a thin plate, each with its own label, and a second source with only one label.
    fn plate() -> (PointSample, BTreeMap<String, Vec<i32>>) {
        let mut sample = PointSample::default();
        for idx in 0..200 {
            let up = idx % 2;
            sample.points.push([
                (idx / 2 / 10) as f32,
                (idx / 2 % 10) as f32,
                1e-3 * up as f32,
            ]);
            sample
                .normals
                .push([0.0, 0.0, if up == 1 { 1.0 } else { -1.0 }]);
            sample.triangles.push(up);
        }
        let sides = (0..200).map(|idx| idx % 2).collect();
        (
            sample,
            BTreeMap::from([
                ("sides".to_owned(), sides),
                ("whole".to_owned(), vec![0; 200]),
            ]),
        )
    }

    #[test]
    fn the_share_is_counted_by_source_and_reported_by_split() {
        let (sample, labels) = plate();
        let count = |voxels| {
            SplitCollisions::of(1, 50, voxels, |_| Ok((Cow::Borrowed(&sample), &labels))).unwrap()
        };
        let (plain, keyed) = (count(Voxels::Plain), count(Voxels::NormalKeyed));
        assert_eq!((plain.share["sides"], plain.share["whole"]), (0.5, 0.0));
        assert_eq!(keyed.share["sides"], 0.0);
        assert_eq!(
            Collisions::new(plain, keyed).to_string(),
            "points whose token has another label: sides 50.00 % in training, 0.00 % at test; whole 0.00 % in training, \
             0.00 % at test (50 and 50 tokens)"
        );
    }
}
