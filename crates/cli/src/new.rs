//! `rodsweep new`: a commented file to begin with, scene and sweep in one.

use super::{CommandError, Exit, flags, print, say};
use clap::Args;
use rodsweep::input::toml::quoted;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Name, one line, text.
type Kind = (&'static str, &'static str, &'static str);

const KINDS: [Kind; 6] = [
    ("catheter", "one coil set in the field of a scanner; three currents", include_str!("new/catheter.toml")),
    ("two-coils", "two coil sets in the field of a scanner; six currents", include_str!("new/two_coils.toml")),
    ("guidewire", "a magnet at the tip, a magnet outside that moves", include_str!("new/guidewire.toml")),
    ("weight", "a wire with a weight, no magnet", include_str!("new/weight.toml")),
    ("coil-array", "a magnet at the tip between six electromagnets", include_str!("new/coil_array.toml")),
    (
        "field-map",
        "a magnet at the tip in a field given on a grid, with the file of that field",
        include_str!("new/field_map.toml"),
    ),
];
/// The word in a text that the name of the map replaces.
const MAP_FILE: &str = "MAP_FILE";

#[derive(Debug, Args)]
pub struct NewArguments {
    /// Kind of the file to begin with; without it, the kinds are listed
    pub kind: Option<String>,
    /// Where the file is written [default: KIND.toml, here]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
}

pub fn new(arguments: &NewArguments) -> Result<Exit, CommandError> {
    let Some(asked) = &arguments.kind else {
        print(&list())?;
        return Ok(Exit::Done);
    };
    let Some((kind, _, text)) = KINDS.iter().find(|(kind, ..)| kind == asked) else {
        return Err(CommandError::Usage(format!(
            "`{asked}` is no kind of file; use one of these\n{}",
            list().trim_end()
        )));
    };
    let path = arguments.out.clone().unwrap_or_else(|| PathBuf::from(format!("{kind}.toml")));
    let map = text.contains(MAP_FILE).then(|| map_beside(&path));
    for path in std::iter::once(&path).chain(&map) {
        flags::refuse_to_overwrite(path, arguments.force, "file with `--out`")?;
    }
    let name = rodsweep::text::shell_word(&rodsweep::text::line(&path.to_string_lossy()));
    let mut text = text.replace("FILE ", &format!("{name} "));
    if let Some(map) = &map {
        let map_name = map.file_name().unwrap_or_default().to_string_lossy();
        text = text.replace(&format!("\"{MAP_FILE}\""), &quoted(&map_name));
        flags::write_text(map, &field_map())?;
    }
    flags::write_text(&path, &text)?;
    say(&format!("next: rodsweep check {name}\n      rodsweep run {name}"));
    Ok(Exit::Done)
}

fn list() -> String {
    KINDS.iter().map(|(name, what, _)| format!("{name:<12}{what}\n")).collect()
}

fn map_beside(path: &Path) -> PathBuf {
    path.with_extension("csv")
}

/// 4 mT along x and a gradient of 0.1 T/m along z, on a grid of 10 mm. Neither has a source or a curl.
fn field_map() -> String {
    let mut text = String::from("x [mm],y [mm],z [mm],Bx [mT],By [mT],Bz [mT]\n");
    for z in (-20..=80).step_by(10) {
        for y in (-50..=50).step_by(10) {
            for x in (-50..=50).step_by(10) {
                let [bx, by, bz] = [4.0 - 0.05 * f64::from(x), -0.05 * f64::from(y), 0.1 * f64::from(z)];
                // Writing to a text cannot fail.
                let _ = writeln!(text, "{x},{y},{z},{bx},{by},{bz}");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_whole() {
        for (name, what, text) in KINDS {
            assert!(what.len() < 80 && text.starts_with("# "), "{name}");
            assert!(text.lines().all(|line| line.chars().count() <= 125), "{name}");
        }
    }
}
