//! Workspaces of many designs on one lattice: what all of them reach, and what a number of the design does.

use super::error::WorkspaceError;
use super::job::WorkspaceJob;
use super::lattice::{Cell, CellMap};
use super::measures::{Estimate, quantiles};
use super::reach::Reach;
use super::stage::WorkspaceStage;
use super::workspace::Workspace;
use crate::input::{Dimension, parse_quantity};
use crate::model::{Parameter, Scene, Vector, short_name};
use crate::spec::{AxisSpec, SobolNet, SweepSpec};
use crate::study::columns::Columns;
use crate::table::{Column, Table};
use serde::Serialize;

/// Fewest designs of which none may fail for "at least 95 % of all designs with a confidence of 95 %" (Wilks 1941).
pub const WILKS_DESIGNS: usize = 59;
/// Confidence of the bounds on probabilities.
const CONFIDENCE: f64 = 0.95;
/// Shares of designs whose common workspace is told.
const SHARES: [f64; 4] = [1.0, 0.95, 0.5, 0.0];
/// Margins are told at these shares of the size.
const MARGIN_SHARES: [f64; 3] = [0.01, 0.05, 0.5];

/// The workspace of one design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Design {
    /// Values of what varies: SI, or factors where several parameters keep their ratio.
    pub values: Vec<f64>,
    /// Volume, area or length, with its interval of 95 %.
    pub size: Estimate,
    /// Stability margin at 1, 5 and 50 % of the size.
    pub margin: Vec<f64>,
}

/// What uncertain designs have in common.
#[derive(Clone, Debug)]
pub struct RobustWorkspace {
    /// Names of what is uncertain.
    pub names: Vec<String>,
    /// Each design.
    pub designs: Vec<Design>,
    /// Designs that reach each voxel.
    pub counts: CellMap<u32>,
    /// Share of the designs and the size that at least so many reach: all, 95 %, 50 %, any.
    pub common: Vec<(f64, f64)>,
    /// Size of the design as it was drawn.
    pub nominal: Estimate,
}

/// What a number of the design does to the workspace; all designs share lattice and nets.
#[derive(Clone, Debug, Serialize)]
pub struct DesignStudy {
    /// What varies.
    pub name: String,
    /// SI unit; empty for a factor.
    pub unit: &'static str,
    /// In order of the values.
    pub designs: Vec<Design>,
    /// Of the size by the value, by least squares; for a factor the value's logarithm.
    pub slope: f64,
    /// Of the slope, from what least squares leaves.
    pub slope_error: f64,
}

/// What `--vary` means: which parameters, as factors or as values.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// What is set.
    pub parameters: Vec<Parameter>,
    /// As it was written.
    pub name: String,
    /// Whether values multiply the scene's.
    pub scales: bool,
    /// In order.
    pub values: Vec<f64>,
}

impl Variation {
    /// Reads `NAME+NAME=-10%..10%:5` (factors about the scene's values) or `NAME=0.5..4:5` (values, SI).
    ///
    /// # Errors
    ///
    /// Text that says no such thing, or a name that the scene does not know.
    pub fn parse(scene: &Scene, text: &str) -> Result<Variation, WorkspaceError> {
        let wrong = |problem: &str| {
            let form = "write NAME+NAME=-10%..10%:5, or NAME=LOW..HIGH:COUNT";
            WorkspaceError::Designs(format!("`{}`: {problem}; {form}", short_name(text)))
        };
        let (names, range) = text.split_once('=').ok_or_else(|| wrong("there is no `=`"))?;
        let (range, count) = range.rsplit_once(':').ok_or_else(|| wrong("there is no number of designs"))?;
        let (low, high) = range.split_once("..").ok_or_else(|| wrong("there is no range"))?;
        let count: usize = count.trim().parse().map_err(|_| wrong("the number of designs is no number"))?;
        if !(2..=1000).contains(&count) {
            return Err(wrong("take 2 to 1000 designs"));
        }
        let scales = low.trim().ends_with('%') && high.trim().ends_with('%');
        let mut parameters = Vec::new();
        for name in names.split('+') {
            let found = Parameter::parse(scene, name.trim());
            parameters
                .extend(found.map_err(|error| WorkspaceError::Designs(format!("`{}`: {error}", short_name(text))))?);
        }
        let unit = parameters.first().map_or("", Parameter::unit);
        let end = |end: &str| -> Result<f64, WorkspaceError> {
            let dimension = if scales { Dimension::NUMBER } else { Dimension::of(unit) };
            let value = parse_quantity(end.trim(), dimension).map_err(|problem| wrong(&problem.to_string()))?;
            Ok(if scales { 1.0 + value } else { value })
        };
        let (low, high) = (end(low)?, end(high)?);
        if low == high {
            return Err(wrong("the range has no width"));
        }
        if !scales && parameters.iter().any(|parameter| parameter.unit() != unit) {
            return Err(wrong("the parameters have different units: give the range in per cent"));
        }
        if let Some(zero) = parameters.iter().find(|parameter| scales && parameter.get(scene) == 0.0) {
            return Err(wrong(&format!("`{}` is zero, of which no share can be taken", zero.name(scene))));
        }
        let last = (count - 1) as f64;
        let values = (0..count).map(|k| (low * (last - k as f64) + high * k as f64) / last).collect();
        Ok(Variation { parameters, name: names.trim().to_owned(), scales, values })
    }

