//! The field at a point: B, its gradient G, and the second derivatives that columns need. F0, F1, F6
//!
//! Positions count from the base; mu0 / 4 pi is one in the plan's units.

use super::map::Map;
use super::program_field::FAR;
use super::{cuboid, cylinder};
use crate::cpu::algebra::{Mat3, Vec3, axpy, cross, dot, outer};
use crate::cpu::rod::problem::Problem;
use crate::cpu::simd::lane::Lane;
use crate::model::record::BASE_POSITION_AT;
use crate::model::{Cuboid, FIELD_DIPOLE_RECORD, FIELD_MAP_RECORD, FIELD_RECORD, SourceForm};
use std::sync::Arc;

/// Squares of lengths below this are none.
const TINY: f64 = 1e-30;

/// A dipole outside of the rod.
#[derive(Clone, Copy, Debug)]
pub struct Dipole<L> {
    pub X: Vec3<L>,
    pub M: Vec3<L>,
    pub clearance: L,
    /// Its form; a cylinder lies along M.
    pub form: SourceForm,
    /// Columns: the directions of the edges of a cuboid.
    pub edges: Mat3<L>,
}

/// B0 + G (x - x0) + the fields of dipoles.
#[derive(Clone, Debug)]
pub struct Space<L> {
    pub B0: Vec3<L>,
    pub G: Mat3<L>,
    pub origin: Vec3<L>,
    pub dipoles: Vec<Dipole<L>>,
    pub maps: Vec<Map<L>>,
}

/// The field at one point and what it does to a dipole there.
#[derive(Clone, Copy, Debug)]
pub struct Local<L> {
    pub B: Vec3<L>,
    pub G: Mat3<L>,
    /// Second derivatives of mu . B.
    pub T3: Mat3<L>,
}

impl<L: Lane> Space<L> {
    /// Weakens the whole field to this share of it.
    #[inline(always)]
    pub fn weaken(&mut self, share: L) {
        (self.B0, self.G) = (self.B0 * share, self.G * share);
        self.dipoles.iter_mut().for_each(|dipole| dipole.M = dipole.M * share);
        self.maps.iter_mut().for_each(|map| map.scale = map.scale * share);
    }
}

/// The matrix of the five entries of a gradient. F0
#[inline(always)]
pub fn gradient<L: Lane>([xx, xy, xz, yy, yz]: [L; 5]) -> Mat3<L> {
    Mat3 { x: Vec3 { x: xx, y: xy, z: xz }, y: Vec3 { x: xy, y: yy, z: yz }, z: Vec3 { x: xz, y: yz, z: -(xx + yy) } }
}

impl<L: Lane> Dipole<L> {
    /// Its field at a distance r. F0
    #[inline(always)]
    pub fn B(&self, r: Vec3<L>) -> Vec3<L> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return cylinder::Seen::new(cylinder, self.M, r, 0).B(),
            SourceForm::Cuboid(cuboid) => return self.cuboid(cuboid, r, 0).B(),
            SourceForm::Point => {}
        }
        let (inverse2, inverse3) = inverses(r);
        (r * (dot(self.M, r) * inverse2 * r.x.constant(3.0)) - self.M) * inverse3
    }

    /// Its field and the force on a dipole there. F0, F1
    #[inline(always)]
    pub fn acts(&self, r: Vec3<L>, mu: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        match &self.form {
            SourceForm::Cylinder(cylinder) => {
                let seen = cylinder::Seen::new(cylinder, self.M, r, 1);
                return (seen.B(), seen.G() * mu);
            }
            SourceForm::Cuboid(cuboid) => {
                let seen = self.cuboid(cuboid, r, 1);
                return (seen.B(), seen.G() * mu);
            }
            SourceForm::Point => {}
        }
        let (inverse2, inverse3) = inverses(r);
        let (a, b, c) = (dot(mu, r), dot(self.M, r), dot(mu, self.M));
        let b2 = b * inverse2;
        let B = (r * (b2 * r.x.constant(3.0)) - self.M) * inverse3;
        let along = r * (b2 * r.x.constant(-5.0)).mul_add(a, c);
        (B, axpy(a, self.M, axpy(b, mu, along)) * (inverse2 * inverse3 * r.x.constant(3.0)))
    }

    /// The gradient of its field.
    #[inline(always)]
    pub fn G(&self, r: Vec3<L>) -> Mat3<L> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return cylinder::Seen::new(cylinder, self.M, r, 1).G(),
            SourceForm::Cuboid(cuboid) => return self.cuboid(cuboid, r, 1).G(),
            SourceForm::Point => {}
        }
        let (inverse2, inverse3) = inverses(r);
        let b = dot(self.M, r);
        let along = axpy(b * inverse2 * r.x.constant(-5.0), r, self.M);
        let sum = outer(self.M, r, outer(r, along, Mat3::identity(b) * b));
        sum * (inverse2 * inverse3 * r.x.constant(3.0))
    }

    /// Second derivatives of mu . B.
    #[inline(always)]
    pub fn T3(&self, r: Vec3<L>, mu: Vec3<L>) -> Mat3<L> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return cylinder::Seen::new(cylinder, self.M, r, 2).T3(mu),
            SourceForm::Cuboid(cuboid) => return self.cuboid(cuboid, r, 2).T3(mu),
            SourceForm::Point => {}
        }
        let (inverse2, inverse3) = inverses(r);
        let (a, b, c) = (dot(mu, r) * inverse2, dot(self.M, r), dot(mu, self.M));
        let five = r.x.constant(5.0);
        let ab = a * b;
        // Each is linear in r; what multiplies r r^T comes last.
        let q = axpy(b * inverse2, mu, self.M * a);
        let square = (ab * r.x.constant(35.0) - five * c) * inverse2;
        let diagonal = Mat3::identity(a) * (c - five * ab);
        let mut sum = outer(mu, self.M, outer(self.M, mu, diagonal));
        sum = outer(q, r * -five, outer(r * -five, q, sum));
        sum = outer(r * square, r, sum);
        sum * (inverse2 * inverse3 * r.x.constant(3.0))
    }
}

