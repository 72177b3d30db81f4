//! The reference: scalar f64 in the literature's own form (p, R, u integrated; virtual angular velocities). It is
//! adaptive and shoots to machine precision, on the branch that leads from rest to the full load.
//!
//! Rods in fields that vary in space, or beside a wall, have six unknowns (`varying`). Limp and taut rods, on which that loses its digits, it solves by multiple shooting (`by_nodes`).
//!
//! Clear before fast. It shares neither formulation nor stepper with the engines, so that an error in either shows.
//! Equations (1)-(4), (9)-(33), with the corrections listed in `EQUATIONS.md`.
//!
//! ```
//! use rodsweep::{input, reference};
//! # std::env::set_current_dir(env!("CARGO_MANIFEST_DIR"))?;
//! let rod = input::read_scene("sweeps/scenes/cantilever.toml".as_ref())?.rod();
//! let equilibrium = reference::solve_rod(&rod, &[]);
//! let middle = &reference::shape(&rod, &equilibrium, &[0.05])[0];
//! println!("tip at {:?} m, middle at {:?} m", equilibrium.p_tip, middle.position);
//! # assert!(equilibrium.status.is_success() && middle.position[2] < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case)]

mod answer;
mod band;
mod by_base;
mod by_nodes;
mod chain;
mod compliance;
mod energy;
mod equilibrium;
mod extrapolation;
mod flexible;
mod multiple;
mod node_ramp;
mod places;
mod ramp;
mod rigid;
mod search;
mod shape;
mod shooting;
mod stability;
mod state;
mod varying;

pub use answer::{Equilibrium, SlotDerivative, Stability, TipContact};
pub use energy::{energy, energy_of};
pub use equilibrium::{
    base_curvature, growth_exponent, residual_by_base_moment, solve_rod, solve_rod_by_nodes, stability_at,
};
pub use search::{Reached, column_growth, equilibrium_near};
pub use shape::{Pose, PoseDerivative, shape, shape_with_derivatives};

use crate::backend::{Backend, BackendError, BackendInfo, BackendKind, Precision};
use crate::clock::Busy;
use crate::model::{Batch, ContactColumn, MOST_ROWS, NO_EQUILIBRIUM, Plan, Quantity, Slot, Solutions, Status};
use rayon::prelude::*;
use std::iter::repeat_n;

/// Samples in one call: enough to keep the threads busy.
const BATCH_SIZE: usize = 1024;
/// Columns are integrated to the tolerance of the tip, and the nearer to a fold the worse. Of random rods with short tapers some
/// were off by 120 times that.
const COLUMN_SHARE: f64 = 200.0;

/// The reference as a backend: one sample after another on each thread.
pub struct Reference {
    plan: Plan,
    /// Slots that some derivative uses, each once.
    slots: Vec<Slot>,
}

impl Reference {
    /// A reference for a plan, whose resolution and tolerance do not matter to it.
    pub fn new(plan: &Plan) -> Self {
        Self { plan: plan.clone(), slots: plan.slots() }
    }

    fn solve_sample(&self, batch: &Batch, sample: usize) -> Vec<f64> {
        let mut equilibrium = solve_rod(&self.plan.sample_rod(batch, sample), &self.slots);
        if batch.bad[sample] {
            equilibrium.status = Status::BadParameter;
        }
        self.row(batch, sample, &equilibrium)
    }

    /// Slots that some derivative of the plan uses, each once.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The row of an equilibrium of the first sample; derivatives that it does not have are not numbers.
    pub fn solution_of(&self, batch: &Batch, equilibrium: &Equilibrium) -> Solutions {
        let mut solutions = Solutions::new(&self.plan, 1);
        for (column, value) in self.row(batch, 0, equilibrium).into_iter().enumerate() {
            solutions.values.set(0, column, value);
        }
        solutions
    }

