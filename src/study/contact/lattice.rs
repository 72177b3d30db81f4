//! Points on a wall about equally far apart, in a flat chart: squares of a plane, an unrolled cylinder, rings about a pole of a sphere.

use super::rows::{across, cross, dot};
use crate::model::{RodWall, Surface, Vector};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Lattices grow from coarse to fine: the first spacing over the last.
const COARSEST: f64 = 16.0;
/// Points nearer than so many spacings are neighbours.
const NEAR: f64 = 1.6;

/// A wall with its points where the rod's end is when the tip touches.
#[derive(Clone, Debug)]
pub struct WallLattice {
    /// Of the wall.
    pub surface: Surface,
    /// Distance of neighbours, about (m).
    pub spacing: f64,
    /// Of each point (m).
    pub points: Vec<Vector>,
    /// Of each point, towards where the rod is.
    pub normals: Vec<Vector>,
    /// Area that each point stands for (m²).
    pub areas: Vec<f64>,
    /// Names of both coordinates of the chart.
    pub axes: [String; 2],
    /// Of each point: column and row of a plane and a cylinder, ring and place in it of a sphere.
    keys: Vec<[i32; 2]>,
    places: HashMap<[i32; 2], usize>,
    chart: Chart,
}

/// How keys lie in flat coordinates.
#[derive(Clone, Copy, Debug)]
enum Chart {
    /// Columns and rows; coordinates of the middle (m).
    Grid { middle: [f64; 2] },
    /// Rings from the pole, in the middle.
    Rings { radius: f64, rings: i32, step: f64 },
}

/// What a lattice is made for.
pub(super) struct Region {
    /// A point of the wall in the middle (m).
    pub middle: Vector,
    /// Base of the rod, and how far from it the tip can be (m).
    pub base: Vector,
    pub reach: f64,
    /// How far from the middle along the wall points are wanted (m).
    pub extent: Option<f64>,
}

impl WallLattice {
    /// Points of a wall, and how many there would be at most, which the caller has found small enough.
    pub(super) fn new(wall: &RodWall, spacing: f64, region: &Region) -> WallLattice {
        let mut lattice = WallLattice {
            surface: wall.kind.surface,
            spacing,
            points: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
            axes: ["u".into(), "v".into()],
            keys: Vec::new(),
            places: HashMap::new(),
            chart: Chart::Grid { middle: [0.0; 2] },
        };
        match wall.kind.surface {
            Surface::Plane => lattice.plane(wall, region),
            Surface::Cylinder => lattice.cylinder(wall, region),
            Surface::Sphere => lattice.sphere(wall, region),
        }
        lattice.places = lattice.keys.iter().copied().enumerate().map(|(at, key)| (key, at)).collect();
        lattice
    }

