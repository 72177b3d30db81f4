//! The field at a point: B, its gradient G, and the second derivatives that columns need. F0, F1, F6
//!
//! In the units of the chain, positions from the base; the constant mu0 / 4 pi is one there.

use super::map::Map;
use crate::model::{CoilLoad, Cuboid, Cylinder, RodField, Slot, SourceForm, Units, gradient_matrix, other_axes};
use crate::reference::chain::matrix;
use nalgebra::{Matrix3, Vector3};

/// Gauss and Legendre's points and weights on [-1, 1], those on one side.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// The length of a piece of a rigid segment over the distance of the nearest dipole: the rule leaves 1e-13 of a dipole's force.
const PIECE: f64 = 0.5;
/// Pieces of a stretch at most.
const MOST_PIECES: f64 = 256.0;

/// A dipole outside of the rod, or its change.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dipole {
    pub X: Vector3<f64>,
    pub M: Vector3<f64>,
    pub clearance: f64,
    /// Its form; a cylinder lies along M.
    pub form: SourceForm,
}

/// B0 + G (x - x0) + the fields of dipoles.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub B0: Vector3<f64>,
    pub G: Matrix3<f64>,
    pub origin: Vector3<f64>,
    pub dipoles: Vec<Dipole>,
    /// Fields sampled on a grid.
    pub maps: Vec<Map>,
    /// Points of a rigid segment where the field acts, as shares of its length, and their shares of its dipole: see
    /// [`places`](Field::places).
    rule: Vec<(f64, f64)>,
}

/// How numbers of the field change; B0 is a number of the chain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FieldChange {
    dG: Matrix3<f64>,
    dorigin: Vector3<f64>,
    /// One dipole of the field.
    of_dipole: Option<(usize, Dipole)>,
    /// A rotation of the edges of one dipole that is a cuboid.
    of_edges: Option<(usize, Vector3<f64>)>,
    /// Scale and position of one map.
    of_map: Option<(usize, f64, Vector3<f64>)>,
}

