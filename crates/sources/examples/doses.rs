//! Prints how far each dose of the degraded sources is from `step-parts`: a Markdown table.
//!
//! The shapes are 40 generated parts with 4 to 30 STEP-Parts, each with 20 000 points uniform by area. The agreement is the
//! adjusted Rand index: 1 if both labelings are equal, and about 0 if they are independent.

#![allow(clippy::print_stdout, reason = "an example prints what it has made")]

use partprobe_carrier::{Carrier, NormalKind, PointSample, keyed_rng, sample_by_area};
use partprobe_eval::{Confusion, adjusted_rand_index};
use partprobe_label::{LabelOptions, label};
use partprobe_sources::source_named;
use partprobe_synth::{SynthSettings, part};
use std::error::Error;

const N_PARTS: u64 = 40;
const N_POINTS: usize = 20_000;

/// The doses of each kind of damage, from none to the most.
const DOSES: [(&str, &[u32]); 5] = [
    ("step-merged-", &[20, 10, 5, 2, 1]),
    ("step-merged-share-", &[0, 20, 40, 60, 80, 100]),
    ("step-split-", &[10, 20, 40, 80, 160]),
    ("step-flipped-", &[0, 10, 20, 40, 80]),
    ("step-jittered-", &[0, 5, 10, 20, 50]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let shapes = (0..N_PARTS).map(shape).collect::<Result<Vec<_>, _>>()?;
    println!("| source | mean ARI | least ARI | mean labels |");
    println!("|---|---:|---:|---:|");
    for (stem, doses) in DOSES {
        for dose in doses {
            println!("{}", row(&format!("{stem}{dose}"), &shapes)?);
        }
    }
    Ok(())
}

/// A generated part with points of its surface.
fn shape(index: u64) -> Result<(Carrier, PointSample), Box<dyn Error>> {
    let settings = SynthSettings {
        seed: 15,
        min_parts: 4,
        max_parts: 30,
    };
    let generated = part(&settings, index);
    let file = label(
        generated.step.as_bytes(),
        &generated.name,
        &LabelOptions::default(),
    )?;
    let carrier = file.shapes.into_iter().next().ok_or("no shape")?.carrier?;
    let mut rng = keyed_rng(0, &["doses", &generated.name]);
    let sample = sample_by_area(carrier.mesh(), N_POINTS, NormalKind::Triangle, &mut rng)?;
    Ok((carrier, sample))
}

fn row(name: &str, shapes: &[(Carrier, PointSample)]) -> Result<String, Box<dyn Error>> {
    let (mut sum, mut least, mut n_labels) = (0.0, f64::INFINITY, 0);
    for (carrier, sample) in shapes {
        let labels_of = |name: &str| {
            source_named(name)?
                .labels(carrier, 0)?
                .label_of_points(sample)
        };
        let labels = labels_of(name)?;
        let agreement =
            adjusted_rand_index(&Confusion::of_labels(&labels, &labels_of("step-parts")?)?);
        sum += agreement;
        least = agreement.min(least);
        n_labels += labels
            .iter()
            .collect::<std::collections::BTreeSet<_>>()
            .len();
    }
    let n = shapes.len() as f64;
    Ok(format!(
        "| `{name}` | {:.3} | {least:.3} | {:.1} |",
        sum / n,
        n_labels as f64 / n
    ))
}
