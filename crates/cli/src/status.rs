//! `rodsweep status`: what of a run is done, failed and left, and who works on it.

use super::progress::duration;
use super::{CommandError, Exit, print, signals, verdict};
use clap::Args;
use rodsweep::draw::count;
use rodsweep::model::Status;
use rodsweep::results::{DirectoryStatus, Results, Worker};
use rodsweep::spec::Format;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

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

pub fn status(arguments: &StatusArguments) -> Result<Exit, CommandError> {
    let results = Results::open(&arguments.directory)?;
    if arguments.watch {
        watch(&results, Duration::from_secs(arguments.every))?;
    }
    // A manifest that is damaged is told after all that is sound.
    let distrust = verdict::of_results(&results, arguments.accept_distrusted);
    let (status, workers) = (results.status()?, results.workers()?);
    print(&(describe(&arguments.directory, &status) + &describe_workers(&workers, left(&status, &workers))))?;
    let distrust = distrust?;
    let verdict = results.verdict()?.filter(|_| status.samples_done > 0);
    if let Some(verdict) = verdict.filter(|verdict| verdict.sound) {
        print(&format!("verdict: nothing speaks against the rows; {}\n", verdict.checked_sentence()))?;
    }
    Ok(match distrust {
        _ if !status.damaged.is_empty() => Exit::Failed,
        distrust => distrust.unwrap_or(Exit::Done),
    })
}

/// A line now and then, until every part is there.
fn watch(results: &Results, pause: Duration) -> Result<(), CommandError> {
    let interrupted = signals::listen();
    let total = results.record().sample_count;
    let (mut last, mut rate) = (None, None);
    while results.has_rows() {
        let (parts, done) = results.progress()?;
        let now = Instant::now();
        if let Some((before, then)) = last.replace((done, now)) {
            rate = Some(done.saturating_sub(before) as f64 / now.duration_since(then).as_secs_f64().max(1e-3));
        }
        let workers = results.workers()?;
        let (living, _) = living(&workers);
        let speed = rate.map_or(String::new(), |rate| format!(", {}/s", count(rate.round() as u64)));
        let left = rate
            .filter(|rate| *rate > 0.0)
            .map(|rate| Duration::from_secs_f64((total - done.min(total)) as f64 / rate));
        let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
        print(&format!(
            "{} of {} samples in {parts} parts, {living} of {} workers alive{speed}{left}\n",
            count(done),
            count(total),
            workers.len()
        ))?;
        if done >= total {
            break;
        }
        let begin = Instant::now();
        while begin.elapsed() < pause {
            if interrupted.load(Ordering::Relaxed) {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    Ok(())
}

/// How many workers live, and how many samples a second they solve together.
fn living(workers: &[Worker]) -> (usize, f64) {
    let living = || workers.iter().filter(|worker| worker.is_alive);
    (living().count(), living().map(|worker| worker.report.rate).sum())
}

/// How long the workers that live will take for what is left.
fn left(status: &DirectoryStatus, workers: &[Worker]) -> Option<Duration> {
    let (_, rate) = living(workers);
    let left = status.record.sample_count.saturating_sub(status.samples_done);
    (rate > 0.0 && left > 0).then(|| Duration::from_secs_f64((left as f64 / rate).min(1e9)))
}

fn describe_workers(workers: &[Worker], left: Option<Duration>) -> String {
    /// More would hide the rest.
    const MOST: usize = 20;
    let mut text = String::new();
    if workers.is_empty() {
        return text;
    }
    let (living, rate) = living(workers);
    let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
    text += &format!("workers: {living} of {} alive, {}/s{left}\n", workers.len(), count(rate.round() as u64));
    for Worker { report, silent, is_alive, .. } in workers.iter().take(MOST) {
        let state = match (is_alive, report.has_left) {
            (true, _) => "alive",
            (_, true) => "has left",
            _ => "expired",
        };
        text += &format!(
            "  {}:{} {state}, {} samples, {}/s, last sign {} ago, {}\n",
            report.host,
            report.process,
            count(report.samples),
            count(report.rate.round() as u64),
            duration(*silent),
            report.engine
        );
    }
    if workers.len() > MOST {
        text += &format!("  and {} more\n", workers.len() - MOST);
    }
    text
}

fn describe(directory: &Path, status: &DirectoryStatus) -> String {
    let (place, samples) = (directory.display(), count(status.samples_done));
    let has_rows = status.record.format() != Format::None;
    let mut text = match (has_rows, status.is_complete()) {
        (true, _) => {
            format!("{place}: {} of {} parts done, {samples} samples\n", status.parts_done, status.parts_total)
        }
        (false, true) => format!("{place}: done, {samples} samples without rows\n"),
        (false, false) => format!("{place}: not done, and a run without rows keeps none before its end\n"),
    };
    if status.every_branch {
        text += &format!("every equilibrium: {} rows\n", count(status.counts.iter().sum()));
    }
    for kind in Status::ALL {
        let samples = status.counts[kind.code() as usize];
        if samples > 0 {
            text += &format!("  {:<14}{:>12}\n", kind.name(), count(samples));
        }
    }
    if status.methods.len() > 1 || status.engines.len() > 1 {
        for (what, rows) in status.methods.iter().filter(|_| status.methods.len() > 1).chain(&status.engines) {
            text += &format!("by {what}: {} rows\n", count(*rows));
        }
    }
    for (path, reason) in &status.damaged {
        text += &format!("damaged: {}: {reason}\n", path.display());
    }
    if !status.is_complete() && has_rows {
        text += &format!("left: {} parts; `rodsweep run ... --resume` goes on\n", count(status.missing_count));
    }
    text
}