    fn scene(&self, scene: &Scene, value: f64) -> Result<Scene, WorkspaceError> {
        let of = |p: &Parameter| (*p, if self.scales { value * p.get(scene) } else { value });
        changed(scene, self.parameters.iter().map(of))
    }

    fn unit(&self) -> &'static str {
        if self.scales { "" } else { self.parameters.first().map_or("", Parameter::unit) }
    }
}

fn changed(scene: &Scene, values: impl Iterator<Item = (Parameter, f64)>) -> Result<Scene, WorkspaceError> {
    let mut changed = scene.clone();
    let values: Vec<(Parameter, f64)> = values.collect();
    Parameter::set_all(&mut changed, values.into_iter()).map_err(|error| WorkspaceError::Designs(error.to_string()))?;
    changed.validate().map_err(|error| WorkspaceError::Designs(format!("a design makes no rod: {error}")))?;
    Ok(changed)
}

impl WorkspaceJob<'_> {
    /// The workspace of each of many designs drawn from what the sweep calls uncertain, beside the nominal one.
    ///
    /// # Errors
    ///
    /// A sweep that calls nothing uncertain, designs that make no rod, or as [`WorkspaceJob::run`].
    pub fn robust(&self, nominal: &Workspace, designs: usize) -> Result<RobustWorkspace, WorkspaceError> {
        let drawn = draw_designs(self.spec(), &nominal.scene, designs, self.seed)?;
        let (mut all, mut counts) = (Vec::new(), CellMap::<u32>::default());
        let mut sizes: CellMap<f64> = CellMap::default();
        for (number, (values, scene)) in drawn.into_iter().enumerate() {
            self.tell(WorkspaceStage::Designs(number, designs));
            let found = self.of_design(nominal, scene, nominal.grown.lattice)?;
            for at in found.grown.reached() {
                let voxel = &found.grown.voxels[at];
                *counts.entry(voxel.cell).or_default() += 1;
                *sizes.entry(voxel.cell).or_default() += voxel.measure;
            }
            all.push(design(&found, values)?);
        }
        // Of a surface a voxel counts as much as its section in a mean design.
        let edge = nominal.grown.lattice.spacing;
        let size_of = |cell: &Cell, count: u32| match nominal.grown.dimension {
            3 => edge.powi(3),
            _ => sizes.get(cell).copied().unwrap_or(0.0) / f64::from(count),
        };
        let reached_by = |share: f64| {
            let least = ((share * designs as f64).ceil() as u32).max(1);
            // Added in the order of the cells: sums must not depend on a hash.
            let mut cells: Vec<(&Cell, u32)> = counts.iter().map(|(cell, count)| (cell, *count)).collect();
            cells.sort_unstable();
            cells.into_iter().filter(|(_, count)| *count >= least).map(|(cell, count)| size_of(cell, count)).sum()
        };
        let common = SHARES.into_iter().map(|share| (share, reached_by(share))).collect();
        let nominal_size = nominal.size().ok_or_else(|| WorkspaceError::Designs("a point has no size".into()))?;
        let names = self.spec().uncertain.iter().map(|axis| axis.name(&nominal.scene)).collect();
        Ok(RobustWorkspace { names, designs: all, counts, common, nominal: nominal_size })
    }

    /// The workspace for each value of a number of the design.
    ///
    /// # Errors
    ///
    /// Designs that make no rod, or as [`WorkspaceJob::run`].
    pub fn vary(&self, nominal: &Workspace, variation: &Variation) -> Result<DesignStudy, WorkspaceError> {
        let mut designs = Vec::new();
        for (number, value) in variation.values.iter().enumerate() {
            self.tell(WorkspaceStage::Designs(number, variation.values.len()));
            let scene = variation.scene(&nominal.scene, *value)?;
            designs.push(design(&self.of_design(nominal, scene, nominal.grown.lattice)?, vec![*value])?);
        }
        let place = |design: &Design| if variation.scales { design.values[0].ln() } else { design.values[0] };
        let points: Vec<(f64, f64)> = designs.iter().map(|design| (place(design), design.size.value)).collect();
        let (slope, slope_error) = line(&points);
        Ok(DesignStudy { name: variation.name.clone(), unit: variation.unit(), designs, slope, slope_error })
    }
}

