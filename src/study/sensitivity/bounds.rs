//! Bounds of total indices by slopes: ST ≤ C ⟨(∂f/∂x)²⟩ / V (Sobol' and Kucherenko 2009; Lamboni and others 2013).
//!
//! C is Poincaré's constant of the input's law: (b - a)²/π² of a uniform one, σ² of a normal one. Of any other it is 1/λ
//! with λ the least eigenvalue above zero of -(ρu')' = λρu with free ends (Roustant, Barthe, Iooss 2017).

use std::f64::consts::PI;

/// Cells of the interval on which the equation of a law is solved.
const CELLS: usize = 4000;

/// Of a uniform law over a range.
pub fn poincare_uniform(from: f64, to: f64) -> f64 {
    ((to - from) / PI).powi(2)
}

/// Of a normal law.
pub fn poincare_normal(standard_deviation: f64) -> f64 {
    standard_deviation.powi(2)
}

/// Poincaré's constant of a law that is uniform in the logarithm, between ends of one sign.
pub fn poincare_log_uniform(from: f64, to: f64) -> f64 {
    // In t = ln |x| the law is uniform and a slope by x is 1/x that by t.
    let (a, b) = (from.abs().min(to.abs()).ln(), from.abs().max(to.abs()).ln());
    // Sizes by the larger end, or powers of large numbers overflow.
    b.exp().powi(2) * inverse_eigenvalue(a - b, 0.0, |_| 1.0, |t| (-2.0 * t).exp())
}

/// Of a law with a positive density over a range, known up to a factor.
pub fn poincare_constant(from: f64, to: f64, density: impl Fn(f64) -> f64) -> f64 {
    inverse_eigenvalue(from, to, &density, &density)
}

/// 1/λ of the least λ above zero with -(su')' = λρu and free ends.
///
/// Linear elements; the eigenvalue comes by inverse iteration on what is orthogonal to the constants.
fn inverse_eigenvalue(from: f64, to: f64, density: impl Fn(f64) -> f64, stiffness: impl Fn(f64) -> f64) -> f64 {
    let h = (to - from) / CELLS as f64;
    let middle = |k: usize| from + (k as f64 + 0.5) * h;
    let rho: Vec<f64> = (0..CELLS).map(|k| density(middle(k))).collect();
    // The flux su' of a solution is the running integral of ρf: no system has to be solved.
    let weight = |k: usize| 0.5 * h * (if k > 0 { rho[k - 1] } else { 0.0 } + rho.get(k).copied().unwrap_or(0.0));
    let total: f64 = (0..=CELLS).map(weight).sum();
    let mut u: Vec<f64> = (0..=CELLS).map(|k| k as f64 / CELLS as f64 - 0.5).collect();
    let mut constant = 0.0;
    for _ in 0..200 {
        let mean = (0..=CELLS).map(|k| weight(k) * u[k]).sum::<f64>() / total;
        u.iter_mut().for_each(|u| *u -= mean);
        let norm = (0..=CELLS).map(|k| weight(k) * u[k] * u[k]).sum::<f64>().sqrt();
        u.iter_mut().for_each(|u| *u /= norm);
        let (mut flux, mut next) = (0.0, vec![0.0; CELLS + 1]);
        for k in 0..CELLS {
            flux -= weight(k) * u[k];
            next[k + 1] = next[k] + h * flux / stiffness(middle(k));
        }
        let mean = (0..=CELLS).map(|k| weight(k) * next[k]).sum::<f64>() / total;
        let found: f64 = (0..=CELLS).map(|k| weight(k) * (next[k] - mean) * u[k]).sum();
        let change = (found - constant).abs();
        (constant, u) = (found, next);
        if change < 1e-13 * constant {
            break;
        }
    }
    constant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_laws_have_their_constants() {
        let uniform = poincare_constant(-1.0, 3.0, |_| 0.25);
        assert!((uniform / poincare_uniform(-1.0, 3.0) - 1.0).abs() < 1e-6, "{uniform}");
        let normal = poincare_constant(-16.0, 16.0, |x| (-0.5 * (x / 2.0) * (x / 2.0)).exp());
        assert!((normal / poincare_normal(2.0) - 1.0).abs() < 1e-4, "{normal}");
        // Cut at one standard deviation: λ = 1/constant by a shooting solution of u'' - x u' + λ u = 0.
        let cut = poincare_constant(-1.0, 1.0, |x| (-0.5 * x * x).exp());
        assert!(cut < poincare_uniform(-1.0, 1.0) && cut > 0.3, "{cut}");
        // Nearly uniform over a narrow range; by the general equation over a wide one; the same for both signs.
        let narrow = poincare_log_uniform(1.0, 1.001);
        assert!((narrow / poincare_uniform(1.0, 1.001) - 1.0).abs() < 1e-3, "{narrow}");
        let (wide, general) = (poincare_log_uniform(2.0, 6.0), poincare_constant(2.0, 6.0, |x| 1.0 / x));
        assert!((wide / general - 1.0).abs() < 1e-6, "{wide} {general}");
        assert_eq!(poincare_log_uniform(-6.0, -2.0), wide);
        let triangle = poincare_constant(0.0, 1.0, |x| x);
        // (xu')' = -λxu: Bessel's functions, λ = j₁,₁².
        assert!((triangle * 3.831_705_970_207_512f64.powi(2) - 1.0).abs() < 1e-5, "{triangle}");
    }
}
