//! `rodsweep contact`: which force the tip can press where.

use super::engine_args::EngineArguments;
use super::{CommandError, Exit, print, say, signals, verdict};
use clap::Args;
use rodsweep::figures::draw_contact;
use rodsweep::input::{Dimension, parse_quantity};
use rodsweep::spec::SweepSpec;
use rodsweep::study::contact::{ContactError, ContactJob, ContactStage};
use std::cell::Cell;
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(Debug, Args)]
pub struct ContactArguments {
    /// A sweep file (TOML) whose scene has a wall; it need not have been run
    pub sweep: PathBuf,
    /// Where files go [default: results/NAME-OF-THE-SWEEP-contact]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Tell the least coefficient of friction at this normal force, such as 5mN, in place of the range of forces
    #[arg(long, value_name = "FORCE", value_parser = newtons)]
    pub force: Option<f64>,
    /// Distance of the points on the wall, such as 1mm [default: the voxel of the sweep]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub voxel: Option<f64>,
    /// How far from the middle along the wall points are, such as 30mm [default: as far as the rod is long]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub extent: Option<f64>,
    /// Least stability margin that counts, from 0 to 1
    #[arg(long, value_name = "MARGIN")]
    pub minimum_margin: Option<f64>,
    /// At which points the designs that [[uncertain]] in the sweep describes hold
    #[arg(long, conflicts_with = "force")]
    pub robust: bool,
    /// Designs of --robust; 59 are the fewest that can show 95 % with a confidence of 95 %
    #[arg(long, value_name = "N", default_value = "64", requires = "robust")]
    pub designs: usize,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Exit with 0 although the reference contradicts answers; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Draw nothing
    #[arg(long)]
    pub no_figures: bool,
    /// Print contact.json and nothing else on the standard output
    #[arg(long)]
    pub json: bool,
    /// Only the answer: nothing on the way, no account
    #[arg(long)]
    pub quiet: bool,
}

/// A positive length (m), for clap.
fn length(text: &str) -> Result<f64, String> {
    positive(text, "m", "length", "1mm")
}

/// A positive force (N), for clap.
fn newtons(text: &str) -> Result<f64, String> {
    positive(text, "N", "force", "5mN")
}

fn positive(text: &str, unit: &'static str, what: &str, example: &str) -> Result<f64, String> {
    match parse_quantity(text, Dimension::of(unit)) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(_) => Err(format!("give a {what} greater than zero, such as {example}")),
        Err(error) => Err(error.to_string()),
    }
}

/// A line of progress at most this often.
const INTERVAL: Duration = Duration::from_secs(2);

pub fn contact(arguments: &ContactArguments) -> Result<Exit, CommandError> {
    let interrupted = signals::listen();
    let spec = SweepSpec::read(&arguments.sweep)?;
    let last: Cell<Option<Instant>> = Cell::new(Some(Instant::now()));
    let tell = |stage: ContactStage| {
        if !arguments.quiet && last.get().is_none_or(|last| last.elapsed() >= INTERVAL) {
            last.set(Some(Instant::now()));
            say(&stage.words());
        }
    };
    let job = ContactJob::of_sweep(&spec)
        .engine(arguments.engine.request())
        .spacing(arguments.voxel.unwrap_or(spec.workspace.voxel))
        .extent(arguments.extent)
        .minimum_margin(arguments.minimum_margin.unwrap_or(spec.workspace.minimum_margin))
        .force(arguments.force)
        .interrupt(interrupted)
        .progress(Some(&tell));
    let found = job.run()?;
    let robust = arguments.robust.then(|| job.robust(&found, arguments.designs)).transpose()?;
    let out = arguments.out.clone().unwrap_or_else(|| {
        let name = arguments.sweep.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from("results").join(format!("{name}-contact"))
    });
    let account = found.account(robust.as_ref());
    let mut files = found.write(&out, &account, robust.as_ref())?;
    if !arguments.no_figures {
        let drawn = draw_contact(&found, robust.as_ref(), &out)?;
        drawn.left_out.iter().for_each(|note| say(&format!("note: {note}")));
        files.extend(drawn);
    }
    if arguments.json {
        print(&account.json())?;
    }
    if arguments.quiet && !arguments.json {
        print(&(account.headline() + "\n"))?;
    }
    if !arguments.quiet {
        found.notes.iter().for_each(|note| say(&format!("note: {note}")));
        match arguments.json {
            true => say(&account.text()),
            false => print(&(account.text() + "\n"))?,
        }
        files.iter().for_each(|path| say(&format!("file: {}", path.display())));
    }
    Ok(verdict::of_study(found.mark(), arguments.accept_distrusted))
}

/// Message for an error of a map of contacts, with the flag that helps.
impl From<ContactError> for CommandError {
    fn from(error: ContactError) -> CommandError {
        match error {
            ContactError::Plan(error) => error.into(),
            ContactError::Backend(error) => error.into(),
            ContactError::Results(error) => error.into(),
            ContactError::NoFriction { .. } => CommandError::Usage(format!("{error} with `--force 5mN`")),
            error => match error.option() {
                Some(option) => CommandError::Usage(format!("`--{}`: {error}", option.replace('_', "-"))),
                None => CommandError::Contact(error),
            },
        }
    }
}
