//! Everything that is wrong with a file, as far as it can be known at once.
//!
//! Readers end at the first mistake. Here it is noted, mended in a copy of the text, and the copy is read again.

use super::error::{InputError, Problem};
use super::scene_file::{parse_scene, read_text};
use super::sweep_file::parse_sweep;
use super::toml::{Source, quoted};
use super::toml_spans::{Spans, spans};
use super::trajectory_file::parse_trajectory;
use crate::model::{ParameterError, Scene};
use crate::spec::{SweepSpec, Trajectory};
use std::path::Path;

/// Mistakes that are told of one file, at most.
const MOST: usize = 50;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// One rod in one field.
    Scene,
    /// A scene, or its name, and what varies.
    Sweep,
    /// Points for the tip.
    Trajectory,
}

impl FileKind {
    /// What the text of a file is, by its keys; a text that is no TOML counts as a scene.
    pub fn of(file: &Path, text: &str) -> FileKind {
        let Ok(source) = Source::parse(file, text) else { return FileKind::Scene };
        let has = |names: &[&str]| names.iter().any(|name| source.root().has(name));
        match () {
            () if has(&["sampling", "axis", "scene"]) => FileKind::Sweep,
            () if has(&["shape", "duration"]) && !has(&["segment"]) => FileKind::Trajectory,
            () => FileKind::Scene,
        }
    }

    /// For messages: `a scene`.
    pub fn name(self) -> &'static str {
        match self {
            FileKind::Scene => "a scene",
            FileKind::Sweep => "a sweep",
            FileKind::Trajectory => "a trajectory",
        }
    }
}

/// What a sound file holds.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum FileContent {
    /// One rod in one field.
    Scene(Box<Scene>),
    /// A scene and what varies.
    Sweep(Box<SweepSpec>),
    /// Points for the tip.
    Trajectory(Box<Trajectory>),
}

/// What became of reading a file.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FileCheck {
    /// What the file is.
    pub kind: FileKind,
    /// What it holds; `None` where anything is wrong.
    pub content: Option<FileContent>,
    /// Every mistake that was found, in the order of reading.
    pub errors: Vec<InputError>,
    /// Whether reading came to the end of the file; else there may be more mistakes.
    pub is_complete: bool,
}

impl FileCheck {
    /// Reads a scene, a sweep or a trajectory to its end. A trajectory needs the scene that it is for.
    ///
    /// # Errors
    ///
    /// A file that cannot be read at all, or a trajectory without a scene.
    pub fn read(file: &Path, scene: Option<&Scene>) -> Result<FileCheck, InputError> {
        let text = read_text(file)?;
        let kind = FileKind::of(file, &text);
        let check = |found: Found<FileContent>| FileCheck {
            kind,
            content: found.content.filter(|_| found.errors.is_empty()),
            errors: found.errors,
            is_complete: found.is_complete,
        };
        Ok(check(match kind {
            FileKind::Scene => mended(file, text, &|text| Ok(FileContent::Scene(parse_scene(file, text)?.into()))),
            FileKind::Sweep => sweep(file, text),
            FileKind::Trajectory => {
                let Some(scene) = scene else {
                    let remedy = "name the scene that the trajectory is for".into();
                    let problem = Problem::Missing { remedy };
                    return Err(InputError {
                        file: file.into(),
                        line: None,
                        key: "scene".into(),
                        problem: problem.into(),
                    });
                };
                let read = |text: &str| Ok(FileContent::Trajectory(parse_trajectory(file, text, scene)?.into()));
                mended(file, text, &read)
            }
        }))
    }
}