impl<L: Lane> Dipole<L> {
    /// All three, and changes of B and of the force by its moment where they are asked for.
    #[inline(always)]
    pub fn all(&self, r: Vec3<L>, mu: Vec3<L>) -> Local<L> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => {
                let seen = cylinder::Seen::new(cylinder, self.M, r, 2);
                return Local { B: seen.B(), G: seen.G(), T3: seen.T3(mu) };
            }
            SourceForm::Cuboid(cuboid) => {
                let seen = self.cuboid(cuboid, r, 2);
                return Local { B: seen.B(), G: seen.G(), T3: seen.T3(mu) };
            }
            SourceForm::Point => {}
        }
        Local { B: self.B(r), G: self.G(r), T3: self.T3(r, mu) }
    }

    /// dB/dM and d(G mu)/dM; a cylinder turns with its moment, a cuboid does not. F6
    #[inline(always)]
    pub fn by_moment(&self, r: Vec3<L>, mu: Vec3<L>) -> (Mat3<L>, Mat3<L>) {
        match &self.form {
            SourceForm::Cylinder(cylinder) => {
                let seen = cylinder::Seen::new(cylinder, self.M, r, 2);
                return (seen.unit(), seen.pull(mu));
            }
            SourceForm::Cuboid(cuboid) => {
                let seen = self.cuboid(cuboid, r, 1);
                return (seen.unit(), seen.pull(mu));
            }
            SourceForm::Point => {}
        }
        // The force is as linear in one moment as in the other.
        (unit(r), Dipole { M: mu, ..*self }.G(r))
    }

    /// dB and d(G mu) by a rotation of a cuboid's edges, its moment at rest; nothing of what has none. F13
    #[inline(always)]
    pub fn by_turn(&self, r: Vec3<L>, mu: Vec3<L>) -> (Mat3<L>, Mat3<L>) {
        match &self.form {
            SourceForm::Cuboid(cuboid) => self.cuboid(cuboid, r, 2).by_turn(mu),
            _ => (Mat3::zero(r.x), Mat3::zero(r.x)),
        }
    }

    #[inline(always)]
    fn cuboid(&self, cuboid: &Cuboid, r: Vec3<L>, order: usize) -> cuboid::Seen<L> {
        cuboid::Seen::new(cuboid, self.edges, self.M, r, order)
    }
}

/// The field of a dipole at a distance r, by its moment. F0
#[inline(always)]
fn unit<L: Lane>(r: Vec3<L>) -> Mat3<L> {
    let (inverse2, inverse3) = inverses(r);
    outer(r * (inverse2 * inverse3 * r.x.constant(3.0)), r, Mat3::identity(inverse3) * -inverse3)
}

/// r^-2 and r^-3
#[inline(always)]
pub fn inverses<L: Lane>(r: Vec3<L>) -> (L, L) {
    let inverse2 = r.x.constant(1.0) / dot(r, r);
    (inverse2, inverse2 * inverse2.sqrt())
}

impl<L: Lane> Space<L> {
    pub fn new(zero: L) -> Self {
        let none = Vec3::splat(zero);
        Self { B0: none, G: Mat3::zero(zero), origin: none, dipoles: Vec::new(), maps: Vec::new() }
    }

