//! Chooses colors that distinguish labels.

use partprobe_carrier::FaceType;
use std::cmp::Reverse;
use std::collections::BTreeSet;

/// Red, green and blue.
pub type Rgb = [u8; 3];

/// The colors of labels. All are light enough to be shaded, and differ clearly from white, black and the grey of surfaces without
/// a label.
///
/// Each two differ by at least 15 in CIE L*a*b* (CIE 1976), for full color vision and for deuteranopes as Machado, Oliveira and
/// Fernandes (2009) simulate them. The first ones are used most.
const COLORS: [Rgb; 20] = [
    [72, 204, 252],
    [242, 142, 72],
    [112, 188, 106],
    [160, 124, 208],
    [236, 140, 190],
    [216, 204, 60],
    [72, 108, 180],
    [180, 84, 72],
    [190, 210, 120],
    [60, 120, 156],
    [72, 204, 144],
    [168, 132, 60],
    [200, 180, 230],
    [90, 146, 104],
    [204, 108, 180],
    [252, 192, 204],
    [156, 144, 252],
    [216, 216, 168],
    [120, 96, 216],
    [180, 72, 132],
];
/// The color of surfaces without a label.
pub(crate) const UNLABELED: Rgb = [150; 3];
/// Colors with a larger squared distance than this are easy to distinguish.
const DISTINCT_DISTANCE: i32 = 110 * 110;

/// The color of a primitive type. It is the same in every picture and file. Each two types differ as much as labels do.
#[must_use]
pub fn color_of_type(face_type: FaceType) -> [u8; 3] {
    match face_type {
        FaceType::Plane => [126, 171, 215],
        FaceType::Cylinder => [243, 152, 79],
        FaceType::Cone => [248, 212, 92],
        FaceType::Sphere => [211, 88, 92],
        FaceType::Torus => [130, 198, 121],
        FaceType::Bezier => [210, 193, 241],
        FaceType::Bspline => [148, 117, 201],
        FaceType::Revolution => [60, 185, 185],
        FaceType::Extrusion => [252, 153, 195],
        FaceType::Offset => [143, 163, 73],
        FaceType::Other => [140, 140, 140],
    }
}

/// One color per label, such that labels that touch never have the same color.
///
/// `labels` has one entry per face, and `pairs` are faces that touch. The result also has one entry per face. A face with a
/// negative label is grey.
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

/// One color per label. `neighbors` are the labels that each label touches. `fixed` gives the colors that are already determined,
/// and may be shorter.
///
/// Labels with many neighbors are colored first, so that there is still a color for a large part between many small ones (Welsh
/// and Powell 1967).
pub(crate) fn chosen_colors(neighbors: &[BTreeSet<usize>], fixed: &[Option<Rgb>]) -> Vec<Rgb> {
    let decided = |label: usize| fixed.get(label).copied().flatten();
    let mut chosen: Vec<Option<Rgb>> = (0..neighbors.len()).map(decided).collect();
    let mut n_uses = COLORS.map(|color| chosen.iter().filter(|&&used| used == Some(color)).count());
    let mut order: Vec<usize> = (0..neighbors.len()).collect();
    order.sort_by_key(|&label| (Reverse(neighbors[label].len()), label));

    for label in order {
        if chosen[label].is_some() {
            continue;
        }
        let touching = neighbors[label].iter();
        let taken: Vec<Rgb> = touching.filter_map(|&other| chosen[other]).collect();
        chosen[label] = Some(match best_color(&taken, &n_uses) {
            Some(color) => {
                n_uses[color] += 1;
                COLORS[color]
            }
            None => further_color(&taken),
        });
    }
    let color = |color: Option<Rgb>| color.unwrap_or(UNLABELED);
    chosen.into_iter().map(color).collect()
}

/// The unused color that is furthest from the taken ones, so that up to twenty labels have different colors. If all colors are in
/// use, it is one that is far from the taken ones: the least used one, and then the first. Returns `None` if all are taken.
fn best_color(taken: &[Rgb], n_uses: &[usize; COLORS.len()]) -> Option<usize> {
    let rank = |color: usize| {
        let margin = margin(COLORS[color], taken).min(DISTINCT_DISTANCE);
        (n_uses[color] == 0, margin, Reverse((n_uses[color], color)))
    };
    (0..COLORS.len())
        .filter(|&color| !taken.contains(&COLORS[color]))
        .max_by_key(|&color| rank(color))
}