impl Dipole {
    /// B at a distance r from it.
    fn B(&self, r: Vector3<f64>) -> Vector3<f64> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return cylinder.field(self.M.into(), r.into()).0.into(),
            SourceForm::Cuboid(cuboid) => return cuboid.field(self.M.into(), r.into()).0.into(),
            SourceForm::Point => {}
        }
        let r2 = r.norm_squared();
        (3.0 * self.M.dot(&r) / r2 * r - self.M) / (r2 * r2.sqrt()) // F0
    }

    /// The gradient of its field.
    fn G(&self, r: Vector3<f64>) -> Matrix3<f64> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return matrix(&cylinder.field(self.M.into(), r.into()).1),
            SourceForm::Cuboid(cuboid) => return matrix(&cuboid.field(self.M.into(), r.into()).1),
            SourceForm::Point => {}
        }
        let (M, r2) = (self.M, r.norm_squared());
        let b = M.dot(&r);
        let symmetric = M * r.transpose() + r * M.transpose() + b * Matrix3::identity();
        (symmetric - r * r.transpose() * (5.0 * b / r2)) * (3.0 / (r2 * r2 * r2.sqrt()))
    }

    /// Second derivatives of mu . B.
    fn T3(&self, r: Vector3<f64>, mu: Vector3<f64>) -> Matrix3<f64> {
        match &self.form {
            SourceForm::Cylinder(cylinder) => return self.T3_of_cylinder(cylinder, r, mu),
            SourceForm::Cuboid(cuboid) => return self.T3_of_cuboid(cuboid, r, mu),
            SourceForm::Point => {}
        }
        let (M, r2) = (self.M, r.norm_squared());
        let (a, b, c) = (mu.dot(&r), M.dot(&r), mu.dot(&M));
        let one = Matrix3::identity();
        let outer = |x: Vector3<f64>, y: Vector3<f64>| x * y.transpose() + y * x.transpose();
        let first = outer(mu, M) + c * one;
        let second = outer(b * mu + a * M, r) + a * b * one + c * r * r.transpose();
        (3.0 * first - second * (15.0 / r2) + r * r.transpose() * (105.0 * a * b / (r2 * r2))) / (r2 * r2 * r2.sqrt())
    }

    /// Second derivatives of mu . B of a cylinder, summed from the third derivatives of its potential. F12
    fn T3_of_cylinder(&self, cylinder: &Cylinder, r: Vector3<f64>, mu: Vector3<f64>) -> Matrix3<f64> {
        let axis = self.M.normalize();
        let z = axis.dot(&r);
        let q = r - z * axis;
        let of = cylinder.slopes(q.norm_squared(), z);
        let across = Matrix3::identity() - axis * axis.transpose();
        let (u, nu) = (across * mu, axis.dot(&mu));
        let c = q.dot(&u);
        let outer = |x: Vector3<f64>, y: Vector3<f64>| x * y.transpose() + y * x.transpose();
        let in_plane = 4.0 * of.ss * (across * c + outer(q, u)) + 8.0 * of.sss * c * q * q.transpose();
        let with_axis = nu * (2.0 * of.sz * across + 4.0 * of.ssz * q * q.transpose());
        let mixed = 2.0 * of.sz * u + (4.0 * of.ssz * c + 2.0 * of.szz * nu) * q;
        let along = (2.0 * of.szz * c + of.zzz * nu) * axis * axis.transpose();
        -self.M.norm() * (in_plane + with_axis + outer(mixed, axis) + along)
    }

    /// Second derivatives of mu . B of a cuboid: the fourth of the mean of 1 / r over its volume, times both moments. F13
    fn T3_of_cuboid(&self, cuboid: &Cuboid, r: Vector3<f64>, mu: Vector3<f64>) -> Matrix3<f64> {
        let axes = matrix(&cuboid.axes());
        let (u, v) = (axes * self.M, axes * mu);
        let of = cuboid.derivatives((axes * r).into());
        // The entry of four indices, by how often each axis is among them.
        let entry = |indices: [usize; 4]| {
            let times = [0, 1, 2].map(|axis| indices.iter().filter(|index| **index == axis).count());
            let most = (0..3).max_by_key(|axis| times[*axis]).unwrap_or(0);
            let [j, k] = other_axes(most);
            let other = if times[j] > 0 { j } else { k };
            match times[most] {
                4 => of.iiii[most],
                3 => of.iiij[most][other],
                _ if times[j] == 1 => of.iijk[most],
                _ => of.iijj[3 - most - other],
            }
        };
        let all =
            |a: usize, b: usize| -> f64 { (0..9).map(|n| entry([a, b, n / 3, n % 3]) * u[n / 3] * v[n % 3]).sum() };
        axes.transpose() * Matrix3::from_fn(all) * axes
    }

    /// Distance of a straight piece from it, or from the surface of its form.
    fn distance(&self, from: Vector3<f64>, along: Vector3<f64>) -> f64 {
        let r = from - self.X;
        match &self.form {
            SourceForm::Cylinder(cylinder) => {
                let axis = self.M.normalize().into();
                return least_on(|share| cylinder.distance(axis, (r + share * along).into()));
            }
            SourceForm::Cuboid(cuboid) => return least_on(|share| cuboid.distance((r + share * along).into())),
            SourceForm::Point => {}
        }
        let share = (-r.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (r + share * along).norm()
    }

    /// Changes of B and of the force on mu at a distance r by a change of the moment; a cylinder turns with its moment, a cuboid does not.
    fn by_moment(&self, dM: Vector3<f64>, r: Vector3<f64>, mu: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        if !matches!(self.form, SourceForm::Cylinder(_)) {
            let grown = Self { M: dM, ..*self };
            return (grown.B(r), grown.G(r) * mu);
        }
        let (size, axis) = (self.M.norm(), self.M.normalize());
        let (grows, w) = (axis.dot(&dM) / size, axis.cross(&dM) / size);
        let (B, G) = (self.B(r), self.G(r));
        let F = G * mu;
        // Turned, it has the field that it had, turned.
        let dB = w.cross(&B) - G * w.cross(&r);
        let dF = w.cross(&F) - G * w.cross(&mu) - self.T3(r, mu) * w.cross(&r);
        (grows * B + dB, grows * F + dF)
    }
}