    fn row(&self, batch: &Batch, sample: usize, equilibrium: &Equilibrium) -> Vec<f64> {
        let mut row = vec![0.0; Quantity::COUNT];
        let mut put = |quantity: Quantity, values: &[f64]| {
            row[quantity.column()..quantity.column() + values.len()].copy_from_slice(values);
        };
        put(Quantity::TipPosition, &equilibrium.p_tip);
        put(Quantity::TipD1, &equilibrium.R_tip.map(|row| row[0]));
        put(Quantity::TipTangent, &equilibrium.R_tip.map(|row| row[2]));
        put(Quantity::BaseMoment, &equilibrium.m0);
        put(Quantity::Residual, &[equilibrium.residual / self.plan.units.moment()]);
        put(Quantity::ErrorEstimate, &[equilibrium.error_estimate]);
        let of_derivatives = COLUMN_SHARE * equilibrium.error_estimate / equilibrium.margin.abs().min(1.0);
        put(Quantity::DerivativeError, &[of_derivatives]);
        put(Quantity::StabilityMargin, &[equilibrium.margin]);
        let index = if equilibrium.status.is_converged() { equilibrium.index as f64 } else { NO_EQUILIBRIUM };
        put(Quantity::StabilityIndex, &[index]);
        put(Quantity::Iterations, &[equilibrium.iterations as f64]);
        put(Quantity::LoadFraction, &[equilibrium.load_fraction]);
        put(Quantity::LoadFractionError, &[1.0]);
        put(Quantity::Status, &[f64::from(equilibrium.status.code())]);
        for derivative in &self.plan.derivatives {
            let mut rows =
                [if equilibrium.derivatives.len() == self.slots.len() { 0.0 } else { f64::NAN }; MOST_ROWS + 3];
            for (slot, entry) in &derivative.terms {
                let rate = self.plan.entry(batch, sample, *entry);
                let of_slot = self.slots.iter().zip(&equilibrium.derivatives).find(|(other, _)| *other == slot);
                if let Some((_, of_slot)) = of_slot {
                    for (row, value) in
                        rows.iter_mut().zip([of_slot.dp, of_slot.w, of_slot.dm0, of_slot.du0].as_flattened())
                    {
                        *row += rate * value;
                    }
                }
            }
            // How the force at the base follows a parameter, the reference does not tell.
            let told = self.plan.base_force_row().unwrap_or(self.plan.rows());
            row.extend(rows[..told].iter().copied().chain(repeat_n(f64::NAN, self.plan.rows() - told)));
        }
        if self.plan.first_beyond_rigid().is_some() {
            row.extend(equilibrium.u0);
        }
        // How the load of a fold follows a parameter, the reference does not tell.
        row.resize(self.plan.contact_column().unwrap_or(self.plan.output_count()), f64::NAN);
        if self.plan.terms.wall {
            row.extend(self.contact_row(batch, sample, equilibrium));
        }
        row
    }

    /// Columns of the contact with the wall; what an equilibrium does not have is not a number.
    fn contact_row(&self, batch: &Batch, sample: usize, equilibrium: &Equilibrium) -> Vec<f64> {
        let mut row = vec![f64::NAN; ContactColumn::COUNT];
        let mut put = |column: ContactColumn, values: &[f64]| {
            row[column as usize..column as usize + values.len()].copy_from_slice(values);
        };
        if let Some(contact) = &equilibrium.contact {
            put(ContactColumn::Touching, &[f64::from(u8::from(contact.touching))]);
            put(ContactColumn::Gap, &[contact.gap]);
            put(ContactColumn::NormalForce, &[contact.normal_force]);
            put(ContactColumn::Force, &contact.force);
            put(ContactColumn::Normal, &contact.normal);
            put(ContactColumn::BodyGap, &[contact.body_gap]);
            put(ContactColumn::ForceError, &[contact.force_error]);
        }
        let wall = self.plan.sample_rod(batch, sample).wall;
        put(ContactColumn::Friction, &[wall.map_or(f64::NAN, |wall| wall.friction)]);
        for derivative in &self.plan.derivatives {
            let mut rows = [if equilibrium.derivatives.len() == self.slots.len() { 0.0 } else { f64::NAN }; 4];
            for (slot, entry) in &derivative.terms {
                let rate = self.plan.entry(batch, sample, *entry);
                let of_slot = self.slots.iter().zip(&equilibrium.derivatives).find(|(other, _)| *other == slot);
                if let Some((_, of_slot)) = of_slot {
                    rows[0] += rate * of_slot.dnormal_force;
                    (0..3).for_each(|k| rows[1 + k] += rate * of_slot.df[k]);
                }
            }
            row.extend(rows);
        }
        row
    }
}

impl Backend for Reference {
    fn info(&self) -> BackendInfo {
        BackendInfo {
            kind: BackendKind::Reference,
            precision: Precision::F64,
            device: format!("{} threads", rayon::current_num_threads()),
            driver: String::new(),
        }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        BATCH_SIZE
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        if self.plan.start.is_some() {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Reference,
                what: "the search for equilibria away from rest".into(),
                remedy: "use the CPU engine".into(),
            });
        }
        let sample_count = batch.sample_count();
        let (samples, busy) = ((0..sample_count).into_par_iter(), Busy::here());
        let rows: Vec<Vec<f64>> =
            samples.map_init(|| busy.enter(), |_, sample| self.solve_sample(batch, sample)).collect();
        let mut solutions = Solutions::new(&self.plan, sample_count);
        for (sample, row) in rows.iter().enumerate() {
            for (column, value) in row.iter().enumerate() {
                solutions.values.set(sample, column, *value);
            }
        }
        Ok(solutions)
    }
}
