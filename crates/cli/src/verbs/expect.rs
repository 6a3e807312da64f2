//! Runs `partprobe expect`: it derives bounds on scores from finished runs, for the `[expect]` table of a config.

use crate::given_path::are_same_path;
use crate::scored_run::ScoredRun;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_eval::{KBin, METRICS, Metric, ScoreRow};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Derive bounds on scores from finished runs of several seeds
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe expect runs/first runs/second > bounds.toml
  partprobe expect --from runs/seeds --metrics miou,ari,count_error

Each line bounds a score of a label source: its mean over all seeds, minus --deviations standard deviations, rounded down to three
decimals. count_error is bounded from above, because it is an error: plus the deviations, rounded up. Copy the lines into the config
of a run. (The bounds of `partprobe score --expect` name a metric alone, for example miou = \">= 0.6\".) Each seed of a run counts
separately, so one run of three seeds is enough.")]
pub(crate) struct ExpectArgs {
    /// The run folders.
    #[arg(value_name = "RUN", required_unless_present = "from")]
    runs: Vec<PathBuf>,
    /// The run folders, as an option.
    #[arg(long, value_name = "RUN", num_args = 1.., conflicts_with = "runs")]
    from: Vec<PathBuf>,
    /// The scores to bound; `all` means every one that the runs have.
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        default_value = "miou,accuracy,gtc_accuracy,gtc_miou"
    )]
    metrics: Vec<String>,
    /// The distance of a bound from the mean, in standard deviations.
    #[arg(long, value_name = "N", default_value_t = 3.0)]
    deviations: f64,
}

/// The mean of a metric over the shapes of one run and seed.
type SeedMeans = BTreeMap<(String, String, Metric), Vec<f64>>;

/// Prints the table.
///
/// # Errors
/// If a folder is not a scored run, or there are fewer than two seeds in all.
pub(crate) fn expect(args: &ExpectArgs) -> Result<()> {
    ensure!(
        args.deviations.is_finite() && args.deviations >= 0.0,
        UsageError("--deviations must not be negative".to_owned())
    );
    let metrics = named_metrics(&args.metrics)?;
    let runs = if args.from.is_empty() {
        &args.runs
    } else {
        &args.from
    };
    let mut means = SeedMeans::new();
    for (idx, path) in runs.iter().enumerate() {
        ensure!(
            !runs[..idx]
                .iter()
                .any(|earlier| are_same_path(earlier, path)),
            UsageError(format!("{} is given twice", path.display()))
        );
        add_run(&ScoredRun::read(path)?, &metrics, &mut means);
    }
    let n_seeds = means.values().map(Vec::len).max().unwrap_or(0);
    ensure!(
        n_seeds >= 2,
        UsageError(
            "one seed has no standard deviation; give runs of several seeds, or train with compare.seeds = [0, 1, 2]".to_owned()
        )
    );

    print_line("[expect]")?;
    for ((supervision, reference, metric), values) in &means {
        if values.len() < 2 {
            continue;
        }
        let bound = if metric.is_error() {
            format!("<= {:.3}", upper_bound(values, args.deviations))
        } else {
            format!(">= {:.3}", lower_bound(values, args.deviations))
        };
        let name = metric.name;
        print_line(format_args!(
            "\"{supervision}/{reference}.{name}\" = \"{bound}\""
        ))?;
    }
    Ok(())
}

/// The metrics of these names, each once: a metric that counts twice would look like two seeds that agree. `all` means every metric.
fn named_metrics(names: &[String]) -> Result<BTreeSet<Metric>> {
    let mut metrics = BTreeSet::new();
    for name in names {
        if name == "all" {
            metrics.extend(METRICS);
            continue;
        }
        let unknown = || {
            UsageError(format!(
                "--metrics: `{name}` is not a metric; the metrics are {}",
                Metric::known_names()
            ))
        };
        metrics.insert(Metric::named(name).ok_or_else(unknown)?);
    }
    Ok(metrics)
}

/// Adds the means of the label sources of a run, separately for each seed, with the first clusterer of its table.
fn add_run(run: &ScoredRun, metrics: &BTreeSet<Metric>, means: &mut SeedMeans) {
    let Some(clusterer) = run.rows.first().map(|row| row.clusterer.as_str()) else {
        return;
    };
    let counts = |row: &&ScoreRow| {
        row.clusterer == clusterer
            && run.supervision.contains(&row.supervision)
            && KBin::of(row.k).is_in_mean()
    };
    let mut cells: BTreeMap<(&str, &str, u64), Vec<&ScoreRow>> = BTreeMap::new();
    for row in run.rows.iter().filter(counts) {
        let cell = (row.supervision.as_str(), row.reference.as_str(), row.seed);
        cells.entry(cell).or_default().push(row);
    }
    for ((supervision, reference, _), rows) in cells {
        for &metric in metrics {
            let values: Vec<f64> = rows.iter().filter_map(|row| metric.of(row)).collect();
            if !values.is_empty() {
                let key = (supervision.to_owned(), reference.to_owned(), metric);
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                means.entry(key).or_default().push(mean);
            }
        }
    }
}

/// The mean minus a number of standard deviations of the sample, rounded down to three decimals.
fn lower_bound(values: &[f64], n_deviations: f64) -> f64 {
    let [mean, deviation] = mean_and_deviation(values);
    ((mean - n_deviations * deviation).max(0.0) * 1e3).floor() / 1e3
}

/// The mean plus a number of standard deviations of the sample, rounded up to three decimals.
fn upper_bound(values: &[f64], n_deviations: f64) -> f64 {
    let [mean, deviation] = mean_and_deviation(values);
    ((mean + n_deviations * deviation) * 1e3).ceil() / 1e3
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    [mean, (squares / (n - 1.0)).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_lies_beside_the_mean() {
        assert_eq!(lower_bound(&[0.5, 0.6], 0.0), 0.55);
        // The deviation of these is 0.1.
        assert_eq!(lower_bound(&[0.4, 0.5, 0.6], 1.0), 0.4);
        assert_eq!(lower_bound(&[0.1, 0.9], 3.0), 0.0);
        assert_eq!(upper_bound(&[1.0, 2.0, 3.0], 2.0), 4.0);
    }
}
