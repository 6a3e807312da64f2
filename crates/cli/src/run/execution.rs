//! Defines the execution of a run: threads, the backend, progress, and Ctrl-C. Nothing here influences a result.

use crate::allocator::keep_freed_memory;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::usage::UsageError;
use anyhow::{Context, Result};
use partprobe_net::Backend;

/// How a run is executed. Nothing here changes its numbers, except that backends differ in the last digits.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ExecutionArgs {
    /// Set a key of the config to another value; can be given several times. `partprobe config show base` lists the keys.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    #[command(flatten)]
    pub(crate) machine: MachineArgs,
}

/// The part of a machine that the work uses. The results do not depend on the number of threads.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MachineArgs {
    /// The number of threads; one per core if not given. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// The implementation of tensor operations. Backends other than `flex` must be built in, for example with `cargo build
    /// --release --features cuda`.
    #[arg(long, value_enum, default_value_t = BackendArg::Flex)]
    backend: BackendArg,
}

/// The backends that a user can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum BackendArg {
    /// burn-flex, the fast backend for CPUs.
    Flex,
    /// burn-ndarray, a portable backend for cross-checks.
    Ndarray,
    /// A GPU through Vulkan, Metal, DirectX or WebGPU.
    Wgpu,
    /// An NVIDIA GPU.
    Cuda,
}

impl BackendArg {
    /// The name that a user gives and that a run records.
    fn name(self) -> &'static str {
        match self {
            Self::Flex => "flex",
            Self::Ndarray => "ndarray",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    /// The backend, if this program was built with it. Otherwise, it is a usage error that explains how to build it.
    fn backend(self) -> Result<Backend, UsageError> {
        match self {
            Self::Flex => Ok(Backend::Flex),
            #[cfg(feature = "ndarray")]
            Self::Ndarray => Ok(Backend::Ndarray),
            #[cfg(feature = "wgpu")]
            Self::Wgpu => Ok(Backend::Wgpu),
            #[cfg(feature = "cuda")]
            Self::Cuda => Ok(Backend::Cuda),
            #[allow(
                unreachable_patterns,
                reason = "a program that is built with every feature has all backends"
            )]
            missing => Err(UsageError(format!(
                "this program was built without the backend `{0}`; build it with `cargo build --release --features {0}`",
                missing.name(),
            ))),
        }
    }
}

/// The execution settings of every stage.
pub(crate) struct Execution {
    pub(crate) threads: usize,
    pub(crate) backend: Backend,
    /// The name of the backend on the command line and in records.
    pub(crate) backend_name: &'static str,
    pub(crate) progress: Progress,
    pub(crate) interrupt: Interrupt,
}

impl Execution {
    /// Sets up threads and Ctrl-C. It may be called once per process.
    pub(crate) fn new(args: &MachineArgs) -> Result<Self> {
        let backend = args.backend.backend()?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = args.jobs.map_or(cores, usize::from);
        keep_freed_memory(threads);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("starting threads")?;
        Ok(Self {
            threads,
            backend,
            backend_name: args.backend.name(),
            progress: Progress::on_terminal(),
            interrupt: Interrupt::listen()?,
        })
    }
}
