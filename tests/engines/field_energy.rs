//! Rods in fields that vary in space by minimising their energy: no force, no moment, no gradient of the field. A chain of
//! helices, curvatures unknown, gradients by dual numbers.
#![allow(non_snake_case)]

use super::common::fields::cases;
use super::common::root;
use super::dual::Number;
use nalgebra::{Cholesky, DMatrix, DVector};
use num_dual::Dual64;
use rodsweep::input::read_scene;
use rodsweep::model::{CoilLoad, Rod, RodSegment, gradient_matrix};
use rodsweep::reference::solve_rod;

type V<D> = [D; 3];
/// Three points of Gauss' rule.
const LINE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

fn dot<D: Number>(a: V<D>, b: V<D>) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<D: Number>(a: V<D>, b: V<D>) -> V<D> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn combine<D: Number>(R: &[V<D>; 3], v: V<D>) -> V<D> {
    std::array::from_fn(|row| R[0][row] * v[0] + R[1][row] * v[1] + R[2][row] * v[2])
}

fn sum<D: Number>(a: V<D>, b: V<D>) -> V<D> {
    std::array::from_fn(|k| a[k] + b[k])
}

/// B at a point.
fn field<D: Number>(rod: &Rod, x: V<D>) -> V<D> {
    let field = rod.field.as_ref().expect("a field that varies");
    let G = gradient_matrix(field.gradient);
    let mut B: V<D> = std::array::from_fn(|row| {
        let linear: D = (0..3).map(|k| (x[k] - field.origin[k]) * G[row][k]).fold(D::from(0.0), |sum, y| sum + y);
        linear + rod.flux_density[row]
    });
    for dipole in &field.dipoles {
        let r: V<D> = std::array::from_fn(|k| x[k] - dipole.position[k]);
        let r2 = dot(r, r);
        let along = dot(r, dipole.moment.map(D::from)) * 3.0 / r2;
        let by = (r2 * r2.sqrt()).recip() * 1e-7;
        (0..3).for_each(|k| B[k] += (r[k] * along - dipole.moment[k]) * by);
    }
    B
}

/// Energy of a chain of helices, `u` one after the other, and its tip, the rod's dipoles at a share of their size.
fn energy<D: Number>(rod: &Rod, share: f64, elements: usize, u: &[D]) -> (D, V<D>) {
    let mut R: [V<D>; 3] = std::array::from_fn(|col| std::array::from_fn(|row| D::from(rod.base_rotation[row][col])));
    let mut p: V<D> = rod.base_position.map(D::from);
    let (mut energy, mut at) = (D::from(0.0), 0);
    for segment in &rod.segments {
        match segment {
            RodSegment::Flexible(flexible) => {
                let h = flexible.length / elements as f64;
                for _ in 0..elements {
                    let u: V<D> = std::array::from_fn(|k| u[at + k]);
                    at += 3;
                    let bent: V<D> = std::array::from_fn(|k| u[k] - flexible.rest_curvature[k]);
                    (0..3).for_each(|k| energy += bent[k] * bent[k] * (0.5 * h * flexible.stiffness[k]));
                    let v = u.map(|x| x * h);
                    // Series of sin(a)/a, (1 - cos(a))/a² and (a - sin(a))/a³: a is a fraction of a radian.
                    let a2 = dot(v, v);
                    let series = |n: f64| {
                        let (mut term, mut total) = (D::from(1.0), D::from(1.0));
                        for k in 1..7 {
                            let k = 2.0 * f64::from(k) + n;
                            term = -term * a2 / (k * (k - 1.0));
                            total += term;
                        }
                        total
                    };
                    let (a, b, c) = (series(1.0), series(2.0) * 0.5, series(3.0) / 6.0);
                    let turned = |e: V<D>, first: D, second: D| -> V<D> {
                        let once = cross(v, e);
                        let twice = cross(v, once);
                        std::array::from_fn(|k| e[k] + once[k] * first + twice[k] * second)
                    };
                    let unit = |k: usize| -> V<D> { std::array::from_fn(|row| D::from(f64::from(u8::from(row == k)))) };
                    p = sum(p, combine(&R, turned(unit(2), b, c)).map(|x| x * h));
                    R = [0, 1, 2].map(|k| combine(&R, turned(unit(k), a, b)));
                }
            }
            RodSegment::Rigid(rigid) => {
                let mu = combine(&R, rigid.dipole.map(|x| D::from(x * share)));
                let load = rod.field.as_ref().map_or(CoilLoad::Middle, |field| field.coil_load);
                let points = if load == CoilLoad::Middle { &[(0.5, 1.0)][..] } else { &LINE };
                for (xi, weight) in points {
                    energy -= dot(mu, field(rod, sum(p, R[2].map(|x| x * (*xi * rigid.length))))) * *weight;
                }
                p = sum(p, R[2].map(|x| x * rigid.length));
            }
        }
    }
    (energy, p)
}

