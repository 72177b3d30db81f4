//! An initial-value problem independent of the library: reduced form (world moment integrated), fixed steps,
//! extrapolated, generic over dual numbers. Its derivatives come from automatic differentiation alone.
#![allow(non_snake_case)]

use num_dual::DualNum;
use rodsweep::model::{Rod, RodSegment, Slot};

/// A number with derivatives, or without.
pub trait Number: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Number for D {}

type V<D> = [D; 3];

/// Steps per piece at the coarsest of four levels.
const STEPS: usize = 10;

/// A rod whose numbers are dual.
pub struct DualRod<D> {
    p0: V<D>,
    /// Columns d1, d2, t.
    R0: [V<D>; 3],
    B: V<D>,
    f_tip: V<D>,
    l_tip: V<D>,
    pieces: Vec<Piece<D>>,
    rigid_force_arm: bool,
}

/// Numbers of a segment. What varies along it: x + (s / length) x_rise.
#[derive(Clone, Copy)]
struct Piece<D> {
    is_flexible: bool,
    length: D,
    K: V<D>,
    K_rise: V<D>,
    u_star: V<D>,
    u_star_rise: V<D>,
    /// Per length where flexible, else in all; so is the load.
    mu: V<D>,
    load: V<D>,
    /// Shear and axial compliance.
    C_se: V<D>,
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

fn add<D: Number>(a: V<D>, b: V<D>) -> V<D> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scale<D: Number>(a: V<D>, s: D) -> V<D> {
    a.map(|x| x * s)
}

fn cross<D: Number>(a: V<D>, b: V<D>) -> V<D> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot<D: Number>(a: V<D>, b: V<D>) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// R v, R by columns.
fn rotate<D: Number>(R: &[V<D>; 3], v: V<D>) -> V<D> {
    add(add(scale(R[0], v[0]), scale(R[1], v[1])), scale(R[2], v[2]))
}

impl<D: Number> Piece<D> {
    /// What acts on the whole piece.
    fn force(&self) -> V<D> {
        if self.is_flexible { scale(self.load, self.length) } else { self.load }
    }

    /// At a share of the length.
    fn curvature(&self, share: f64, point: &Point<D>) -> V<D> {
        std::array::from_fn(|k| {
            let K = self.K[k] + self.K_rise[k] * share;
            self.u_star[k] + self.u_star_rise[k] * share + dot(point.R[k], point.m) / K
        })
    }

    fn slope(&self, share: f64, n_end: V<D>, B: V<D>, point: &Point<D>) -> Point<D> {
        let n = add(n_end, scale(self.load, self.length * (1.0 - share)));
        let [d1, d2, t] = point.R;
        let strain: V<D> = std::array::from_fn(|k| self.C_se[k] * dot(point.R[k], n));
        let p = add(t, rotate(&point.R, strain));
        let omega = rotate(&point.R, self.curvature(share, point));
        let couple = cross(B, rotate(&point.R, self.mu));
        Point { p, R: [cross(omega, d1), cross(omega, d2), cross(omega, t)], m: add(cross(n, p), couple) }
    }

    /// Runge-Kutta's classical method with equal steps.
    fn integrate(&self, n_end: V<D>, B: V<D>, mut point: Point<D>, steps: usize) -> Point<D> {
        let h = self.length / steps as f64;
        let slope = |at: f64, point: &Point<D>| self.slope(at / steps as f64, n_end, B, point);
        for step in 0..steps {
            let at = step as f64;
            let k1 = slope(at, &point);
            let k2 = slope(at + 0.5, &point.plus(&k1, h * 0.5));
            let k3 = slope(at + 0.5, &point.plus(&k2, h * 0.5));
            let k4 = slope(at + 1.0, &point.plus(&k3, h));
            point = point.plus(&k1, h / 6.0).plus(&k2, h / 3.0).plus(&k3, h / 3.0).plus(&k4, h / 6.0);
        }
        point
    }

    /// The end of a flexible piece, extrapolated in powers 4, 5 and 6 of the step.
    fn cross_flexible(&self, n_end: V<D>, B: V<D>, point: Point<D>) -> Point<D> {
        let mut level = [1, 2, 4, 8].map(|k| self.integrate(n_end, B, point, k * STEPS)).to_vec();
        for factor in [16.0, 32.0, 64.0] {
            level = level.windows(2).map(|pair| Point::extrapolated(&pair[1], &pair[0], factor)).collect();
        }
        level[0]
    }

