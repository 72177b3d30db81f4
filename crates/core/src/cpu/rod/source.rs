//! Forward columns: what three parameters change, segment by segment.

use super::columns::Columns;
use super::program::{Inputs, Program};
use super::section::{Flexible, to_world};
use super::segments::{Rigid, Rod, Segment, State, world_dipole};
use super::step::Stage;
use crate::cpu::algebra::{Mat3, Vec3, axpy, columns_cross, columns_cross_sub, cross, cross_sub, dot, outer};
use crate::cpu::simd::lane::Lane;
use crate::model::{Axis, Slot};

/// Three parameters: what each changes at the base, at the tip and on the segments.
pub struct Sources<L> {
    /// Virtual rotation and displacement of the base.
    pub w0: Mat3<L>,
    pub dp0: Mat3<L>,
    /// Change of the force at the base.
    pub dn0: Mat3<L>,
    pub dl_tip: Mat3<L>,
    pub dB: Mat3<L>,
    /// How fast each inserts.
    pub insertion: Vec3<L>,
    pub segments: Vec<Source<L>>,
    /// Whether segments are any but zero.
    pub changed: bool,
}

/// What three parameters change on one segment.
#[derive(Clone, Copy, Debug)]
pub struct Source<L> {
    pub dL: Vec3<L>,
    pub dK: Mat3<L>,
    pub dK_rise: Mat3<L>,
    pub du_star: Mat3<L>,
    pub du_star_rise: Mat3<L>,
    pub dC_se: Mat3<L>,
    /// Change of the dipole, per length on a flexible segment. A piece that bears a couple has no dipole: the couple's change stands here.
    pub dmu: Mat3<L>,
    /// Of the force, per length on a flexible segment.
    pub dload: Mat3<L>,
    pub dB: Mat3<L>,
    pub uses: Uses,
}

/// What of a source is not zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uses {
    bend: bool,
    shear: bool,
    load: bool,
    magnet: bool,
}

impl<L: Lane> Sources<L> {
    pub fn new(token: L::Token) -> Self {
        let zero = Mat3::zero(L::splat(token, 0.0));
        Self {
            w0: zero,
            dp0: zero,
            dn0: zero,
            dl_tip: zero,
            dB: zero,
            insertion: zero.x,
            segments: Vec::new(),
            changed: false,
        }
    }

    /// Fills in up to three derivatives of the program, from number `first` on, of a rod under this share of its loads.
    #[inline(always)]
    pub fn load(
        &mut self,
        (program, inputs): (&Program, &Inputs<'_, L::Scalar>),
        rod: &Rod<L>,
        first: usize,
        share: Option<L>,
    ) {
        let token = rod.t.x.token();
        let zero = Mat3::zero(L::splat(token, 0.0));
        (self.w0, self.dp0, self.dn0, self.dl_tip, self.dB) = (zero, zero, zero, zero, zero);
        self.insertion = zero.x;
        // What changes no segment leaves them as they are.
        if self.changed || self.segments.len() != rod.segments.len() {
            self.segments.clear();
            self.segments.resize(rod.segments.len(), Source::zero(zero));
        }
        self.changed = false;
        for (k, terms) in program.derivatives.iter().skip(first).take(3).enumerate() {
            for (slot, entry) in terms {
                let rate = rate_under(share, *slot, program.entry(token, inputs, *entry));
                self.add(k, *slot, rate);
            }
        }
        for (source, segment) in self.segments.iter_mut().zip(&rod.segments) {
            source.dB = self.dB;
            source.uses.magnet = source.uses.magnet || matches!(segment, Segment::Flexible(s) if s.has_magnet);
            let dn = match segment {
                Segment::Flexible(flexible) => outer(flexible.w, source.dL, source.dload * flexible.length),
                Segment::Rigid(_) => source.dload,
            };
            self.dn0 = self.dn0 + dn;
        }
    }

    #[inline(always)]
    fn add(&mut self, k: usize, slot: Slot, rate: L) {
        match slot {
            Slot::BasePosition(axis) => add_to(&mut self.dp0, k, axis, rate),
            Slot::BaseRotation(axis) => add_to(&mut self.w0, k, axis, rate),
            Slot::FluxDensity(axis) => add_to(&mut self.dB, k, axis, rate),
            Slot::TipForce(axis) => add_to(&mut self.dn0, k, axis, rate),
            Slot::TipMoment(axis) => add_to(&mut self.dl_tip, k, axis, rate),
            Slot::Insertion => add_at(&mut self.insertion, k, rate),
            _ => {
                // Segments of the unloaded distal part are not integrated; such slots change nothing there.
                if let Some(source) = slot.segment().and_then(|segment| self.segments.get_mut(segment)) {
                    source.add(k, slot, rate);
                    self.changed = true;
                }
            }
        }
    }
}

impl<L: Lane> Source<L> {
    fn zero(zero: Mat3<L>) -> Self {
        Self {
            dL: zero.x,
            dK: zero,
            dK_rise: zero,
            du_star: zero,
            du_star_rise: zero,
            dC_se: zero,
            dmu: zero,
            dload: zero,
            dB: zero,
            uses: Uses::default(),
        }
    }

