//! The verdict on a run is printed before anything else and decides the exit code.

use super::{CommandError, Exit, say};
use rodsweep::draw::count;
use rodsweep::results::{Doubt, DoubtKind, Results, Solved};
use rodsweep::spec::SolutionMethod;
use rodsweep::sweep::Summary;
use std::path::Path;

/// Prints doubts about rows: as an error, or as a warning where the user accepts them.
fn tell(text: &str, is_accepted: bool) {
    let (what, more) = if is_accepted {
        ("warning", "")
    } else {
        ("error", "\n`--accept-distrusted` goes on all the same; what comes of it says so")
    };
    say(&format!("{what}: {}{more}", text.trim_end()));
}

/// Prints doubts about the rows of a directory, and whether some were not checked; returns the exit code where the command
/// must stop.
pub fn of_results(results: &Results, is_accepted: bool) -> Result<Option<Exit>, CommandError> {
    let distrust = results.distrust()?;
    if let Some(text) = &distrust {
        tell(text, is_accepted);
    }
    if let Some(unchecked) = results.unchecked()? {
        say(&format!("note: {unchecked}"));
    }
    Ok(distrust.filter(|_| !is_accepted).map(|_| Exit::Distrusted))
}

/// Prints the doubt about what a study is to be compared with; returns the exit code where the command must stop.
pub fn of_other(place: &Path, mark: Option<&str>, is_accepted: bool) -> Option<Exit> {
    tell(&format!("{}: {}", place.display(), mark?), is_accepted);
    (!is_accepted).then_some(Exit::Distrusted)
}

/// Prints the doubt about the results of a study, which are written and marked; returns the exit code.
pub fn of_study(mark: Option<&str>, is_accepted: bool) -> Exit {
    let Some(mark) = mark else { return Exit::Done };
    let text = format!(
        "{mark}\n  what helps: narrower limits or smaller steps of the inputs; see one: `rodsweep solve` of the scene with these \
         inputs by `--set`, and again with `--backend reference`"
    );
    tell(&text, is_accepted);
    if is_accepted { Exit::Done } else { Exit::Distrusted }
}

/// Prints that a fit lies too far off its points; returns the exit code.
pub fn of_misfit(misfit: Option<&str>, is_accepted: bool) -> Exit {
    let Some(misfit) = misfit else { return Exit::Done };
    let text = format!(
        "{misfit}\n  what helps: free what else may differ; start from a scene nearer to the shape; more points along the rod; \
         `--noise` with the true deviation of a point, errors of registration included"
    );
    tell(&text, is_accepted);
    if is_accepted { Exit::Done } else { Exit::Distrusted }
}

/// The exit code of a run: sound, distrusted, or with more failures than allowed.
pub fn of_run(
    summary: &Summary,
    (method, place): (SolutionMethod, &Path),
    max_failures: Option<u64>,
    is_accepted: bool,
) -> Exit {
    let failed = summary.failed();
    let beyond = max_failures.filter(|most| failed > *most);
    let of_failures = |kind| matches!(kind, DoubtKind::TooManyFailures | DoubtKind::NothingUsable);
    let is_all = summary.verdict.doubts.iter().all(|doubt| of_failures(doubt.kind));
    if let Some(most) = beyond.filter(|_| is_all) {
        let details = summary.verdict.failures.as_ref().map(Doubt::details).unwrap_or_default();
        let told = format!("error: {} samples failed; --max-failures allows {most}\n{details}", count(failed));
        say(told.trim_end());
        return Exit::TooManyFailures;
    }
    if summary.verdict.sound {
        return Exit::Done;
    }
    let solved = Solved { method: Some(method), certain: summary.is_certain(), place: Some(place) };
    tell(&summary.verdict.explain(&solved), is_accepted);
    if is_accepted { Exit::Done } else { Exit::Distrusted }
}