/// A color outside of the list, as far as possible from the taken ones.
fn further_color(taken: &[Rgb]) -> Rgb {
    let levels = || (6..=24).map(|level| level * 10);
    let grid = levels().flat_map(|r| levels().flat_map(move |g| levels().map(move |b| [r, g, b])));
    // The first of the farthest colors, so that the result depends only on the taken colors.
    grid.map(|color| (margin(color, taken), Reverse(color)))
        .max()
        .map_or(UNLABELED, |(_, Reverse(color))| color)
}

/// The square of the distance to the nearest of these colors.
fn margin(color: Rgb, others: &[Rgb]) -> i32 {
    let distances = others.iter().map(|&other| distance(color, other));
    distances.min().unwrap_or(DISTINCT_DISTANCE)
}

/// The square of the distance of two colors.
fn distance(a: Rgb, b: Rgb) -> i32 {
    (0..3)
        .map(|channel| (i32::from(a[channel]) - i32::from(b[channel])).pow(2))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Intensities of light from 0 to 1, which a screen shows for a color (sRGB, IEC 61966-2-1).
    fn light(color: Rgb) -> [f64; 3] {
        color.map(|value| match f64::from(value) / 255.0 {
            low if low <= 0.04045 => low / 12.92,
            high => ((high + 0.055) / 1.055).powf(2.4),
        })
    }

    fn product(matrix: [[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// The light as a deuteranope sees it (Machado, Oliveira and Fernandes 2009, severity 1).
    fn deuteranopia(light: [f64; 3]) -> [f64; 3] {
        let matrix = [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ];
        product(matrix, light).map(|value| value.clamp(0.0, 1.0))
    }

    /// Lightness and the two opponent colors (CIE 1976 L*a*b*, white D65).
    fn lab(light: [f64; 3]) -> [f64; 3] {
        let to_xyz = [
            [0.412_456_4, 0.357_576_1, 0.180_437_5],
            [0.212_672_9, 0.715_152_2, 0.072_175_0],
            [0.019_333_9, 0.119_192_0, 0.950_304_1],
        ];
        let [x, y, z] = product(to_xyz, light);
        let [x, y, z] = [x / 0.950_47, y, z / 1.088_83].map(|ratio| {
            if ratio > 216.0 / 24_389.0 {
                ratio.cbrt()
            } else {
                (24_389.0 / 27.0 * ratio + 16.0) / 116.0
            }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    }

    /// The smaller of the differences of two colors for full color vision and for deuteranopes.
    fn seen_difference(a: Rgb, b: Rgb) -> f64 {
        let full = difference(lab(light(a)), lab(light(b)));
        let dichromat = difference(lab(deuteranopia(light(a))), lab(deuteranopia(light(b))));
        full.min(dichromat)
    }

    #[track_caller]
    fn check_palette(colors: &[Rgb]) {
        for (idx, &a) in colors.iter().enumerate() {
            for &b in &colors[..idx] {
                let seen = seen_difference(a, b);
                assert!(seen >= 15.0, "{a:?} and {b:?}: {seen:.1}");
            }
        }
    }

    #[test]
    fn each_two_colors_differ_for_everybody() {
        check_palette(&COLORS);
        check_palette(&FaceType::ALL.map(color_of_type));
        for color in COLORS {
            assert!(seen_difference(color, UNLABELED) >= 8.0, "{color:?}");
        }
    }

    #[track_caller]
    fn check_touching(n_labels: i32, pairs: &[[u32; 2]]) {
        let labels: Vec<i32> = (0..n_labels).collect();
        let colors = colors_of_labels(&labels, pairs.iter().copied());
        for &[a, b] in pairs.iter().filter(|[a, b]| a != b) {
            assert_ne!(colors[a as usize], colors[b as usize], "{a} and {b}");
        }
    }

    #[test]
    fn labels_that_touch_never_share_a_color() {
        // A fan: the last label touches all others, and each of the others touches the next one.
        let spokes = (0..59).map(|other| [59, other]);
        let rim = (0..58).map(|other| [other, other + 1]);
        check_touching(60, &spokes.chain(rim).collect::<Vec<_>>());
        // All labels touch each other, and there are more labels than colors.
        let all = (0..30).flat_map(|a| (0..a).map(move |b| [a, b]));
        check_touching(30, &all.collect::<Vec<_>>());
        // Many random neighbors.
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % 200
        };
        let pairs: Vec<[u32; 2]> = (0..3000).map(|_| [next(), next()]).collect();
        check_touching(200, &pairs);
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
}
