//! The verdict on a run, said before anything else; and what becomes of a command then.

use super::{CommandError, Exit, say};
use rodsweep::report::count;
use rodsweep::results::{DoubtKind, Results, Solved};
use rodsweep::spec::SolutionMethod;
use rodsweep::sweep::Summary;
use std::path::Path;

/// Says what speaks against rows: as an error, or as a warning where the user goes on.
fn tell(text: &str, is_accepted: bool) {
    let (what, more) = if is_accepted {
        ("warning", "")
    } else {
        ("error", "\n`--accept-distrusted` goes on all the same; what comes of it says so")
    };
    say(&format!("{what}: {}{more}", text.trim_end()));
}

/// Says what speaks against the rows of a directory; the exit, where the command does not go on.
pub fn of_results(results: &Results, is_accepted: bool) -> Result<Option<Exit>, CommandError> {
    let Some(text) = results.distrust()? else { return Ok(None) };
    tell(&text, is_accepted);
    Ok((!is_accepted).then_some(Exit::Distrusted))
}

/// Whether the rows of a run can be trusted, and enough of them have succeeded.
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
        say(&format!("error: {} samples failed; --max-failures allows {most}", count(failed)));
        return Exit::TooManyFailures;
    }
    if summary.verdict.sound {
        return Exit::Done;
    }
    let solved = Solved { method: Some(method), certain: summary.is_certain(), place: Some(place) };
    tell(&summary.verdict.explain(&solved), is_accepted);
    if is_accepted { Exit::Done } else { Exit::Distrusted }
}