/// Designs drawn by a net from what a sweep calls uncertain: their values, and a scene with them.
///
/// # Errors
///
/// A sweep that calls nothing uncertain, no designs, or designs that make no rod.
pub fn draw_designs(
    spec: &SweepSpec,
    scene: &Scene,
    designs: usize,
    seed: u64,
) -> Result<Vec<(Vec<f64>, Scene)>, WorkspaceError> {
    let uncertain = &spec.uncertain;
    if uncertain.is_empty() {
        let remedy = "add [[uncertain]] blocks with parameter and relative, such as \"10 %\"";
        return Err(WorkspaceError::Designs(format!("nothing is said to be uncertain: {remedy}")));
    }
    if designs == 0 {
        return Err(WorkspaceError::Designs("0 designs tell nothing: give at least one".into()));
    }
    let net = SobolNet::new(uncertain.len(), seed);
    let draw = |number: usize| {
        let mut point = vec![0.0; uncertain.len()];
        net.point(number as u64, &mut point);
        let values: Vec<f64> = uncertain.iter().zip(&point).map(|(axis, u)| axis.distribution.value(*u)).collect();
        let changed = changed(scene, settings(uncertain, &values, scene))?;
        Ok((values, changed))
    };
    (0..designs).map(draw).collect()
}

fn settings<'a>(
    uncertain: &'a [AxisSpec],
    values: &'a [f64],
    scene: &'a Scene,
) -> impl Iterator<Item = (Parameter, f64)> + 'a {
    uncertain.iter().zip(values).flat_map(move |(axis, value)| {
        axis.parameters.iter().copied().zip(axis.rates(scene)).map(move |(parameter, rate)| (parameter, rate * value))
    })
}

fn design(found: &Workspace, values: Vec<f64>) -> Result<Design, WorkspaceError> {
    let size = found.size().ok_or_else(|| WorkspaceError::Designs("a design's workspace is a point".into()))?;
    let places: Vec<usize> = found.grown.reached().collect();
    let margins: Vec<f64> = places.iter().map(|at| found.grown.voxels[*at].margin).collect();
    let weights: Vec<f64> = places.iter().map(|at| found.grown.voxels[*at].measure).collect();
    Ok(Design { values, size, margin: quantiles(&margins, &weights, &MARGIN_SHARES) })
}

/// Slope of a line through points, and its standard error (zero for two points).
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let xx: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    let xy: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    let slope = xy / xx;
    let left: f64 = points.iter().map(|point| (point.1 - y - slope * (point.0 - x)).powi(2)).sum();
    let error = if points.len() > 2 { (left / (count - 2.0) / xx).sqrt() } else { 0.0 };
    (slope, error)
}

