//! A second variation, piece by piece: its index and its least eigenvalue by eliminating the unknowns of each piece, from the tip to the
//! base. F8
//!
//! A piece is told rotation and displacements where it starts. What lies beyond it is a quadratic form of the same where it ends. So
//! its unknowns are eliminated by a matrix of their number, and signs add up (Sylvester, Haynsworth): the work grows with the number of
//! pieces, not with its cube.

use super::contact::Hold;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3xX, SymmetricEigen};

/// Numbers that a piece is told from the base: rotation, displacement, displacement on which forces do work.
pub(super) const FROM_BASE: usize = 9;
/// Forces of a wall at most; they are the same for all pieces.
const FORCES: usize = 3;
/// Columns of a form before those of the piece's unknowns: numbers from the base, then forces of the wall.
pub(super) const CARRIED: usize = FROM_BASE + FORCES;
/// Steps to the least eigenvalue; two digits will do.
const ITERATIONS: usize = 12;

/// The second variation of a piece of the rod.
pub(super) struct Piece {
    /// Twice its energy, by what is carried and by its unknowns, whose square is the elastic energy: the identity on them at rest.
    pub form: DMatrix<f64>,
    /// Rotation and displacements at its end, by the same.
    pub onward: DMatrix<f64>,
}

impl Piece {
    fn unknowns(&self) -> usize {
        self.form.ncols() - CARRIED
    }

    /// Carried on to the next piece.
    fn carried(&self) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(CARRIED, self.form.ncols());
        all.rows_mut(0, FROM_BASE).copy_from(&self.onward);
        all.fixed_view_mut::<FORCES, FORCES>(FROM_BASE, FROM_BASE).fill_with_identity();
        all
    }
}

/// A piece whose unknowns are eliminated.
struct Eliminated {
    carried: DMatrix<f64>,
    /// Inverse of the form of its unknowns and all beyond.
    inverse: DMatrix<f64>,
    /// That form's entries by one of its unknowns and one of what is carried.
    cross: DMatrix<f64>,
}

/// A direction in which the wall holds the tip.
struct Held {
    /// The change of all unknowns that moves the tip along it: a unit vector.
    way: DVector<f64>,
    /// Compliance against the rod's own.
    compliance: f64,
}

/// The second variation, eliminated.
pub(super) struct Elimination {
    /// From the tip to the base.
    pieces: Vec<Eliminated>,
    held: Vec<Held>,
    /// The form of the wall's forces that is left.
    of_forces: DMatrix<f64>,
    index: usize,
}

impl Elimination {
    /// Pieces from base to tip, the tip free or held. `None` where they are not finite.
    pub(super) fn new(pieces: Vec<Piece>, hold: Option<&Hold>) -> Option<Self> {
        // The form of all beyond, by what is carried.
        let mut beyond = DMatrix::zeros(CARRIED, CARRIED);
        let mut held = Vec::new();
        if let Some(hold) = hold {
            beyond.fixed_view_mut::<3, 3>(3, 3).copy_from(&hold.curvature);
            held = hold_at_tip(&mut beyond, &tip(&pieces), hold)?;
        }
        let mut index = 0;
        let mut eliminated = Vec::with_capacity(pieces.len());
        for piece in pieces.into_iter().rev() {
            let (carried, unknowns) = (piece.carried(), piece.unknowns());
            let form = piece.form + carried.tr_mul(&beyond) * &carried;
            let (inverse, negative) = inverted(form.view((CARRIED, CARRIED), (unknowns, unknowns)).into_owned())?;
            let cross = form.view((CARRIED, 0), (unknowns, CARRIED)).into_owned();
            let left = form.view((0, 0), (CARRIED, CARRIED)) - cross.tr_mul(&(&inverse * &cross));
            beyond = 0.5 * (&left + left.transpose());
            index += negative;
            eliminated.push(Eliminated { carried, inverse, cross });
        }
        let of_forces = beyond.view((FROM_BASE, FROM_BASE), (held.len(), held.len())).into_owned();
        let (of_forces, negative) = inverted(of_forces)?;
        // Each force adds a negative eigenvalue of its own.
        let index = (index + negative).saturating_sub(held.len());
        Some(Self { pieces: eliminated, held, of_forces, index })
    }

    /// Negative eigenvalues.
    pub(super) fn index(&self) -> usize {
        self.index
    }

    /// The least eigenvalue, by inverse iteration. `None` where one is negative.
    pub(super) fn least_eigenvalue(&self) -> Option<f64> {
        if self.index > 0 {
            return None;
        }
        let count = self.pieces.iter().map(|piece| piece.inverse.ncols()).sum();
        let mut way = DVector::from_element(count, 1.0).normalize();
        let mut least = f64::INFINITY;
        for _ in 0..ITERATIONS {
            way = self.solve(way);
            least = 1.0 / way.norm();
            way *= least;
        }
        Some(least)
    }