/// A sweep, and the scene in a file of its own.
fn sweep(file: &Path, text: String) -> Found<FileContent> {
    let named = Source::parse(file, &text).ok().and_then(|source| {
        let name = source.root().string("scene").ok()??.to_owned();
        let path = file.parent().unwrap_or(Path::new("")).join(&name);
        Some((read_text(&path).ok()?, path))
    });
    let Some((scene_text, path)) = named else {
        return mended(file, text, &|text| Ok(FileContent::Sweep(parse_sweep(file, text, &[])?.into())));
    };
    let scene = mended(&path, scene_text, &|text| parse_scene(&path, text));
    if scene.content.is_none() {
        return Found { content: None, errors: scene.errors, is_complete: false, text };
    }
    let place = path.to_string_lossy().into_owned();
    let built_in = [(place.as_str(), scene.text.as_str())];
    let mut found = mended(file, text, &|text| Ok(FileContent::Sweep(parse_sweep(file, text, &built_in)?.into())));
    found.errors.splice(0..0, scene.errors);
    found
}

/// What came of reading a text again and again.
struct Found<T> {
    content: Option<T>,
    errors: Vec<InputError>,
    is_complete: bool,
    /// As it was read in the end.
    text: String,
}

/// Reads a text; where it is wrong, notes the mistake, mends it and reads again.
fn mended<T>(file: &Path, mut text: String, read: &dyn Fn(&str) -> Result<T, InputError>) -> Found<T> {
    let mut errors: Vec<InputError> = Vec::new();
    // A value that was made up may be at odds with others, which is no mistake of the user.
    let mut is_made_up = false;
    let mut result = read(&text);
    loop {
        let error = match result {
            Ok(content) => return Found { content: Some(content), errors, is_complete: true, text },
            Err(error) => error,
        };
        let is_told = errors.iter().any(|told| told.line == error.line && told.key == error.key);
        if is_told || is_made_up && may_follow(&error.problem) {
            return Found { content: None, errors, is_complete: false, text };
        }
        errors.push(error.clone());
        let next = if error.file == file && errors.len() < MOST { mend(file, &text, &error, read) } else { None };
        let Some(next) = next else { return Found { content: None, errors, is_complete: false, text } };
        is_made_up |= next.is_made_up;
        (text, result) = (next.text, next.result);
    }
}

/// Whether a mistake may follow from a value that was made up.
fn may_follow(problem: &Problem) -> bool {
    matches!(
        problem,
        Problem::Scene(_)
            | Problem::Plan(_)
            | Problem::Conflict { .. }
            | Problem::InsertionTooShort { .. }
            | Problem::Missing { .. }
            | Problem::Parameter(_)
            | Problem::Column(_)
            | Problem::TooMany { .. }
    )
}

/// A text in which a mistake is mended, and what reading it gives.
struct Next<T> {
    text: String,
    result: Result<T, InputError>,
    is_made_up: bool,
}

/// Tries changes of the text at a mistake until the mistake is no longer there.
fn mend<T>(
    file: &Path,
    text: &str,
    error: &InputError,
    read: &dyn Fn(&str) -> Result<T, InputError>,
) -> Option<Next<T>> {
    let source = Source::parse(file, text).ok()?;
    let Spans { key, value } = spans(&source, &error.key)?;
    let replaced = |range: std::ops::Range<usize>, with: &str| {
        let mut text = text.to_owned();
        text.replace_range(range, with);
        text
    };
    let mut tries: Vec<(String, bool)> = Vec::new();
    let suggestion = match &*error.problem {
        Problem::UnknownKey { suggestion, .. } => {
            if let (Some(name), Some(key)) = (suggestion, &key) {
                tries.push((replaced(key.clone(), name), false));
            }
            None
        }
        Problem::Choice { suggestion, allowed, .. } => suggestion.clone().or(allowed.split(',').next().map(Into::into)),
        Problem::Parameter(ParameterError::Unknown { suggestion, .. }) => suggestion.clone(),
        _ => None,
    };
    if let Some(value) = &value {
        let values = suggestion.iter().map(|name| (quoted(name.trim()), false));
        let made_up = example(&error.problem.to_string()).into_iter().chain(PLACEHOLDERS.map(str::to_owned));
        let is_key = matches!(*error.problem, Problem::UnknownKey { .. });
        let values = values.chain(made_up.map(|text| (text, true))).filter(|_| !is_key);
        tries.extend(values.map(|(with, is_made_up)| (replaced(value.clone(), &with), is_made_up)));
        if let Some(key) = &key {
            // Lines stay where they are.
            let range = key.start.min(value.start)..value.end;
            let blank: String = text[range.clone()].chars().map(|c| if c == '\n' { '\n' } else { ' ' }).collect();
            tries.push((replaced(range, &blank), !is_key));
        }
    }
    let is_mended = |result: &Result<T, InputError>| match result {
        Ok(_) => true,
        Err(other) => {
            let is_there =
                other.file == error.file && (other.key.starts_with(&error.key) || error.key.starts_with(&other.key));
            !is_there && !matches!(*other.problem, Problem::Syntax(_))
        }
    };
    tries.into_iter().find_map(|(text, is_made_up)| {
        let result = read(&text);
        is_mended(&result).then_some(Next { text, result, is_made_up })
    })
}