impl Field {
    pub(super) fn new(field: &RodField, B0: Vector3<f64>, base: Vector3<f64>, units: &Units) -> Self {
        let place = |p: [f64; 3]| (Vector3::from(p) - base) / units.length;
        let dipole = |dipole: &crate::model::FieldDipole| Dipole {
            X: place(dipole.position),
            M: Vector3::from(dipole.moment) / units.source_moment(),
            clearance: dipole.clearance / units.length,
            form: dipole.form.scaled(units.length),
        };
        let line = || {
            let each = |(x, weight): &(f64, f64)| [-1.0, 1.0].map(|side| (0.5 + 0.5 * side * x, 0.5 * weight));
            GAUSS.iter().flat_map(each).collect()
        };
        let G = gradient_matrix(field.gradient);
        Self {
            B0,
            G: Matrix3::from_fn(|row, col| G[row][col] / units.gradient()),
            origin: place(field.origin),
            dipoles: field.dipoles.iter().map(dipole).collect(),
            maps: field.maps.iter().map(|map| Map::new(map, base, units)).collect(),
            rule: if field.coil_load == CoilLoad::Middle { vec![(0.5, 1.0)] } else { line() },
        }
    }

    /// Points of a rigid segment that begins at `p` and extends by `arm`, as shares of its length, and their shares of its dipole:
    /// those of the rule on each stretch on which no map passes from cell to cell, cut into pieces that are short beside how far sources
    /// are. The middle alone is one point. F9
    pub(super) fn places(&self, p: Vector3<f64>, arm: Vector3<f64>) -> Vec<(f64, f64)> {
        if self.rule.len() == 1 {
            return self.rule.clone();
        }
        let mut ends = vec![0.0, 1.0];
        self.maps.iter().for_each(|map| ends.extend(map.faces(p, arm)));
        ends.sort_by(f64::total_cmp);
        let far = self.distance(p, arm);
        let on = |pair: &[f64]| {
            let (from, whole) = (pair[0], pair[1] - pair[0]);
            let pieces = (arm.norm() * whole / (PIECE * far)).ceil().clamp(1.0, MOST_PIECES);
            let length = whole / pieces;
            let starts = (0..pieces as usize).map(move |piece| from + piece as f64 * length);
            starts.flat_map(move |from| self.rule.iter().map(move |(at, share)| (from + at * length, share * length)))
        };
        ends.windows(2).flat_map(on).collect()
    }

    pub(super) fn B(&self, x: Vector3<f64>) -> Vector3<f64> {
        let of_dipoles: Vector3<f64> = self.dipoles.iter().map(|d| d.B(x - d.X)).sum();
        let of_maps: Vector3<f64> = self.maps.iter().map(|map| map.scale * map.B(x)).sum();
        self.B0 + self.G * (x - self.origin) + of_dipoles + of_maps
    }

    pub(super) fn G(&self, x: Vector3<f64>) -> Matrix3<f64> {
        let of_maps: Matrix3<f64> = self.maps.iter().map(|map| map.scale * map.G(x)).sum();
        self.G + self.dipoles.iter().map(|dipole| dipole.G(x - dipole.X)).sum::<Matrix3<f64>>() + of_maps
    }

    pub(super) fn T3(&self, x: Vector3<f64>, mu: Vector3<f64>) -> Matrix3<f64> {
        let of_maps: Matrix3<f64> = self.maps.iter().map(|map| map.scale * map.T3(x, mu)).sum();
        of_maps + self.dipoles.iter().map(|dipole| dipole.T3(x - dipole.X, mu)).sum::<Matrix3<f64>>()
    }

