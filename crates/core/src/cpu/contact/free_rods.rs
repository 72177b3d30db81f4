//! A batch beside a wall in a uniform field: its rods are solved without the wall, by the kernels of free rods; the wall comes to those whose
//! tips it presses or holds. W4

use super::free_tip::FREE_COLUMNS;
use crate::cpu::Cpu;
use crate::cpu::simd::lane::Scalar;
use crate::model::record::BASE_POSITION_AT;
use crate::model::{BLOCK, Batch, ContactColumn, Quantity, Solutions, Status};

impl Cpu {
    /// The samples of a batch that the wall may change, once their rods are solved without it: all but those whose rod has no equilibrium
    /// from rest.
    pub(in crate::cpu) fn beside_wall(&self, batch: &Batch, solutions: &Solutions) -> Vec<usize> {
        let is_settled = |at: &usize| matches!(solutions.status(*at), Status::Fold | Status::BadParameter);
        (0..batch.sample_count()).filter(|at| !is_settled(at)).collect()
    }

    /// The free rods of samples for the kernel, in the plan's units.
    pub(in crate::cpu) fn take_free_rods<S: Scalar>(
        &self,
        (batch, rows): (&Batch, &Solutions),
        samples: &[usize],
        free: &mut Vec<S>,
    ) {
        free.resize(FREE_COLUMNS * BLOCK, S::default());
        let (length, moment) = (self.plan.units.length, self.plan.units.moment());
        for (place, sample) in samples.iter().enumerate() {
            let m0 = rows.vector(*sample, Quantity::BaseMoment);
            let p = rows.vector(*sample, Quantity::TipPosition);
            let base: [f64; 3] = std::array::from_fn(|axis| self.plan.entry(batch, *sample, BASE_POSITION_AT + axis));
            let passes = rows.get(*sample, Quantity::Iterations);
            let moments = m0.map(|m| m / moment);
            let places: [f64; 3] = std::array::from_fn(|axis| (p[axis] - base[axis]) / length);
            for (column, value) in moments.into_iter().chain(places).chain([passes]).enumerate() {
                free[column * BLOCK + place] = S::from_f64(value);
            }
        }
    }

    /// Sorts samples by how far the wall comes to a sliding tip: those of a register take about as many steps.
    pub(in crate::cpu) fn sort_by_way(&self, solutions: &Solutions, samples: &mut [usize]) {
        let Some(wall) = &self.program.wall else { return };
        if !wall.kind.sticks {
            let gap = |at: &usize| solutions.contact(*at, ContactColumn::Gap);
            samples.sort_by(|a, b| gap(a).total_cmp(&gap(b)).then(a.cmp(b)));
        }
    }

    /// Takes over which free rods are in the wall behind their tips.
    pub(in crate::cpu) fn mark_through_wall(&self, solutions: &mut Solutions, samples: &[usize], rows: &[f64]) {
        let code = f64::from(Status::ThroughWall.code());
        for (place, sample) in samples.iter().enumerate() {
            if rows[Quantity::Status.column() * BLOCK + place] == code {
                solutions.set_status(*sample, Status::ThroughWall);
            }
        }
    }
}
