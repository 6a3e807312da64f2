//! Colors that tell labels apart.

use partprobe_carrier::FaceType;
use std::collections::BTreeSet;

/// Red, green and blue.
pub type Rgb = [u8; 3];

/// The colors that labels get; all are light enough to be shaded, and far from white and black.
const COLORS: [[u8; 3]; 18] = [
    [92, 158, 219],
    [242, 142, 72],
    [112, 188, 106],
    [226, 98, 104],
    [160, 124, 208],
    [240, 200, 80],
    [86, 190, 190],
    [236, 140, 190],
    [168, 128, 98],
    [150, 170, 70],
    [78, 118, 188],
    [190, 210, 120],
    [200, 90, 150],
    [120, 200, 235],
    [245, 175, 145],
    [90, 146, 104],
    [200, 180, 230],
    [190, 150, 60],
];
/// The color of what has no label.
pub(crate) const UNLABELED: Rgb = [150; 3];
/// Neighbors whose colors are further apart than this (squared) are told apart without effort.
const FAR_APART: i32 = 110 * 110;

/// The color of a primitive type; the same in every picture and file.
#[must_use]
pub fn color_of_type(face_type: FaceType) -> [u8; 3] {
    match face_type {
        FaceType::Plane => [128, 170, 214],
        FaceType::Cylinder => [242, 152, 78],
        FaceType::Cone => [240, 204, 88],
        FaceType::Sphere => [222, 96, 102],
        FaceType::Torus => [118, 190, 112],
        FaceType::Bezier => [206, 186, 232],
        FaceType::Bspline => [158, 122, 206],
        FaceType::Revolution => [86, 190, 190],
        FaceType::Extrusion => [236, 142, 190],
        FaceType::Offset => [156, 172, 74],
        FaceType::Other => [140, 140, 140],
    }
}

/// A color for each label, such that labels that touch look different.
///
/// `labels` has an entry for each face and `pairs` are faces that touch; the result has an entry for each face too.
/// A face with a negative label is grey.
#[must_use]
pub fn colors_of_labels(labels: &[i32], pairs: impl Iterator<Item = [u32; 2]>) -> Vec<[u8; 3]> {
    let n_labels = labels
        .iter()
        .max()
        .map_or(0, |&max| usize::try_from(max + 1).unwrap_or(0));
    let mut neighbors = vec![BTreeSet::new(); n_labels];
    for pair in pairs {
        if let [Ok(a), Ok(b)] = pair.map(|face| usize::try_from(labels[face as usize]))
            && a != b
        {
            neighbors[a].insert(b);
            neighbors[b].insert(a);
        }
    }
    let chosen = chosen_colors(&neighbors, &[]);
    let color = |&label: &i32| usize::try_from(label).map_or(UNLABELED, |label| chosen[label]);
    labels.iter().map(color).collect()
}

/// A color for each label. `neighbors` are the labels that each label touches; `fixed` gives the colors that are decided
/// already, and may be shorter.
pub(crate) fn chosen_colors(neighbors: &[BTreeSet<usize>], fixed: &[Option<Rgb>]) -> Vec<Rgb> {
    let decided = |label: usize| fixed.get(label).copied().flatten();
    let mut chosen: Vec<Option<Rgb>> = (0..neighbors.len()).map(decided).collect();
    let mut n_uses = COLORS.map(|color| chosen.iter().filter(|&&used| used == Some(color)).count());
    for (label, touching) in neighbors.iter().enumerate() {
        if chosen[label].is_some() {
            continue;
        }
        let taken: Vec<Rgb> = touching.iter().filter_map(|&other| chosen[other]).collect();
        let color = best_color(&taken, &n_uses);
        n_uses[color] += 1;
        chosen[label] = Some(COLORS[color]);
    }
    let color = |color: Option<Rgb>| color.unwrap_or(UNLABELED);
    chosen.into_iter().map(color).collect()
}

/// The color that is far from all taken ones; among those the least used, then the first.
fn best_color(taken: &[[u8; 3]], n_uses: &[usize; COLORS.len()]) -> usize {
    let margin = |color: [u8; 3]| {
        taken
            .iter()
            .map(|&other| distance(color, other))
            .min()
            .unwrap_or(FAR_APART)
    };
    let rank = |color: usize| {
        (
            margin(COLORS[color]).min(FAR_APART),
            std::cmp::Reverse((n_uses[color], color)),
        )
    };
    (0..COLORS.len())
        .max_by_key(|&color| rank(color))
        .unwrap_or(0)
}

/// The square of the distance of two colors.
fn distance(a: [u8; 3], b: [u8; 3]) -> i32 {
    (0..3)
        .map(|channel| (i32::from(a[channel]) - i32::from(b[channel])).pow(2))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_look_different() {
        // A fan: label 0 touches all others, each other touches the next.
        let labels: Vec<i32> = (0..60).collect();
        let spokes = (1..60).map(|other| [0, other]);
        let rim = (1..59).map(|other| [other, other + 1]);
        let pairs: Vec<[u32; 2]> = spokes.chain(rim).collect();
        let colors = colors_of_labels(&labels, pairs.iter().copied());
        for [a, b] in pairs {
            assert!(
                distance(colors[a as usize], colors[b as usize]) > 50 * 50,
                "{a} and {b}"
            );
        }
    }

    #[test]
    fn faces_of_one_label_share_a_color_and_no_label_is_grey() {
        let colors = colors_of_labels(&[1, 0, 1, -1], [[0, 1], [1, 2], [2, 3]].into_iter());
        assert_eq!((colors[0], colors[3]), (colors[2], UNLABELED));
        assert_ne!(colors[0], colors[1]);
        assert_eq!(
            colors_of_labels(&[], std::iter::empty()),
            Vec::<[u8; 3]>::new()
        );
    }

    #[test]
    fn types_have_colors_of_their_own() {
        for (code, a) in FaceType::ALL.into_iter().enumerate() {
            for b in &FaceType::ALL[..code] {
                assert!(
                    distance(color_of_type(a), color_of_type(*b)) > 20 * 20,
                    "{a} and {b}"
                );
            }
        }
    }
}