    fn cross_rigid(&self, n_end: V<D>, B: V<D>, arm: bool, point: Point<D>) -> Point<D> {
        let arm_vector = scale(point.R[2], self.length);
        let mut m = add(point.m, cross(B, rotate(&point.R, self.mu)));
        if arm {
            m = add(m, cross(add(n_end, scale(self.load, D::from(0.5))), arm_vector));
        }
        Point { p: add(point.p, arm_vector), m, ..point }
    }
}

impl<D: Number> Point<D> {
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
pub fn shoot<D: Number>(rod: &DualRod<D>, m0: V<D>) -> Shot<D> {
    let mut n_end = vec![rod.f_tip; rod.pieces.len()];
    for j in (1..rod.pieces.len()).rev() {
        n_end[j - 1] = add(n_end[j], rod.pieces[j].force());
    }
    let mut point = Point { p: rod.p0, R: rod.R0, m: m0 };
    let mut u0 = None;
    for (piece, n_end) in rod.pieces.iter().zip(n_end) {
        if piece.is_flexible {
            u0.get_or_insert_with(|| piece.curvature(0.0, &point));
            point = piece.cross_flexible(n_end, rod.B, point);
        } else {
            point = piece.cross_rigid(n_end, rod.B, rod.rigid_force_arm, point);
        }
    }
    let residual = add(point.m, scale(rod.l_tip, D::from(-1.0)));
    Shot { p: point.p, R: point.R, residual, u0: u0.expect("a flexible segment") }
}

/// The rod with slots moved by dual numbers of value zero.
pub fn dual_rod<D: Number>(rod: &Rod, moves: &[(Slot, D)]) -> DualRod<D> {
    let constant = |v: [f64; 3]| v.map(D::from);
    let zero = constant([0.0; 3]);
    let R0: [V<D>; 3] = std::array::from_fn(|col| constant(std::array::from_fn(|row| rod.base_rotation[row][col])));
    let piece = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => Piece {
            is_flexible: true,
            length: D::from(flexible.length),
            K: constant(flexible.stiffness),
            K_rise: constant(flexible.stiffness_rise),
            u_star: constant(flexible.rest_curvature),
            u_star_rise: constant(flexible.rest_curvature_rise),
            mu: constant(flexible.dipole),
            load: constant(flexible.load),
            C_se: constant(flexible.shear_compliance),
        },
        RodSegment::Rigid(rigid) => Piece {
            is_flexible: false,
            length: D::from(rigid.length),
            K: zero,
            K_rise: zero,
            u_star: zero,
            u_star_rise: zero,
            mu: constant(rigid.dipole),
            load: constant(rigid.weight),
            C_se: zero,
        },
    };
    let mut dual = DualRod {
        p0: constant(rod.base_position),
        R0,
        B: constant(rod.flux_density),
        f_tip: constant(rod.tip_force),
        l_tip: constant(rod.tip_moment),
        pieces: rod.segments.iter().map(piece).collect(),
        rigid_force_arm: rod.rigid_force_arm,
    };
    // Insertion last: it shifts the pieces.
    for (slot, by) in moves.iter().filter(|(slot, _)| *slot != Slot::Insertion) {
        move_slot(&mut dual, *slot, *by);
    }
    for (_, by) in moves.iter().filter(|(slot, _)| *slot == Slot::Insertion) {
        insert(&mut dual, *by);
    }
    dual
}

fn move_slot<D: Number>(dual: &mut DualRod<D>, slot: Slot, by: D) {
    let number = match slot {
        Slot::BaseRotation(axis) => {
            let mut turn = [D::from(0.0); 3];
            turn[axis.index()] = by;
            dual.R0 = dual.R0.map(|d| add(d, cross(turn, d)));
            return;
        }
        Slot::Length(j) => {
            // What varies goes on as it does.
            let piece = &mut dual.pieces[j];
            if piece.length.re() > 0.0 {
                let stretch = by / piece.length + 1.0;
                piece.K_rise = scale(piece.K_rise, stretch);
                piece.u_star_rise = scale(piece.u_star_rise, stretch);
            }
            piece.length += by;
            return;
        }
        Slot::Insertion => unreachable!("a piece of its own"),
        Slot::FieldGradient(_)
        | Slot::FieldOrigin(_)
        | Slot::SourcePosition(..)
        | Slot::SourceMoment(..)
        | Slot::SourceTurn(..)
        | Slot::MapScale(_)
        | Slot::MapPosition(..) => unreachable!("the field is uniform"),
        Slot::Couple(..) => unreachable!("all loads have an energy"),
        Slot::WallPosition(_)
        | Slot::WallRotation(_)
        | Slot::WallRadius
        | Slot::WallTipRadius
        | Slot::WallCompliance
        | Slot::WallAnchor(_) => unreachable!("there is no wall"),
        Slot::BasePosition(axis) => &mut dual.p0[axis.index()],
        Slot::FluxDensity(axis) => &mut dual.B[axis.index()],
        Slot::TipForce(axis) => &mut dual.f_tip[axis.index()],
        Slot::TipMoment(axis) => &mut dual.l_tip[axis.index()],
        Slot::Stiffness(j, axis) => &mut dual.pieces[j].K[axis.index()],
        Slot::StiffnessRise(j, axis) => &mut dual.pieces[j].K_rise[axis.index()],
        Slot::RestCurvature(j, axis) => &mut dual.pieces[j].u_star[axis.index()],
        Slot::RestCurvatureRise(j, axis) => &mut dual.pieces[j].u_star_rise[axis.index()],
        Slot::ShearCompliance(j, axis) => &mut dual.pieces[j].C_se[axis.index()],
        Slot::Dipole(j, axis) | Slot::DipolePerLength(j, axis) => &mut dual.pieces[j].mu[axis.index()],
        Slot::Load(j, axis) | Slot::Weight(j, axis) => &mut dual.pieces[j].load[axis.index()],
    };
    *number += by;
}

/// A piece of no length in front that grows: what varies along the first piece with a length goes on towards the base.
fn insert<D: Number>(dual: &mut DualRod<D>, by: D) {
    let mut front = dual.pieces[0];
    front.length = by;
    if front.is_flexible {
        let sloped = dual.pieces.iter().find(|piece| piece.length.re() > 0.0).filter(|piece| piece.is_flexible);
        let rise =
            |of: fn(&Piece<D>) -> V<D>| sloped.map_or([D::from(0.0); 3], |piece| scale(of(piece), by / piece.length));
        (front.K_rise, front.u_star_rise) = (rise(|piece| piece.K_rise), rise(|piece| piece.u_star_rise));
        front.K = add(front.K, scale(front.K_rise, D::from(-1.0)));
        front.u_star = add(front.u_star, scale(front.u_star_rise, D::from(-1.0)));
    } else {
        (front.mu, front.load) = ([D::from(0.0); 3], [D::from(0.0); 3]);
    }
    dual.pieces.insert(0, front);
}
