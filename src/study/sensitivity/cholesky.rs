//! Symmetric positive semidefinite systems, by Cholesky's method with pivots.

use nalgebra::DMatrix;

/// Pivots below this share of the largest count as zero.
const RANK: f64 = 1e-13;

/// Solves `a x = b` for several right sides. Unknowns that the system does not determine are zero.
pub(super) fn solve(mut a: DMatrix<f64>, mut b: DMatrix<f64>) -> DMatrix<f64> {
    let count = a.nrows();
    let mut order: Vec<usize> = (0..count).collect();
    let mut rank = count;
    let largest = (0..count).map(|k| a[(k, k)]).fold(0.0, f64::max);
    for k in 0..count {
        let pivot = (k..count).max_by(|i, j| a[(*i, *i)].total_cmp(&a[(*j, *j)])).unwrap_or(k);
        if a[(pivot, pivot)] <= RANK * largest {
            rank = k;
            break;
        }
        a.swap_rows(k, pivot);
        a.swap_columns(k, pivot);
        b.swap_rows(k, pivot);
        order.swap(k, pivot);
        let root = a[(k, k)].sqrt();
        a[(k, k)] = root;
        (k + 1..count).for_each(|i| a[(i, k)] /= root);
        for j in k + 1..count {
            let factor = a[(j, k)];
            (j..count).for_each(|i| {
                let product = a[(i, k)] * factor;
                a[(i, j)] -= product;
            });
        }
        // Pivots to come are looked for in the whole: keep the upper half in step.
        for j in k + 1..count {
            (j + 1..count).for_each(|i| a[(j, i)] = a[(i, j)]);
        }
    }
    let mut x = DMatrix::zeros(count, b.ncols());
    for column in 0..b.ncols() {
        let mut y = vec![0.0; rank];
        for i in 0..rank {
            y[i] = (b[(i, column)] - (0..i).map(|j| a[(i, j)] * y[j]).sum::<f64>()) / a[(i, i)];
        }
        for i in (0..rank).rev() {
            y[i] = (y[i] - (i + 1..rank).map(|j| a[(j, i)] * y[j]).sum::<f64>()) / a[(i, i)];
            x[(order[i], column)] = y[i];
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_solved_and_what_is_not_determined_is_zero() {
        let root = DMatrix::from_fn(7, 5, |i, j| ((3 * i * i + 7 * i * j + j * j) as f64).sin());
        let (a, x) = (root.transpose() * &root, DMatrix::from_fn(5, 2, |i, j| (i + 3 * j) as f64 - 2.0));
        assert!((solve(a.clone(), &a * &x) - &x).amax() < 1e-9);
        let double = root.clone().insert_column(5, 0.0);
        let double = DMatrix::from_fn(7, 6, |i, j| if j < 5 { double[(i, j)] } else { double[(i, 0)] });
        let a = double.transpose() * &double;
        let b = &a * DMatrix::from_fn(6, 1, |i, _| i as f64);
        let found = solve(a.clone(), b.clone());
        assert!((&a * &found - b).amax() < 1e-8 && (found[(0, 0)] == 0.0 || found[(5, 0)] == 0.0), "{found}");
    }
}
