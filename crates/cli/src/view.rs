//! `rodsweep view`: a rod that follows sliders, or the map of a result directory, in the browser.

use super::{CommandError, Exit, print, say, say_notes, verdict};
use crate::signals;
use clap::Args;
use rodsweep::draw::count;
use rodsweep::results::{Results, is_place};
use rodsweep_view::{Server, View, open_browser};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Scene file, sweep file or result directory
    pub source: PathBuf,
    /// Print the address and leave opening it to you
    #[arg(long)]
    pub no_open: bool,
    /// Go on when the last window has gone, until Ctrl-C
    #[arg(long)]
    pub keep: bool,
    /// Go on with rows that are not to be trusted; the page says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Write one page that needs no program and no network, instead
    #[arg(long, value_name = "FILE", conflicts_with_all = ["no_open", "keep"])]
    pub export: Option<PathBuf>,
}

pub fn view(arguments: &ViewArguments) -> Result<Exit, CommandError> {
    if is_place(&arguments.source)
        && let Some(exit) = verdict::of_results(&Results::open(&arguments.source)?, arguments.accept_distrusted)?
    {
        return Ok(exit);
    }
    let view = View::open(&arguments.source)?;
    say_notes(view.scene());
    if let Some(path) = &arguments.export {
        let done = view.export(path)?;
        let megabytes = done.bytes as f64 / 1e6;
        say(&format!("page: {}, {megabytes:.1} MB", path.display()));
        if done.points > 0 {
            let (points, all) = (count(done.points as u64), count(done.of_points as u64));
            say(&format!("{points} of {all} points, positions rounded by at most {:.1} um", 1e6 * done.rounding));
        }
        return Ok(Exit::Done);
    }
    let stop = signals::listen();
    let server = Server::bind(view)?;
    let address = server.address();
    print(&format!("{address}\n"))?;
    if !arguments.no_open && !open_browser(&address) {
        say("note: no browser could be opened; open the address above");
    }
    say(if arguments.keep { "Ctrl-C ends it" } else { "Ctrl-C ends it, or closing its last window" });
    server.run(stop, arguments.keep)?;
    Ok(Exit::Done)
}
