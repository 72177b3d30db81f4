//! Elastic stability in a field that varies: the second variation of the energy, by collocation of the curvature's
//! variation at Gauss points. No constraint is left, so that its index is a count of negative eigenvalues. F8

use super::contact::Hold;
use super::elimination::{CARRIED, Elimination, FROM_BASE, Piece};
use super::flexible::Flexible;
use super::rigid;
use super::state::{BaseLoad, State, Varying};
use crate::reference::extrapolation::Extrapolation;
use nalgebra::{DMatrix, DMatrixView, DVector, Matrix3, Matrix3xX, Vector3};

/// Elements of a rod of one flexible segment, and Gauss points of each.
const ELEMENTS: f64 = 3.0;
/// Elements are split so often before a rod counts as unstable: where loads are large it bends within little.
const FINER: [usize; 2] = [1, 3];
const POINTS: usize = 6;
/// Abscissae on [0, 1].
const GAUSS: [f64; POINTS] = [
    0.033_765_242_898_423_99,
    0.169_395_306_766_867_74,
    0.380_690_406_958_401_55,
    0.619_309_593_041_598_5,
    0.830_604_693_233_132_3,
    0.966_234_757_101_576,
];

/// What was found on the way along the rod.
pub(super) struct Stability {
    /// `None` for a second variation that is not finite.
    second_variation: Option<Elimination>,
    /// How far the tip may move before any part of the rod is within a magnet's clearance, if each moves in proportion to its share of
    /// the rod. Negative where one is.
    pub leeway: f64,
    /// How far the rod's dipoles are inside of every map.
    pub inside: f64,
}

impl Stability {
    /// The least eigenvalue. `None` where the rod is unstable, or its second variation is not finite.
    pub fn least_eigenvalue(&self) -> Option<f64> {
        self.second_variation.as_ref()?.least_eigenvalue()
    }

    /// Negative eigenvalues. `None` for a second variation that is not finite.
    pub fn index(&self) -> Option<usize> {
        self.second_variation.as_ref().map(Elimination::index)
    }
}

/// Linear forms of what a piece is told from the base and of its own unknowns, at one place: rotation, displacement, and the
/// displacement on which forces do work: without the force arm rigid segments do not add to it.
#[derive(Clone)]
struct Forms {
    w: Matrix3xX<f64>,
    dp: Matrix3xX<f64>,
    at_work: Matrix3xX<f64>,
}

impl Forms {
    /// Where a piece with so many unknowns starts.
    fn at_start(unknowns: usize) -> Self {
        let form = |first: usize| {
            let mut form = Matrix3xX::zeros(CARRIED + unknowns);
            form.fixed_view_mut::<3, 3>(0, first).fill_with_identity();
            form
        };
        Self { w: form(0), dp: form(3), at_work: form(6) }
    }

    /// All of them, one below the other.
    fn joined(&self) -> DMatrix<f64> {
        let mut rows = DMatrix::zeros(FROM_BASE, self.w.ncols());
        for (k, form) in [&self.w, &self.dp, &self.at_work].into_iter().enumerate() {
            rows.rows_mut(3 * k, 3).copy_from(form);
        }
        rows
    }
}

/// Weights by which values at Gauss points integrate to each of them and, last, to the end.
fn integration() -> [[f64; POINTS]; POINTS + 1] {
    // Lagrange's polynomials, integrated exactly by the coefficients of their products.
    let mut rows = [[0.0; POINTS]; POINTS + 1];
    for j in 0..POINTS {
        let mut coefficients = vec![1.0];
        for k in (0..POINTS).filter(|k| *k != j) {
            let scale = 1.0 / (GAUSS[j] - GAUSS[k]);
            let mut next = vec![0.0; coefficients.len() + 1];
            for (power, c) in coefficients.iter().enumerate() {
                next[power + 1] += c * scale;
                next[power] -= c * scale * GAUSS[k];
            }
            coefficients = next;
        }
        for (i, row) in rows.iter_mut().enumerate() {
            let end = GAUSS.get(i).copied().unwrap_or(1.0);
            row[j] = coefficients.iter().enumerate().map(|(k, c)| c * end.powi(k as i32 + 1) / (k + 1) as f64).sum();
        }
    }
    rows
}

