//! Play files of the laboratory's current controller: lines `channel, current [mA], dwell [ms]`.
//!
//! A channel keeps its current until it is set again; channel 0 sets all. A state is complete, and held for the dwell
//! time, at the line whose dwell time is not zero. Channels 1 to 3 are coils x, y (side) and z (axial) of one set.

use super::super::error::{InputError, Problem};
use super::super::units::{Dimension, parse_quantity};
use super::keywords::{number, size_words};
use super::{Import, ImportKind, ImportOptions, name_of};
use crate::model::short_name;
use std::path::Path;

const CHANNELS: usize = 6;

struct Play<'a> {
    /// Currents of all channels (A) and the dwell time's digits (ms)
    states: Vec<([f64; CHANNELS], &'a str)>,
    /// Highest channel that is set by its number.
    highest: usize,
    /// Lines after the last dwell time.
    left_over: usize,
}

/// Whether the first line that is no comment has three numbers between commas.
pub(crate) fn looks_so(text: &str) -> bool {
    let first = lines(text).next();
    first.is_some_and(|(_, line)| line.split(',').count() == 3 && line.split(',').all(|c| number(c.trim()).is_some()))
}

pub(crate) fn import(file: &Path, text: &str, options: &ImportOptions) -> Result<Import, InputError> {
    let play = parse(file, text)?;
    let sets = play.highest.max(1).div_ceil(3);
    let coils: Vec<String> = match (options.coils.len(), sets) {
        (0, 1) => vec!["coil".into()],
        (0, _) => vec!["coil_1".into(), "coil_2".into()],
        (given, _) if given == sets => options.coils.clone(),
        (given, _) => {
            let wanted = if sets == 1 { "one: the file sets channels 1 to 3" } else { "two: channels 1 to 3, 4 to 6" };
            let problem = Problem::Range { value: format!("a list of {given}"), expected: wanted.into() };
            return Err(error(file, None, "--coil", problem));
        }
    };
    let side = |(state, _): &&([f64; CHANNELS], &str)| (0..3 * sets).all(|k| k % 3 == 2 || state[k] == 0.0);
    let start = play.states.iter().take_while(side).count();
    Ok(Import {
        kind: ImportKind::Currents,
        text: table(file, &play, &coils, options.negate_axial),
        summary: format!("{} rows: currents of {} [A]", play.states.len(), coils.join(", ")),
        notes: notes(&play, &coils, start, options),
    })
}

fn notes(play: &Play, coils: &[String], start: usize, options: &ImportOptions) -> Vec<String> {
    let mut notes = Vec::new();
    if start > 0 && start < play.states.len() {
        let rows = if start == 1 { "first row has".to_owned() } else { format!("first {start} rows have") };
        notes.push(format!("the {rows} no current in the side coils (the way to the start); kept"));
    }
    if play.left_over > 0 {
        notes.push(format!("the last {} lines have no dwell time: no state, left out", play.left_over));
    }
    if let ([first, second], true) = (coils, options.coils.is_empty()) {
        let order = format!("channels 1 to 3 are taken as `{first}`, 4 to 6 as `{second}`");
        notes.push(format!("{order}: the file does not say which is nearer the base; `--coil NAME,NAME` changes it"));
    }
    if !options.negate_axial {
        let commanded = "axial currents (.z) are as commanded";
        notes.push(format!("{commanded}; laps observed with prototype 6 fit only with them negated: `--negate-axial`"));
    }
    notes
}

fn error(file: &Path, line: Option<usize>, key: &str, problem: Problem) -> InputError {
    InputError { file: file.into(), line, key: key.into(), problem: problem.into() }
}

/// Lines that hold something, numbered from one, without comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    lines.map(|(number, line)| (number, line.split('#').next().unwrap_or("").trim())).filter(|(_, l)| !l.is_empty())
}

fn parse<'a>(file: &Path, text: &'a str) -> Result<Play<'a>, InputError> {
    let mut play = Play { states: Vec::new(), highest: 0, left_over: 0 };
    let mut state = [0.0; CHANNELS];
    for (line, row) in lines(text) {
        let wrong = |key: &str, value: String, expected: &str| {
            error(file, Some(line), key, Problem::Range { value, expected: expected.into() })
        };
        let quoted = |cell: &str| format!("\"{}\"", short_name(cell));
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        let [channel, current, dwell] = cells[..] else {
            return Err(wrong("", format!("a list of {}", cells.len()), "three values: channel, mA, ms"));
        };
        let Some(channel) = channel.parse::<usize>().ok().filter(|channel| *channel <= CHANNELS) else {
            return Err(wrong("channel", quoted(channel), "1 to 6, or 0 for all of them"));
        };
        // With the unit in the text, the double is the one nearest to the decimal in A.
        let amperes = number(current).and_then(|_| parse_quantity(&format!("{current} mA"), Dimension::of("A")).ok());
        let Some(amperes) = amperes else {
            return Err(wrong("current", quoted(current), &format!("a number [mA]{}", size_words(current))));
        };
        let Some(milliseconds) = number(dwell).filter(|time| *time >= 0.0) else {
            return Err(wrong("dwell", quoted(dwell), &format!("a number [ms]{}, not negative", size_words(dwell))));
        };
        match channel {
            0 => state = [amperes; CHANNELS],
            _ => state[channel - 1] = amperes,
        }
        play.highest = play.highest.max(channel);
        play.left_over += 1;
        if milliseconds > 0.0 {
            play.states.push((state, dwell));
            play.left_over = 0;
        }
    }
    if play.states.is_empty() {
        let remedy = "a state is complete at a line whose third value, its dwell time [ms], is above zero".into();
        return Err(error(file, None, "dwell", Problem::Missing { remedy }));
    }
    Ok(play)
}

/// The table as CSV; dwell times are comments, since a static table has no column for them.
fn table(file: &Path, play: &Play, coils: &[String], negate_axial: bool) -> String {
    let sign = if negate_axial { "negated" } else { "as commanded" };
    let mut text = format!("# Imported from {}: currents [A], axial ones (.z) {sign}.\n", name_of(file));
    let columns = coils.iter().flat_map(|coil| ["x", "y", "z"].map(|axis| format!("{coil}.current.{axis}")));
    text += &(columns.collect::<Vec<_>>().join(",") + "\n");
    let mut held = "";
    for (state, dwell) in &play.states {
        if *dwell != held {
            text += &format!("# each held {dwell} ms\n");
            held = dwell;
        }
        let cells = state[..3 * coils.len()].iter().enumerate().map(|(k, current)| {
            let sign = if negate_axial && k % 3 == 2 { -1.0 } else { 1.0 };
            // Adding zero turns -0 into 0.
            format!("{:?}", sign * current + 0.0)
        });
        text += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    text
}
