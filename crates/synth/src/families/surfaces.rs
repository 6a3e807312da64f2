//! Makes parts with gently bent tops: facets at shallow angles, and B-spline surfaces.

use super::plates::furnish;
use crate::feature::{Feature, Rim, draw_hole};
use crate::part_builder::{Host, PartBuilder, cells};
use crate::patch::Patch;
use crate::path::Path;
use crate::profile::Profile;
use crate::spline;
use crate::wavy_block::add_wavy_block;

/// A bar whose top is a chain of facets. Some neighbors meet at an angle below the threshold, others above it.
pub(super) fn dome(builder: &mut PartBuilder) {
    let n_facets = builder.count(2, 9);
    let width = builder.length(15.0, 60.0);
    let base = builder.length(6.0, 15.0);
    let mut slope = builder.fraction(0.1, 0.6);
    let (mut x, mut y) = (0.0, base);
    let mut corners = vec![[0.0, 0.0], [0.0, base]];
    for _ in 0..n_facets {
        let run = builder.length(5.0, 15.0);
        (x, y) = (
            x + run * libm::cos(slope),
            (y + run * libm::sin(slope)).max(2.0),
        );
        corners.push([x, y]);
        // A bend of 3° to 7° keeps two facets in one part, and a bend of 11° to 30° separates them.
        let bend = if builder.chance(0.5) {
            builder.fraction(3.0, 7.0)
        } else {
            builder.fraction(11.0, 30.0)
        };
        slope = (slope - bend.to_radians()).max(-0.9);
    }
    corners.push([x, 0.0]);
    corners.reverse();
    let profile = Profile::polygon(corners);
    let plane = builder.plane;
    let lean = builder.fraction(0.05, 0.12) * width.min(base) * 0.5;
    let path = match builder.chance(0.3) {
        true => Path::at(0.0).by(0.0, 0.6 * width).by(-lean, 0.4 * width),
        false => Path::at(0.0).by(0.0, width),
    };
    let block = builder.block(&plane, &profile, &path);
    let Some(top) = block.top_host(&plane) else {
        return;
    };
    if builder.n_missing_parts() > 2 {
        // The hole is near the start of the bar, which is as high as `base`. Its end may be only 2 mm high.
        let host = Host {
            plane: top.plane,
            depth: 0.4 * width,
            through: None,
            ..top
        };
        let hole = draw_hole(builder, &host, 0.2 * base);
        hole.place(&mut builder.shell, &host, [0.55 * base, 0.5 * base]);
    }
}

/// A block with a wavy top of one or two B-spline surfaces, and features on its bottom.
pub(super) fn wave(builder: &mut PartBuilder) {
    let width = builder.length(30.0, 90.0);
    let depth = builder.length(25.0, 70.0);
    let height = builder.length(12.0, 35.0);
    let two = builder.chance(0.5);
    let middle = if two {
        builder.fraction(0.35, 0.65) * width
    } else {
        width
    };
    let frame = builder.plane;
    let heights = draw_heights(builder, height);
    let first = Patch {
        frame,
        low: [0.0; 2],
        high: [middle, depth],
        heights,
    };
    let patches = match two {
        true => {
            let second = continued(builder, &first, width);
            vec![first, second]
        }
        false => vec![first],
    };
    let bottom = add_wavy_block(&mut builder.shell, &patches);
    // The y axis of the bottom is opposite to that of the block.
    let host = Host {
        plane: frame.flipped(),
        face: bottom,
        depth: 0.45 * height,
        through: None,
    };
    let margin = 0.1 * width.min(depth);
    if builder.chance(0.5) {
        let (centers, room) = cells(
            [margin, margin - depth],
            [width - margin, -margin],
            [2, builder.count(1, 2)],
        );
        let foot = Feature::boss(
            &builder.round(0.5 * room),
            builder.length(2.0, 8.0),
            Rim::Sharp,
            0.0,
        );
        for center in centers {
            foot.place(&mut builder.shell, &host, center);
        }
    } else {
        furnish(
            builder,
            &host,
            [margin, margin - depth],
            [width - margin, -margin],
        );
    }
}

fn draw_heights(builder: &mut PartBuilder, height: f64) -> Vec<Vec<f64>> {
    let (nx, ny) = (builder.count(4, 6), builder.count(4, 6));
    (0..nx)
        .map(|_| {
            (0..ny)
                .map(|_| height * builder.fraction(0.7, 1.3))
                .collect()
        })
        .collect()
}

/// A second patch that continues the first one at its last row, either smoothly or with a crease.
fn continued(builder: &mut PartBuilder, first: &Patch, width: f64) -> Patch {
    let n = first.heights.len();
    let (edge, before) = (&first.heights[n - 1], &first.heights[n - 2]);
    let span = |patch_width: f64, n: usize| {
        patch_width * (spline::greville(n)[1] - spline::greville(n)[0])
    };
    let ratio = span(width - first.high[0], 4) / span(first.high[0] - first.low[0], n);
    let crease = if builder.chance(0.5) {
        0.0
    } else {
        builder.fraction(0.3, 0.8) * ratio
    };
    let mean = edge.iter().sum::<f64>() / edge.len() as f64;
    // The second row continues the slope across the border. A crease changes the slope by the same amount everywhere.
    let second: Vec<f64> = edge
        .iter()
        .zip(before)
        .map(|(at, before)| {
            (at + ratio * (at - before) + crease * 0.3 * mean).clamp(0.3 * mean, 2.0 * mean)
        })
        .collect();
    let mut row = || {
        edge.iter()
            .map(|_| mean * builder.fraction(0.7, 1.3))
            .collect()
    };
    let heights = vec![edge.clone(), second, row(), row()];
    Patch {
        frame: first.frame,
        low: [first.high[0], first.low[1]],
        high: [width, first.high[1]],
        heights,
    }
}