    #[inline(always)]
    fn add(&mut self, k: usize, slot: Slot, rate: L) {
        match slot {
            Slot::Length(_) => add_at(&mut self.dL, k, rate),
            Slot::Stiffness(_, axis) => add_to(&mut self.dK, k, axis, rate),
            Slot::StiffnessRise(_, axis) => add_to(&mut self.dK_rise, k, axis, rate),
            Slot::RestCurvature(_, axis) => add_to(&mut self.du_star, k, axis, rate),
            Slot::RestCurvatureRise(_, axis) => add_to(&mut self.du_star_rise, k, axis, rate),
            Slot::ShearCompliance(_, axis) => add_to(&mut self.dC_se, k, axis, rate),
            Slot::Load(_, axis) | Slot::Weight(_, axis) => add_to(&mut self.dload, k, axis, rate),
            Slot::DipolePerLength(_, axis) | Slot::Dipole(_, axis) | Slot::Couple(_, axis) => {
                add_to(&mut self.dmu, k, axis, rate);
            }
            _ => {}
        }
        use Slot::{
            DipolePerLength, Load, RestCurvature, RestCurvatureRise, ShearCompliance, Stiffness, StiffnessRise,
        };
        let uses = &mut self.uses;
        uses.bend |= matches!(slot, Stiffness(..) | StiffnessRise(..) | RestCurvature(..) | RestCurvatureRise(..));
        uses.shear |= matches!(slot, ShearCompliance(..));
        uses.load |= matches!(slot, Load(..));
        uses.magnet |= matches!(slot, DipolePerLength(..));
    }

    /// dn of column `k` a distance beyond the point where it is `dn`.
    #[inline(always)]
    pub fn force(&self, k: usize, dn: Vec3<L>, distance: L) -> Vec3<L> {
        if self.uses.load { axpy(-distance, self.dload[k], dn) } else { dn }
    }

    /// R du* + R d(K^-1) R^T m at a share `at` of the segment, added to `dw` of column `k`.
    #[inline(always)]
    pub fn bend(&self, k: usize, at: f64, compliance: Vec3<L>, stage: &Stage<L>, dw: &mut Vec3<L>) {
        if !self.uses.bend {
            return;
        }
        let at = compliance.x.constant(at);
        let dK = axpy(at, self.dK_rise[k], self.dK[k]);
        let du_star = axpy(at, self.du_star_rise[k], self.du_star[k]);
        let [d1, d2, t] = [stage.d1, stage.d2, stage.t];
        let m_body = Vec3 { x: dot(d1, stage.m), y: dot(d2, stage.m), z: dot(t, stage.m) };
        *dw = *dw + to_world(d1, d2, t, du_star - m_body * compliance * compliance * dK); // J1
    }

    /// R d(Kse^-1) R^T n, added to `ddp` of column `k`.
    #[inline(always)]
    pub fn shear(&self, k: usize, stage: &Stage<L>, ddp: &mut Vec3<L>) {
        if self.uses.shear {
            let [d1, d2, t] = [stage.d1, stage.d2, stage.t];
            let n_body = Vec3 { x: dot(d1, stage.n), y: dot(d2, stage.n), z: dot(t, stage.n) };
            *ddp = *ddp + to_world(d1, d2, t, n_body * self.dC_se[k]);
        }
    }

    /// -p x df - (R dmu) x B - (R mu) x dB, added to `ddM` of column `k`.
    #[inline(always)]
    pub fn couple(&self, k: usize, rod: &Rod<L>, segment: &Flexible<L>, stage: &Stage<L>, ddM: &mut Vec3<L>) {
        if self.uses.load {
            *ddM = *ddM + cross(self.dload[k], stage.p);
        }
        if self.uses.magnet {
            let dmu_world = to_world(stage.d1, stage.d2, stage.t, self.dmu[k]);
            let mu_world = to_world(stage.d1, stage.d2, stage.t, segment.mu);
            *ddM = cross_sub(dmu_world, rod.B, *ddM) + cross(self.dB[k], mu_world);
        }
    }

    /// More of a flexible segment at its distal end, where the rod goes on with R u, p' and M'.
    #[inline(always)]
    pub fn lengthen(
        &self,
        segment: &Flexible<L>,
        (omega, v, slope): (Vec3<L>, Vec3<L>, Vec3<L>),
        columns: &mut Columns<L>,
    ) {
        columns.w = outer(omega, self.dL, columns.w);
        columns.dp = outer(v, self.dL, columns.dp);
        columns.dM = outer(slope, self.dL, columns.dM);
        columns.dn = outer(-segment.w, self.dL, columns.dn);
    }

    /// -(R dmu) x B - (R mu) x dB - middle x dW on a rigid segment; lever arms are the caller's.
    #[inline(always)]
    pub fn cross_rigid(
        &self,
        rod: &Rod<L>,
        segment: &Rigid<L>,
        force_arm: bool,
        state: &State<L>,
        columns: &mut Columns<L>,
    ) {
        let one = segment.length.constant(1.0);
        let d2 = cross(state.t, state.d1);
        let R = Mat3 { x: state.d1, y: d2, z: state.t };
        let mu_world = world_dipole(segment, state, one);
        columns.dM = columns_cross_sub(R * self.dmu, rod.B, columns.dM) + columns_cross(self.dB, mu_world);
        let half = segment.length * one.constant(0.5);
        let middle = if force_arm { axpy(half, state.t, state.p) } else { state.p };
        columns.dM = columns.dM + columns_cross(self.dload, middle);
        columns.dn = columns.dn - self.dload;
    }
}

/// How a number of a rod under a share of its loads follows a parameter, where that under full loads does so at `rate`.
#[inline(always)]
pub fn rate_under<L: Lane>(share: Option<L>, slot: Slot, rate: L) -> L {
    match share {
        Some(share) if slot.is_load() => rate * share,
        _ => rate,
    }
}

#[inline(always)]
fn add_to<L: Lane>(columns: &mut Mat3<L>, k: usize, axis: Axis, rate: L) {
    add_at(&mut columns[k], axis.index(), rate);
}

#[inline(always)]
fn add_at<L: Lane>(v: &mut Vec3<L>, k: usize, rate: L) {
    v[k] = v[k] + rate;
}
