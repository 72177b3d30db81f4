//! The rod in units of its own size, and its variations: what changes when one of its numbers does.

use crate::model::{self, Axis, FlexibleRod, Rod, RodSegment, Slot, Units};
use nalgebra::{Matrix3, Vector3};

/// Numbers of one segment, or their differentials. What varies along it: x(s) = x + (s / length) x_rise.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segment {
    pub length: f64,
    /// EIx, EIy, GJ.
    pub K: Vector3<f64>,
    pub K_rise: Vector3<f64>,
    pub u_star: Vector3<f64>,
    pub u_star_rise: Vector3<f64>,
    /// Force per length; on a rigid segment the whole force.
    pub load: Vector3<f64>,
    /// On a rigid segment in a field that varies.
    pub couple: Vector3<f64>,
    /// Whether both turn with it, and are in the body frame.
    pub follows: bool,
    /// Dipole per length; on a rigid segment the whole dipole.
    pub mu: Vector3<f64>,
    /// Kse^-1, its diagonal.
    pub C_se: Vector3<f64>,
}

/// Numbers of a rod, or their differentials.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    pub B: Vector3<f64>,
    pub f_tip: Vector3<f64>,
    pub l_tip: Vector3<f64>,
    pub segments: Vec<Segment>,
}

/// A rod based at the origin, in units of its length, its mean stiffness and its field.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    pub numbers: Numbers,
    pub R0: Matrix3<f64>,
    pub is_flexible: Vec<bool>,
    pub rigid_force_arm: bool,
    /// n at the distal end of each segment.
    pub n_end: Vec<Vector3<f64>>,
}

/// A direction in which a rod changes: of its base pose, its base moment and its numbers.
#[derive(Clone, Debug)]
pub(super) struct Variation {
    pub w0: Vector3<f64>,
    pub dp0: Vector3<f64>,
    /// Of the base moment, body frame.
    pub dm0_body: Vector3<f64>,
    pub numbers: Numbers,
    /// Change of n at the distal end of each segment.
    pub dn_end: Vec<Vector3<f64>>,
}

/// Length of the rod; moment that bends its flexible part, on the mean, by one radian; field.
pub(super) fn units(rod: &Rod) -> Units {
    let length = rod.total_length();
    let (mut flexible, mut compliance) = (0.0, 0.0);
    for segment in &rod.segments {
        if let RodSegment::Flexible(FlexibleRod { length, stiffness, stiffness_rise, .. }) = segment {
            let [x, y] = [0, 1].map(|axis| stiffness[axis] + 0.5 * stiffness_rise[axis]);
            flexible += length;
            compliance += length / (x * y).sqrt();
        }
    }
    let stiffness = if compliance > 0.0 { flexible / compliance } else { 1.0 };
    let field = Vector3::from(rod.flux_density).norm();
    Units { length, force: stiffness / (length * length), field: if field > 0.0 { field } else { 1.0 } }
}

/// A matrix given by rows.
pub(super) fn matrix(rows: &model::Matrix) -> Matrix3<f64> {
    Matrix3::from_fn(|row, col| rows[row][col])
}

/// Rows of a matrix.
pub(super) fn rows(matrix: &Matrix3<f64>) -> model::Matrix {
    std::array::from_fn(|row| std::array::from_fn(|col| matrix[(row, col)]))
}

/// The world axis of a name.
pub(super) fn unit(axis: Axis) -> Vector3<f64> {
    Vector3::ith(axis.index(), 1.0)
}

/// e3 x v
pub(super) fn e3_cross(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-v.y, v.x, 0.0)
}

/// Stretch and shear with the tangent, p' = R nu, under the force n in the body frame. R5
pub(super) fn nu(C_se: Vector3<f64>, n_body: Vector3<f64>) -> Vector3<f64> {
    Vector3::z() + C_se.component_mul(&n_body)
}

