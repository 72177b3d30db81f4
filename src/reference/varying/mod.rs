//! The reference in fields that vary in space: forces act along with torques, and the force at the base is unknown, too.
//! F0 to F8
//!
//! The literature's form (p, R, u integrated) with the internal force as a part of the state. A wall that the tip touches adds its
//! force, W1 to W6.

mod body_gap;
mod coming;
mod contact;
mod elimination;
mod energy;
mod field;
mod flexible;
mod hessian;
mod map;
mod passage;
mod ramp;
mod rigid;
mod shape;
mod shooting;
mod state;

pub(super) use energy::{Of, energy};
pub(super) use shape::{poses, poses_with_derivatives};

use super::answer::{Equilibrium, RESIDUAL_FACTOR, SI, SlotDerivative, Stability, TOLERANCE, TipContact, status};
use super::chain::{self, rows};
use super::extrapolation::Extrapolation;
use super::stability::{is_unstable, margin};
use crate::model::{BaseWrench, Rod, Slot, Status, Units, Vector};
use contact::{Balance, Contact, Gap, Touch, WallChange, of_base};
use flexible::Flexible;
use nalgebra::{DVector, Matrix3, Vector3};
use passage::Passage;
use ramp::End;
use shooting::{Polished, balanced_force, pass, polish};
use state::{BaseLoad, Change, Varying};

/// Steps that a passage may take at this tolerance: bounds the sum of their errors.
const STEPS: f64 = 20.0;
/// An error estimate by the growth of errors along the rod that is above this is replaced by a measured one where that is smaller.
const LARGE_ESTIMATE: f64 = 1e-8;
/// For the measured one the rod is integrated with so many times the tolerance; the answer may be off by so many times the difference.
const COARSER: f64 = 10.0;
const SAFETY: f64 = 10.0;
/// Base moments that differ by no more than this, against the larger of theirs and EI / L, are those of one equilibrium.
const SAME_MOMENT: f64 = 1e-3;

/// What the path from rest led to.
struct Ending {
    found: Polished,
    passes: usize,
    steps: usize,
    /// Share of the load, and of the wall's way beyond 1.
    reached: f64,
    end: End,
    is_sure: bool,
}

/// Solves the rod from rest and differentiates the solution by `slots`; `None` where its field is uniform and there is no wall.
pub(super) fn solve(rod: &Rod, slots: &[Slot]) -> Option<Equilibrium> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let contact = Contact::of(rod, &units);
    let without = |status| Some(Equilibrium::without_solution(status, slots.len()));
    if let Some(status) = contact.as_ref().and_then(Contact::refusal) {
        return without(status);
    }
    let mut integrator = Extrapolation::new(TOLERANCE);
    let (path, is_sure) = ramp::from_rest(&full);
    let loaded = full.loaded(path.lambda);
    let Ok((found, passes)) = polish(&loaded, path.base, None, &mut integrator) else {
        return without(Status::NonFinite);
    };
    let (passes, steps) = (path.passes + passes, path.steps);
    let mut ending = Ending { found, passes, steps, reached: path.lambda, end: path.end, is_sure };
    if let Some(contact) = &contact
        && ending.end == End::Arrived
        && is_sure
    {
        let p_free = ending.found.passage.tip.p;
        if !contact.has_normal(p_free) {
            return without(Status::BadParameter);
        }
        if contact.sticks() || contact.gap(p_free).g < 0.0 {
            let (way, is_sure) = coming::from_free(&full, contact, ending.found.base, p_free);
            let Ok((found, passes)) = polish(&full, way.base, Some(&way.touch), &mut integrator) else {
                return without(Status::NonFinite);
            };
            let passes = ending.passes + way.passes + passes;
            let steps = steps.max(way.steps);
            ending = Ending { found, passes, steps, reached: 1.0 + way.tau, end: way.end, is_sure };
        }
    }
    Some(answer((rod, &units), &loaded, contact.as_ref(), ending, slots, &mut integrator))
}

