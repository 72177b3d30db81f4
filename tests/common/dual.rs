//! An initial-value problem independent of the library: reduced form (world moment integrated), fixed steps,
//! extrapolated, generic over dual numbers. Its derivatives come from automatic differentiation alone.

use num_dual::{Dual64, DualNum};
use rodsweep::model::{Rod, RodSegment, Slot};

type V<D> = [D; 3];

/// Steps per flexible segment at the coarsest of three levels.
const STEPS: usize = 40;

/// A rod whose numbers are dual.
pub struct DualRod<D> {
    p0: V<D>,
    /// Columns d1, d2, t.
    R0: [V<D>; 3],
    B: V<D>,
    f_tip: V<D>,
    l_tip: V<D>,
    segments: Vec<DualSegment<D>>,
    rigid_force_arm: bool,
}

struct DualSegment<D> {
    is_flexible: bool,
    length: D,
    K: V<D>,
    u_star: V<D>,
    mu: V<D>,
    load: V<D>,
}

/// Results of one integration.
#[derive(Clone, Copy)]
pub struct Shot<D> {
    pub p: V<D>,
    /// Columns d1, d2, t.
    pub R: [V<D>; 3],
    /// m(L) - l_tip
    pub residual: V<D>,
    /// u at the start of the first flexible segment.
    pub u0: V<D>,
}

#[derive(Clone, Copy)]
struct Point<D> {
    p: V<D>,
    R: [V<D>; 3],
    m: V<D>,
}

fn add<D: DualNum<Primitive = f64> + Copy>(a: V<D>, b: V<D>) -> V<D> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scale<D: DualNum<Primitive = f64> + Copy>(a: V<D>, s: D) -> V<D> {
    a.map(|x| x * s)
}

fn cross<D: DualNum<Primitive = f64> + Copy>(a: V<D>, b: V<D>) -> V<D> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot<D: DualNum<Primitive = f64> + Copy>(a: V<D>, b: V<D>) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// R v, R by columns.
fn rotate<D: DualNum<Primitive = f64> + Copy>(R: &[V<D>; 3], v: V<D>) -> V<D> {
    add(add(scale(R[0], v[0]), scale(R[1], v[1])), scale(R[2], v[2]))
}

impl<D: DualNum<Primitive = f64> + Copy> DualSegment<D> {
    fn curvature(&self, point: &Point<D>) -> V<D> {
        std::array::from_fn(|k| self.u_star[k] + dot(point.R[k], point.m) / self.K[k])
    }

    fn slope(&self, s: D, n_end: V<D>, point: &Point<D>) -> Point<D> {
        let n = add(n_end, scale(self.load, self.length - s));
        let [d1, d2, t] = point.R;
        let omega = rotate(&point.R, self.curvature(point));
        Point { p: t, R: [cross(omega, d1), cross(omega, d2), cross(omega, t)], m: cross(n, t) }
    }

    /// Runge-Kutta's classical method with equal steps.
    fn integrate(&self, n_end: V<D>, mut point: Point<D>, steps: usize) -> Point<D> {
        let h = self.length / steps as f64;
        for step in 0..steps {
            let s = h * step as f64;
            let k1 = self.slope(s, n_end, &point);
            let k2 = self.slope(s + h * 0.5, n_end, &point.plus(&k1, h * 0.5));
            let k3 = self.slope(s + h * 0.5, n_end, &point.plus(&k2, h * 0.5));
            let k4 = self.slope(s + h, n_end, &point.plus(&k3, h));
            point = point.plus(&k1, h / 6.0).plus(&k2, h / 3.0).plus(&k3, h / 3.0).plus(&k4, h / 6.0);
        }
        point
    }
}

impl<D: DualNum<Primitive = f64> + Copy> Point<D> {
    fn plus(&self, slope: &Point<D>, h: D) -> Point<D> {
        let add = |a: V<D>, b: V<D>| add(a, scale(b, h));
        Point { p: add(self.p, slope.p), R: [0, 1, 2].map(|k| add(self.R[k], slope.R[k])), m: add(self.m, slope.m) }
    }

    /// (factor fine - coarse) / (factor - 1)
    fn extrapolated(fine: &Self, coarse: &Self, factor: f64) -> Self {
        let mix = |a: V<D>, b: V<D>| [0, 1, 2].map(|k| a[k] + (a[k] - b[k]) / (factor - 1.0));
        Point { p: mix(fine.p, coarse.p), R: [0, 1, 2].map(|k| mix(fine.R[k], coarse.R[k])), m: mix(fine.m, coarse.m) }
    }
}

