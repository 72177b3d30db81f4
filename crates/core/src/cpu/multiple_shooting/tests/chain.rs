//! A rod as a chain of helices: its energy, its equilibria, stable or not, and how many directions lead down from them.

use super::vector;
use crate::model::{Base, Flexible, Loads, Profile, Rigid, Scene, Segment, SegmentKind, Stiffness, Vector};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

/// Helices of a chain.
pub const HELICES: usize = 12;
pub const LENGTH: f64 = 1.0;
const TIP_LENGTH: f64 = 0.05;

/// A flexible segment with a magnet at its tip, and its energy as a chain of helices.
pub struct Column {
    pub stiffness: Vector,
    pub rest: Vector,
    pub force: Vector,
    pub field: Vector,
    /// Body frame
    pub dipole: Vector,
}

pub fn helix((p, R): (Vector3<f64>, Matrix3<f64>), u: Vector3<f64>, h: f64) -> (Vector3<f64>, Matrix3<f64>) {
    let v = u * h;
    let a = v.norm();
    let (once, twice) = match a < 1e-3 {
        true => (0.5 - a * a / 24.0, 1.0 / 6.0 - a * a / 120.0),
        false => ((1.0 - a.cos()) / (a * a), (a - a.sin()) / (a * a * a)),
    };
    let along = Vector3::z();
    let chord = along + v.cross(&along) * once + v.cross(&v.cross(&along)) * twice;
    (p + R * chord * h, R * Rotation3::new(v).matrix())
}

impl Column {
    /// Curvature of a helix.
    pub fn curvature(u: &DVector<f64>, k: usize) -> Vector3<f64> {
        Vector3::new(u[3 * k], u[3 * k + 1], u[3 * k + 2])
    }

    /// The chain's frames, base first.
    pub fn frames(u: &DVector<f64>) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
        let mut frames = vec![(Vector3::zeros(), Matrix3::identity())];
        for k in 0..HELICES {
            frames.push(helix(frames[k], Self::curvature(u, k), LENGTH / HELICES as f64));
        }
        frames
    }

    pub fn tip(u: &DVector<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let (p, R) = Self::frames(u)[HELICES];
        (p + R.column(2) * TIP_LENGTH, R)
    }

    fn energy(&self, u: &DVector<f64>) -> f64 {
        let of_helix = |k: usize| {
            let bent = Self::curvature(u, k) - vector(self.rest);
            0.5 * LENGTH / HELICES as f64 * bent.component_mul(&bent).dot(&vector(self.stiffness))
        };
        let (p, R) = Self::tip(u);
        let magnet = (R * vector(self.dipole)).dot(&vector(self.field));
        (0..HELICES).map(of_helix).sum::<f64>() - vector(self.force).dot(&p) - magnet
    }

    /// Gradient and Hessian, by differences.
    fn slopes(&self, u: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let at = |moves: &[(usize, f64)]| {
            let mut moved = u.clone();
            moves.iter().for_each(|(k, by)| moved[*k] += by);
            self.energy(&moved)
        };
        let (h, H) = (1e-5, 1e-3);
        let slope = |k: usize, _: usize| (at(&[(k, h)]) - at(&[(k, -h)])) / (2.0 * h);
        let mut hessian = DMatrix::zeros(u.len(), u.len());
        for i in 0..u.len() {
            for j in 0..=i {
                let of = |a: f64, b: f64| at(&[(i, a * H), (j, b * H)]);
                let second = (of(1.0, 1.0) - of(1.0, -1.0) - of(-1.0, 1.0) + of(-1.0, -1.0)) / (4.0 * H * H);
                (hessian[(i, j)], hessian[(j, i)]) = (second, second);
            }
        }
        (DVector::from_fn(u.len(), slope), hessian)
    }

    /// An equilibrium of the chain, stable or not, and its index; `None` where Newton's method finds none, or one next to a
    /// bifurcation.
    pub fn equilibrium(&self, mut u: DVector<f64>) -> Option<(DVector<f64>, usize)> {
        for _ in 0..60 {
            let (gradient, hessian) = self.slopes(&u);
            let step = hessian.clone().lu().solve(&gradient)?;
            if step.amax() < 1e-5 {
                let values = hessian.symmetric_eigenvalues();
                let least = values.iter().fold(f64::INFINITY, |least: f64, value| least.min(value.abs()));
                let clear = 0.03 * self.stiffness[2] * LENGTH / HELICES as f64;
                return (least > clear).then(|| (u, values.iter().filter(|value| **value < 0.0).count()));
            }
            u -= &step * (1.0 / step.amax()).min(1.0);
        }
        None
    }

    /// Moment in the middle of a helix, body frame; between two of them on a line.
    pub fn moment(&self, u: &DVector<f64>, s: f64) -> Vector3<f64> {
        let of = |k: usize| -> Vector3<f64> {
            (Self::curvature(u, k) - vector(self.rest)).component_mul(&vector(self.stiffness))
        };
        let at = s / LENGTH * HELICES as f64 - 0.5;
        let first = at.clamp(0.0, HELICES as f64 - 2.0) as usize;
        of(first) + (of(first + 1) - of(first)) * (at - first as f64)
    }

    pub fn scene(&self) -> Scene {
        let [bending_x, bending_y, torsion] = self.stiffness;
        let flexible = Flexible {
            stiffness: Stiffness::Direct { bending_x, bending_y, torsion },
            rest_curvature: Profile::Constant(self.rest),
            stiffness_shear: None,
            stiffness_axial: None,
            density: None,
            dipole_per_length: None,
            magnet: None,
        };
        let magnet = Rigid { dipole_per_length: Some(self.dipole.map(|x| x / TIP_LENGTH)), ..Rigid::default() };
        let segment = |name: &str, length: f64, kind: SegmentKind| Segment { name: name.into(), length, kind };
        Scene {
            name: String::new(),
            base: Base::default(),
            flux_density: self.field,
            sources: Default::default(),
            loads: Loads { tip_force: Some(self.force), ..Loads::default() },
            segments: vec![
                segment("rod", LENGTH, SegmentKind::Flexible(flexible)),
                segment("magnet", TIP_LENGTH, SegmentKind::Rigid(magnet)),
            ],
            inner_loads: Vec::new(),
            wall: None,
            inserted: 0.0,
            rigid_force_arm: true,
        }
    }
}