/// Elements of each segment: its share of the rod's length or compliance, and none of a rigid one.
fn elements(rod: &Varying) -> Vec<usize> {
    let chain = &rod.chain;
    let bends = |j: usize| chain.is_flexible[j] && chain.numbers.segments[j].length > 0.0;
    let sizes: Vec<[f64; 2]> = (0..chain.is_flexible.len())
        .map(|j| match bends(j) {
            true => {
                let length = chain.numbers.segments[j].length;
                let flexible = Flexible::new(rod, j, &[]);
                let softest =
                    [0.0, 0.5, 1.0].map(|at| flexible.K(at * length).min()).into_iter().fold(f64::INFINITY, f64::min);
                [length, length / softest]
            }
            false => [0.0; 2],
        })
        .collect();
    let all = sizes.iter().fold([0.0; 2], |all, of| [all[0] + of[0], all[1] + of[1]]);
    let share = |of: &[f64; 2]| (of[0] / all[0]).max(of[1] / all[1]);
    sizes.iter().map(|of| if of[0] > 0.0 { (ELEMENTS * share(of) - 1e-9).ceil() as usize } else { 0 }).collect()
}

fn hat(v: Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// a . (w x (w x b)) as a quadratic form in w.
fn turned(a: Vector3<f64>, b: Vector3<f64>) -> Matrix3<f64> {
    0.5 * (a * b.transpose() + b * a.transpose()) - a.dot(&b) * Matrix3::identity()
}

/// A sum of `left^T form right`, of which the symmetric part counts.
struct Sum {
    /// Elastic energy of each unknown, twice.
    elastic: DVector<f64>,
    /// Rows of `left` and of `form right`, one after the other.
    left: Vec<f64>,
    right: Vec<f64>,
}

impl Sum {
    fn zero(unknowns: usize) -> Self {
        Self { elastic: DVector::zeros(unknowns), left: Vec::new(), right: Vec::new() }
    }

    fn add(&mut self, left: &Matrix3xX<f64>, form: Matrix3<f64>, right: &Matrix3xX<f64>) {
        let by = form * right;
        for k in 0..3 {
            self.left.extend(left.row(k).iter());
            self.right.extend(by.row(k).iter());
        }
    }

    /// The piece, at whose end the forms are these. The square of its unknowns is their elastic energy.
    fn piece(&self, end: &Forms) -> Piece {
        let count = end.w.ncols();
        let rows = self.left.len() / count;
        let of = |rows_of: &[f64]| DMatrixView::from_slice(rows_of, count, rows).into_owned();
        let q = of(&self.left) * of(&self.right).transpose();
        let mut form = 0.5 * (&q + q.transpose());
        let mut onward = end.joined();
        for (k, energy) in self.elastic.iter().enumerate() {
            let (at, scale) = (CARRIED + k, 1.0 / energy.sqrt());
            form.column_mut(at).scale_mut(scale);
            form.row_mut(at).scale_mut(scale);
            form[(at, at)] += 1.0;
            onward.column_mut(at).scale_mut(scale);
        }
        Piece { form, onward }
    }
}

/// A dipole at a place: how its energy changes to second order, twice. F8
fn add_dipole(q: &mut Sum, rod: &Varying, x: Vector3<f64>, mu: Vector3<f64>, forms: &Forms) {
    let field = &rod.field;
    q.add(&forms.w, -turned(field.B(x), mu), &forms.w);
    q.add(&forms.dp, field.G(x) * hat(mu), &forms.w);
    q.add(&forms.at_work, field.G(x) * hat(mu), &forms.w);
    q.add(&forms.at_work, -field.T3(x, mu), &forms.dp);
}

/// Stability of an equilibrium, its tip free or held; `None` where the rod cannot be integrated. A rod that seems unstable is looked at
/// on finer elements.
pub(super) fn stability(
    rod: &Varying,
    base: &BaseLoad,
    hold: Option<&Hold>,
    integrator: &mut Extrapolation,
) -> Option<Stability> {
    let mut found = None;
    for split in FINER {
        found = Some(on_elements(rod, base, hold, split, integrator)?);
        if found.as_ref().is_some_and(|found| found.index() == Some(0)) {
            break;
        }
    }
    found
}

/// Stability by elements that are split into so many.
fn on_elements(
    rod: &Varying,
    base: &BaseLoad,
    hold: Option<&Hold>,
    split: usize,
    integrator: &mut Extrapolation,
) -> Option<Stability> {
    let chain = &rod.chain;
    let elements: Vec<usize> = elements(rod).into_iter().map(|count| split * count).collect();
    let shears = chain.numbers.segments.iter().any(|segment| segment.C_se != Vector3::zeros());
    let per_point = if shears { 6 } else { 3 };
    let rules = integration();
    let mut pieces = Vec::new();
    let mut state = rod.base_state(base, &[]);
    let (mut leeway, mut travelled) = (f64::INFINITY, 0.0);
    let mut last = state.p;
    let mut near = |last: &mut Vector3<f64>, state: &State| {
        travelled += (state.p - *last).norm();
        leeway = leeway.min(rod.field.clearance(*last, state.p) / travelled);
        *last = state.p;
    };
    let mut inside = f64::INFINITY;
    for (j, &elements) in elements.iter().enumerate() {
        let is_magnetic = chain.numbers.segments[j].mu != Vector3::zeros();
        if is_magnetic {
            inside = inside.min(rod.field.inside(state.p));
        }
        if !chain.is_flexible[j] {
            pieces.push(rigid_piece(rod, j, &state));
            rigid::cross(rod, j, &[], &mut state);
            near(&mut last, &state);
            if is_magnetic {
                inside = inside.min(rod.field.inside(state.p));
            }
            continue;
        }
        let length = chain.numbers.segments[j].length;
        if length <= 0.0 {
            continue;
        }
        let flexible = Flexible::new(rod, j, &[]);
        let h = length / elements as f64;
        for element in 0..elements {
            let start = element as f64 * h;
            let mut states = Vec::with_capacity(POINTS);
            let mut s = start;
            for place in GAUSS {
                flexible.advance(integrator, s, start + place * h, &mut state).ok()?;
                s = start + place * h;
                near(&mut last, &state);
                if is_magnetic {
                    inside = inside.min(rod.field.inside(state.p));
                }
                states.push((s, state.clone()));
            }
            flexible.advance(integrator, s, start + h, &mut state).ok()?;
            pieces.push(flexible_piece(rod, (&flexible, j), h, &states, per_point, &rules));
        }
        near(&mut last, &state);
        if is_magnetic {
            inside = inside.min(rod.field.inside(state.p));
        }
    }
    let second_variation = Elimination::new(pieces, hold);
    Some(Stability { second_variation, leeway: leeway * travelled, inside })
}

/// The work of the field and of all forces beyond on a rigid segment.
fn rigid_piece(rod: &Varying, j: usize, state: &State) -> Piece {
    let (mut q, mut forms) = (Sum::zero(0), Forms::at_start(0));
    let segment = rod.chain.numbers.segments[j];
    let t: Vector3<f64> = state.R.column(2).into();
    let mu = state.R * segment.mu;
    let load = if segment.follows { state.R * segment.load } else { segment.load };
    if segment.follows {
        // The symmetric part of what it works as it turns. F11
        q.add(&forms.at_work, hat(load), &forms.w);
    }
    let mut end = state.n - load;
    let mut lever = 0.5 * load;
    let has_arm = rod.chain.rigid_force_arm;
    for (xi, share) in &rod.field.places(state.p, segment.length * t) {
        let x = state.p + xi * segment.length * t;
        let force = *share * (rod.field.G(x) * mu);
        end -= force;
        lever += *xi * force;
        let by_arm = -hat(*xi * segment.length * t) * &forms.w;
        let at_work = if has_arm { &forms.at_work + &by_arm } else { forms.at_work.clone() };
        add_dipole(&mut q, rod, x, *share * mu, &Forms { w: forms.w.clone(), dp: &forms.dp + by_arm, at_work });
    }
    let by_arm = -hat(segment.length * t) * &forms.w;
    forms.dp += &by_arm;
    if has_arm {
        q.add(&forms.w, -segment.length * turned(end + lever, t), &forms.w);
        forms.at_work += by_arm;
    }
    q.piece(&forms)
}

/// One element, with so many unknowns a point.
fn flexible_piece(
    rod: &Varying,
    (flexible, j): (&Flexible, usize),
    h: f64,
    states: &[(f64, State)],
    per_point: usize,
    rules: &[[f64; POINTS]; POINTS + 1],
) -> Piece {
    let numbers = rod.chain.numbers.segments[j];
    let unknowns = POINTS * per_point;
    let count = CARRIED + unknowns;
    let (mut q, mut forms) = (Sum::zero(unknowns), Forms::at_start(unknowns));
    let root = numbers.C_se.map(f64::sqrt);
    let slope = |k: usize| {
        let mut slope = Matrix3xX::zeros(count);
        slope.view_mut((0, CARRIED + k * per_point), (3, 3)).copy_from(&states[k].1.R);
        slope
    };
    // R d(nu), by unknowns whose square is the energy.
    let strain = |k: usize| {
        let mut strain = Matrix3xX::zeros(count);
        if per_point == 6 {
            let by = states[k].1.R * Matrix3::from_diagonal(&root);
            strain.view_mut((0, CARRIED + k * per_point + 3), (3, 3)).copy_from(&by);
        }
        strain
    };
    let slopes: Vec<_> = (0..POINTS).map(slope).collect();
    let strains: Vec<_> = (0..POINTS).map(strain).collect();
    let sum = |row: usize, of: &[Matrix3xX<f64>]| {
        of.iter().zip(rules[row]).fold(Matrix3xX::zeros(count), |sum, (form, weight)| sum + form * (h * weight))
    };
    let w: Vec<_> = (0..POINTS).map(|i| &forms.w + sum(i, &slopes)).collect();
    let velocity = |k: usize| flexible.velocity(&states[k].1.R, states[k].1.n);
    let dp_slopes: Vec<_> = (0..POINTS).map(|k| -(hat(velocity(k)) * &w[k]) + &strains[k]).collect();
    for i in 0..POINTS {
        let (s, state) = &states[i];
        let weight = h * rules[POINTS][i];
        let at = i * per_point;
        let K = flexible.K(*s);
        for k in 0..3 {
            q.elastic[at + k] = weight * K[k];
            if per_point == 6 {
                q.elastic[at + 3 + k] = weight;
            }
        }
        let m = state.R * state.m_body;
        q.add(&slopes[i], -weight * hat(m), &w[i]);
        q.add(&w[i], -weight * turned(state.n, velocity(i)), &w[i]);
        // -2 n . (w x R d(nu))
        q.add(&w[i], 2.0 * weight * hat(state.n), &strains[i]);
        if numbers.mu != Vector3::zeros() {
            let moved = sum(i, &dp_slopes);
            let there = Forms { w: w[i].clone(), dp: &forms.dp + &moved, at_work: &forms.at_work + moved };
            add_dipole(&mut q, rod, state.p, weight * (state.R * numbers.mu), &there);
        }
    }
    forms.w += sum(POINTS, &slopes);
    let moved = sum(POINTS, &dp_slopes);
    forms.dp += &moved;
    forms.at_work += moved;
    q.piece(&forms)
}
