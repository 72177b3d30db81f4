//! A study's files: tables, and all of it as JSON.

use super::experiments::Observability;
use super::result::{Identification, Index, Information, QUANTILES, Sensitivity};
use crate::results::{ResultsError, place_table, verdict_metadata, write_bytes, write_table};
use crate::study::columns::Columns;
use crate::table::Table;
use std::path::{Path, PathBuf};

/// The file of everything.
const JSON_FILE: &str = "sensitivity.json";

impl Sensitivity {
    /// Every table by the name of its file; those without rows are left out.
    pub fn tables(&self) -> Vec<(&'static str, Table)> {
        let mut tables = vec![
            ("indices.csv", self.index_table()),
            ("dgsm.csv", self.slope_table()),
            ("local.csv", self.local_table()),
            ("moments.csv", self.spread_table()),
            ("failures.csv", self.failure_table()),
            ("chaos.csv", self.polynomial_table()),
        ];
        if let Some(identification) = &self.identification {
            tables.push(("fisher.csv", fisher_table(identification)));
            tables.extend(identification.chosen.as_ref().map(|chosen| ("design.csv", chosen.table.clone())));
        }
        tables.retain(|(_, table)| table.row_count() > 0);
        tables
    }

    /// Writes every table and `sensitivity.json` into a directory that is there; returns the files.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, dir: &Path) -> Result<Vec<PathBuf>, ResultsError> {
        let mut files = Vec::new();
        for (name, table) in self.tables() {
            let path = place_table(dir, name)?;
            write_table(&path, &table, &[verdict_metadata(self.mark.as_deref())])?;
            files.push(path);
        }
        let path = dir.join(JSON_FILE);
        let text = serde_json::to_string_pretty(&self.to_json()).unwrap_or_default() + "\n";
        write_bytes(&path, text.as_bytes())?;
        files.push(path);
        Ok(files)
    }

    fn index_table(&self) -> Table {
        let of = |text: &dyn Fn(&Index) -> String| self.indices.iter().map(text).collect::<Vec<_>>();
        let number = |value: &dyn Fn(&Index) -> f64| self.indices.iter().map(value).collect::<Vec<_>>();
        let mut columns = Columns::default();
        columns.words("output", of(&|index| index.output.clone()));
        columns.words("input", of(&|index| index.input.clone()));
        columns.words("index", of(&|index| index.order.name().into()));
        columns.words("estimator", of(&|index| index.estimator.into()));
        columns.flags("main", self.indices.iter().map(|index| index.is_main));
        columns.numbers("value", "", number(&|index| index.estimate.value));
        columns.numbers("low", "", number(&|index| index.estimate.low));
        columns.numbers("high", "", number(&|index| index.estimate.high));
        columns.counts("pairs", self.indices.iter().map(|index| index.pairs));
        columns.counts("rows", self.indices.iter().map(|index| index.rows));
        columns.words("flag", of(&|index| index.flag.clone()));
        columns.finish()
    }

    fn slope_table(&self) -> Table {
        let mut columns = Columns::default();
        columns.words("output", self.slopes.iter().map(|slopes| slopes.output.clone()));
        columns.words("input", self.slopes.iter().map(|slopes| slopes.input.clone()));
        columns.numbers("nu", "", self.slopes.iter().map(|slopes| slopes.mean_square));
        columns.numbers("constant", "", self.slopes.iter().map(|slopes| slopes.constant));
        columns.numbers("upper", "", self.slopes.iter().map(|slopes| slopes.upper));
        columns.numbers("mean_slope", "", self.slopes.iter().map(|slopes| slopes.mean));
        columns.numbers("sd_slope", "", self.slopes.iter().map(|slopes| slopes.deviation));
        columns.numbers("jump_share", "", self.slopes.iter().map(|slopes| slopes.jump_share));
        columns.words("flag", self.slopes.iter().map(|slopes| slopes.flag.clone()));
        columns.finish()
    }

    fn local_table(&self) -> Table {
        let mut columns = Columns::default();
        columns.words("output", self.local.iter().map(|local| local.output.clone()));
        columns.words("input", self.local.iter().map(|local| local.input.clone()));
        columns.numbers("slope", "", self.local.iter().map(|local| local.slope));
        columns.numbers("per_100_percent", "", self.local.iter().map(|local| local.per_value));
        columns.numbers("per_standard_deviation", "", self.local.iter().map(|local| local.per_deviation));
        for (k, share) in ["q5", "q50", "q95"].into_iter().enumerate() {
            let name = format!("per_standard_deviation.{share}");
            columns.numbers(name, "", self.local.iter().map(|local| local.quantiles[k]));
        }
        columns.finish()
    }

    fn spread_table(&self) -> Table {
        let mut columns = Columns::default();
        let spreads = || self.spreads.iter();
        columns.words("output", spreads().map(|spread| spread.output.clone()));
        columns.words("unit", spreads().map(|spread| spread.unit.clone()));
        columns.counts("rows", spreads().map(|spread| spread.rows));
        columns.numbers("mean", "", spreads().map(|spread| spread.mean));
        columns.numbers("sd", "", spreads().map(|spread| spread.deviation));
        columns.numbers("skew", "", spreads().map(|spread| spread.skew));
        columns.numbers("least", "", spreads().map(|spread| spread.least));
        columns.numbers("largest", "", spreads().map(|spread| spread.largest));
        for (k, share) in QUANTILES.iter().enumerate() {
            columns.numbers(format!("q{}", 100.0 * share), "", spreads().map(|spread| spread.quantiles[k]));
        }
        columns.numbers("nominal", "", spreads().map(|spread| spread.nominal));
        columns.numbers("sd_first_order", "", spreads().map(|spread| spread.first_order));
        for (k, share) in QUANTILES.iter().enumerate() {
            let name = format!("q{}_first_order", 100.0 * share);
            columns.numbers(name, "", spreads().map(|spread| spread.first_order_quantiles[k]));
        }
        columns.numbers("ratio", "", spreads().map(|spread| spread.ratio));
        columns.numbers("mean_shift", "", spreads().map(|spread| spread.mean_shift));
        columns.numbers("lumps_at", "", spreads().map(|spread| spread.lumps.map_or(f64::NAN, |lumps| lumps.at)));
        let above = |spread: &super::Spread| spread.lumps.map_or(f64::NAN, |lumps| lumps.share_above);
        columns.numbers("share_above", "", spreads().map(above));
        columns.words("flag", spreads().map(|spread| spread.flag.clone()));
        columns.finish()
    }

    /// Statuses, then the indices of indicators.
    fn failure_table(&self) -> Table {
        let mut columns = Columns::default();
        let (statuses, indices) = (&self.statuses, &self.failure_indices);
        let words = |of_status: &dyn Fn(usize) -> String, of_index: &dyn Fn(&Index) -> String| -> Vec<String> {
            (0..statuses.len()).map(of_status).chain(indices.iter().map(of_index)).collect()
        };
        let numbers = |of_status: &dyn Fn(usize) -> f64, of_index: &dyn Fn(&Index) -> f64| -> Vec<f64> {
            (0..statuses.len()).map(of_status).chain(indices.iter().map(of_index)).collect()
        };
        columns.words("status", words(&|k| statuses[k].status.name().into(), &|index| index.output.clone()));
        columns.words("input", words(&|_| String::new(), &|index| index.input.clone()));
        columns.words("index", words(&|_| String::new(), &|index| index.order.name().into()));
        let rows = statuses.iter().map(|share| share.rows).chain(indices.iter().map(|index| index.pairs));
        columns.counts("rows", rows);
        columns.numbers("share", "", numbers(&|k| statuses[k].share, &|index| index.estimate.value));
        columns.numbers("low", "", numbers(&|k| statuses[k].interval[0], &|index| index.estimate.low));
        columns.numbers("high", "", numbers(&|k| statuses[k].interval[1], &|index| index.estimate.high));
        columns.finish()
    }

    fn polynomial_table(&self) -> Table {
        let terms = || {
            let of = |one: &'_ super::Polynomial| one.exponents.len();
            self.polynomials.iter().flat_map(move |one| (0..of(one)).map(move |term| (one, term)))
        };
        let mut columns = Columns::default();
        columns.words("output", terms().map(|(one, _)| one.output.clone()));
        columns.numbers("q2", "", terms().map(|(one, _)| one.predicted));
        for (k, (name, ..)) in self.inputs.iter().enumerate() {
            columns.counts(format!("degree.{name}"), terms().map(|(one, term)| u64::from(one.exponents[term][k])));
        }
        columns.numbers("coefficient", "", terms().map(|(one, term)| one.coefficients[term]));
        columns.finish()
    }
}

