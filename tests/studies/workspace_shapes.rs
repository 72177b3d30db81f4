//! Workspaces that are known in closed form: maps from inputs to tips that are no rods.

use rodsweep::backend::BackendError;
use rodsweep::model::Vector;
use rodsweep::spec::SobolNet;
use rodsweep::study::workspace::{
    BaseLoad, Inputs, MOST_INPUTS, MeasureOptions, Measured, Tip, TipMap, measure, shifted_lattice,
};
use std::f64::consts::PI;

/// A map by a formula; `None` where there is no equilibrium.
struct Formula<F> {
    count: usize,
    of: F,
}

impl<F: Fn(&[f64]) -> Option<Vector>> Formula<F> {
    fn tip(&self, at: &Inputs) -> Tip {
        let of = |at: &Inputs| (self.of)(&at[..self.count]);
        let Some(position) = of(at) else { return Tip::NONE };
        let mut tip = Tip { usable: true, position, tangent: [0.0, 0.0, 1.0], margin: 1.0, ..Tip::NONE };
        tip.base.moment = [0.0; 3];
        for k in 0..self.count {
            let step = 1e-6;
            let moved = |sign: f64| {
                let mut there = *at;
                there[k] += sign * step;
                of(&there)
            };
            let (Some(a), Some(b)) = (moved(1.0), moved(-1.0)) else { return Tip::NONE };
            tip.jacobian[k] = std::array::from_fn(|axis| (a[axis] - b[axis]) / (2.0 * step));
        }
        tip
    }
}

impl<F: Fn(&[f64]) -> Option<Vector>> TipMap for Formula<F> {
    fn input_count(&self) -> usize {
        self.count
    }

    fn solve_from_rest(&mut self, inputs: &[Inputs]) -> Result<Vec<Tip>, BackendError> {
        Ok(inputs.iter().map(|at| self.tip(at)).collect())
    }

    fn near(&mut self, inputs: &[(Inputs, BaseLoad)]) -> Result<Vec<Tip>, BackendError> {
        Ok(inputs.iter().map(|(at, _)| self.tip(at)).collect())
    }
}

fn starts(count: usize) -> Vec<Inputs> {
    let net = SobolNet::new(count, 3);
    let point = |index| {
        let mut unit = [0.5; MOST_INPUTS];
        net.point(index, &mut unit[..count]);
        unit.map(|u| 2.0 * u - 1.0)
    };
    (0..4096).map(point).collect()
}

fn measured(count: usize, edge: f64, seed: u64, of: impl Fn(&[f64]) -> Option<Vector>) -> Measured {
    let options = MeasureOptions { seed, ..MeasureOptions::default() };
    measure(&mut Formula { count, of }, shifted_lattice(edge, seed), &starts(count), options).expect("a workspace")
}

/// Distance and two angles.
fn polar(t: &[f64], radius: f64) -> Option<Vector> {
    let (r, polar, turn) = (0.5 * radius * (t[0] + 1.0), 0.5 * PI * (t[1] + 1.0), PI * (t[2] + 1.0));
    Some([r * polar.sin() * turn.cos(), r * polar.sin() * turn.sin(), r * polar.cos()])
}

/// So that no side of a box is parallel to the lattice.
fn turned([x, y, z]: Vector) -> Vector {
    [0.8 * x - 0.6 * y, 0.48 * x + 0.64 * y - 0.6 * z, 0.36 * x + 0.48 * y + 0.8 * z]
}

fn assert_within(name: &str, found: f64, truth: f64, share: f64) {
    assert!((found / truth - 1.0).abs() <= share, "{name}: {found}, in truth {truth}");
}

#[test]
fn a_ball_has_its_volume() {
    let truth = 4.0 / 3.0 * PI * 0.03f64.powi(3);
    let found = measured(3, 2e-3, 1, |t| polar(t, 0.03));
    let volume = found.volume.expect("a volume");
    assert_eq!((found.dimension.rank, found.dimension.is_thin, found.area.is_none()), (3, false, true));
    assert_within("volume", volume.value, truth, 0.01);
    assert!(volume.low <= truth && truth <= volume.high, "{volume:?}, in truth {truth}");
    let check = found.check.expect("an independent value");
    let integral = check.by_change_of_variables;
    assert!(check.agrees && (integral.value - truth).abs() < 4.0 * integral.standard_error, "{check:?}");
    assert_within("multiplicity", integral.multiplicity, 1.0, 0.01);
}

#[test]
fn volumes_hold_their_intervals() {
    // Forty lattices; of intervals of 95 % between 90 and 100 % hold the truth.
    let truth = 4.0 / 3.0 * PI * 0.02f64.powi(3);
    let holds = |seed: u64| {
        let volume = measured(3, 2e-3, seed, |t| polar(t, 0.02)).volume.expect("a volume");
        volume.low <= truth && truth <= volume.high
    };
    let held = (0..40).filter(|seed| holds(*seed)).count();
    assert!(held >= 36, "{held} of 40 intervals hold the truth");
}