/// Bounds of 95 % on the probability of which `successes` of `trials` were seen (Clopper and Pearson 1934).
pub fn clopper_pearson(successes: u32, trials: u32) -> [f64; 2] {
    let tail = 0.5 * (1.0 - CONFIDENCE);
    // P(X >= successes) grows with p, P(X <= successes) falls.
    let bisect = |is_below: &dyn Fn(f64) -> bool| {
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if is_below(middle) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let low = match successes {
        0 => 0.0,
        _ => bisect(&|p| 1.0 - at_most(successes - 1, trials, p) < tail),
    };
    let high = if successes == trials { 1.0 } else { bisect(&|p| at_most(successes, trials, p) > tail) };
    [low, high]
}

/// P(X <= successes) of a binomial distribution.
fn at_most(successes: u32, trials: u32, p: f64) -> f64 {
    let (log_p, log_q) = (p.ln(), (1.0 - p).ln());
    let (mut choose, mut sum) = (0.0f64, 0.0);
    for k in 0..=successes {
        sum += (choose + f64::from(k) * log_p + f64::from(trials - k) * log_q).exp();
        choose += (f64::from(trials - k) / f64::from(k + 1)).ln();
    }
    sum.min(1.0)
}

impl RobustWorkspace {
    /// The rows of a voxel table with what the designs say: `reach.designs`, `reach.probability` and its bounds; a
    /// voxel that only other designs reach has a row, too.
    pub fn voxel_columns(&self, nominal: &Workspace) -> Table {
        let lattice = &nominal.grown.lattice;
        let mut cells: Vec<Cell> = self.counts.keys().copied().collect();
        cells.sort_unstable();
        let mut columns = Columns::default();
        columns.vectors("voxel", "m", &cells.iter().map(|cell| lattice.centre(*cell)).collect::<Vec<Vector>>());
        columns.flags("reached", cells.iter().map(|cell| nominal.grown.voxel(*cell).is_some_and(|v| v.is_reached())));
        let mut table = columns.finish();
        table.columns.extend(self.reach_columns(&cells));
        table
    }

    /// Of each cell: designs that reach it, their share and its bounds of 95 %.
    pub(super) fn reach_columns(&self, cells: &[Cell]) -> Vec<Column> {
        let trials = self.designs.len() as u32;
        let bounds: Vec<[f64; 2]> = (0..=trials).map(|count| clopper_pearson(count, trials)).collect();
        let counts: Vec<u32> = cells.iter().map(|cell| self.counts.get(cell).copied().unwrap_or(0)).collect();
        let mut columns = Columns::default();
        columns.counts("reach.designs", counts.iter().map(|count| u64::from(*count)));
        columns.numbers("reach.probability", "", counts.iter().map(|count| f64::from(*count) / f64::from(trials)));
        columns.numbers("reach.low", "", counts.iter().map(|count| bounds[*count as usize][0]));
        columns.numbers("reach.high", "", counts.iter().map(|count| bounds[*count as usize][1]));
        columns.finish().columns
    }

    /// Every design: its values, size with interval, margins.
    pub fn table(&self) -> Table {
        design_table(&self.names, &self.designs)
    }

    /// Tells each answer of the nominal workspace which share of the designs reaches the voxel of its target.
    pub fn rate(&self, nominal: &Workspace, answers: &mut [Reach]) {
        for answer in answers {
            let cell = nominal.grown.lattice.cell(answer.target.position);
            let count = self.counts.get(&cell).copied().unwrap_or(0);
            answer.probability = f64::from(count) / self.designs.len().max(1) as f64;
        }
    }
}

impl DesignStudy {
    /// Every design: its value, size with interval, margins.
    pub fn table(&self) -> Table {
        design_table(std::slice::from_ref(&self.name), &self.designs)
    }
}

fn design_table(names: &[String], designs: &[Design]) -> Table {
    let mut columns = Columns::default();
    columns.counts("design", 0..designs.len() as u64);
    for (k, name) in names.iter().enumerate() {
        columns.numbers(name.clone(), "", designs.iter().map(|design| design.values[k]));
    }
    columns.numbers("size", "", designs.iter().map(|design| design.size.value));
    columns.numbers("size.low", "", designs.iter().map(|design| design.size.low));
    columns.numbers("size.high", "", designs.iter().map(|design| design.size.high));
    for (k, name) in ["margin.1_percent", "margin.5_percent", "margin.median"].iter().enumerate() {
        columns.numbers(*name, "", designs.iter().map(|design| design.margin[k]));
    }
    columns.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_says_what_is_wrong_with_its_ends() {
        let text = "[[segment]]\nname = \"wire\"\nkind = \"flexible\"\nlength = 0.05\n\
                    stiffness = { bending = 1e-5, torsion = 1e-5 }\n";
        let scene = crate::input::parse_scene("scene.toml".as_ref(), text).expect("a scene");
        let values = |text: &str| Variation::parse(&scene, text).map(|variation| variation.values);
        for (text, words) in [
            ("wire.stiffness.bending=1..1e61:5", "of at most 1e60 in size"),
            ("wire.stiffness.bending=-1e300%..10%:5", "of at most 1e60 in size"),
            ("wire.stiffness.bending=1..1e400:5", "is not finite"),
            ("wire.stiffness.bending=1..much:5", "does not start with a number"),
            ("wire.stiffness.bending=1..2 kg:5", "is a mass"),
        ] {
            let error = values(text).expect_err(text).to_string();
            assert!(error.contains(words) && error.contains("NAME=LOW..HIGH:COUNT"), "{error}");
        }
        assert_eq!(values("wire.stiffness.bending=-50%..50%:3").expect("factors"), [0.5, 1.0, 1.5]);
        assert_eq!(values("wire.stiffness.bending=1..3:3").expect("values"), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn bounds_are_those_of_the_tables() {
        let near = |found: [f64; 2], wanted: [f64; 2]| {
            assert!((0..2).all(|k| (found[k] - wanted[k]).abs() < 5e-5), "{found:?} {wanted:?}");
        };
        near(clopper_pearson(0, 10), [0.0, 0.3085]);
        near(clopper_pearson(10, 10), [0.6915, 1.0]);
        near(clopper_pearson(5, 10), [0.1871, 0.8129]);
        // Wilks: none of 59 fails, so that 95 % is exceeded with a confidence of 95 % on one side.
        assert!(0.95f64.powi(WILKS_DESIGNS as i32) < 0.05 && 0.95f64.powi(WILKS_DESIGNS as i32 - 1) > 0.05);
    }
}
