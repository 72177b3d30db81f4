//! Words and names that stand in files for what they mean.

use super::error::{InputError, Problem};
use super::toml::Reader;
use crate::model::{Parameter, Scene, closest};

/// One word of a fixed list.
///
/// # Errors
///
/// A value that is no text, or no word of the list.
pub fn choice<T: Copy>(
    reader: &Reader,
    name: &str,
    all: &[T],
    word: fn(T) -> &'static str,
) -> Result<Option<T>, InputError> {
    let Some(text) = reader.string(name)? else { return Ok(None) };
    one_of(text, all, word).map(Some).map_err(|problem| reader.error(name, problem))
}

/// The item of a fixed list whose word a text is.
///
/// # Errors
///
/// A text that is no word of the list.
pub fn one_of<T: Copy>(text: &str, all: &[T], word: fn(T) -> &'static str) -> Result<T, Problem> {
    let words: Vec<&str> = all.iter().map(|item| word(*item)).collect();
    match all.iter().find(|item| word(**item) == text) {
        Some(item) => Ok(*item),
        None => Err(Problem::Choice {
            found: text.into(),
            suggestion: closest(text, words.iter().copied()),
            allowed: words.join(", "),
        }),
    }
}

/// The parameters of a scene that a name stands for; mistakes are told at a key of the reader.
///
/// # Errors
///
/// A name that the scene does not have.
pub fn parameters(reader: &Reader, key: &str, scene: &Scene, name: &str) -> Result<Vec<Parameter>, InputError> {
    Parameter::parse(scene, name).map_err(|error| reader.error(key, error))
}