impl Chain {
    pub(super) fn new(rod: &Rod, units: &Units) -> Self {
        let scaled = |v: model::Vector, unit: f64| Vector3::from(v) / unit;
        let segment = |segment: &RodSegment| match segment {
            RodSegment::Flexible(flexible) => Segment {
                length: flexible.length / units.length,
                K: scaled(flexible.stiffness, units.stiffness()),
                K_rise: scaled(flexible.stiffness_rise, units.stiffness()),
                u_star: scaled(flexible.rest_curvature, units.curvature()),
                u_star_rise: scaled(flexible.rest_curvature_rise, units.curvature()),
                load: scaled(flexible.load, units.load()),
                mu: scaled(flexible.dipole, units.dipole() / units.length),
                C_se: scaled(flexible.shear_compliance, 1.0 / units.force),
                ..Segment::default()
            },
            RodSegment::Rigid(rigid) => Segment {
                length: rigid.length / units.length,
                load: scaled(rigid.weight, units.force),
                couple: scaled(rigid.couple, units.moment()),
                follows: rigid.follows,
                mu: scaled(rigid.dipole, units.dipole()),
                ..Segment::default()
            },
        };
        let numbers = Numbers {
            B: Vector3::from(rod.flux_density) / units.field,
            f_tip: Vector3::from(rod.tip_force) / units.force,
            l_tip: Vector3::from(rod.tip_moment) / units.moment(),
            segments: rod.segments.iter().map(segment).collect(),
        };
        let mut chain = Self {
            numbers,
            R0: matrix(&rod.base_rotation),
            is_flexible: rod.segments.iter().map(RodSegment::is_flexible).collect(),
            rigid_force_arm: rod.rigid_force_arm,
            n_end: Vec::new(),
        };
        chain.set_forces();
        chain
    }

    /// n(L_j) = f_tip + the loads beyond segment j.
    fn set_forces(&mut self) {
        let mut n = self.numbers.f_tip;
        self.n_end = vec![n; self.numbers.segments.len()];
        for j in (0..self.n_end.len()).rev() {
            self.n_end[j] = n;
            n += self.weight(j);
        }
    }

    /// Force on segment j.
    fn weight(&self, j: usize) -> Vector3<f64> {
        let Segment { length, load, .. } = self.numbers.segments[j];
        if self.is_flexible[j] { load * length } else { load }
    }

    /// The same rod under a share of its loads: dipoles, tip force, tip moment, distributed loads.
    pub(super) fn loaded(&self, lambda: f64) -> Self {
        let mut chain = self.clone();
        chain.numbers.f_tip *= lambda;
        chain.numbers.l_tip *= lambda;
        for segment in &mut chain.numbers.segments {
            segment.mu *= lambda;
            segment.load *= lambda;
            segment.couple *= lambda;
        }
        chain.set_forces();
        chain
    }

    /// Whether a dead moment acts, or a load that turns with the rod: its work depends on the way, and no energy tells stability. S6
    pub(super) fn has_no_energy(&self) -> bool {
        let zero = Vector3::zeros();
        let of = |segment: &Segment| segment.couple != zero || segment.follows && segment.load != zero;
        self.numbers.l_tip != zero || self.numbers.segments.iter().any(of)
    }

    /// n at the proximal end of segment j.
    pub(super) fn n_start(&self, segment: usize) -> Vector3<f64> {
        self.n_end[segment] + self.weight(segment)
    }

    /// u(0), if the rod starts with a flexible segment.
    pub(super) fn u_base(&self, m0_body: Vector3<f64>) -> Option<Vector3<f64>> {
        let first = self.numbers.segments[0];
        self.is_flexible[0].then(|| first.u_star + m0_body.component_div(&first.K))
    }

    /// p' at the base.
    pub(super) fn tangent_base(&self) -> Vector3<f64> {
        let nu = nu(self.numbers.segments[0].C_se, self.R0.tr_mul(&self.n_start(0)));
        self.R0 * nu
    }

