//! Elimination against a dense solve.

use super::{L, Random, lane, matrix};
use crate::cpu::algebra::Mat3;
use crate::cpu::multiple_shooting::elimination::Elimination;
use crate::cpu::multiple_shooting::interval::Transfer;
use nalgebra::{DMatrix, Matrix3};

#[test]
fn elimination_is_a_dense_solve() {
    const COUNT: usize = 9;
    let (mut random, one) = (Random(7), lane(1.0));
    let none = Mat3::zero(one);
    let mut transfer = || {
        let [a, b, c, d] = [(); 4].map(|()| random.matrix());
        Transfer { a, b, c, d, dp_w: none, dp_mu: none, length: one, bends: true }
    };
    let transfers: Vec<Transfer<L>> = (0..COUNT).map(|_| transfer()).collect();
    let defects: Vec<_> = (0..COUNT).map(|_| (random.matrix(), random.matrix())).collect();
    let [s_tip, g_tip, w_base] = [(); 3].map(|()| random.matrix());

    // w_0 = w_base; then each interval: w = a w + b mu + e_w, mu = c w + d mu + e_mu; last mu = s w + g at the tip.
    let size = 6 * (COUNT + 1);
    let mut A = DMatrix::<f64>::zeros(size, size);
    let mut right = DMatrix::<f64>::zeros(size, 3);
    let mut put = |row: usize, column: usize, m: Matrix3<f64>| A.view_mut((row, column), (3, 3)).copy_from(&m);
    put(0, 0, Matrix3::identity());
    right.view_mut((0, 0), (3, 3)).copy_from(&matrix(w_base));
    for (i, (Transfer { a, b, c, d, .. }, (e_w, e_mu))) in transfers.iter().zip(&defects).enumerate() {
        let (row, here, next) = (3 + 6 * i, 6 * i, 6 * i + 6);
        for (part, from_w, from_mu, e) in [(0, a, b, e_w), (3, c, d, e_mu)] {
            put(row + part, here, -matrix(*from_w));
            put(row + part, here + 3, -matrix(*from_mu));
            put(row + part, next + part, Matrix3::identity());
            right.view_mut((row + part, 0), (3, 3)).copy_from(&matrix(*e));
        }
    }
    put(size - 3, size - 6, -matrix(s_tip));
    put(size - 3, size - 3, Matrix3::identity());
    right.view_mut((size - 3, 0), (3, 3)).copy_from(&matrix(g_tip));
    let dense = A.lu();
    let expected = dense.solve(&right).expect("regular");
    let mut of_moment = DMatrix::<f64>::zeros(size, 3);
    of_moment.view_mut((size - 3, 0), (3, 3)).copy_from(&Matrix3::identity());
    let by_moment = dense.solve(&of_moment).expect("regular");

    let mut elimination = Elimination::new(one);
    elimination.factor(&transfers, s_tip);
    let mut changes = Vec::new();
    elimination.solve(&transfers, |i| Some(defects[i]), g_tip, w_base, &mut changes);
    assert_eq!(changes.len(), COUNT + 1);
    let close = |what: &str, found: Mat3<L>, of: &DMatrix<f64>, row: usize| {
        let off = (matrix(found) - of.view((row, 0), (3, 3))).amax();
        assert!(off <= 1e-10 * of.amax(), "{what}: {off:e} of {:e}", of.amax());
    };
    for (node, (w, mu)) in changes.into_iter().enumerate() {
        close("w", w, &expected, 6 * node);
        close("mu", mu, &expected, 6 * node + 3);
    }
    // A moment of one at the tip asks for W^-1 at the base.
    close("W^-1", elimination.w_inverse, &by_moment, 3);
}
