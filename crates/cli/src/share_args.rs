//! The arguments of runs that many workers share, and of what hands such runs to a scheduler.

use clap::{Args, Subcommand};
use rodsweep::results::SILENCE;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, Args)]
pub struct ShareArguments {
    /// Share the run with every other worker that joins it, on whatever machine: each claims chunks, those of dead
    /// workers are taken over, and all end together
    #[arg(long, conflicts_with = "shard")]
    pub join: bool,
    /// Seconds without a sign after which a worker is taken for dead; the first worker settles it [default: 60]
    #[arg(long, value_name = "SECONDS", requires = "join", value_parser = clap::value_parser!(u64).range(1..=86400))]
    pub silence: Option<u64>,
    /// Workers may solve the run by different methods (engine, precision, steps); each part says by which
    #[arg(long)]
    pub mixed_methods: bool,
}

impl ShareArguments {
    /// When a worker is taken for dead.
    pub fn silence(&self) -> Duration {
        self.silence.map_or(SILENCE, Duration::from_secs)
    }
}

#[derive(Debug, Args)]
pub struct StatusArguments {
    /// A result directory
    pub directory: PathBuf,
    /// Exit with 0 although rows are not to be trusted
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Tell again and again, until every part is there
    #[arg(long)]
    pub watch: bool,
    /// Seconds between two lines
    #[arg(long, value_name = "SECONDS", default_value_t = 5, requires = "watch", value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
}

#[derive(Debug, Subcommand)]
pub enum SubmitCommand {
    /// Write a job array and the job that ends the run, for Slurm
    Slurm(SlurmArguments),
    /// Write an Indexed Job and the job that ends the run, for Kubernetes
    Kubernetes(KubernetesArguments),
}

#[derive(Debug, Args)]
pub struct SubmitArguments {
    /// Sweep file (TOML)
    pub sweep: PathBuf,
    /// Result directory that every node sees, or its address, such as s3://bucket/results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Workers at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub workers: u64,
    /// GPUs of each worker
    #[arg(long, value_name = "G")]
    pub gpus: Option<u64>,
    /// Processor cores of each worker
    #[arg(long, value_name = "C")]
    pub cpus: Option<u64>,
    /// Arguments of `run` for every worker, such as "--backend cpu"
    #[arg(long, value_name = "ARGUMENTS", allow_hyphen_values = true)]
    pub run: Option<String>,
    /// Folder that the files are written to [default: NAME-OF-THE-SWEEP-slurm or -kubernetes, here]
    #[arg(long, value_name = "DIR")]
    pub write: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Hand it in
    #[arg(long)]
    pub submit: bool,
}

#[derive(Debug, Args)]
pub struct SlurmArguments {
    #[command(flatten)]
    pub common: SubmitArguments,
    /// Time limit of a task, as Slurm reads it; a task that reaches it is queued again
    #[arg(long, value_name = "TIME")]
    pub time: Option<String>,
    /// Partition
    #[arg(long, value_name = "NAME")]
    pub partition: Option<String>,
    /// Account
    #[arg(long, value_name = "NAME")]
    pub account: Option<String>,
    /// Memory of a task, such as 4G
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// The program on the nodes [default: this one]
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct KubernetesArguments {
    #[command(flatten)]
    pub common: SubmitArguments,
    /// Container image that has `rodsweep`
    #[arg(long, value_name = "IMAGE")]
    pub image: String,
    /// Secret whose entries become environment variables, such as AWS_ACCESS_KEY_ID
    #[arg(long, value_name = "NAME")]
    pub secret: Option<String>,
    /// Claim of a volume that holds the result directory, mounted at DIR
    #[arg(long, value_name = "NAME")]
    pub volume: Option<String>,
    /// Memory of a worker, such as 4Gi
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
}