/// Integrates the rod from its base.
pub fn shoot<D: DualNum<Primitive = f64> + Copy>(rod: &DualRod<D>, m0: V<D>) -> Shot<D> {
    let mut n_end = vec![rod.f_tip; rod.segments.len()];
    for j in (1..rod.segments.len()).rev() {
        n_end[j - 1] = add(n_end[j], scale(rod.segments[j].load, rod.segments[j].length));
    }
    let mut point = Point { p: rod.p0, R: rod.R0, m: m0 };
    let mut u0 = None;
    for (segment, n_end) in rod.segments.iter().zip(n_end) {
        if segment.is_flexible {
            u0.get_or_insert_with(|| segment.curvature(&point));
            let [coarse, medium, fine] = [1, 2, 4].map(|k| segment.integrate(n_end, point, k * STEPS));
            let low = Point::extrapolated(&medium, &coarse, 16.0);
            let high = Point::extrapolated(&fine, &medium, 16.0);
            point = Point::extrapolated(&high, &low, 32.0);
        } else {
            let (t, L) = (point.R[2], segment.length);
            let mut jump = cross(rotate(&point.R, segment.mu), rod.B);
            if rod.rigid_force_arm {
                let force = add(scale(n_end, L), scale(segment.load, L * L * 0.5));
                jump = add(jump, cross(t, force));
            }
            point.m = add(point.m, scale(jump, D::from(-1.0)));
            point.p = add(point.p, scale(t, L));
        }
    }
    let residual = add(point.m, scale(rod.l_tip, D::from(-1.0)));
    Shot { p: point.p, R: point.R, residual, u0: u0.expect("a flexible segment") }
}

/// The rod with a unit dual part in one slot. Insertion differentiates the first segment's length.
pub fn dual_rod(rod: &Rod, slot: Option<Slot>) -> DualRod<Dual64> {
    let constant = |v: [f64; 3]| v.map(Dual64::from);
    let zero = constant([0.0; 3]);
    let R0: [V<Dual64>; 3] =
        std::array::from_fn(|col| constant(std::array::from_fn(|row| rod.base_rotation[row][col])));
    let segment = |segment: &RodSegment| match *segment {
        RodSegment::Flexible { length, stiffness, rest_curvature, load } => DualSegment {
            is_flexible: true,
            length: Dual64::from(length),
            K: constant(stiffness),
            u_star: constant(rest_curvature),
            mu: zero,
            load: constant(load),
        },
        RodSegment::Rigid { length, dipole, load } => DualSegment {
            is_flexible: false,
            length: Dual64::from(length),
            K: zero,
            u_star: zero,
            mu: constant(dipole),
            load: constant(load),
        },
    };
    let mut dual = DualRod {
        p0: constant(rod.base_position),
        R0,
        B: constant(rod.flux_density),
        f_tip: constant(rod.tip_force),
        l_tip: constant(rod.tip_moment),
        segments: rod.segments.iter().map(segment).collect(),
        rigid_force_arm: rod.rigid_force_arm,
    };
    match slot {
        None => {}
        Some(Slot::BasePosition(axis)) => dual.p0[axis.index()].eps = 1.0,
        Some(Slot::BaseRotation(axis)) => {
            let mut epsilon = zero;
            epsilon[axis.index()].eps = 1.0;
            dual.R0 = dual.R0.map(|d| add(d, cross(epsilon, d)));
        }
        Some(Slot::FluxDensity(axis)) => dual.B[axis.index()].eps = 1.0,
        Some(Slot::TipForce(axis)) => dual.f_tip[axis.index()].eps = 1.0,
        Some(Slot::TipMoment(axis)) => dual.l_tip[axis.index()].eps = 1.0,
        Some(Slot::Insertion) => dual.segments[0].length.eps = 1.0,
        Some(Slot::Length(j)) => dual.segments[j].length.eps = 1.0,
        Some(Slot::Stiffness(j, axis)) => dual.segments[j].K[axis.index()].eps = 1.0,
        Some(Slot::RestCurvature(j, axis)) => dual.segments[j].u_star[axis.index()].eps = 1.0,
        Some(Slot::Dipole(j, axis)) => dual.segments[j].mu[axis.index()].eps = 1.0,
        Some(Slot::Load(j, axis)) => dual.segments[j].load[axis.index()].eps = 1.0,
    }
    dual
}
