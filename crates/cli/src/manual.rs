//! `rodsweep manual`: pages for `man`, one for the program and one for each command.

use super::{CommandError, Exit, say};
use clap::{Args, Command};
use clap_mangen::Man;
use rodsweep::files;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct ManualArguments {
    /// Folder that the pages are written to, such as ~/.local/share/man/man1
    pub dir: PathBuf,
}

/// Writes the pages of the whole program.
pub fn manual(program: Command, arguments: &ManualArguments) -> Result<Exit, CommandError> {
    let dir = &arguments.dir;
    let unwritten =
        |error| CommandError::Usage(format!("cannot write pages to {}: {error}; choose another folder", dir.display()));
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    add_pages(&program, &mut pages).map_err(unwritten)?;
    std::fs::create_dir_all(dir).map_err(unwritten)?;
    let mut write = pages.iter().map(|(name, text)| files::replace(&dir.join(name), text.as_bytes()));
    write.try_for_each(|written| written).map_err(unwritten)?;
    say(&format!("written: {} pages in {}", pages.len(), dir.display()));
    Ok(Exit::Done)
}

/// The page of a command, such as `rodsweep-run.1`, and those of the commands below it.
fn add_pages(command: &Command, pages: &mut Vec<(String, String)>) -> std::io::Result<()> {
    let man = Man::new(command.clone());
    let mut text = Vec::new();
    man.render(&mut text)?;
    pages.push((man.get_filename(), String::from_utf8_lossy(&text).into_owned()));
    command.get_subcommands().try_for_each(|below| add_pages(below, pages))
}