/// Information, correlations and directions, of all candidates and of the chosen measurements.
fn fisher_table(identification: &Identification) -> Table {
    let mut cells: Vec<([String; 3], f64, Vec<f64>)> = Vec::new();
    let mut add = |set: &str, information: &Information| {
        let row = |kind: &str, name: &str| [set.to_owned(), kind.to_owned(), name.to_owned()];
        for (k, name) in identification.parameters.iter().enumerate() {
            cells.push((row("fisher", name), information.deviations[k], information.fisher[k].clone()));
        }
        for (k, name) in identification.parameters.iter().enumerate() {
            cells.push((row("correlation", name), f64::NAN, information.correlations[k].clone()));
        }
        for direction in &information.directions {
            let strength = direction.strength.name();
            cells.push((row("direction", strength), direction.singular_value.powi(2), direction.weights.clone()));
        }
        let none = vec![f64::NAN; identification.parameters.len()];
        let Observability { volume, roundness, weakest, amplification } = information.observability;
        for (name, value) in [
            ("volume", volume),
            ("roundness", roundness),
            ("weakest", weakest),
            ("amplification", amplification),
            ("log_determinant", information.log_determinant),
        ] {
            cells.push((row("observability", name), value, none.clone()));
        }
    };
    add("all", &identification.all);
    if let Some(chosen) = &identification.chosen {
        add("chosen", &chosen.information);
    }
    let mut columns = Columns::default();
    for (k, name) in ["measurements", "kind", "name"].into_iter().enumerate() {
        columns.words(name, cells.iter().map(|(words, ..)| words[k].clone()));
    }
    columns.numbers("value", "", cells.iter().map(|(_, value, _)| *value));
    for (k, name) in identification.parameters.iter().enumerate() {
        columns.numbers(name.clone(), "", cells.iter().map(|(_, _, row)| row[k]));
    }
    columns.finish()
}
