//! Plain-text files of laboratories: parameter files of catheters and calibrations of coils to scenes, play files to
//! tables of currents.
//!
//! A file's kind is recognised by what it holds. Texts keep the source's digits and say where the source is silent.

mod catheter;
mod currents;
mod keywords;
mod mpem;
mod scene;
mod spatial;
mod yaml;

use super::error::{InputError, Problem};
use super::scene_file::{parse_scene, read_text};
use std::path::{Path, PathBuf};

/// What an import may be told beside the file.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// File with field, gravity and base pose, for a parameter file.
    pub spatial: Option<PathBuf>,
    /// Names of the segments that channels 1 to 3 and 4 to 6 of a play file drive; empty for the usual ones.
    pub coils: Vec<String>,
    /// Change the sign of the currents of axial coils.
    pub negate_axial: bool,
}

/// What an imported file becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImportKind {
    /// A scene file, of a parameter file or a calibration.
    Scene,
    /// A table of currents, of a play file.
    Currents,
}

/// An imported file: the text to write and what to tell about it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Import {
    /// What the file becomes.
    pub kind: ImportKind,
    /// TOML of a scene, or CSV of a table.
    pub text: String,
    /// What the file holds, in a few words.
    pub summary: String,
    /// What was left out, supposed or is unusual.
    pub notes: Vec<String>,
}

/// Imports a parameter file, a calibration of coils or a play file.
///
/// # Errors
///
/// A file that cannot be read, or a mistake in it.
pub fn import(file: &Path, options: &ImportOptions) -> Result<Import, InputError> {
    let text = read_text(file)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    if has_keyword(text, &catheter::USED) {
        let spatial = options.spatial.as_deref().map(spatial::read).transpose()?;
        let catheter = catheter::parse(file, text)?;
        return judged(file, scene::import(file, &catheter, spatial.as_ref()));
    }
    if mpem::looks_so(text) {
        if options.spatial.is_some() {
            let problem =
                Problem::Unreadable("it is a calibration of coils: `--spatial` is for parameter files".into());
            return Err(InputError { file: file.into(), line: None, key: String::new(), problem: problem.into() });
        }
        return judged(file, mpem::import(file, text)?);
    }
    let problem = if has_keyword(text, &spatial::KNOWN) {
        "it holds field, gravity and base pose only; import the parameter file and give this one as `--spatial FILE`"
    } else if currents::looks_so(text) {
        return currents::import(file, text, options);
    } else {
        "it is neither a parameter file (lines such as `CatheterConfig F A F`) nor a play file (lines `channel,mA,ms`) nor a \
         calibration of coils (YAML with `Coil_List:`)"
    };
    let problem = Problem::Unreadable(problem.into()).into();
    Err(InputError { file: file.into(), line: None, key: String::new(), problem })
}

/// Refuses a scene that would not be read: numbers that are possible alone may not be so together.
fn judged(file: &Path, import: Import) -> Result<Import, InputError> {
    match parse_scene(file, &import.text) {
        Ok(_) => Ok(import),
        Err(InputError { key, problem, .. }) => {
            let problem = Problem::Table(format!("makes no scene: `{key}`: {problem}")).into();
            Err(InputError { file: file.into(), line: None, key: String::new(), problem })
        }
    }
}

/// Whether a line begins with one of the keywords.
fn has_keyword(text: &str, known: &[&str]) -> bool {
    text.lines().any(|line| line.split_whitespace().next().is_some_and(|word| known.contains(&word)))
}

/// A text of the source as a line's comment: without what TOML forbids there.
fn printable(text: &str) -> String {
    text.trim().chars().filter(|c| !c.is_control() || *c == '\t').collect()
}

/// The file's name without its folder.
fn name_of(file: &Path) -> String {
    printable(&file.file_name().unwrap_or_default().to_string_lossy())
}
