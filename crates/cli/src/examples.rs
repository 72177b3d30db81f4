//! `rodsweep examples`: the scenes, sweeps and trajectories that the program brings along.

use super::{CommandError, Exit, flags, print};
use clap::Args;
use rodsweep::files;
use rodsweep::input::parse_scene;
use rodsweep::shipped::{LAP_TABLE, SCENES, SWEEPS, ShippedFile, TRAJECTORIES};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct ExamplesArguments {
    /// Which one, such as workspace or scenes/p6; without it, all are listed
    pub name: Option<String>,
    /// Folder that it is written to, with the files that it needs [default: here]
    #[arg(long, value_name = "DIR", requires = "name")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
}

/// A shipped file.
struct Example {
    /// Path from the folder of the sweeps, such as `scenes/p6.toml`.
    path: String,
    text: &'static str,
}

impl Example {
    /// As the user names it: without extension.
    fn name(&self) -> &str {
        self.path.strip_suffix(".toml").unwrap_or(&self.path)
    }

    /// The name of a scene, or the first sentence of the comment above a file.
    fn line(&self) -> String {
        if let Some(scene) = parse_scene(Path::new(&self.path), self.text).ok().filter(|scene| !scene.name.is_empty()) {
            return scene.name;
        }
        let comment = self.text.lines().map_while(|line| line.strip_prefix('#')).map(str::trim);
        let comment = comment.collect::<Vec<_>>().join(" ");
        comment.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
    }
}

pub fn examples(arguments: &ExamplesArguments) -> Result<Exit, CommandError> {
    let all = all();
    let Some(asked) = &arguments.name else {
        let line = |example: &Example| format!("{:<25}{}\n", example.name(), example.line());
        print(&(all.iter().map(line).collect::<String>() + "\nrodsweep examples NAME --out DIR writes one\n"))?;
        return Ok(Exit::Done);
    };
    let asked = asked.strip_suffix(".toml").unwrap_or(asked);
    let Some(example) = all.iter().find(|example| example.name() == asked) else {
        let names: Vec<&str> = all.iter().map(Example::name).collect();
        return Err(CommandError::Usage(format!("no example is called `{asked}`; use one of: {}", names.join(", "))));
    };
    let folder = arguments.out.clone().unwrap_or_default();
    let files = with_needs(&all, example);
    for (path, text) in &files {
        let path = folder.join(path);
        // A file that is there already with the same text need not be written.
        if files::read_text(&path).is_ok_and(|there| there == *text) {
            continue;
        }
        flags::refuse_to_overwrite(&path, arguments.force, "folder with `--out`")?;
    }
    for (path, text) in &files {
        let path = folder.join(path);
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(|error| flags::unwritten(&path, &error))?;
        }
        flags::write_text(&path, text)?;
    }
    Ok(Exit::Done)
}

fn all() -> Vec<Example> {
    let of = |folder: &'static str, files: &'static [ShippedFile]| {
        files.iter().map(move |(name, text)| Example { path: format!("{folder}{name}"), text })
    };
    of("", &SWEEPS).chain(of("scenes/", &SCENES)).chain(of("trajectories/", &TRAJECTORIES)).collect()
}

/// A file with the scene and the table that it names.
fn with_needs<'a>(all: &'a [Example], example: &'a Example) -> Vec<(&'a str, &'a str)> {
    let is_named = |path: &str| example.text.contains(&format!("\"{path}\""));
    let named = all.iter().filter(|other| is_named(&other.path)).map(|other| (other.path.as_str(), other.text));
    let table = [LAP_TABLE].into_iter().filter(|(name, _)| is_named(name));
    std::iter::once((example.path.as_str(), example.text)).chain(named).chain(table).collect()
}