/// All that is asked of an ending.
fn answer(
    (rod, units): (&Rod, &Units),
    loaded: &Varying,
    contact: Option<&Contact>,
    ending: Ending,
    slots: &[Slot],
    integrator: &mut Extrapolation,
) -> Equilibrium {
    let Polished { base, touch, passage, balance } = &ending.found;
    let hold = touch.as_ref().map(|touch| touch.hold(passage.tip.p));
    let index = hessian::stability(loaded, base, hold.as_ref(), integrator).and_then(|found| found.index());
    let most = RESIDUAL_FACTOR * TOLERANCE * passage.growth();
    let residual = balance.residual.norm();
    let is_unstable = index.map(|index| is_unstable(&loaded.chain, balance.determinant(), index));
    let arrived = ending.end == End::Arrived;
    let (tip_error, force_error) = if arrived { errors(loaded, &ending.found) } else { grown_errors(&ending.found) };
    let touched = contact.map(|contact| touched((loaded, units), contact, &ending.found, force_error, integrator));
    let is_through = |of: &TipContact| Contact::is_through(of.body_gap / units.length);
    let status = match ending.end {
        _ if !ending.is_sure => Status::Doubtful,
        End::TooNear => Status::TooNearMagnet,
        End::Outside => Status::OutsideMap,
        End::Fold if ending.reached >= 1.0 => Status::Fold,
        End::GaveUp if ending.reached >= 1.0 => Status::StepLimit,
        end => status((ending.reached, end == End::GaveUp, ending.steps), (residual, most), is_unstable),
    };
    let status = match &touched {
        Some(of) if status.is_success() && is_through(of) => Status::ThroughWall,
        _ => status,
    };
    let index = index.unwrap_or_default();
    let derivatives = differentiate(loaded, units, &ending.found, contact, slots, integrator);
    Equilibrium {
        n0: SI(base.n, units.force),
        m0: SI(loaded.chain.R0 * base.m_body, units.moment()),
        u0: SI(passage.u_first, units.curvature()),
        p_tip: SI(passage.tip.p + Vector3::from(rod.base_position) / units.length, units.length),
        R_tip: rows(&passage.tip.R),
        u_tip: SI(passage.u_last, units.curvature()),
        residual: residual * units.moment(),
        error_estimate: tip_error,
        index,
        margin: margin(balance.moment_inverse(), is_unstable.unwrap_or_default()),
        status,
        load_fraction: if arrived { 1.0 } else { ending.reached },
        iterations: ending.passes,
        derivatives: derivatives.unwrap_or_else(|| vec![SlotDerivative::default(); slots.len()]),
        contact: touched,
        nodes: Vec::new(),
    }
}

/// What tip and wall do to each other, SI.
fn touched(
    (loaded, units): (&Varying, &Units),
    contact: &Contact,
    found: &Polished,
    force_error: f64,
    integrator: &mut Extrapolation,
) -> TipContact {
    let p = found.passage.tip.p;
    let Gap { g, n, .. } = contact.gap(p);
    let f = found.touch.as_ref().map_or(Vector3::zeros(), |touch| touch.force(p));
    let least = body_gap::least_gap(loaded, contact, &found.base, integrator).unwrap_or(f64::NAN);
    TipContact {
        touching: found.touch.is_some(),
        gap: g * units.length,
        normal: n.into(),
        normal_force: f.dot(&n) * units.force,
        force: SI(f, units.force),
        // The wall stands where the tissue has yielded to the tip.
        body_gap: (if least > g { g } else { least } + (-g).max(0.0)) * units.length,
        force_error: force_error * units.force,
    }
}

/// Errors of the tip's pose and of the wall's force. By how much errors grow along the rod bounds them. Where they grow much, the bound is far
/// too large, for the conditions at the tip take back most of such an error. Then they are measured.
fn errors(rod: &Varying, found: &Polished) -> (f64, f64) {
    let (tip, force) = grown_errors(found);
    if tip < LARGE_ESTIMATE && force < LARGE_ESTIMATE {
        return (tip, force);
    }
    let (measured_tip, measured_force) = measured_errors(rod, found).unwrap_or((tip, force));
    (tip.min(measured_tip), force.min(measured_force))
}

/// Errors of tip and force are measured: by the size of Newton's next step, and by how far its end moves if the rod is integrated with another
/// tolerance.
fn measured_errors(rod: &Varying, found: &Polished) -> Option<(f64, f64)> {
    let touch = found.touch.as_ref();
    let coarser = &mut Extrapolation::new(COARSER * TOLERANCE);
    let passage = pass(rod, &found.base, &rod.base_changes(), coarser).ok()?;
    let other_step = Balance::new(&passage, touch).step()?;
    let (dp, w, df) = moves(&found.passage, touch, &found.balance.step()?);
    let (other_dp, other_w, other_df) = moves(&passage, touch, &other_step);
    let (tip, other) = (&found.passage.tip, &passage.tip);
    let apart = turned(other_w, &other.R) - turned(w, &tip.R);
    let difference = (other.p + other_dp - tip.p - dp).norm().max(apart.norm());
    let f = touch.map_or(0.0, |touch| touch.force(tip.p).norm());
    let sum = |size: f64, left_over: f64, difference: f64| STEPS * TOLERANCE * size + left_over + SAFETY * difference;
    Some((sum(1.0, dp.norm().max(w.norm()), difference), sum(f, df.norm(), (other_df - df).norm())))
}

