//! The shape of a rod in a field that varies, and how its points move with its numbers.

use super::contact::{Balance, Contact, WallChange, of_base};
use super::flexible::Flexible;
use super::shooting::{Polished, tip_passage};
use super::state::{BaseLoad, Change, Column, State, Varying};
use super::{all_changes, base_load, equilibrium_at, rigid, turned};
use crate::model::{BaseWrench, Rod, Slot, Units};
use crate::reference::answer::{Equilibrium, SI, TOLERANCE};
use crate::reference::chain::{self, rows};
use crate::reference::extrapolation::Extrapolation;
use crate::reference::shape::{Pose, PoseDerivative};
use nalgebra::{Vector3, Vector6};

/// A point before the derivatives by the base load are known.
struct Station {
    arc_length: f64,
    state: State,
    u: Vector3<f64>,
    du: Vec<Vector3<f64>>,
    tangent: Vector3<f64>,
}

/// Poses of an equilibrium at arc lengths (m); `None` where the field is uniform.
pub(in crate::reference) fn poses(rod: &Rod, equilibrium: &Equilibrium, arc_lengths: &[f64]) -> Option<Vec<Pose>> {
    let units = chain::units(rod);
    let loaded = Varying::new(rod, &units)?.loaded(equilibrium.load_fraction.min(1.0));
    let base = base_load(&loaded, &units, equilibrium);
    let (stations, _) = stations(&loaded, &units, &base, &[], arc_lengths);
    Some(stations.iter().map(|station| pose(station, &units, rod, Vec::new())).collect())
}

/// Poses with derivatives of the equilibrium with this load at the base; the first `None` where the field is uniform, the second
/// where there is no such equilibrium.
pub(in crate::reference) fn poses_with_derivatives(
    rod: &Rod,
    base: BaseWrench,
    arc_lengths: &[f64],
    slots: &[Slot],
) -> Option<Option<Vec<Pose>>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let found = equilibrium_at(rod, &full, &units, base);
    Some(found.and_then(|found| moving(rod, &full, &units, &found, arc_lengths, slots)))
}

fn moving(
    rod: &Rod,
    full: &Varying,
    units: &Units,
    Polished { base, touch, .. }: &Polished,
    arc_lengths: &[f64],
    slots: &[Slot],
) -> Option<Vec<Pose>> {
    let (contact, touch) = (Contact::of(rod, units), touch.as_ref());
    let changes = all_changes(full, base, slots);
    let (mut stations, tip) = stations(full, units, base, &changes, arc_lengths);
    let passage = tip_passage(full, &changes, tip?);
    let balance = Balance::new(&passage, touch);
    let correction = of_base(&balance.step()?);
    let answer = |(k, slot): (usize, &Slot)| {
        let of_wall = contact.map_or(WallChange::default(), |contact| contact.change(*slot, passage.tip.p));
        Some(of_base(&balance.answer(&Balance::change(&passage, touch, 6 + k, &of_wall))?)) // (33)
    };
    let by: Vec<Vector6<f64>> = slots.iter().enumerate().map(answer).collect::<Option<_>>()?;
    let complete = |station: &mut Station| {
        let columns = std::mem::take(&mut station.state.columns);
        let combined = |of: &dyn Fn(usize) -> Vector3<f64>, by: &Vector6<f64>| -> Vector3<f64> {
            (0..6).map(|k| of(k) * by[k]).sum()
        };
        let (dp, w, du) = (|k: usize| columns[k].dp, |k: usize| columns[k].w, |k: usize| station.du[k]);
        let derivative = |(k, slot): (usize, &Slot)| {
            let per = 1.0 / slot.unit(units);
            PoseDerivative {
                dp: SI(dp(6 + k) + combined(&dp, &by[k]), units.length * per),
                w: SI(w(6 + k) + combined(&w, &by[k]), per),
                du: SI(du(6 + k) + combined(&du, &by[k]), units.curvature() * per),
            }
        };
        let derivatives = slots.iter().enumerate().map(derivative).collect();
        let turn = combined(&w, &correction);
        station.state.p += combined(&dp, &correction);
        station.u += combined(&du, &correction);
        station.state.R = turned(turn, &station.state.R);
        pose(station, units, rod, derivatives)
    };
    (stations.len() == arc_lengths.len()).then(|| stations.iter_mut().map(complete).collect())
}

fn pose(station: &Station, units: &Units, rod: &Rod, derivatives: Vec<PoseDerivative>) -> Pose {
    Pose {
        arc_length: station.arc_length * units.length,
        position: (station.state.p * units.length + Vector3::from(rod.base_position)).into(),
        rotation: rows(&station.state.R),
        curvature: SI(station.u, units.curvature()),
        tangent: station.tangent.into(),
        derivatives,
    }
}

/// Integrates the rod past all the points; also the state at the tip, where it can be reached.
fn stations(
    rod: &Varying,
    units: &Units,
    base: &BaseLoad,
    changes: &[Change],
    arc_lengths: &[f64],
) -> (Vec<Station>, Option<State>) {
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut order: Vec<usize> = (0..arc_lengths.len()).collect();
    order.sort_by(|a, b| arc_lengths[*a].total_cmp(&arc_lengths[*b]));
    let mut order = order.into_iter().peekable();
    let mut found: Vec<(usize, Station)> = Vec::new();
    let mut state = rod.base_state(base, changes);
    let (mut start, mut reached) = (0.0, true);
    let last = rod.chain.is_flexible.len() - 1;
    'rod: for (j, segment) in rod.chain.numbers.segments.iter().enumerate() {
        let flexible = Flexible::new(rod, j, changes);
        let bends = rod.chain.is_flexible[j];
        let mut s = 0.0;
        while let Some(k) = order.next_if(|k| j == last || arc_lengths[*k] / units.length <= start + segment.length) {
            let target = (arc_lengths[k] / units.length - start).clamp(s, segment.length.max(s));
            if bends && flexible.advance(&mut integrator, s, target, &mut state).is_err() {
                reached = false;
                break 'rod;
            }
            s = if bends { target } else { s };
            let arc_length = start + target;
            found.push((
                k,
                if bends {
                    on_flexible(&flexible, arc_length, target, &state)
                } else {
                    on_rigid(&state, arc_length, target)
                },
            ));
        }
        if !bends {
            rigid::cross(rod, j, changes, &mut state);
        } else if flexible.advance(&mut integrator, s, segment.length, &mut state).is_err() {
            reached = false;
            break;
        } else {
            flexible.lengthen(&mut state);
        }
        start += segment.length;
    }
    found.sort_by_key(|(k, _)| *k);
    (found.into_iter().map(|(_, station)| station).collect(), reached.then_some(state))
}

fn on_flexible(flexible: &Flexible, arc_length: f64, s: f64, state: &State) -> Station {
    let (u, du) = flexible.curvature(s, state);
    Station { arc_length, state: state.clone(), u, du, tangent: flexible.velocity(&state.R, state.n) }
}

/// A point on a rigid segment, `along` it from its proximal end, where the state stands.
fn on_rigid(state: &State, arc_length: f64, along: f64) -> Station {
    let arm: Vector3<f64> = along * state.R.column(2);
    let moved = |column: &Column| Column { dp: column.dp + column.w.cross(&arm), ..*column };
    let columns: Vec<Column> = state.columns.iter().map(moved).collect();
    let du = vec![Vector3::zeros(); columns.len()];
    let state = State { p: state.p + arm, columns, ..state.clone() };
    Station { arc_length, u: Vector3::zeros(), du, tangent: state.R.column(2).into(), state }
}