    /// How many points there would be, about.
    pub(super) fn expected(wall: &RodWall, spacing: f64, region: &Region) -> f64 {
        let flat = region.extent.map_or(2.0 * region.reach, |extent| 2.0 * extent.min(2.0 * region.reach));
        let radius = rounded_radius(wall);
        let area = match wall.kind.surface {
            Surface::Plane => flat * flat,
            Surface::Cylinder => flat.min(TAU * radius) * flat,
            Surface::Sphere => (flat * flat).min(4.0 * PI * radius * radius),
        };
        area / (spacing * spacing)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    fn add(&mut self, wall: &RodWall, region: &Region, key: [i32; 2], point: Vector, area: f64) {
        if distance(point, region.base) <= region.reach {
            self.points.push(point);
            self.normals.push(wall.gap(point).normal);
            self.areas.push(area);
            self.keys.push(key);
        }
    }

    /// Steps to each side of the middle.
    fn steps(&self, region: &Region) -> i32 {
        let most = region.extent.unwrap_or(f64::INFINITY).min(2.0 * region.reach);
        (most / self.spacing + 1e-9).floor() as i32
    }

    fn plane(&mut self, wall: &RodWall, region: &Region) {
        let normal = wall.axis;
        let directions = in_plane(normal);
        self.axes = std::array::from_fn(|k| axis_name(directions[k], ["u", "v"][k]));
        let middle = directions.map(|t| dot(t, region.middle));
        self.chart = Chart::Grid { middle };
        let steps = self.steps(region);
        for row in -steps..=steps {
            for column in -steps..=steps {
                let [u, v] = [column, row].map(|k| f64::from(k) * self.spacing);
                let point = moved(region.middle, [(directions[0], u), (directions[1], v)]);
                self.add(wall, region, [column, row], point, self.spacing * self.spacing);
            }
        }
    }

    fn cylinder(&mut self, wall: &RodWall, region: &Region) {
        let (axis, radius) = (wall.axis, rounded_radius(wall));
        let around = (TAU * radius / self.spacing).round().max(3.0) as i32;
        let step = TAU * radius / f64::from(around);
        self.axes = ["around".into(), "along".into()];
        let steps = self.steps(region);
        let along = dot(difference(region.middle, wall.position), axis);
        let foot = moved(wall.position, [(axis, along), (axis, 0.0)]);
        let arm = difference(region.middle, foot);
        let size = dot(arm, arm).sqrt();
        let first = arm.map(|x| x / size);
        let second = cross(axis, first);
        let half = (around / 2).min(steps);
        // A whole turn has no seam: the point opposite stands once.
        let from = if 2 * half >= around { 1 - half } else { -half };
        for row in -steps..=steps {
            let middle = moved(foot, [(axis, f64::from(row) * self.spacing), (axis, 0.0)]);
            for column in from..=half {
                let angle = f64::from(column) * step / radius;
                let point = moved(middle, [(first, radius * angle.cos()), (second, radius * angle.sin())]);
                self.add(wall, region, [column, row], point, step * self.spacing);
            }
        }
    }

    fn sphere(&mut self, wall: &RodWall, region: &Region) {
        let radius = rounded_radius(wall);
        let rings = (PI * radius / self.spacing).round().max(2.0) as i32;
        let step = PI / f64::from(rings);
        self.axes = ["from the middle, u".into(), "v".into()];
        self.chart = Chart::Rings { radius, rings, step };
        let arm = difference(region.middle, wall.position);
        let size = dot(arm, arm).sqrt();
        let pole = arm.map(|x| x / size);
        let [first, second] = across(pole);
        let last = region.extent.map_or(rings, |extent| ((extent / radius / step) + 1e-9).floor().min(1e9) as i32);
        for ring in 0..=last.min(rings) {
            let angle = f64::from(ring) * step;
            let count = ring_count(ring, rings, step);
            let [inner, outer] = [angle - 0.5 * step, angle + 0.5 * step].map(|x| x.clamp(0.0, PI));
            let area = TAU * radius * radius * (inner.cos() - outer.cos()) / f64::from(count);
            for place in 0..count {
                let turn = f64::from(place) * TAU / f64::from(count);
                let out = radius * angle.sin();
                let middle = moved(wall.position, [(pole, radius * angle.cos()), (pole, 0.0)]);
                let point = moved(middle, [(first, out * turn.cos()), (second, out * turn.sin())]);
                self.add(wall, region, [ring, place], point, area);
            }
        }
    }

    /// A raster of the chart: its lower left corner (m), columns, and the point that each square shows, row by row from below.
    pub fn raster(&self) -> ([f64; 2], usize, Vec<Option<usize>>) {
        let bounds = |k: usize| {
            let all = self.keys.iter().map(|key| key[k]);
            all.fold((i32::MAX, i32::MIN), |(low, high), at| (low.min(at), high.max(at)))
        };
        let ([(left, right), (bottom, top)], middle) = match self.chart {
            Chart::Rings { .. } => ([(-bounds(0).1, bounds(0).1); 2], [0.0; 2]),
            Chart::Grid { middle } => ([bounds(0), bounds(1)], middle),
        };
        let corner = |k: usize| middle[k] + (f64::from([left, bottom][k]) - 0.5) * self.spacing;
        let squares = (bottom..=top).flat_map(|row| (left..=right).map(move |column| [column, row]));
        let squares = squares.map(|square| self.places.get(&self.key(square)?).copied()).collect();
        ([corner(0), corner(1)], (right - left + 1).max(0) as usize, squares)
    }

    /// Of the point nearest to the middle of a square.
    fn key(&self, square: [i32; 2]) -> Option<[i32; 2]> {
        let Chart::Rings { radius, rings, step } = self.chart else { return Some(square) };
        let [u, v] = square.map(|k| f64::from(k) * self.spacing);
        let ring = (u.hypot(v) / radius / step).round() as i32;
        let count = ring_count(ring, rings, step);
        let place = (v.atan2(u).rem_euclid(TAU) / TAU * f64::from(count)).round() as i32;
        (ring <= rings).then(|| [ring, place.rem_euclid(count)])
    }

    /// Points in groups, coarse ones first: each group with those before it fills the wall twice as densely.
    pub(super) fn groups(&self) -> Vec<Vec<usize>> {
        let mut groups = Vec::new();
        let mut is_taken = vec![false; self.len()];
        let mut edge = COARSEST * self.spacing;
        while edge > 0.75 * self.spacing {
            let is_last = edge < 1.5 * self.spacing;
            let mut cells: std::collections::HashSet<[i64; 3]> = std::collections::HashSet::new();
            let taken = (0..self.len()).filter(|at| is_taken[*at]).map(|at| cell(self.points[at], edge));
            cells.extend(taken);
            let mut group = Vec::new();
            for (at, is_taken) in is_taken.iter_mut().enumerate() {
                if !*is_taken && (cells.insert(cell(self.points[at], edge)) || is_last) {
                    *is_taken = true;
                    group.push(at);
                }
            }
            groups.push(group);
            edge *= 0.5;
        }
        groups
    }

    /// Points near others.
    pub(super) fn neighbours(&self) -> Neighbours<'_> {
        Neighbours::new(self, &(0..self.len()).collect::<Vec<_>>(), NEAR * self.spacing)
    }

