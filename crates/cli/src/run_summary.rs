//! What a run says of itself when it has ended.

use super::progress::duration;
use super::say;
use rodsweep::draw::{count, engineering};
use rodsweep::model::Status;
use rodsweep::results::{BranchCounts, ErrorDistribution, PathCheck, SampleOrigin, Timings};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::Summary;
use std::path::Path;
use std::time::Duration;

fn named_stages(of: &Timings) -> String {
    let search = if of.search > 0.0 { format!(", search {:.2}", of.search) } else { String::new() };
    format!(
        "build {:.2}, solve {:.2}, solve again {:.2}{search}, rows {:.2}, write {:.2}, check {:.2}",
        of.build, of.solve, of.refine, of.rows, of.write, of.check
    )
}

pub fn print_summary(spec: &SweepSpec, summary: &Summary, out: &Path, is_verbose: bool) {
    let time = duration(Duration::from_secs_f64(summary.timings.total));
    let resumed = if summary.resumed > 0 { format!(", {} found done", count(summary.resumed)) } else { String::new() };
    say(&format!(
        "solved {} samples in {time} ({}/s) on {}{resumed}",
        count(summary.solved),
        count(summary.rate.round() as u64),
        summary.backend
    ));
    if is_verbose {
        say_stages(summary);
    }
    summary.notes.iter().for_each(|note| say(&format!("warning: {note}")));
    if let SampleOrigin::HostBecause(reason) = &summary.origin {
        say(&format!("note: samples were made on the host and uploaded: {reason}"));
    }
    say_statuses(summary);
    if let Some([low, high]) = summary.reduction.extents {
        let span = |axis: usize| format!("{:.2} to {:.2}", low[axis] * 1e3, high[axis] * 1e3);
        say(&format!("tip extents [mm]: x {}, y {}, z {}", span(0), span(1), span(2)));
    }
    say(&format!(
        "worst residual {} (plan units of moment), worst error estimate {}, {} rows above the tolerance {:.0e}",
        engineering(summary.worst_residual),
        engineering(summary.worst_error_estimate),
        count(summary.above_tolerance),
        spec.tolerance
    ));
    for path in &summary.quarantined {
        say(&format!("warning: a damaged part was put aside as {} and solved again", path.display()));
    }
    if let Some(check) = &summary.path_check {
        let PathCheck { followed, confirmed, elsewhere, past_fold, doubtful, .. } = check;
        let which = if check.all { "every row that is called solved" } else { "a fixed choice" };
        say(&format!(
            "second paths: {} rows ({which}) followed from rest by other steps: {elsewhere} were another equilibrium, {past_fold} beyond a \
             fold, {doubtful} doubtful, {confirmed} confirmed by the reference",
            count(*followed)
        ));
    }
    if let Some(check) = &summary.spot_check {
        let distribution = |d: &ErrorDistribution| [d.median, d.p95, d.max].map(engineering).join(" / ");
        say(&format!(
            "spot check: {} samples against the reference; median / 95 % / max error: position over length {}, rotation {} rad, derivative column {}",
            count(check.compared),
            distribution(&check.position),
            distribution(&check.rotation),
            distribution(&check.derivative)
        ));
    }
    say(&format!("results: {}", out.display()));
}

/// Times by stage; the manifest has them, too.
fn say_stages(summary: &Summary) {
    say(&format!("stages (busy seconds, overlapping): {}", named_stages(&summary.timings)));
    if let Some(processor) = &summary.processor {
        let stages = named_stages(processor);
        say(&format!("stages (processor seconds): {stages}, of {:.2} of the process", processor.total));
    }
    if !summary.engine_timings.is_empty() {
        // Which kernels there are depends on the sweep; the manifest has all of them.
        let is_told = |(name, s): &&(&str, f64)| !name.starts_with("kernel_") || *s > 0.0;
        let told = summary.engine_timings.iter().filter(is_told);
        let each: Vec<_> = told.map(|(name, s)| format!("{} {s:.2}", spaced(name))).collect();
        say(&format!("of these, the {}: {}", summary.backend.kind, each.join(", ")));
    }
}

/// `first dispatch` for `first_dispatch`
fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

fn say_statuses(summary: &Summary) {
    let reduction = &summary.reduction;
    let words: Vec<String> = Status::ALL
        .into_iter()
        .filter(|status| summary.count(*status) > 0)
        .map(|status| format!("{} {}", count(summary.count(status)), status.name()))
        .collect();
    let words = words.join(", ");
    let share = 100.0 * (1.0 - summary.failed() as f64 / reduction.sample_count.max(1) as f64);
    let Some(BranchCounts { most, unbalanced, .. }) = reduction.branches else {
        return say(&format!("status: {words}; {share:.3} % usable"));
    };
    let rows = count(reduction.row_count());
    say(&format!("status of {rows} rows: {words}; {share:.3} % of the samples have an equilibrium"));
    let complete = match unbalanced {
        0 => "their signs add up in every sample".into(),
        some => format!("in {} samples their signs do not add up: some are missing", count(some)),
    };
    say(&format!("equilibria: at most {most} a sample; {complete}"));
}