    /// The unknowns that the second variation takes to these, its inverse, from the forms with the wall's forces.
    ///
    /// A direction q in which the wall gives way by c times the rod's own compliance adds q q^T / c. With that of q shrunk by
    /// sqrt(c / (1 + c)), which changes no sign, the sum is the identity at rest, finite, and for c = 0 the form on all that does not
    /// move the tip.
    fn solve(&self, mut given: DVector<f64>) -> DVector<f64> {
        let shrunk = |held: &Held| (held.compliance * (1.0 + held.compliance)).sqrt();
        let along: Vec<f64> = self.held.iter().map(|held| held.way.dot(&given)).collect();
        for (held, along) in self.held.iter().zip(&along) {
            given.axpy(-along, &held.way, 1.0);
        }
        let gaps = self.held.iter().zip(&along).map(|(held, along)| shrunk(held) * along);
        let gaps = DVector::from_iterator(self.held.len(), gaps);
        let (mut found, forces) = self.with_forces(&given, &gaps);
        for ((held, along), force) in self.held.iter().zip(&along).zip(forces.iter()) {
            let now = held.way.dot(&found);
            found.axpy(shrunk(held) * force + (1.0 + held.compliance) * along - now, &held.way, 1.0);
        }
        found
    }

    /// Unknowns and forces of the wall by their right-hand sides.
    fn with_forces(&self, given: &DVector<f64>, gaps: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let mut found = DVector::zeros(given.len());
        let mut pull = DVector::zeros(CARRIED);
        pull.rows_mut(FROM_BASE, gaps.len()).copy_from(&-gaps);
        let mut first = given.len();
        for piece in &self.pieces {
            let unknowns = piece.inverse.ncols();
            first -= unknowns;
            let pulled = piece.carried.tr_mul(&pull);
            let own = &piece.inverse * (given.rows(first, unknowns) - pulled.rows(CARRIED, unknowns));
            pull = pulled.rows(0, CARRIED) + piece.cross.tr_mul(&own);
            found.rows_mut(first, unknowns).copy_from(&own);
        }
        let forces = -(&self.of_forces * pull.rows(FROM_BASE, gaps.len()));
        let mut state = DVector::zeros(CARRIED);
        state.rows_mut(FROM_BASE, forces.len()).copy_from(&forces);
        for piece in self.pieces.iter().rev() {
            let unknowns = piece.inverse.ncols();
            let mut own = found.rows_mut(first, unknowns);
            own -= &piece.inverse * (&piece.cross * &state);
            state = piece.carried.columns(0, CARRIED) * &state + piece.carried.columns(CARRIED, unknowns) * &own;
            first += unknowns;
        }
        (found, forces)
    }
}

/// Eigenvalues of a symmetric matrix; `None` for one that is not finite, on which the decomposition would not end.
fn eigen(form: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    const MOST_ITERATIONS: usize = 2000;
    let is_finite = form.iter().all(|x| x.is_finite());
    is_finite.then(|| SymmetricEigen::try_new(form, f64::EPSILON, MOST_ITERATIONS))?
}

/// The inverse of a symmetric matrix, and how many of its eigenvalues are negative.
fn inverted(form: DMatrix<f64>) -> Option<(DMatrix<f64>, usize)> {
    if let Some(factors) = Cholesky::new(form.clone()) {
        return Some((factors.inverse(), 0));
    }
    let eigen = eigen(form)?;
    let negative = eigen.eigenvalues.iter().filter(|value| **value < 0.0).count();
    let by = DMatrix::from_diagonal(&eigen.eigenvalues.map(f64::recip));
    Some((&eigen.eigenvectors * by * eigen.eigenvectors.transpose(), negative))
}

/// The tip's displacement by all unknowns.
fn tip(pieces: &[Piece]) -> Matrix3xX<f64> {
    let mut of_tip = Matrix3xX::zeros(pieces.iter().map(Piece::unknowns).sum());
    let mut by_end = Matrix3xX::zeros(FROM_BASE);
    by_end.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    let mut first = of_tip.ncols();
    for piece in pieces.iter().rev() {
        let unknowns = piece.unknowns();
        first -= unknowns;
        of_tip.columns_mut(first, unknowns).copy_from(&(&by_end * piece.onward.columns(CARRIED, unknowns)));
        by_end = &by_end * piece.onward.columns(0, FROM_BASE);
    }
    of_tip
}

/// Adds the wall's forces to the form beyond the tip: one in each direction of the wall in which the rod can move it, across each
/// other.
fn hold_at_tip(beyond: &mut DMatrix<f64>, dp: &Matrix3xX<f64>, hold: &Hold) -> Option<Vec<Held>> {
    /// The tip does not move that way: a square against the largest.
    const STILL: f64 = 1e-24;
    let directions = Matrix3xX::from_columns(&hold.directions);
    let rows = directions.tr_mul(dp);
    let eigen = eigen(&rows * rows.transpose())?;
    let least = STILL * dp.norm_squared();
    let moving = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(size, _)| **size > least);
    let mut held = Vec::new();
    for (k, (size, share)) in moving.enumerate() {
        let at = FROM_BASE + k;
        let (scale, compliance) = (1.0 / size.sqrt(), hold.compliance / size);
        let direction = scale * (&directions * share);
        beyond.fixed_view_mut::<3, 1>(3, at).copy_from(&direction);
        beyond.fixed_view_mut::<1, 3>(at, 3).copy_from(&direction.transpose());
        beyond[(at, at)] = -compliance;
        held.push(Held { way: scale * rows.tr_mul(&share), compliance });
    }
    Some(held)
}
