//! Lists the commands. Each one has a file or folder with its arguments.
//!
//! A command reads its arguments, calls the libraries, and prints. To add one, write its module, and add a line to each of
//! the three lists below.

mod attach;
mod bench;
mod calibrate;
mod check;
mod compare;
mod completions;
mod config;
#[cfg(feature = "train")]
mod embed;
#[cfg(feature = "train")]
mod eval;
mod expect;
mod export;
mod extract;
#[cfg(feature = "train")]
mod false_alarms;
mod inspect;
mod label;
mod merge;
#[cfg(feature = "train")]
mod models;
#[cfg(feature = "train")]
mod parity;
mod registry;
mod release;
mod render;
#[cfg(feature = "train")]
mod replay;
mod report;
#[cfg(feature = "train")]
mod rerun;
#[cfg(feature = "train")]
mod run;
mod runs;
mod sample;
mod score;
mod sources;
mod status;
mod synth;
mod tessellation;
#[cfg(feature = "train")]
mod train;
#[cfg(feature = "train")]
mod verdict;
mod verify;
#[cfg(feature = "train")]
mod weights;

use crate::label::{WorkerArgs, worker};
use anyhow::Result;
use clap::Subcommand;
use std::process::ExitCode;

/// The verbs of the program.
#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    #[cfg(feature = "train")]
    Run(run::RunArgs),
    Label(label::LabelArgs),
    Merge(merge::MergeArgs),
    Status(status::StatusArgs),
    Sample(sample::SampleArgs),
    #[cfg(feature = "train")]
    Train(train::TrainArgs),
    #[cfg(feature = "train")]
    Replay(replay::ReplayArgs),
    #[cfg(feature = "train")]
    Embed(embed::EmbedArgs),
    #[cfg(feature = "train")]
    Nearest(embed::NearestArgs),
    #[cfg(feature = "train")]
    Predict(export::PredictArgs),
    #[cfg(feature = "train")]
    Eval(eval::EvalArgs),
    Inspect(inspect::InspectArgs),
    Extract(extract::ExtractArgs),
    Render(render::RenderArgs),
    Synth(synth::SynthArgs),
    Verify(verify::VerifyArgs),
    Export(export::ExportArgs),
    Release(release::ReleaseArgs),
    Attach(attach::AttachArgs),
    Registry(registry::RegistryArgs),
    Check(check::CheckArgs),
    Calibrate(calibrate::CalibrateArgs),
    Compare(compare::CompareArgs),
    Score(score::ScoreArgs),
    Report(report::ReportArgs),
    Expect(expect::ExpectArgs),
    #[cfg(feature = "train")]
    Rerun(rerun::RerunArgs),
    Runs(runs::RunsArgs),
    #[cfg(feature = "train")]
    Verdict(verdict::VerdictArgs),
    #[cfg(feature = "train")]
    FalseAlarms(false_alarms::FalseAlarmsArgs),
    Tessellation(tessellation::TessellationArgs),
    Bench(bench::BenchArgs),
    #[cfg(feature = "train")]
    Models(models::ModelsArgs),
    #[cfg(feature = "train")]
    Weights(weights::WeightsArgs),
    Sources(sources::SourcesArgs),
    Config(config::ConfigArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
    #[command(hide = true)]
    Worker(WorkerArgs),
    #[cfg(feature = "train")]
    #[command(hide = true)]
    Parity(parity::ParityArgs),
}

impl Verb {
    /// Runs the command.
    ///
    /// # Errors
    /// If it fails. The exit code of a command that did not fail can still be 1.
    pub(crate) fn call(&self) -> Result<ExitCode> {
        let done = |()| ExitCode::SUCCESS;
        match self {
            #[cfg(feature = "train")]
            Self::Run(args) => run::run(args),
            Self::Label(args) => label::label(args).map(done),
            Self::Merge(args) => merge::merge(args).map(done),
            Self::Status(args) => status::status(args).map(done),
            Self::Sample(args) => sample::sample(args).map(done),
            #[cfg(feature = "train")]
            Self::Train(args) => train::train(args),
            #[cfg(feature = "train")]
            Self::Replay(args) => replay::replay(args),
            #[cfg(feature = "train")]
            Self::Embed(args) => embed::embed(args),
            #[cfg(feature = "train")]
            Self::Nearest(args) => embed::nearest(args),
            #[cfg(feature = "train")]
            Self::Predict(args) => export::predict(args).map(done),
            #[cfg(feature = "train")]
            Self::Eval(args) => eval::eval(args),
            Self::Inspect(args) => inspect::inspect(args).map(done),
            Self::Extract(args) => extract::extract(args).map(done),
            Self::Render(args) => render::render(args).map(done),
            Self::Synth(args) => synth::synth(args).map(done),
            Self::Verify(args) => verify::verify(args).map(done),
            Self::Export(args) => export::export(args).map(done),
            Self::Release(args) => release::release(args).map(done),
            Self::Attach(args) => attach::attach(args).map(done),
            Self::Registry(args) => registry::registry(args).map(done),
            Self::Check(args) => check::check(args).map(done),
            Self::Calibrate(args) => calibrate::calibrate(args).map(done),
            Self::Compare(args) => compare::compare(args).map(done),
            Self::Score(args) => score::score(args),
            #[cfg(feature = "train")]
            Self::Rerun(args) => rerun::rerun(args),
            Self::Expect(args) => expect::expect(args).map(done),
            Self::Report(args) => report::report(args),
            Self::Runs(args) => runs::runs(args).map(done),
            #[cfg(feature = "train")]
            Self::Verdict(args) => verdict::verdict(args),
            #[cfg(feature = "train")]
            Self::FalseAlarms(args) => false_alarms::false_alarms_of(args).map(done),
            Self::Tessellation(args) => tessellation::tessellation(args).map(done),
            Self::Bench(args) => bench::bench(args).map(done),
            #[cfg(feature = "train")]
            Self::Models(args) => models::models(args).map(done),
            #[cfg(feature = "train")]
            Self::Weights(args) => weights::weights(args).map(done),
            Self::Sources(args) => sources::sources(args).map(done),
            Self::Config(args) => config::config(args).map(done),
            Self::Completions(args) => completions::completions(args).map(done),
            Self::Man(args) => completions::man(args).map(done),
            #[cfg(feature = "train")]
            Self::Parity(args) => parity::parity(args).map(done),
            Self::Worker(args) => worker(args).map(done),
        }
    }
}
