//! Defines the arguments for the execution of a training.

use super::shapes::Points;
use partprobe_net::Fault;
use std::time::{Duration, Instant};

/// The weights from which a training starts, and how it is executed.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TrainingArgs {
    /// Start from these weights instead of random ones, like --set 'train.init="WEIGHTS"'. `{source}` and `{seed}` are replaced
    /// by those of the training.
    #[arg(long, value_name = "WEIGHTS")]
    init: Option<String>,
    #[command(flatten)]
    pub(crate) process: TrainingProcessArgs,
}

/// How a training is executed. Only a fault changes its numbers.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TrainingProcessArgs {
    /// The number of threads that load shapes in advance. With 0, the threads of the updates load them when they are needed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub(super) loaders: u16,
    /// Draw the points of a training shape from its carrier each time that it is loaded, instead of keeping them in memory. The
    /// results are the same.
    #[arg(long)]
    resample: bool,
    /// Stop a training after this number of minutes, like Ctrl-C: a checkpoint is written, --resume continues, and the exit code
    /// is 130.
    #[arg(long, value_name = "MINUTES", value_parser = minutes)]
    stop_after: Option<Duration>,
    /// Build a fault into the training, to check whether the run's expectations detect it.
    #[arg(long, value_name = "FAULT", hide = true, value_parser = fault)]
    pub(super) inject_fault: Option<Fault>,
}

impl TrainingArgs {
    /// The arguments of a training whose weights are determined by the config alone.
    pub(crate) fn of_config(process: TrainingProcessArgs) -> Self {
        Self {
            init: None,
            process,
        }
    }

    /// The overrides of the user, and then the overrides from these arguments.
    pub(crate) fn overrides(&self, set: &[String]) -> Vec<String> {
        let init = self.init.iter();
        let init = init.map(|path| format!("train.init={}", toml::Value::from(path.as_str())));
        set.iter().cloned().chain(init).collect()
    }
}

impl TrainingProcessArgs {
    /// The storage of the points of training shapes.
    pub(crate) fn points(&self) -> Points {
        if self.resample {
            Points::Redrawn
        } else {
            Points::Kept
        }
    }

    /// The time at which to stop with a checkpoint.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.stop_after
            .and_then(|time| Instant::now().checked_add(time))
    }
}

fn minutes(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a number of minutes");
    let minutes: f64 = text.parse().map_err(|_| refused())?;
    Duration::try_from_secs_f64(60.0 * minutes).map_err(|_| refused())
}

fn fault(text: &str) -> Result<Fault, String> {
    let names = || Fault::ALL.map(Fault::name).join(", ");
    Fault::ALL
        .into_iter()
        .find(|fault| fault.name() == text)
        .ok_or_else(|| format!("`{text}` is not a fault; these are: {}", names()))
}