    /// Nothing changes.
    pub(super) fn no_variation(&self) -> Variation {
        let zero = Vector3::zeros();
        let count = self.numbers.segments.len();
        let numbers = Numbers { segments: vec![Segment::default(); count], ..Numbers::default() };
        Variation { w0: zero, dp0: zero, dm0_body: zero, numbers, dn_end: vec![zero; count] }
    }

    /// Fills in the change of the internal force.
    fn with_forces(&self, mut variation: Variation) -> Variation {
        let mut dn = variation.numbers.f_tip;
        for j in (0..self.numbers.segments.len()).rev() {
            variation.dn_end[j] = dn;
            let (value, d) = (self.numbers.segments[j], variation.numbers.segments[j]);
            dn += if self.is_flexible[j] { d.load * value.length + value.load * d.length } else { d.load };
        }
        variation
    }

    /// Unit changes of the base moment.
    pub(super) fn base_moment_variations(&self) -> [Variation; 3] {
        std::array::from_fn(|k| Variation { dm0_body: Vector3::ith(k, 1.0), ..self.no_variation() })
    }

    /// Growth of all loads together; `self` is the rod under its full load.
    pub(super) fn load_variation(&self, lambda: f64) -> Variation {
        let mut variation = self.no_variation();
        variation.numbers.f_tip = self.numbers.f_tip;
        variation.numbers.l_tip = self.numbers.l_tip;
        for (d, segment) in variation.numbers.segments.iter_mut().zip(&self.numbers.segments) {
            d.mu = segment.mu;
            d.load = segment.load;
            d.couple = segment.couple;
        }
        self.loaded(lambda).with_forces(variation)
    }

    /// Unit change of a slot, the body-frame base moment held.
    pub(super) fn slot_variation(&self, slot: Slot, m0_body: Vector3<f64>) -> Variation {
        let mut variation = self.no_variation();
        let numbers = &mut variation.numbers;
        match slot {
            Slot::BasePosition(axis) => variation.dp0 = unit(axis),
            Slot::BaseRotation(axis) => variation.w0 = unit(axis),
            Slot::FluxDensity(axis) => numbers.B = unit(axis),
            // What of the field varies in space, and the wall, is no number of the chain: `varying` adds its part.
            Slot::FieldGradient(_)
            | Slot::FieldOrigin(_)
            | Slot::SourcePosition(..)
            | Slot::SourceMoment(..)
            | Slot::SourceTurn(..)
            | Slot::MapScale(_)
            | Slot::MapPosition(..)
            | Slot::WallPosition(_)
            | Slot::WallRotation(_)
            | Slot::WallRadius
            | Slot::WallTipRadius
            | Slot::WallCompliance
            | Slot::WallAnchor(_) => {}
            Slot::TipForce(axis) => numbers.f_tip = unit(axis),
            Slot::TipMoment(axis) => numbers.l_tip = unit(axis),
            Slot::Insertion => {
                variation.dp0 = self.tangent_base();
                variation.w0 = self.u_base(m0_body).map_or(Vector3::zeros(), |u| self.R0 * u);
            }
            Slot::Length(j) => numbers.segments[j].length = 1.0,
            Slot::Stiffness(j, axis) => numbers.segments[j].K = unit(axis),
            Slot::StiffnessRise(j, axis) => numbers.segments[j].K_rise = unit(axis),
            Slot::RestCurvature(j, axis) => numbers.segments[j].u_star = unit(axis),
            Slot::RestCurvatureRise(j, axis) => numbers.segments[j].u_star_rise = unit(axis),
            Slot::ShearCompliance(j, axis) => numbers.segments[j].C_se = unit(axis),
            Slot::Dipole(j, axis) | Slot::DipolePerLength(j, axis) => numbers.segments[j].mu = unit(axis),
            Slot::Load(j, axis) | Slot::Weight(j, axis) => numbers.segments[j].load = unit(axis),
            Slot::Couple(j, axis) => numbers.segments[j].couple = unit(axis),
        }
        self.with_forces(variation)
    }
}
