//! The shape of a solved rod, and how its points move with the rod's numbers.

use super::answer::{Equilibrium, SI, TOLERANCE};
use super::by_nodes::{self, MovingNodes};
use super::chain::{self, Chain, Variation, rows};
use super::extrapolation::Extrapolation;
use super::flexible::Flexible;
use super::places::{Node, Place};
use super::rigid;
use super::search;
use super::shooting::tip_residual;
use super::state::{Column, State, base_state};
use super::varying;
use crate::model::{BaseWrench, Matrix, Rod, Slot, Units, Vector};
use nalgebra::{Matrix3, Vector3};

/// Pose and curvature at one point of a rod; SI units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Pose {
    /// From the base (m)
    pub arc_length: f64,
    /// World frame (m)
    pub position: Vector,
    /// Body to world, by rows.
    pub rotation: Matrix,
    /// Body frame; zero in rigid segments (1/m)
    pub curvature: Vector,
    /// d(position)/d(arc length), world frame; of length 1 unless the rod shears or stretches.
    pub tangent: Vector,
    /// One for each slot or parameter asked for.
    pub derivatives: Vec<PoseDerivative>,
}

/// How a point of the rod moves with one slot, total derivatives, SI units per unit of the slot. The point is one of
/// the material: it goes along when the rod before it lengthens or is inserted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseDerivative {
    /// d(position) (m)
    pub dp: Vector,
    /// Virtual rotation, world frame (rad)
    pub w: Vector,
    /// d(curvature), body frame (1/m)
    pub du: Vector,
}

/// A point before the derivatives by the base moment are known.
struct Station {
    arc_length: f64,
    p: Vector3<f64>,
    R: Matrix3<f64>,
    u: Vector3<f64>,
    tangent: Vector3<f64>,
    columns: Vec<Column>,
    du: Vec<Vector3<f64>>,
}

/// Poses at the given arc lengths from the base (m), held within the rod; in the order asked for.
///
/// A point between two segments belongs to the proximal one. Poses past a point where the rod cannot be integrated
/// are missing.
pub fn shape(rod: &Rod, equilibrium: &Equilibrium, arc_lengths: &[f64]) -> Vec<Pose> {
    if let Some(poses) = varying::poses(rod, equilibrium, arc_lengths) {
        return poses;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units).loaded(equilibrium.load_fraction);
    let m0_body = chain.R0.tr_mul(&Vector3::from(equilibrium.m0)) / units.moment();
    let base = [Node::base(&chain, m0_body)];
    let nodes = if equilibrium.nodes.is_empty() { &base[..] } else { &equilibrium.nodes };
    let starts = nodes.iter().map(|node| (node.place, node.state(Vec::new()))).collect();
    let (stations, _) = stations(&chain, &units, starts, &[], arc_lengths);
    let pose = |station: &Station| pose(station, &units, rod, Vec::new());
    stations.iter().map(pose).collect()
}

/// Poses at arc lengths (m) with their derivatives by `slots`. `base` is the moment (N·m, world frame), or moment and force, at
/// the base of an equilibrium under the full load; an error in it is taken out to first order. `None` where the rod cannot be
/// integrated.
///
/// A base moment does not tell the state of a limp rod: it is then solved from rest again, and must have this moment.
pub fn shape_with_derivatives(
    rod: &Rod,
    base: impl Into<BaseWrench>,
    arc_lengths: &[f64],
    slots: &[Slot],
) -> Option<Vec<Pose>> {
    let base = base.into();
    if let Some(poses) = varying::poses_with_derivatives(rod, base, arc_lengths, slots) {
        return poses;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(base.moment)) / units.moment();
    if by_nodes::is_limp(&chain) {
        return limp_shape(rod, &units, &chain, m0_body, arc_lengths, slots);
    }
    let mut variations = chain.base_moment_variations().to_vec();
    variations.extend(slots.iter().map(|slot| chain.slot_variation(*slot, m0_body)));
    let starts = vec![(Place::BASE, base_state(&chain, m0_body, &variations))];
    let (stations, tip) = stations(&chain, &units, starts, &variations, arc_lengths);
    let (residual, dresidual) = tip_residual(&chain, &variations, &tip?);
    let by_moment = Matrix3::from_columns(&dresidual[..3]);
    let matrix = by_moment.lu();
    let correction = match search::is_neutral(&by_moment) {
        true => -search::pseudo_inverse(&by_moment)? * residual,
        false => matrix.solve(&-residual)?,
    };
    let dm0: Vec<Vector3<f64>> = dresidual[3..].iter().map(|dr| matrix.solve(&-dr)).collect::<Option<_>>()?; // (33)
    let complete = |station: &Station| {
        let by_base = |of: &dyn Fn(usize) -> Vector3<f64>, dm0: &Vector3<f64>| -> Vector3<f64> {
            (0..3).map(|k| of(k) * dm0[k]).sum()
        };
        let (dp, w, du) = (|k: usize| station.columns[k].dp, |k: usize| station.columns[k].w, |k: usize| station.du[k]);
        let derivative = |(k, slot): (usize, &Slot)| {
            let per = 1.0 / slot.unit(&units);
            PoseDerivative {
                dp: SI(dp(3 + k) + by_base(&dp, &dm0[k]), units.length * per),
                w: SI(w(3 + k) + by_base(&w, &dm0[k]), per),
                du: SI(du(3 + k) + by_base(&du, &dm0[k]), units.curvature() * per),
            }
        };
        let derivatives = slots.iter().enumerate().map(derivative).collect();
        let turn = nalgebra::Rotation3::new(by_base(&w, &correction));
        let corrected = Station {
            p: station.p + by_base(&dp, &correction),
            R: turn.matrix() * station.R,
            u: station.u + by_base(&du, &correction),
            tangent: turn * station.tangent,
            arc_length: station.arc_length,
            columns: Vec::new(),
            du: Vec::new(),
        };
        pose(&corrected, &units, rod, derivatives)
    };
    (stations.len() == arc_lengths.len()).then(|| stations.iter().map(complete).collect())
}

