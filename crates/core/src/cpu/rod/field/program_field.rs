//! What of the field of a plan varies in space, in the plan's units. F0

use super::map::ProgramMap;
use crate::model::record::field_offset;
use crate::model::{Plan, SourceForm};
use std::sync::Arc;

/// Farther from every magnet than any rod.
pub const FAR: f64 = 1e9;

/// What of the field of a plan varies in space.
#[derive(Clone, Debug)]
pub struct ProgramField {
    /// First entry of its record.
    pub entry: usize,
    /// Of each dipole outside of the rod, in the plan's units.
    pub clearances: Vec<f64>,
    /// The form of each of them.
    pub forms: Vec<SourceForm>,
    pub maps: Vec<Arc<ProgramMap>>,
    /// Points of a rigid segment where the field acts, and their shares of its dipole (of maps, on each stretch within a cell): on a
    /// path with care; on the fine steps, as many times as the plan has parts; for the answer.
    pub points: &'static [(f64, f64)],
    pub fine_points: Vec<(f64, f64)>,
    pub check_points: Vec<(f64, f64)>,
}

impl ProgramField {
    /// `None` where kernels of uniform fields do; `constant` tells an entry of the plan, in its units, that is the same for all samples.
    pub fn new(plan: &Plan, constant: impl Fn(usize) -> Option<f64>) -> Option<Self> {
        let rod = plan.scene.rod();
        let field = rod.field.as_ref().filter(|_| plan.terms.varying_field)?;
        let clearances: Vec<f64> = field.dipoles.iter().map(|dipole| dipole.clearance / plan.units.length).collect();
        let length = plan.units.length;
        let forms = field.dipoles.iter().map(|dipole| dipole.form.scaled(length)).collect();
        let nearest = clearances.iter().copied().fold(FAR, f64::min);
        let magnets = plan.segments.iter().filter(|segment| segment.has_dipole);
        let longest = magnets.map(|segment| constant(segment.record).unwrap_or(FAR)).fold(0.0, f64::max);
        let target = plan.target();
        let [points, check_points] = field.coil_load.points_within(longest / nearest, target);
        let [fine_points, check_points] = [points, check_points].map(|points| parts(points, plan.rigid_parts()));
        let maps = field.maps.iter().map(|map| Arc::new(ProgramMap::new(&map.grid, &plan.units))).collect();
        Some(Self { entry: field_offset(&rod.segments), clearances, forms, maps, points, fine_points, check_points })
    }
}

/// Points on a line and their shares, on each of so many equal parts of it; where it is the middle alone that counts, that.
fn parts(points: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    let count = if points.len() > 1 { count } else { 1 };
    let part = 1.0 / count as f64;
    let on = |k: usize| points.iter().map(move |(at, share)| ((k as f64 + at) * part, share * part));
    (0..count).flat_map(on).collect()
}