/// Errors of tip and force are bounded: the integrator's errors grow along the rod, a residual is left, and the sensitivities tell what both move.
fn grown_errors(found: &Polished) -> (f64, f64) {
    let Some(inverse) = found.balance.inverse() else { return (1.0, f64::INFINITY) };
    let left_over = found.balance.residual.norm();
    let size = (STEPS * TOLERANCE * found.passage.growth()).min(1.0) + left_over;
    let touch = found.touch.as_ref();
    let (mut moved, mut turned, mut pressed) = (0.0, 0.0, 0.0);
    for error in (0..inverse.ncols()).map(|k| size * inverse.column(k)) {
        let (dp, w, df) = moves(&found.passage, touch, &error);
        moved += dp.norm_squared();
        turned += w.norm_squared();
        pressed += df.norm_squared();
    }
    let f = touch.map_or(0.0, |touch| touch.force(found.passage.tip.p).norm());
    (STEPS * TOLERANCE + f64::max(moved, turned).sqrt(), STEPS * TOLERANCE * f + pressed.sqrt())
}

/// Displacement and turn of the tip and change of the wall's force by a change of the unknown.
fn moves(
    passage: &Passage,
    touch: Option<&Touch>,
    change: &DVector<f64>,
) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let by = of_base(change);
    let dp = passage.combined(|column| column.dp, &by);
    let df = touch.map(|touch| touch.force_change(passage.tip.p, dp, change, &WallChange::default()).1);
    (dp, passage.combined(|column| column.w, &by), df.unwrap_or_default())
}

/// Total derivatives by the implicit function theorem (33).
fn differentiate(
    rod: &Varying,
    units: &Units,
    found: &Polished,
    contact: Option<&Contact>,
    slots: &[Slot],
    integrator: &mut Extrapolation,
) -> Option<Vec<SlotDerivative>> {
    let (base, touch) = (&found.base, found.touch.as_ref());
    let changes = all_changes(rod, base, slots);
    let passage = pass(rod, base, &changes, integrator).ok()?;
    let balance = Balance::new(&passage, touch);
    let p = passage.tip.p;
    let derivative = |(k, slot): (usize, &Slot)| {
        let of_slot = 6 + k;
        let of_wall = contact.map_or(WallChange::default(), |contact| contact.change(*slot, p));
        let answer = balance.answer(&Balance::change(&passage, touch, of_slot, &of_wall))?; // (33)
        let by = of_base(&answer);
        let total =
            |of: fn(&state::Column) -> Vector3<f64>| of(&passage.tip.columns[of_slot]) + passage.combined(of, &by);
        let mut du0 = passage.du_first[of_slot] + (0..6).map(|c| passage.du_first[c] * by[c]).sum::<Vector3<f64>>();
        let (R0, dn0) = (rod.chain.R0, by.fixed_rows::<3>(0).into_owned());
        let mut dm0 = changes[of_slot].of.w0.cross(&(R0 * base.m_body)) + R0 * by.fixed_rows::<3>(3);
        if *slot == Slot::Insertion {
            let (slope, u_slope) = at_base(rod, base);
            dm0 -= slope;
            du0 -= u_slope;
        }
        let dp = total(|column| column.dp);
        let of_force = touch.map(|touch| touch.force_change(p, dp, &answer, &of_wall));
        let (dlambda, df) = of_force.unwrap_or_default();
        let per = 1.0 / slot.unit(units);
        Some(SlotDerivative {
            dp: SI(dp, units.length * per),
            w: SI(total(|column| column.w), per),
            dm0: SI(dm0, units.moment() * per),
            dn0: SI(dn0, units.force * per),
            du0: SI(du0, units.curvature() * per),
            df: SI(df, units.force * per),
            dnormal_force: dlambda * units.force * per,
        })
    };
    slots.iter().enumerate().map(derivative).collect()
}

/// m' in the world frame and u' at the base: what is inserted lies proximal to it.
fn at_base(rod: &Varying, base: &BaseLoad) -> (Vector3<f64>, Vector3<f64>) {
    if !rod.chain.is_flexible[0] {
        let t: Vector3<f64> = rod.chain.R0.column(2).into();
        let arm = if rod.chain.rigid_force_arm { 1.0 } else { 0.0 };
        return (-arm * t.cross(&base.n), Vector3::zeros());
    }
    let mut still = rod.clone();
    // Pieces of no length say nothing of the slope.
    let segments = &rod.chain.numbers.segments;
    if let Some(sloped) = segments.iter().find(|segment| segment.length > 0.0) {
        let first = &mut still.chain.numbers.segments[0];
        (first.length, first.K_rise, first.u_star_rise) = (sloped.length, sloped.K_rise, sloped.u_star_rise);
    }
    let state = still.base_state(base, &[]);
    let flexible = Flexible::new(&still, 0, &[]);
    let (u, _) = flexible.curvature(0.0, &state);
    let slope: Vector3<f64> = state.R * (u.cross(&state.m_body) + flexible.moment_slope(&state));
    (slope, flexible.u_slope(&state))
}