    /// Reads the records of a group.
    #[inline(always)]
    pub fn load(&mut self, problem: &Problem<'_, L>) {
        let Problem { program, inputs, rod } = *problem;
        let token = problem.token();
        let Some(field) = &program.field else { return };
        let base = program.vector(token, &inputs, BASE_POSITION_AT);
        self.B0 = rod.B;
        let mut entries = [base.x; 5];
        for (k, entry) in entries.iter_mut().enumerate() {
            *entry = program.entry(token, &inputs, field.entry + k);
        }
        self.G = gradient(entries);
        self.origin = program.vector(token, &inputs, field.entry + 5) - base;
        self.dipoles.clear();
        let first = field.entry + FIELD_RECORD + FIELD_DIPOLE_RECORD * field.clearances.len();
        let mut edges_at = first + FIELD_MAP_RECORD * field.maps.len();
        for (j, (clearance, form)) in field.clearances.iter().zip(&field.forms).enumerate() {
            let at = field.entry + FIELD_RECORD + FIELD_DIPOLE_RECORD * j;
            let mut edges = Mat3::zero(base.x);
            if form.is_cuboid() {
                let [one, other] = [0, 3].map(|k| program.vector(token, &inputs, edges_at + k));
                edges = Mat3 { x: one, y: other, z: cross(one, other) };
                edges_at += Cuboid::RECORD;
            }
            self.dipoles.push(Dipole {
                X: program.vector(token, &inputs, at) - base,
                M: program.vector(token, &inputs, at + 3),
                clearance: L::splat(token, *clearance),
                form: *form,
                edges,
            });
        }
        self.maps.clear();
        for (k, map) in field.maps.iter().enumerate() {
            let at = first + FIELD_MAP_RECORD * k;
            let X = program.vector(token, &inputs, at + 1) - base;
            self.maps.push(Map { program: Arc::clone(map), scale: program.entry(token, &inputs, at), X });
        }
    }

    /// B and G at a point.
    #[inline(always)]
    pub fn field(&self, x: Vec3<L>) -> (Vec3<L>, Mat3<L>) {
        let (mut B, mut G) = (self.B0 + self.G * (x - self.origin), self.G);
        for dipole in &self.dipoles {
            B = B + dipole.B(x - dipole.X);
            G = G + dipole.G(x - dipole.X);
        }
        for map in &self.maps {
            let local = map.local(x, 2);
            (B, G) = (B + local.B * map.scale, G + local.G * map.scale);
        }
        (B, G)
    }

    /// B at a point and the force on a dipole there, but for what maps add.
    #[inline(always)]
    pub fn acts(&self, x: Vec3<L>, mu: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        let (mut B, mut F) = (self.B0 + self.G * (x - self.origin), self.G * mu);
        for dipole in &self.dipoles {
            let (of_B, of_F) = dipole.acts(x - dipole.X, mu);
            (B, F) = (B + of_B, F + of_F);
        }
        (B, F)
    }

    /// The same with what columns need for a dipole there; what each dipole of the field does is added to `kept`.
    #[inline(always)]
    pub fn local(&self, x: Vec3<L>, mu: Vec3<L>, kept: &mut Vec<Local<L>>) -> Local<L> {
        let (mut B, mut G) = (self.B0 + self.G * (x - self.origin), self.G);
        let mut T3 = Mat3::zero(x.x);
        for dipole in &self.dipoles {
            let r = x - dipole.X;
            let of_dipole = dipole.all(r, mu);
            (B, G, T3) = (B + of_dipole.B, G + of_dipole.G, T3 + of_dipole.T3);
            kept.push(of_dipole);
        }
        for map in &self.maps {
            let local = map.local(x, 3);
            (B, G) = (B + local.B * map.scale, G + local.G * map.scale);
            T3 = T3 + local.T3(mu) * map.scale;
        }
        Local { B, G, T3 }
    }

    /// How far a point where the field acts is inside of every map; negative outside.
    #[inline(always)]
    pub fn inside(&self, x: Vec3<L>, least: L) -> L {
        let mut least = least;
        for map in &self.maps {
            least = map.inside(x, least);
        }
        least
    }

    /// Distance of a straight piece to the nearest dipole beyond its clearance.
    #[inline(always)]
    pub fn clearance(&self, from: Vec3<L>, to: Vec3<L>) -> L {
        let mut least = from.x.constant(FAR);
        let (zero, one) = (least.constant(0.0), least.constant(1.0));
        let along = to - from;
        let per = one / dot(along, along).max(least.constant(TINY));
        for dipole in &self.dipoles {
            let r = from - dipole.X;
            let away = match &dipole.form {
                SourceForm::Cylinder(cylinder) => cylinder::distance(cylinder, dipole.M, r, along),
                SourceForm::Cuboid(cuboid) => cuboid::distance(cuboid, dipole.edges, r, along),
                SourceForm::Point => {
                    let share = (-dot(r, along) * per).max(zero).min(one);
                    let nearest = axpy(share, along, r);
                    dot(nearest, nearest).sqrt()
                }
            };
            least = least.min(away - dipole.clearance);
        }
        least
    }
}
