//! What `shaders/generate.wgsl` reads to make samples: keys of the sampling method, and how inputs follow from axes.
//!
//! It is found by asking the plan: on which axes an input depends, its values over a grid, its ends over a range. Then it
//! is compared with the plan's own inputs. Where they differ, the device makes no samples.

use super::record::input_units;
use crate::model::{Entry, Plan, PlanAnchors, RecipeMethod, SampleRecipe};

/// Numbers in the tables of a grid at most.
const MAX_TABLE: usize = 1 << 22;
/// Axes whose corners can all be looked at.
const MAX_AXES: usize = 12;
/// Samples compared with the plan's own inputs.
const PROBES: usize = 512;
/// Bits of the whole numbers that inputs are summed in, less sign and carry.
const BITS: i32 = 62;

/// The tables of the generating kernel.
#[derive(Clone, Debug, PartialEq)]
pub struct Generator {
    /// The term that the method has in the shader.
    pub(super) term: &'static str,
    pub(super) axis_count: usize,
    pub(super) axis_words: usize,
    pub(super) columns_at: usize,
    pub(super) common_at: usize,
    pub(crate) words: Vec<u32>,
    /// In the plan's units.
    pub(crate) tables: Vec<f64>,
}

/// The methods' terms in the shader.
pub(super) const TERMS: [&str; 4] = ["GRID", "SOBOL", "UNIFORM", "LATIN_HYPERCUBE"];

/// Inputs of a plan for rows of axis values, in the plan's units.
struct Oracle<'a> {
    plan: &'a Plan,
    units: Vec<f64>,
}

impl Oracle<'_> {
    /// Input columns of each row; an error where a row makes no rod.
    fn inputs(&self, rows: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, String> {
        let batch = self.plan.batch(rows.len(), |at, row| {
            if let Some(values) = rows.get(at) {
                row.copy_from_slice(values);
            }
        });
        if batch.bad.contains(&true) {
            return Err("some of its samples make no rod".into());
        }
        let value = |at: usize, column: usize| batch.inputs.get(at, column) / self.units[column];
        Ok((0..rows.len()).map(|at| (0..self.plan.input_count).map(|column| value(at, column)).collect()).collect())
    }
}

