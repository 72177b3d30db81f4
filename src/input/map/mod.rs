//! `[[field_map]]` of a scene file: fields sampled on a grid, from text, NPZ, VTK or VTI.

mod arrays;
mod columns;
mod data;
mod gaps;
mod grid;
mod nodes;
mod samples;
mod vti;
mod vtk;

use super::error::{InputError, Problem};
use super::segment_file::check_name;
use super::toml::{Reader, quoted};
use super::units::{Dimension, parse_quantity};
use crate::files;
use crate::model::{FieldMap, LEAST_MAP_NODES, MapGrid, short_name};
use data::{Factors, Samples, Values};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

const KEYS: [&str; 7] = ["name", "file", "scale", "position", "length_unit", "field_unit", "digest"];
/// Nodes that need a value.
const LEAST_VALUES: usize = LEAST_MAP_NODES.pow(3) / 2;
/// Nodes of a grid at most: their splines take 32 MB.
const MOST_NODES: usize = 4_000_000;

/// The fields sampled on grids.
pub(super) fn field_maps(reader: &Reader) -> Result<Vec<FieldMap>, InputError> {
    reader.tables("field_map")?.iter().map(field_map).collect()
}

fn field_map(reader: &Reader) -> Result<FieldMap, InputError> {
    reader.check_keys(&KEYS)?;
    let name = reader.string("name")?;
    let name = name.ok_or_else(|| {
        reader.missing("name", "parameters of a map start with `maps.` and its name, such as name = \"coil1\"")
    })?;
    check_name(reader, name)?;
    let file = reader.string("file")?;
    let file =
        file.ok_or_else(|| reader.missing("file", "name the file of the samples: text (CSV), NPZ, VTK or VTI"))?;
    let path = reader.source().file.parent().unwrap_or(Path::new("")).join(file);
    let bytes = files::read(&path).map_err(|error| {
        let reason = format!("{}: {error}; the path starts from the folder of this file", path.display());
        reader.error("file", Problem::Unreadable(reason))
    })?;
    let digest = format!("{:016x}", xxh3_64(&bytes));
    if let Some(expected) = reader.string("digest")?.filter(|expected| *expected != digest) {
        let expected = format!(
            "\"{}\", which this scene was written with: bring that file back, or drop `digest`",
            short_name(expected)
        );
        let value = format!("not that of {}, \"{digest}\"", path.display());
        return Err(reader.error("digest", Problem::Range { value, expected }));
    }
    let factors = Factors { length: factor(reader, "length_unit", "m")?, field: factor(reader, "field_unit", "T")? };
    let samples = samples::read(&path, bytes, &factors)?;
    let (grid, remarks) = fitted(&path, samples)?;
    let absolute = std::path::absolute(&path).unwrap_or(path.clone());
    Ok(FieldMap {
        name: name.into(),
        file: absolute.to_string_lossy().into_owned(),
        digest,
        scale: reader.quantity("scale", "")?.unwrap_or(1.0),
        position: reader.vector("position", "m")?.unwrap_or_default(),
        units: factors.words(),
        grid: Arc::new(grid),
        remarks,
    })
}

/// What a number without unit is worth.
fn factor(reader: &Reader, key: &str, unit: &str) -> Result<Option<(String, f64)>, InputError> {
    let Some(word) = reader.string(key)? else { return Ok(None) };
    let value = parse_quantity(&format!("1 {word}"), Dimension::of(unit));
    let value = value.map_err(|problem| reader.error(key, Problem::Quantity(problem)))?;
    Ok(Some((word.into(), value)))
}

/// The splines through samples, and what was supposed of them.
fn fitted(path: &Path, samples: Samples) -> Result<(MapGrid, Vec<String>), InputError> {
    let Samples { lattice, mut values, strays, mut notes } = samples;
    let gaps = values.gaps();
    let missing = gaps.iter().filter(|is_gap| **is_gap).count();
    if gaps.len() - missing < LEAST_VALUES {
        let words = format!("{missing} of {} nodes have no value: give at least {LEAST_VALUES}", gaps.len());
        return Err(wrong(path, None, "", words));
    }
    let fit = |values: &Values| -> Result<MapGrid, InputError> {
        let grid::Lattice { origin, steps, counts } = lattice;
        let grid = match values {
            Values::Potential(values) => MapGrid::from_potential(origin, steps, counts, values),
            Values::FluxDensity([x, y, z]) => MapGrid::from_flux_density(origin, steps, counts, [x, y, z]),
        };
        grid.ok_or_else(|| wrong(path, None, "", "the grid has too few nodes: give at least 4 in each direction"))
    };
    if missing > 0 {
        gaps::fill(&mut values, &gaps, lattice.counts);
    }
    let mut grid = fit(&values)?;
    if missing > 0 {
        // Values in the gaps must not change the potential elsewhere.
        for _ in 0..gaps::passes(gaps.len()) {
            let Values::FluxDensity(b) = &mut values else { break };
            let change = gaps::follow(b, &gaps, &lattice, &grid);
            grid = fit(&values)?;
            if change < gaps::SETTLED {
                break;
            }
        }
    }
    if let Some(strays) = strays {
        let share = |axis: usize| strays[axis].iter().fold(0.0_f64, |most, x| most.max(x.abs())) / lattice.steps[axis];
        let most = [0, 1, 2].map(share).into_iter().fold(0.0, f64::max);
        let words = match &mut values {
            Values::FluxDensity(b) => {
                gaps::onto_nodes(b, &strays, &lattice, &grid);
                grid = fit(&values)?;
                "B is corrected for that"
            }
            Values::Potential(_) => "they are taken as on it",
        };
        notes.push(format!("points miss an even grid by up to {:.2} % of a step; {words}", 100.0 * most));
    }
    if missing == 0 {
        return Ok((grid, notes));
    }
    let grid = grid.with_gaps(&gaps);
    let misfit = match &values {
        Values::FluxDensity(b) => {
            let share = 100.0 * gaps::misfit(b, &gaps, &lattice, &grid);
            format!("; beside the open ones B misses its samples by up to {share:.2} % of the largest")
        }
        Values::Potential(_) => String::new(),
    };
    let of = gaps.len();
    notes.push(format!("{missing} of {of} nodes have no value: rods in a cell beside one are `outside-map`{misfit}"));
    Ok((grid, notes))
}

/// A mistake in the file of samples.
fn wrong(path: &Path, line: Option<usize>, key: &str, words: impl Into<String>) -> InputError {
    InputError { file: PathBuf::from(path), line, key: key.into(), problem: Box::new(Problem::Table(words.into())) }
}

/// A map as it reads back; what it was read from has to be there still.
pub(super) fn write_map(text: &mut String, map: &FieldMap, prefix: &str) -> std::fmt::Result {
    writeln!(text, "\n[[{prefix}field_map]]\nname = {}\nfile = {}", quoted(&map.name), quoted(&map.file))?;
    writeln!(text, "digest = \"{}\"\nscale = {:?}\nposition = {:?}", map.digest, map.scale, map.position)?;
    for (key, unit) in ["length_unit", "field_unit"].iter().zip(&map.units) {
        if let Some(unit) = unit {
            writeln!(text, "{key} = {}", quoted(unit))?;
        }
    }
    Ok(())
}