#[test]
fn surfaces_have_their_areas() {
    let (wide, narrow) = (0.03, 0.012);
    let torus = move |t: &[f64]| {
        let (a, b) = (PI * t[0], PI * t[1]);
        let out = wide + narrow * b.cos();
        Some([out * a.cos(), out * a.sin(), narrow * b.sin()])
    };
    let found = measured(2, 2e-3, 2, torus);
    let truth = 4.0 * PI * PI * wide * narrow;
    assert_eq!((found.dimension.rank, found.volume.is_none()), (2, true));
    assert_within("torus", found.area.expect("an area").value, truth, 0.01);
    let check = found.check.expect("an independent value");
    assert!(check.agrees, "{check:?}");
    // A helicoid of one turn: u from -1 to 1 times the radius, v one turn, rise c a radian.
    let (radius, rise) = (0.03f64, 0.008f64);
    let found = measured(2, 2e-3, 5, move |t| {
        let (u, v) = (radius * t[0], PI * t[1]);
        Some([u * v.cos(), u * v.sin(), rise * v])
    });
    let x = radius / rise;
    let truth = 2.0 * PI * rise * rise * (x * (1.0 + x * x).sqrt() + x.asinh());
    assert_within("helicoid", found.area.expect("an area").value, truth, 0.01);
}

#[test]
fn a_torus_shell_is_thin() {
    let (wide, narrow, thick) = (0.03, 0.012, 0.001);
    let shell = move |t: &[f64]| {
        let (a, b, r) = (PI * t[0], PI * t[1], narrow + 0.5 * thick * t[2]);
        let out = wide + r * b.cos();
        Some([out * a.cos(), out * a.sin(), r * b.sin()])
    };
    let found = measured(3, 1e-3, 2, shell);
    assert!(found.dimension.is_thin, "{:?}", found.dimension);
    let area = 4.0 * PI * PI * wide * narrow;
    assert_within("volume", found.volume.expect("a volume").value, area * thick, 0.02);
    assert_within("area", found.area.expect("an area").value, area, 0.02);
}

#[test]
fn curves_and_points_are_told() {
    let found = measured(1, 1e-3, 1, |t| Some([0.02 * (PI * t[0]).cos(), 0.02 * (PI * t[0]).sin(), 0.01 * t[0]]));
    let truth = 2.0 * (0.02f64 * PI).hypot(0.01);
    assert_eq!(found.dimension.rank, 1);
    assert_within("length", found.length.expect("a length").value, truth, 0.01);
    let found = measured(2, 1e-3, 1, |_| Some([0.01, 0.02, 0.03]));
    assert_eq!((found.dimension.rank, found.dimension.name()), (0, "point"));
    assert!(found.volume.is_none() && found.area.is_none() && found.length.is_none() && found.check.is_none());
}

#[test]
fn a_map_covered_twice_says_so() {
    // A fold: x = t² from either side.
    let found = measured(3, 1e-3, 4, |t| Some([0.02 * t[0] * t[0], 0.02 * t[1], 0.02 * t[2]]));
    let truth = 0.02 * 0.04 * 0.04;
    assert_within("volume", found.volume.expect("a volume").value, truth, 0.01);
    let check = found.check.expect("an independent value");
    let integral = check.by_change_of_variables;
    assert_within("multiplicity", integral.multiplicity, 2.0, 0.01);
    assert_within("with multiplicity", integral.with_multiplicity, 2.0 * truth, 0.01);
    assert!(check.agrees, "{check:?}");
}

#[test]
fn more_inputs_than_dimensions_are_no_obstacle() {
    // Each point of a cube is reached by a straight fibre of inputs; both its ends lie on faces.
    let found = measured(4, 2e-3, 4, |t| Some(turned([0.02 * (t[0] + t[3]), 0.02 * t[1], 0.02 * t[2]])));
    let truth = 0.08 * 0.04 * 0.04;
    assert_within("volume", found.volume.expect("a volume").value, truth, 0.02);
    let check = found.check.expect("an independent value");
    assert_within("multiplicity", check.by_change_of_variables.multiplicity, 2.0, 0.02);
    assert!(check.agrees, "{check:?}");
}

#[test]
fn a_torn_map_is_measured_in_pieces() {
    // The equilibrium jumps at t = 0, and there is none at large inputs: two boxes with a corner missing.
    let found = measured(3, 1e-3, 4, |t| {
        let jump = if t[0] > 0.0 { 0.03 } else { 0.0 };
        (t[0] + t[1] < 1.0).then_some(turned([0.02 * t[0] + jump, 0.02 * t[1], 0.02 * t[2]]))
    });
    let truth = 0.04 * 0.04 * 0.04 * (1.0 - 0.5 / 4.0);
    let volume = found.volume.expect("a volume");
    assert_within("volume", volume.value, truth, 0.01);
    let check = found.check.expect("an independent value");
    assert!(check.agrees, "{check:?} {volume:?}");
}
