//! The curvature where the first flexible segment starts, beyond rigid ones. There the moment at the base does not tell
//! it: the force at the base is unknown, too. J1
#![allow(clippy::needless_range_loop)]

use super::matrix::Mat6;
use super::parameters::Parameters;
use super::state::{Columns, State};
use crate::cpu::algebra::{Vec3, cross, cross_sub, dot};
use crate::cpu::rod::column::compliance_times;
use crate::cpu::rod::section::{Flexible, curvature};
use crate::cpu::rod::step::Stage;
use crate::cpu::rod::terms::ProgramTerms;
use crate::cpu::simd::lane::Lane;

/// Body frame.
#[derive(Clone, Debug)]
pub struct First<L> {
    pub u: Vec3<L>,
    /// By force and moment at the base.
    pub by_load: [Vec3<L>; 6],
    /// By parameters, three each, the load at the base held.
    pub by_parameters: Vec<[Vec3<L>; 3]>,
}

impl<L: Lane> First<L> {
    pub fn new(zero: L) -> Self {
        let none = Vec3::splat(zero);
        Self { u: none, by_load: [none; 6], by_parameters: Vec::new() }
    }

    /// Where segment `index` starts; `load` is how the canonical load there follows that at the base, which turns nothing.
    #[inline(always)]
    pub fn load(
        &mut self,
        terms: ProgramTerms,
        (segment, index): (&Flexible<L>, usize),
        state: &State<L>,
        load: &Mat6<L>,
        parameters: &[Parameters<L>],
        columns: &[Columns<L>],
    ) {
        let State { p, d1, t, m, n } = *state;
        let section = segment.section(terms, 0.0);
        let d2 = cross(t, d1);
        let omega = curvature(terms, &section, d1, d2, t, m);
        let compliance = section.compliance;
        let k = segment.compliance_at(terms, compliance);
        self.u = to_body(d1, d2, t, omega);
        for column in 0..6 {
            let dm = Vec3 { x: load.0[3][column], y: load.0[4][column], z: load.0[5][column] };
            self.by_load[column] = to_body(d1, d2, t, compliance_times(terms, k, d1, d2, t, dm));
        }
        let stage = Stage { p, d1, d2, t, m, n, v: t, compliance };
        self.by_parameters.clear();
        for (parameters, columns) in parameters.iter().zip(columns) {
            let mut three = [m; 3];
            for j in 0..3 {
                let x = cross_sub(columns.w[j], m, columns.dm[j]);
                let mut dw = compliance_times(terms, k, d1, d2, t, x); // J1
                parameters.sources.segments[index].bend(j, 0.0, k, &stage, &mut dw); // J1
                three[j] = to_body(d1, d2, t, dw);
            }
            self.by_parameters.push(three);
        }
    }

    /// What a change of the load at the base does to it.
    #[inline(always)]
    pub fn moved(&self, (dn, dm): (Vec3<L>, Vec3<L>)) -> Vec3<L> {
        let by = &self.by_load;
        let of_force = by[0] * dn.x + by[1] * dn.y + by[2] * dn.z;
        of_force + by[3] * dm.x + by[4] * dm.y + by[5] * dm.z
    }
}

#[inline(always)]
fn to_body<L: Lane>(d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, v: Vec3<L>) -> Vec3<L> {
    Vec3 { x: dot(d1, v), y: dot(d2, v), z: dot(t, v) }
}