/// Values that stand in for one that cannot be read.
const PLACEHOLDERS: [&str; 8] =
    ["1", "0.5", "true", "[0, 0, 0]", "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]", "\"base.position.x\"", "[]", "[1]"];

/// The value that a message gives as an example.
fn example(message: &str) -> Option<String> {
    let after = ["such as ", "for example "].iter().filter_map(|words| message.rsplit_once(words)).next()?.1;
    let value = match after.strip_prefix('"') {
        Some(text) => format!("\"{}\"", text.split('"').next()?),
        None => after.split([',', ';', ' ']).next()?.to_owned(),
    };
    (!value.is_empty()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(text: &str) -> (Vec<(Option<usize>, String)>, bool) {
        let kind = FileKind::of(Path::new("a.toml"), text);
        let found = match kind {
            FileKind::Sweep => sweep(Path::new("a.toml"), text.into()),
            _ => mended(Path::new("a.toml"), text.into(), &|text| {
                Ok(FileContent::Scene(parse_scene(Path::new("a.toml"), text)?.into()))
            }),
        };
        (found.errors.iter().map(|error| (error.line, error.key.clone())).collect(), found.is_complete)
    }

    const TUBE: &str = "[[segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = \"80 mm\"\n\
                        stiffness = { bending = 1e-5, torsion = 1e-5 }\n";

    #[test]
    fn mistakes_are_found_at_once() {
        let text =
            format!("nam = \"x\"\n[field]\nflux_density = [0, \"3 A\", 0]\n[loads]\ntip_force = 3\nfoo = 1\n{TUBE}");
        let (errors, is_complete) = wrong(&text);
        let lines: Vec<usize> = errors.iter().filter_map(|(line, _)| *line).collect();
        assert_eq!(lines, [1, 3, 6, 5], "{errors:?}");
        assert!(is_complete);
    }

    #[test]
    fn a_sound_text_has_none_and_a_missing_table_ends_the_search() {
        assert_eq!(wrong(TUBE), (Vec::new(), true));
        let (errors, is_complete) = wrong("name = 3\n");
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(!is_complete || errors[0].1 == "segment");
    }

    #[test]
    fn names_of_parameters_in_a_sweep_are_all_looked_at() {
        let scene = TUBE.replace("[[segment]]", "[[scene.segment]]");
        let axis = |name: &str| format!("[[axis]]\nparameter = \"{name}\"\nfrom = 0\nto = 1\npoints = 3\n");
        let text = format!(
            "{scene}[sampling]\nmethod = \"gird\"\n{}{}[solver]\ntolerence = 1e-6\n",
            axis("loads.tip_force.xx"),
            axis("tube.lenth")
        );
        let keys: Vec<String> = wrong(&text).0.into_iter().map(|(_, key)| key).collect();
        for key in ["sampling.method", "axis[0].parameter", "axis[1].parameter", "solver.tolerence"] {
            assert!(keys.iter().any(|other| other == key), "{key}: {keys:?}");
        }
    }

    #[test]
    fn examples_are_taken_from_messages() {
        assert_eq!(example("give a length such as \"13 mm\"").as_deref(), Some("\"13 mm\""));
        assert_eq!(example("give a number between 0 and 1, such as 1e-6").as_deref(), Some("1e-6"));
        assert_eq!(example("nothing"), None);
    }
}