    /// dB and dG mu at a point that stands still.
    pub(super) fn change(
        &self,
        x: Vector3<f64>,
        mu: Vector3<f64>,
        change: &FieldChange,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let mut dB = change.dG * (x - self.origin) - self.G * change.dorigin;
        let mut dF = change.dG * mu;
        if let Some((k, d)) = change.of_dipole {
            let dipole = self.dipoles[k];
            let r = x - dipole.X;
            let (by_B, by_F) = dipole.by_moment(d.M, r, mu);
            dB += by_B - dipole.G(r) * d.X;
            dF += by_F - dipole.T3(r, mu) * d.X;
        }
        if let Some((k, w)) = change.of_edges {
            let dipole = self.dipoles[k];
            let r = x - dipole.X;
            let (B, G) = (dipole.B(r), dipole.G(r));
            // Turned with its moment it has the field that it had, turned; then its moment goes back.
            let (by_B, by_F) = dipole.by_moment(w.cross(&dipole.M), r, mu);
            dB += w.cross(&B) - G * w.cross(&r) - by_B;
            dF += w.cross(&(G * mu)) - G * w.cross(&mu) - dipole.T3(r, mu) * w.cross(&r) - by_F;
        }
        if let Some((k, scale, dX)) = change.of_map {
            let map = &self.maps[k];
            dB += scale * map.B(x) - map.scale * map.G(x) * dX;
            dF += scale * map.G(x) * mu - map.scale * map.T3(x, mu) * dX;
        }
        (dB, dF)
    }

    /// How far a point where the field acts is inside of every map; infinite without maps.
    pub(super) fn inside(&self, x: Vector3<f64>) -> f64 {
        self.maps.iter().map(|map| map.inside(x)).fold(f64::INFINITY, f64::min)
    }

    /// Distance of a straight piece to the nearest dipole beyond its clearance; infinite without dipoles.
    pub(super) fn clearance(&self, from: Vector3<f64>, to: Vector3<f64>) -> f64 {
        let beyond = |dipole: &Dipole| dipole.distance(from, to - from) - dipole.clearance;
        self.dipoles.iter().map(beyond).fold(f64::INFINITY, f64::min)
    }

    /// Distance of a straight piece to the nearest dipole; infinite without dipoles.
    fn distance(&self, from: Vector3<f64>, along: Vector3<f64>) -> f64 {
        self.dipoles.iter().map(|dipole| dipole.distance(from, along)).fold(f64::INFINITY, f64::min)
    }
}

/// The least distance on a straight piece: along a line that of what is convex has one least value.
fn least_on(at: impl Fn(f64) -> f64) -> f64 {
    const CUTS: usize = 40;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..CUTS {
        let third = (high - low) / 3.0;
        if at(low + third) < at(high - third) { high -= third } else { low += third }
    }
    at(0.5 * (low + high))
}

impl FieldChange {
    /// Unit change of a slot.
    pub(super) fn of(slot: Slot) -> Self {
        let mut change = Self::default();
        let unit = |axis: crate::model::Axis| Vector3::ith(axis.index(), 1.0);
        match slot {
            Slot::FieldGradient(entry) => {
                let mut entries = [0.0; 5];
                entries[entry.index()] = 1.0;
                let rows = gradient_matrix(entries);
                change.dG = Matrix3::from_fn(|row, col| rows[row][col]);
            }
            Slot::FieldOrigin(axis) => change.dorigin = unit(axis),
            Slot::SourcePosition(k, axis) => {
                change.of_dipole = Some((k, Dipole { X: unit(axis), ..Dipole::default() }))
            }
            Slot::SourceMoment(k, axis) => change.of_dipole = Some((k, Dipole { M: unit(axis), ..Dipole::default() })),
            Slot::SourceTurn(k, axis) => change.of_edges = Some((k, unit(axis))),
            Slot::MapScale(k) => change.of_map = Some((k, 1.0, Vector3::zeros())),
            Slot::MapPosition(k, axis) => change.of_map = Some((k, 0.0, unit(axis))),
            _ => {}
        }
        change
    }
}
