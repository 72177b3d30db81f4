//! Numbers of a workspace beside its voxels, for titles and curves.

use crate::draw::DrawnWall;
use crate::study::workspace::Estimate;

/// What is known of a workspace besides its voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkspaceSummary {
    /// Above the figures, such as the scene's name.
    pub title: String,
    /// 3 for a volume, 2 for a surface, 1 for a line.
    pub dimension: usize,
    /// Volume (m³), area (m²) or length (m), by `dimension`.
    pub size: Option<Estimate>,
    /// The size by several methods, each at several costs.
    pub methods: Vec<Method>,
    /// The wall of the scene, where no input moves it.
    pub wall: Option<DrawnWall>,
    /// The size to compare the methods with, and its name.
    pub reference: Option<(String, Estimate)>,
}

/// What one method says of the size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Method {
    /// In words.
    pub name: String,
    /// In order of cost.
    pub points: Vec<MethodPoint>,
}

/// The size by one method at one cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodPoint {
    /// Edge of a voxel (m); `None` for a method without voxels.
    pub spacing: Option<f64>,
    /// Equilibria that it took.
    pub solves: u64,
    /// m³, m² or m
    pub size: Estimate,
}

/// The size of the workspace for several designs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DesignStudy {
    /// Above the figure.
    pub title: String,
    /// 3 for a volume, 2 for a surface, 1 for a line.
    pub dimension: usize,
    /// What is varied.
    pub name: String,
    /// Its unit; empty for none. Values are drawn as given.
    pub unit: String,
    /// One for each design.
    pub values: Vec<f64>,
    /// One for each design (m³, m² or m).
    pub sizes: Vec<Estimate>,
    /// Change of the size over that of the value, and its standard error.
    pub slope: Option<[f64; 2]>,
    /// Share of the workspace, 0 to 1, and the stability margin that it stays below, one for each design.
    pub margins: Vec<(f64, Vec<f64>)>,
}

/// Words, factor from SI and unit of a size of some dimension.
pub(super) fn size_unit(dimension: usize) -> (&'static str, f64, &'static str) {
    match dimension {
        1 => ("length", 1e2, "cm"),
        2 => ("area", 1e4, "cm²"),
        _ => ("volume", 1e6, "cm³"),
    }
}

/// A number with as many decimals as its bounds allow, and the bounds.
pub(super) fn words(estimate: Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    let is_bounded = high > low;
    let decimals = decimals(if is_bounded { high - low } else { 0.01 * value.abs() });
    let [value, low, high] = [value, low, high].map(|x| fixed(x, decimals));
    if is_bounded { format!("{value} ({low} to {high})") } else { value }
}

/// A number with as many decimals as its standard error allows.
pub(super) fn with_error(value: f64, error: f64) -> String {
    if error.is_nan() || error <= 0.0 {
        return fixed(value, decimals(0.01 * value.abs()));
    }
    let decimals = decimals(error);
    format!("{} ± {}", fixed(value, decimals), fixed(error, decimals))
}

/// Decimals for two digits of a width, or one where that suffices.
fn decimals(width: f64) -> usize {
    let decimals = -width.log10().floor();
    let lead = width * 10f64.powf(decimals);
    if decimals.is_finite() { (decimals + if lead < 3.0 { 1.0 } else { 0.0 }).clamp(0.0, 9.0) as usize } else { 1 }
}

fn fixed(x: f64, decimals: usize) -> String {
    format!("{x:.decimals$}").replace('-', "−")
}