/// The same by nodes, whose columns are total changes.
fn limp_shape(
    rod: &Rod,
    units: &Units,
    chain: &Chain,
    m0_body: Vector3<f64>,
    arc_lengths: &[f64],
    slots: &[Slot],
) -> Option<Vec<Pose>> {
    let MovingNodes { nodes, variations, columns } = by_nodes::from_rest_with(chain, m0_body, slots)?;
    let starts = nodes.iter().zip(columns).map(|(node, columns)| (node.place, node.state(columns))).collect();
    let (stations, _) = stations(chain, units, starts, &variations, arc_lengths);
    let complete = |station: &Station| {
        let derivative = |(k, slot): (usize, &Slot)| {
            let (column, per) = (&station.columns[k], 1.0 / slot.unit(units));
            PoseDerivative {
                dp: SI(column.dp, units.length * per),
                w: SI(column.w, per),
                du: SI(station.du[k], units.curvature() * per),
            }
        };
        pose(station, units, rod, slots.iter().enumerate().map(derivative).collect())
    };
    (stations.len() == arc_lengths.len()).then(|| stations.iter().map(complete).collect())
}

fn pose(station: &Station, units: &Units, rod: &Rod, derivatives: Vec<PoseDerivative>) -> Pose {
    Pose {
        arc_length: station.arc_length * units.length,
        position: (station.p * units.length + Vector3::from(rod.base_position)).into(),
        rotation: rows(&station.R),
        curvature: SI(station.u, units.curvature()),
        tangent: station.tangent.into(),
        derivatives,
    }
}

/// Integrates the rod past all the points from the last start before each; also the state at the tip, where it can be
/// reached. The first start is the base.
fn stations(
    chain: &Chain,
    units: &Units,
    starts: Vec<(Place, State)>,
    variations: &[Variation],
    arc_lengths: &[f64],
) -> (Vec<Station>, Option<State>) {
    let mut starts = starts.into_iter().peekable();
    let Some((_, mut state)) = starts.next() else { return (Vec::new(), None) };
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut order: Vec<usize> = (0..arc_lengths.len()).collect();
    order.sort_by(|a, b| arc_lengths[*a].total_cmp(&arc_lengths[*b]));
    let mut order = order.into_iter().peekable();
    let mut found: Vec<(usize, Station)> = Vec::new();
    let mut start = 0.0;
    let mut reached = true;
    let last = chain.is_flexible.len() - 1;
    'rod: for (j, segment) in chain.numbers.segments.iter().enumerate() {
        let flexible = Flexible::new(chain, j, variations);
        let mut s = 0.0;
        while let Some(k) = order.next_if(|k| j == last || arc_lengths[*k] / units.length <= start + segment.length) {
            let target = (arc_lengths[k] / units.length - start).clamp(s, segment.length.max(s));
            let station = if chain.is_flexible[j] {
                while let Some((place, start)) = starts.next_if(|(at, _)| at.segment == j && at.s <= target) {
                    (s, state) = (place.s, start);
                }
                if flexible.advance(&mut integrator, s, target, &mut state).is_err() {
                    reached = false;
                    break 'rod;
                }
                s = target;
                let (u, du) = flexible.curvature(target, &state);
                Station {
                    arc_length: start + target,
                    p: state.p,
                    R: state.R,
                    u,
                    tangent: flexible.tangent(target, &state.R),
                    columns: state.columns.clone(),
                    du,
                }
            } else {
                on_rigid(&state, start, target)
            };
            found.push((k, station));
        }
        if chain.is_flexible[j] {
            while let Some((place, start)) = starts.next_if(|(at, _)| at.segment == j) {
                (s, state) = (place.s, start);
            }
            if flexible.advance(&mut integrator, s, segment.length, &mut state).is_err() {
                reached = false;
                break;
            }
            flexible.lengthen(&mut state);
        } else {
            rigid::cross(chain, j, variations, &mut state);
        }
        start += segment.length;
    }
    found.sort_by_key(|(k, _)| *k);
    (found.into_iter().map(|(_, station)| station).collect(), reached.then_some(state))
}

/// A point on a rigid segment, `along` it from its proximal end, where the state stands.
fn on_rigid(state: &State, start: f64, along: f64) -> Station {
    let arm = along * state.R.column(2);
    let moved = |column: &Column| Column { dp: column.dp + column.w.cross(&arm), ..*column };
    Station {
        arc_length: start + along,
        p: state.p + arm,
        R: state.R,
        u: Vector3::zeros(),
        tangent: state.R.column(2).into(),
        columns: state.columns.iter().map(moved).collect(),
        du: vec![Vector3::zeros(); state.columns.len()],
    }
}