/// Numbers in [0, 1) that look random and are always the same.
fn share(seed: usize) -> f64 {
    let mut x = (seed as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    ((x ^ (x >> 32)) >> 11) as f64 / (1u64 << 53) as f64
}

impl Generator {
    /// Prepares the samples of a recipe for a plan, or says why they cannot be made on the device.
    pub fn new(plan: &Plan, recipe: &SampleRecipe) -> Result<Generator, String> {
        if plan.input_count == 0 || plan.axes.is_empty() {
            return Err("nothing varies".into());
        }
        if plan.axes.len() > MAX_AXES {
            return Err(format!("{} axes vary, more than {MAX_AXES}", plan.axes.len()));
        }
        let oracle = Oracle { plan, units: input_units(plan) };
        let corner = |corner: usize| {
            let of = |(axis, range): (usize, &(f64, f64))| if corner >> axis & 1 == 0 { range.0 } else { range.1 };
            recipe.ranges.iter().enumerate().map(of).collect::<Vec<f64>>()
        };
        oracle.inputs(&(0..1 << recipe.ranges.len()).map(corner).collect::<Vec<_>>())?;
        match &recipe.method {
            RecipeMethod::Grid(values) => grid(&oracle, values),
            method => affine(&oracle, method, recipe),
        }
    }
}

/// Axes that each column depends on, by rows that differ in one axis.
fn dependence(oracle: &Oracle, value: &dyn Fn(usize, f64) -> f64) -> Result<Vec<Vec<usize>>, String> {
    const BASES: usize = 4;
    const OTHERS: usize = 8;
    let axis_count = oracle.plan.axes.len();
    let mut found = vec![Vec::new(); oracle.plan.input_count];
    for axis in 0..axis_count {
        for base in 0..BASES {
            let row: Vec<f64> = (0..axis_count).map(|a| value(a, share(base * axis_count + a))).collect();
            let moved = |other: usize| {
                let mut row = row.clone();
                // Both ends are among the others.
                row[axis] = value(axis, (other as f64 / (OTHERS - 1) as f64).min(1.0 - f64::EPSILON));
                row
            };
            let inputs = oracle.inputs(&(0..OTHERS).map(moved).collect::<Vec<_>>())?;
            for (column, axes) in found.iter_mut().enumerate() {
                if !axes.contains(&axis) && inputs.iter().any(|row| row[column] != inputs[0][column]) {
                    axes.push(axis);
                }
            }
        }
    }
    Ok(found)
}

fn grid(oracle: &Oracle, values: &[Vec<f64>]) -> Result<Generator, String> {
    let at = |axis: usize, place: f64| values[axis][(place * values[axis].len() as f64) as usize];
    let columns = dependence(oracle, &at)?;
    let size = |axes: &[usize]| axes.iter().map(|axis| values[*axis].len() as u64).product::<u64>();
    let total = columns.iter().map(|axes| size(axes)).sum::<u64>();
    if total > MAX_TABLE as u64 {
        return Err(format!("inputs that depend on several axes take {total} values"));
    }
    let mut words: Vec<u32> = values.iter().map(|values| values.len() as u32).collect();
    let columns_at = words.len();
    words.resize(columns_at + columns.len(), 0);
    let mut tables = Vec::new();
    let first: Vec<f64> = values.iter().map(|values| values[0]).collect();
    for (column, axes) in columns.iter().enumerate() {
        words[columns_at + column] = words.len() as u32;
        words.extend([tables.len() as u32, axes.len() as u32]);
        words.extend(axes.iter().map(|axis| *axis as u32));
        let row = |place: u64| {
            let (mut row, mut rest) = (first.clone(), place);
            for axis in axes {
                let count = values[*axis].len() as u64;
                row[*axis] = values[*axis][(rest % count) as usize];
                rest /= count;
            }
            row
        };
        let inputs = oracle.inputs(&(0..size(axes)).map(row).collect::<Vec<_>>())?;
        tables.extend(inputs.iter().map(|row| row[column]));
    }
    let places = |probe: usize| -> Vec<usize> {
        (0..values.len()).map(|a| (share(probe * values.len() + a) * values[a].len() as f64) as usize).collect()
    };
    let probes: Vec<Vec<usize>> = (0..PROBES).map(places).collect();
    let row = |places: &Vec<usize>| places.iter().enumerate().map(|(axis, at)| values[axis][*at]).collect();
    let expected = oracle.inputs(&probes.iter().map(row).collect::<Vec<_>>())?;
    for (places, expected) in probes.iter().zip(expected) {
        for (column, axes) in columns.iter().enumerate() {
            let place = axes.iter().rev().fold(0, |place, axis| place * values[*axis].len() + places[*axis]);
            if tables[words[words[columns_at + column] as usize] as usize + place] != expected[column] {
                return Err("an input follows from the axes in a way that no table of them holds".into());
            }
        }
    }
    let (axis_count, common_at) = (values.len(), words.len());
    Ok(Generator { term: "GRID", axis_count, axis_words: 1, columns_at, common_at, words, tables })
}

/// Low and high word.
fn halves(x: u64) -> [u32; 2] {
    [x as u32, (x >> 32) as u32]
}

/// Keys of each axis, then what concerns all.
fn keys(method: &RecipeMethod, sample_count: u64) -> (&'static str, Vec<Vec<u32>>, Vec<u32>) {
    match method {
        RecipeMethod::Sobol { directions, keys } => {
            let of = |(directions, key): (&Vec<u32>, &u32)| {
                (0..32).map(|bit| directions.get(bit).copied().unwrap_or(0)).chain([*key]).collect()
            };
            ("SOBOL", directions.iter().zip(keys).map(of).collect(), Vec::new())
        }
        RecipeMethod::LatinHypercube { rounds, jitter } => {
            let of =
                |(rounds, jitter): (&[u64; 6], &u64)| rounds.iter().chain([jitter]).flat_map(|x| halves(*x)).collect();
            let bits = (64 - sample_count.saturating_sub(1).leading_zeros()).max(1);
            let half = bits.max(2).div_ceil(2);
            let inverse = ((1u128 << (63 + bits)) / u128::from(sample_count.max(1))).min(u128::from(u64::MAX)) as u64;
            let mut common = halves(sample_count).to_vec();
            common.extend([bits, half]);
            common.extend(halves(inverse));
            ("LATIN_HYPERCUBE", rounds.iter().zip(jitter).map(of).collect(), common)
        }
        RecipeMethod::Uniform(keys) => ("UNIFORM", keys.iter().map(|key| halves(*key).to_vec()).collect(), Vec::new()),
        RecipeMethod::Grid(_) => ("GRID", Vec::new(), Vec::new()),
    }
}

/// By column: how far from the first anchor the zero of an axis lies, in points. Coordinates are that much less exact.
fn far_zeros(plan: &Plan) -> Vec<f64> {
    let mut zeros = vec![0.0; plan.input_count];
    if let Some(PlanAnchors { grid, entry }) = &plan.anchors {
        for (axis, entry) in grid.axes().iter().zip(&plan.entries[*entry..]) {
            if let Entry::Varying(column) = entry {
                zeros[*column] = (axis.from / axis.spacing).abs();
            }
        }
    }
    zeros
}

fn affine(oracle: &Oracle, method: &RecipeMethod, recipe: &SampleRecipe) -> Result<Generator, String> {
    let ranges = &recipe.ranges;
    let value = |axis: usize, share: f64| ranges[axis].0 + (ranges[axis].1 - ranges[axis].0) * share;
    let columns = dependence(oracle, &value)?;
    let row = |shares: &[f64]| shares.iter().enumerate().map(|(axis, share)| value(axis, *share)).collect::<Vec<f64>>();
    let unit = |axis: usize| (0..ranges.len()).map(|a| f64::from(u8::from(a == axis))).collect::<Vec<f64>>();
    // All axes at their first ends; then one at its last.
    let ends: Vec<Vec<f64>> = (0..ranges.len()).map(|axis| row(&unit(axis))).collect();
    let first = oracle.inputs(&[row(&vec![0.0; ranges.len()])])?.remove(0);
    let ends = oracle.inputs(&ends)?;
    let rises = |column: usize| columns[column].iter().map(move |axis| (*axis, column));
    let rise = |(axis, column): (usize, usize)| ends[axis][column] - first[column];
    let probes: Vec<Vec<f64>> =
        (0..PROBES).map(|probe| (0..ranges.len()).map(|a| share(probe * ranges.len() + a)).collect()).collect();
    let expected = oracle.inputs(&probes.iter().map(|shares| row(shares)).collect::<Vec<_>>())?;
    let scale = |column: usize| first[column].abs() + rises(column).map(|at| rise(at).abs()).sum::<f64>();
    let zeros = far_zeros(oracle.plan);
    for (shares, expected) in probes.iter().zip(expected) {
        for (column, expected) in expected.iter().enumerate() {
            let found = first[column] + rises(column).map(|at| rise(at) * shares[at.0]).sum::<f64>();
            if (found - expected).abs() > 8.0 * f64::EPSILON * (scale(column) + zeros[column]) {
                return Err("an input is no linear function of the axes".into());
            }
        }
    }
    let (term, axes, common) = keys(method, recipe.sample_count);
    let axis_words = axes.first().map_or(1, Vec::len);
    let mut words: Vec<u32> = axes.into_iter().flatten().collect();
    let columns_at = words.len();
    words.resize(columns_at + columns.len(), 0);
    let mut tables = Vec::new();
    for column in 0..columns.len() {
        words[columns_at + column] = words.len() as u32;
        let exponent = scale(column).max(f64::MIN_POSITIVE).log2().ceil() as i32 - BITS;
        let whole = |x: f64| (x * 2f64.powi(-exponent)).round();
        tables.push(2f64.powi(exponent));
        words.push(exponent as u32);
        words.extend(halves(whole(first[column]) as i64 as u64));
        words.push(columns[column].len() as u32);
        for (axis, column) in rises(column) {
            let rise = rise((axis, column));
            words.extend([axis as u32, u32::from(rise < 0.0)]);
            words.extend(halves(whole(rise.abs()) as u64));
        }
    }
    let common_at = words.len();
    words.extend(common);
    Ok(Generator { term, axis_count: ranges.len(), axis_words, columns_at, common_at, words, tables })
}
