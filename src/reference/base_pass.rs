//! One passage from a given base moment, whatever comes of it: what passes of engines are held against.

use super::answer::{SI, TOLERANCE};
use super::by_nodes;
use super::chain::{self, Chain, rows};
use super::extrapolation::Extrapolation;
use super::shooting::pass;
use super::state::{Column, State};
use crate::model::{PassColumn, PassEnd, Rod, Vector};
use nalgebra::Vector3;

/// Where the rod ends that sets out with base moment `m0` (N·m, world frame), an equilibrium or not. `None` where the rod
/// cannot be integrated, as a limp one from its base, and in a field that varies.
pub fn pass_end(rod: &Rod, m0: Vector) -> Option<PassEnd> {
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    if by_nodes::is_limp(&chain) || rod.field.is_some() {
        return None;
    }
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let variations = chain.base_moment_variations();
    let passage = pass(&chain, m0_body, &variations, &mut Extrapolation::new(TOLERANCE)).ok()?;
    let State { p, R, m_body, columns } = passage.tip;
    let moment = R * m_body;
    let column = |axis: usize| {
        // Columns are by components in the base frame.
        let by = |of: &dyn Fn(&Column) -> Vector3<f64>| -> Vector3<f64> {
            columns.iter().enumerate().map(|(k, column)| of(column) * chain.R0[(axis, k)]).sum()
        };
        PassColumn {
            w: SI(by(&|column| column.w), 1.0 / units.moment()),
            dp: SI(by(&|column| column.dp), units.length / units.moment()),
            dm: by(&|column| R * column.dm_body + column.w.cross(&moment)).into(),
        }
    };
    Some(PassEnd {
        position: (p * units.length + Vector3::from(rod.base_position)).into(),
        rotation: rows(&R),
        moment: SI(moment, units.moment()),
        columns: [0, 1, 2].map(column),
    })
}
