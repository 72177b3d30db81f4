//! Text with a row for each node, as other programs write it.

use super::data::{Factors, POTENTIAL, Samples};
use super::nodes::{FLUX, Named, PLACES, meaning, of_columns};
use super::wrong;
use crate::input::InputError;
use crate::input::error::Problem;
use crate::input::text_table::{Head, TextTable, comments, decode, is_gap};
use crate::input::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{short_list, short_name};
use std::path::Path;

/// How COMSOL tells the unit of coordinates.
const LENGTH_UNIT: &str = "Length unit";

/// A column that is used.
struct Used<'a> {
    at: usize,
    head: &'a Head<'a>,
    name: &'static str,
    /// Whether its name is our own.
    is_own: bool,
    factor: f64,
}

pub(super) fn read(path: &Path, bytes: Vec<u8>, factors: &Factors) -> Result<Samples, InputError> {
    let text = decode(bytes).map_err(|reason| wrong(path, None, "", reason))?;
    let asked = "the first line must name x, y, z and Bx, By, Bz, or x, y, z and potential";
    let six = [PLACES[0], PLACES[1], PLACES[2], FLUX[0], FLUX[1], FLUX[2]];
    let mut notes = Vec::new();
    let table = match TextTable::new(path, &text, "x,y,z,Bx,By,Bz") {
        Ok(table) => table.ok_or_else(|| wrong(path, None, "", asked))?,
        Err(unnamed) => {
            notes.push("no line names the columns, which are taken as x, y, z, Bx, By, Bz".to_owned());
            TextTable::unnamed(&text, &six).ok_or(unnamed)?
        }
    };
    let length = length_unit(path, &text, table.line, factors)?;
    let used = columns(path, &table, length, factors)?;
    let mut named: Named = used.iter().map(|column| (column.name, Vec::new())).collect();
    for row in table.rows(path) {
        let (line, cells) = row?;
        for (column, (_, values)) in used.iter().zip(&mut named) {
            let cell = cells[column.at];
            let Used { head: Head { name, .. }, .. } = column;
            let value = match table.number(cell) {
                Some(value) => value * column.factor,
                None if is_gap(cell) => f64::NAN,
                None => {
                    let (cell, column) = (short_name(cell), short_name(name));
                    let words = format!(
                        "\"{cell}\" is no number; write the unit once, in the first line as `{column} [mT]` or as `field_unit` of the scene"
                    );
                    return Err(wrong(path, Some(line), name, words));
                }
            };
            if value.is_nan() && PLACES.contains(&column.name) {
                return Err(wrong(path, Some(line), name, "is no place: give each node its coordinates"));
            }
            values.push(value);
        }
    }
    let names = short_list(table.heads.iter().map(|head| format!("`{}`", short_name(head.name))));
    let there = format!("line {} names {names}", table.line);
    let samples = of_columns(path, &named, &there).map_err(|error| match notes.is_empty() {
        true => error,
        false => {
            let words =
                format!("{}; no line names the columns: write them above, such as x,y,z,Bx,By,Bz", error.problem);
            wrong(path, None, "", words)
        }
    })?;
    Ok(Samples { notes, ..samples })
}

/// Factor of coordinates by a comment of the file: `% Length unit: mm`.
fn length_unit(path: &Path, text: &str, before: usize, factors: &Factors) -> Result<Option<f64>, InputError> {
    let of = |words: &str| {
        words.strip_prefix(LENGTH_UNIT).map(|rest| rest.trim_matches([':', ',', ' ', '\t', '"']).to_owned())
    };
    let said =
        comments(text).take_while(|(line, _)| *line <= before).find_map(|(line, words)| Some((line, of(words)?)));
    let Some((line, unit)) = said else { return Ok(None) };
    let wrong_unit = |problem: QuantityError| InputError {
        problem: Box::new(problem.into()),
        ..wrong(path, Some(line), LENGTH_UNIT, "")
    };
    let factor = parse_quantity(&format!("1 {unit}"), Dimension::of("m")).map_err(wrong_unit)?;
    match &factors.length {
        Some((other, value)) if (value - factor).abs() > 1e-12 * factor => {
            let remedy = "drop `length_unit` of the scene, or mend this line".into();
            let problem = Problem::Conflict { with: format!("length_unit = \"{other}\""), remedy };
            Err(InputError {
                problem: problem.into(),
                ..wrong(path, Some(line), &format!("{LENGTH_UNIT}: {unit}"), "")
            })
        }
        _ => Ok(Some(factor)),
    }
}

/// The columns that hold places and values. Our own names win over those of other programs.
fn columns<'t>(
    path: &Path,
    table: &'t TextTable,
    length: Option<f64>,
    factors: &Factors,
) -> Result<Vec<Used<'t>>, InputError> {
    let mut used: Vec<Used> = Vec::new();
    for (at, head) in table.heads.iter().enumerate() {
        let Some((name, is_own, unit)) = understood(head) else { continue };
        let dimension = dimension_of(name);
        let factor = match unit {
            None if PLACES.contains(&name) => length.unwrap_or_else(|| factors.of(name)),
            None => factors.of(name),
            Some(unit) => parse_quantity(&format!("1 {unit}"), dimension).map_err(|problem| InputError {
                problem: Box::new(problem.into()),
                ..wrong(path, Some(table.line), head.name, "")
            })?,
        };
        let column = Used { at, head, name, is_own, factor };
        match used.iter().position(|other| other.name == name) {
            None => used.push(column),
            Some(other) if is_own && !used[other].is_own => used[other] = column,
            Some(other) if used[other].is_own && !is_own => {}
            Some(other) => {
                let words = match used[other].head.name {
                    same if same == head.name => "stands twice in the first line: drop one of the columns".to_owned(),
                    another => {
                        let another = short_name(another);
                        format!("and `{another}` both may be {name}: drop one of the columns, or rename it")
                    }
                };
                return Err(wrong(path, Some(table.line), head.name, words));
            }
        }
    }
    Ok(used)
}

fn dimension_of(name: &str) -> Dimension {
    Dimension::of(match name {
        "x" | "y" | "z" => "m",
        POTENTIAL => "T·m",
        _ => "T",
    })
}

/// The meaning of a head, whether in our own name, and its unit: `Bx [mT]`, `mf.Bx (T)`, `Bx(mT)`, `Bx / mT`, `x_mm`.
fn understood<'a>(head: &Head<'a>) -> Option<(&'static str, bool, Option<&'a str>)> {
    if let Some((name, is_own)) = meaning(head.name) {
        return Some((name, is_own, head.unit));
    }
    if head.unit.is_some() {
        return None;
    }
    let bracket = head.name.split_once('(').and_then(|(name, unit)| Some((name, unit.strip_suffix(')')?)));
    let word = || ["/", " in "].into_iter().find_map(|by| head.name.split_once(by));
    let (name, unit) = bracket.or_else(word).or_else(|| head.name.rsplit_once('_'))?;
    let (name, unit) = (meaning(name.trim())?.0, unit.trim());
    parse_quantity(&format!("1 {unit}"), dimension_of(name)).ok()?;
    Some((name, false, Some(unit)))
}