    /// The same among some of them, within a distance (m).
    pub(super) fn among(&self, some: &[usize], within: f64) -> Neighbours<'_> {
        Neighbours::new(self, some, within)
    }
}

/// Finds points by their place.
pub(super) struct Neighbours<'a> {
    lattice: &'a WallLattice,
    within: f64,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl<'a> Neighbours<'a> {
    fn new(lattice: &'a WallLattice, some: &[usize], within: f64) -> Self {
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for at in some {
            cells.entry(cell(lattice.points[*at], within)).or_default().push(*at);
        }
        Self { lattice, within, cells }
    }

    /// Those near a point, the nearest first, without itself.
    pub(super) fn of(&self, at: usize) -> Vec<usize> {
        let point = self.lattice.points[at];
        let own = cell(point, self.within);
        let mut near = Vec::new();
        for k in 0..27 {
            let cell = [own[0] + k % 3 - 1, own[1] + k / 3 % 3 - 1, own[2] + k / 9 - 1];
            for other in self.cells.get(&cell).into_iter().flatten().filter(|other| **other != at) {
                let far = distance(point, self.lattice.points[*other]);
                if far <= self.within {
                    near.push((far, *other));
                }
            }
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(_, other)| other).collect()
    }
}

/// Radius of the surface on which the rod's end is when its ball touches (m).
fn rounded_radius(wall: &RodWall) -> f64 {
    if wall.kind.outside { wall.radius + wall.tip_radius } else { wall.radius - wall.tip_radius }
}

/// Points of a ring about as far apart as rings are.
fn ring_count(ring: i32, rings: i32, step: f64) -> i32 {
    if ring <= 0 || ring >= rings {
        return 1;
    }
    ((TAU * (f64::from(ring) * step).sin() / step).round() as i32).max(1)
}