/// Stability of the equilibrium with this load at the base.
pub(super) fn stability_at(rod: &Rod, base: BaseWrench) -> Option<Option<Stability>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let found = equilibrium_at(rod, &full, &units, base);
    Some(found.and_then(|Polished { base, touch, passage, balance }| {
        let hold = touch.as_ref().map(|touch| touch.hold(passage.tip.p));
        let mut integrator = Extrapolation::new(TOLERANCE);
        let index = hessian::stability(&full, &base, hold.as_ref(), &mut integrator)?.index()?;
        let residual = balance.residual.norm() * units.moment();
        let is_unstable = is_unstable(&full.chain, balance.determinant(), index);
        Some(Stability { index, margin: margin(balance.moment_inverse(), is_unstable), residual })
    }))
}

/// Curvature at the start of the first flexible segment of the equilibrium with this load at the base; the first `None` where the
/// field is uniform.
pub(super) fn base_curvature(rod: &Rod, base: BaseWrench) -> Option<Option<Vector>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let found = equilibrium_at(rod, &full, &units, base);
    Some(found.map(|found| SI(found.passage.u_first, units.curvature())))
}

/// The equilibrium with this load at the base. Where the force is not known, that is taken which goes with the moment, or where
/// that leads elsewhere, as it may in a strong field, that of the equilibrium from rest. Beside a wall it is the latter.
fn equilibrium_at(rod: &Rod, full: &Varying, units: &Units, base: BaseWrench) -> Option<Polished> {
    let m_body = full.chain.R0.tr_mul(&Vector3::from(base.moment)) / units.moment();
    let contact = Contact::of(rod, units);
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut polished = |base: BaseLoad, touch: Option<&Touch>| {
        let (found, _) = polish(full, base, touch, &mut integrator).ok()?;
        let most = RESIDUAL_FACTOR * TOLERANCE * found.passage.growth();
        let is_same = (found.base.m_body - m_body).norm() <= SAME_MOMENT * found.base.m_body.norm().max(1.0);
        (is_same && found.balance.residual.norm() <= most).then_some(found)
    };
    if let Some(n) = base.force {
        let base = BaseLoad { n: Vector3::from(n) / units.force, m_body };
        let touch = contact.and_then(|contact| touch_at(full, contact, &base));
        return polished(base, touch.as_ref());
    }
    let Some(contact) = contact else {
        let balanced = balanced_force(full, m_body, &mut Extrapolation::new(TOLERANCE));
        return balanced.and_then(|n| polished(BaseLoad { n, m_body }, None)).or_else(|| {
            let (path, _) = ramp::from_rest(full);
            if path.end == End::Arrived { polished(path.base, None) } else { None }
        });
    };
    let found = solve(rod, &[])?;
    let base = found.status.is_converged().then(|| base_load(full, units, &found))?;
    let touch = touch_at(full, contact, &base);
    polished(base, touch.as_ref())
}

/// The wall that presses on a rod with this load at the base; `None` where the end bears no more than the loads.
fn touch_at(full: &Varying, contact: Contact, base: &BaseLoad) -> Option<Touch> {
    /// A force below this, EI / L^2, is none.
    const NO_FORCE: f64 = 1e-7;
    let passage = pass(full, base, &[], &mut Extrapolation::new(TOLERANCE)).ok()?;
    let f: Vector3<f64> = passage.residual.fixed_rows::<3>(0).into();
    let touches = contact.sticks() || f.norm() > NO_FORCE;
    touches.then(|| Touch::of_force(contact, passage.tip.p, f))
}

/// The load at the base of an equilibrium, in the units of the chain.
fn base_load(rod: &Varying, units: &Units, equilibrium: &Equilibrium) -> BaseLoad {
    let m = Vector3::from(equilibrium.m0) / units.moment();
    BaseLoad { n: Vector3::from(equilibrium.n0) / units.force, m_body: rod.chain.R0.tr_mul(&m) }
}

/// Changes by slots after those of the unknown.
fn all_changes(rod: &Varying, base: &BaseLoad, slots: &[Slot]) -> Vec<Change> {
    let mut changes = rod.base_changes();
    changes.extend(slots.iter().map(|slot| rod.slot_change(*slot, base)));
    changes
}

/// A rotation matrix by its columns turned by a small vector.
fn turned(w: Vector3<f64>, R: &Matrix3<f64>) -> Matrix3<f64> {
    nalgebra::Rotation3::new(w).matrix() * R
}