/// A chain whose energy is asked for by all its curvatures.
pub struct Chain<'a> {
    pub rod: &'a Rod,
    /// Helices of a flexible segment.
    pub elements: usize,
}

impl Chain<'_> {
    /// As the rod is without loads.
    pub fn rest(&self) -> Vec<f64> {
        let flexible = self.rod.segments.iter().filter_map(|segment| match segment {
            RodSegment::Flexible(flexible) => Some(flexible),
            RodSegment::Rigid(_) => None,
        });
        flexible.flat_map(|s| s.rest_curvature.repeat(self.elements)).collect()
    }

    /// Slope of the energy, the rod's dipoles at a share of their size.
    pub fn gradient(&self, share: f64, u: &[f64]) -> DVector<f64> {
        let slope = |k: usize| {
            let seeded = |(j, x): (usize, &f64)| Dual64::new(*x, f64::from(u8::from(j == k)));
            energy(self.rod, share, self.elements, &u.iter().enumerate().map(seeded).collect::<Vec<_>>()).0.eps
        };
        DVector::from_iterator(u.len(), (0..u.len()).map(slope))
    }

    pub fn hessian(&self, share: f64, u: &[f64]) -> DMatrix<f64> {
        let h = 1e-3;
        let column = |k: usize| {
            let at = |by: f64| {
                let mut moved = u.to_vec();
                moved[k] += by;
                self.gradient(share, &moved)
            };
            (at(h) - at(-h)) / (2.0 * h)
        };
        let columns: Vec<_> = (0..u.len()).map(column).collect();
        let hessian = DMatrix::from_columns(&columns);
        0.5 * (&hessian + hessian.transpose())
    }

    pub fn tip(&self, u: &[f64]) -> [f64; 3] {
        energy(self.rod, 1.0, self.elements, u).1
    }
}

/// Tip of least energy, led there by growing dipoles and Newton's method; its Hessian must have a Cholesky factor.
fn least(rod: &Rod, elements: usize) -> [f64; 3] {
    let chain = Chain { rod, elements };
    let mut u = chain.rest();
    const LOADS: usize = 40;
    for load in 1..=LOADS {
        let share = load as f64 / LOADS as f64;
        for _ in 0..if load == LOADS { 5 } else { 1 } {
            let factor = Cholesky::new(chain.hessian(share, &u)).expect("a stable rod");
            let step = factor.solve(&-chain.gradient(share, &u));
            u.iter_mut().zip(step.iter()).for_each(|(u, step)| *u += step);
        }
    }
    chain.tip(&u)
}

/// The arm's magnet near pull-in, and golden scenes; two meshes and their extrapolation, of fourth order.
#[test]
fn the_least_energy_is_where_the_reference_is() {
    let mut arm = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("a good scene");
    arm.sources.magnets[0].position[0] = 0.115;
    let mut rods = vec![("arm".to_owned(), arm.rod())];
    for case in cases().into_iter().filter(|case| case.scene.name.starts_with("golden-dipole-1 ")) {
        rods.push((case.scene.name.clone(), case.scene.rod()));
    }
    for (name, rod) in rods {
        let found = solve_rod(&rod, &[]);
        assert!(found.status.is_success() && found.index == 0, "{name}: {:?}", found.status);
        let (coarse, fine) = (least(&rod, 12), least(&rod, 24));
        let off =
            |tip: [f64; 3]| (0..3).map(|k| (tip[k] - found.p_tip[k]).powi(2)).sum::<f64>().sqrt() / rod.total_length();
        let extrapolated = std::array::from_fn(|k| (4.0 * fine[k] - coarse[k]) / 3.0);
        let errors = [off(coarse), off(fine), off(extrapolated)];
        println!("{name}: {errors:?}, margin {}", found.margin);
        assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.02 * errors[1] && errors[2] < 2e-6, "{name}: {errors:?}");
    }
}