/// Two directions along a plane: axes of the world where the plane has them.
fn in_plane(normal: Vector) -> [Vector; 2] {
    let k = (0..3).max_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs())).unwrap_or(2);
    // Across z: x and y; across x: y and z; across y: x and z.
    let first = if k == 0 { 1 } else { 0 };
    let second = if k == 2 { 1 } else { 2 };
    let axis = |k: usize| -> Vector { std::array::from_fn(|a| f64::from(u8::from(a == k))) };
    let flat = |v: Vector, away: &[Vector]| -> Vector {
        let v = away.iter().fold(v, |v, n| {
            let along = dot(v, *n);
            std::array::from_fn(|a| v[a] - along * n[a])
        });
        let size = dot(v, v).sqrt();
        v.map(|x| x / size)
    };
    let u = flat(axis(first), &[normal]);
    [u, flat(axis(second), &[normal, u])]
}

/// x, y or z for a direction along such an axis.
fn axis_name(direction: Vector, other: &str) -> String {
    let along = (0..3).find(|k| direction[*k] > 1.0 - 1e-12);
    along.map_or(other, |k| ["x", "y", "z"][k]).to_owned()
}

fn cell(point: Vector, edge: f64) -> [i64; 3] {
    point.map(|x| (x / edge + 1e-6).floor() as i64)
}

fn moved(from: Vector, by: [(Vector, f64); 2]) -> Vector {
    std::array::from_fn(|a| from[a] + by[0].0[a] * by[0].1 + by[1].0[a] * by[1].1)
}

fn difference(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

fn distance(a: Vector, b: Vector) -> f64 {
    let d = difference(a, b);
    dot(d, d).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{Region, WallLattice};
    use crate::model::{Side, TipOnWall, Wall, WallShape};

    fn wall(shape: WallShape) -> Wall {
        Wall {
            shape,
            position: [0.0, 0.0, 0.08],
            rotation: [0.0; 3],
            tip_radius: 0.001,
            stiffness: None,
            friction: None,
            tip: TipOnWall::Slides,
        }
    }

    fn lattice(shape: WallShape, extent: Option<f64>) -> WallLattice {
        let wall = wall(shape).rod_wall();
        let middle = wall.foot([0.001, 0.002, 0.1]);
        WallLattice::new(&wall, 1e-3, &Region { middle, base: [0.0; 3], reach: 1.0, extent })
    }

    #[test]
    fn points_lie_on_the_wall_and_fill_it() {
        let plane = lattice(WallShape::Plane { normal: [0.0, 0.0, -1.0] }, Some(0.03));
        assert_eq!((plane.len(), plane.raster().1, plane.raster().2.len()), (61 * 61, 61, 61 * 61));
        assert_eq!(plane.axes, ["x", "y"]);
        let sphere = lattice(WallShape::Sphere { radius: 0.021, side: Side::Inside }, None);
        let area: f64 = sphere.areas.iter().sum();
        assert!((area / (4.0 * std::f64::consts::PI * 0.02f64.powi(2)) - 1.0).abs() < 1e-12, "{area}");
        let axis = [1.0, 0.0, 0.0];
        let cylinder = lattice(WallShape::Cylinder { axis, radius: 0.019, side: Side::Outside }, Some(0.005));
        assert_eq!(cylinder.len(), 11 * 11);
        for (lattice, shape) in [
            (&plane, WallShape::Plane { normal: [0.0, 0.0, -1.0] }),
            (&sphere, WallShape::Sphere { radius: 0.021, side: Side::Inside }),
            (&cylinder, WallShape::Cylinder { axis, radius: 0.019, side: Side::Outside }),
        ] {
            let wall = wall(shape).rod_wall();
            let off = lattice.points.iter().map(|point| wall.gap(*point).gap.abs()).fold(0.0, f64::max);
            assert!(off < 1e-15, "{off}");
            let mut order: Vec<usize> = lattice.groups().concat();
            assert!(lattice.groups().len() > 3);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..lattice.len()));
            let near = lattice.neighbours();
            assert!((0..lattice.len()).all(|at| near.of(at).len() >= 2));
            let mut seen: Vec<usize> = lattice.raster().2.into_iter().flatten().collect();
            seen.sort_unstable();
            seen.dedup();
            assert!(seen.len() * 10 > lattice.len() * 9, "{} of {}", seen.len(), lattice.len());
        }
    }
}
