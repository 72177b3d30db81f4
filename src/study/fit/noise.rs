//! How smooth the observed points are along the rod, and whether a fit lies further off than that.

use crate::spec::{ObservedShape, ObservedShapes};

/// Residuals beyond so many times the noise are a misfit.
const BEYOND: f64 = 5.0;
/// Models differ from rods: a misfit against the points' own smoothness is at least this share of the length ...
const LEAST_MISFIT: f64 = 1e-3;
/// ... and one of this share needs no noise to compare with.
const GROSS_MISFIT: f64 = 0.05;
/// Orders of differences, and windows of points that an order needs.
const ORDERS: std::ops::RangeInclusive<usize> = 3..=8;
const LEAST_WINDOWS: usize = 3;

/// Standard deviation of a coordinate (m) from divided differences along the arc length: the least over their orders, an upper
/// bound where points are sparse. `None`: too few points along a rod.
pub(super) fn noise_of_points(observed: &ObservedShapes, length: f64) -> Option<f64> {
    let of_order = |order: usize| {
        let squares: Vec<f64> =
            observed.shapes.iter().flat_map(|shape| squared_differences(shape, order, length)).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        (squares.len() >= 3 * LEAST_WINDOWS).then(|| mean.sqrt())
    };
    ORDERS.filter_map(of_order).min_by(f64::total_cmp)
}

/// Squares whose expectation is the variance of a coordinate, where the true line is a polynomial of a lower order.
fn squared_differences(shape: &ObservedShape, order: usize, length: f64) -> Vec<f64> {
    let mut points: Vec<_> =
        shape.points.iter().map(|p| (p.arc_length.unwrap_or(length) / length, p.position)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_spread = |window: &&[(f64, [f64; 3])]| window.windows(2).all(|pair| pair[1].0 - pair[0].0 > 1e-6);
    let of = |window: &[(f64, [f64; 3])]| {
        let weight = |i: usize| -> f64 {
            (0..window.len()).filter(|j| *j != i).map(|j| 1.0 / (window[i].0 - window[j].0)).product()
        };
        let weights: Vec<f64> = (0..window.len()).map(weight).collect();
        let scale: f64 = weights.iter().map(|weight| weight * weight).sum();
        let difference = |a: usize| weights.iter().zip(window).map(|(weight, (_, p))| weight * p[a]).sum::<f64>();
        [0, 1, 2].map(|a| difference(a).powi(2) / scale)
    };
    points.windows(order + 1).filter(is_spread).flat_map(of).collect()
}

/// Sum of the angles (rad) between the base's tangent and the chords from point to point, the largest over the shapes. A single
/// point counts twice, as an arc does.
pub(super) fn bend(observed: &ObservedShapes, base: [f64; 3], tangent: [f64; 3]) -> f64 {
    let of = |shape: &ObservedShape| {
        let mut points: Vec<_> =
            shape.points.iter().map(|p| (p.arc_length.unwrap_or(f64::INFINITY), p.position)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut at, mut along, mut sum, mut last) = (base, tangent, 0.0, 0.0);
        for (_, position) in points {
            let chord: [f64; 3] = std::array::from_fn(|a| position[a] - at[a]);
            let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let size = (dot(&chord, &chord) * dot(&along, &along)).sqrt();
            if size > 0.0 {
                last = (dot(&chord, &along) / size).clamp(-1.0, 1.0).acos();
                sum += last;
                (at, along) = (position, chord);
            }
        }
        sum + last
    };
    observed.shapes.iter().map(of).fold(0.0, f64::max)
}

/// A sentence that says whether residuals of this size are too large; `rms` and `noise` of a coordinate (m).
pub(super) fn misfit(rms: f64, given: Option<f64>, of_points: Option<f64>, length: f64) -> Option<String> {
    let (noise, whose) = match (given, of_points) {
        (Some(noise), _) => (Some(noise), "the noise given"),
        (None, noise) => (noise, "their own noise along the rod"),
    };
    let least = if given.is_some() { 0.0 } else { LEAST_MISFIT * length };
    let distance = 3f64.sqrt() * rms;
    let millimetres = |x: f64| format!("{:.3} mm", 1e3 * x);
    let against = match noise {
        Some(noise) if rms > BEYOND * noise && distance > least => {
            let times = rms / noise;
            let times = if times < 1e4 { format!("{times:.0}") } else { "over 10,000".into() };
            format!("{times} times {whose} ({noise:.1e} m)")
        }
        _ if distance > GROSS_MISFIT * length => format!("{:.0} % of the rod's length", 100.0 * distance / length),
        _ => return None,
    };
    Some(format!(
        "DISTRUSTED: the points lie {} off the fitted rod (rms), {against}: either this is not the best fit, or no value of the \
         free numbers gives this shape",
        millimetres(distance)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::ObservedPoint;

    fn circle(points: usize, turns: f64, noise: f64) -> ObservedShapes {
        // Noise of a fixed pattern whose mean square is noise².
        let wobble = |k: usize, a: usize| if (k * k * 7 + 3 * a * k + a) % 4 < 2 { noise } else { -noise };
        let point = |k: usize| {
            let s = (k + 1) as f64 / points as f64;
            let angle = std::f64::consts::TAU * turns * s;
            let radius = 1.0 / (std::f64::consts::TAU * turns);
            let exact = [radius * (1.0 - angle.cos()), 0.0, radius * angle.sin()];
            ObservedPoint { arc_length: Some(s), position: std::array::from_fn(|a| exact[a] + wobble(k, a)) }
        };
        let shape = ObservedShape { points: (0..points).map(point).collect(), ..ObservedShape::default() };
        ObservedShapes { known: vec![], shapes: vec![shape] }
    }

    #[test]
    fn noise_is_told_from_the_shape() {
        let exact = noise_of_points(&circle(40, 2.0, 0.0), 1.0).unwrap();
        assert!(exact < 1e-6, "{exact}");
        for noise in [1e-4, 1e-3] {
            let found = noise_of_points(&circle(60, 1.0, noise), 1.0).unwrap();
            assert!(found > 0.3 * noise && found < 3.0 * noise, "{found} of {noise}");
        }
        assert_eq!(noise_of_points(&circle(5, 1.0, 0.0), 1.0), None);
        let tips = ObservedShapes { known: vec![], shapes: vec![circle(1, 1.0, 0.0).shapes[0].clone(); 20] };
        assert_eq!(noise_of_points(&tips, 1.0), None);
    }

    #[test]
    fn the_bend_of_a_circle_is_its_angle() {
        for turns in [0.25, 1.0, 3.0] {
            let found = bend(&circle(60, turns, 0.0), [0.0; 3], [0.0, 0.0, 1.0]);
            assert!((found / (std::f64::consts::TAU * turns) - 1.0).abs() < 0.03, "{found} at {turns}");
        }
    }

    #[test]
    fn a_misfit_is_named_by_what_it_is_compared_with() {
        let misfit = |rms, given, of_points| misfit(rms, given, of_points, 1.0);
        assert!(misfit(0.01, None, Some(1e-4)).unwrap().contains("100 times their own noise"));
        assert!(misfit(0.01, Some(1e-3), Some(1e-4)).unwrap().contains("10 times the noise given"));
        assert_eq!(misfit(4e-4, None, Some(1e-5)), None);
        assert!(misfit(4e-4, Some(1e-5), None).is_some());
        assert_eq!(misfit(0.01, None, None), None);
        assert!(misfit(0.04, None, None).unwrap().contains("7 % of the rod's length"));
    }
}
