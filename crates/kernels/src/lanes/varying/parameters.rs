//! What parameters change: numbers of the rod by their sources, numbers of the field by their slots. F6

use super::space::{Space, gradient};
use crate::lanes::algebra::{Mat3, Vec3};
use crate::lanes::lane::Lane;
use crate::lanes::problem::Problem;
use crate::lanes::source::Sources;
use crate::model::{Axis, Slot};

/// Three parameters.
pub struct Parameters<L> {
    pub sources: Sources<L>,
    /// Numbers of the field that each moves, and how fast.
    field: [Vec<(Slot, L)>; 3],
    /// Change of the force at the tip.
    pub df_tip: Mat3<L>,
}

impl<L: Lane> Parameters<L> {
    pub fn new(token: L::Token) -> Self {
        Self { sources: Sources::new(token), field: Default::default(), df_tip: Mat3::zero(L::splat(token, 0.0)) }
    }

    /// Fills in up to three derivatives of the program, from number `first` on.
    #[inline(always)]
    pub fn load(&mut self, problem: &Problem<'_, L>, first: usize) {
        let Problem { program, inputs, .. } = *problem;
        let token = problem.token();
        self.sources.load(problem, first);
        self.df_tip = Mat3::zero(L::splat(token, 0.0));
        self.field.iter_mut().for_each(Vec::clear);
        for (k, terms) in program.derivatives.iter().skip(first).take(3).enumerate() {
            for (slot, entry) in terms {
                let rate: L = program.entry(token, &inputs, *entry);
                if let Slot::TipForce(axis) = slot {
                    let df = &mut self.df_tip[k][axis.index()];
                    *df = *df + rate;
                }
                if slot.is_of_sources() {
                    self.field[k].push((*slot, rate));
                }
            }
        }
    }

    /// dB and dG mu at a point that stands still, by parameter `k`. F6
    #[inline(always)]
    pub fn field(&self, space: &Space<L>, k: usize, x: Vec3<L>, mu: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        let zero = Vec3::splat(x.x.constant(0.0));
        let (mut dB, mut dF) = (self.sources.dB[k], zero);
        for (slot, rate) in &self.field[k] {
            match *slot {
                Slot::FieldGradient(entry) => {
                    let mut entries = [zero.x; 5];
                    entries[entry.index()] = *rate;
                    let dG = gradient(entries);
                    dB = dB + dG * (x - space.origin);
                    dF = dF + dG * mu;
                }
                Slot::FieldOrigin(axis) => dB = dB - space.G * unit(axis, *rate),
                Slot::SourcePosition(j, axis) => {
                    let (dipole, dX) = (space.dipoles[j], unit(axis, *rate));
                    let r = x - dipole.X;
                    dB = dB - dipole.G(r) * dX;
                    dF = dF - dipole.T3(r, mu) * dX;
                }
                Slot::SourceMoment(j, axis) => {
                    let mut dipole = space.dipoles[j];
                    let r = x - dipole.X;
                    dipole.M = unit(axis, *rate);
                    dB = dB + dipole.B(r);
                    dF = dF + dipole.G(r) * mu;
                }
                Slot::MapScale(j) => {
                    let local = space.maps[j].local(x, 2);
                    dB = dB + local.B * *rate;
                    dF = dF + local.G * mu * *rate;
                }
                Slot::MapPosition(j, axis) => {
                    let (map, dX) = (&space.maps[j], unit(axis, *rate));
                    let local = map.local(x, 3);
                    dB = dB - local.G * dX * map.scale;
                    dF = dF - local.T3(mu) * dX * map.scale;
                }
                _ => {}
            }
        }
        (dB, dF)
    }
}

#[inline(always)]
fn unit<L: Lane>(axis: Axis, by: L) -> Vec3<L> {
    let mut v = Vec3::splat(by.constant(0.0));
    v[axis.index()] = by;
    v
}
