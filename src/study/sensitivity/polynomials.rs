//! Orthonormal polynomials of several independent inputs.

/// Polynomials that are orthonormal under the law of an input, in its standard variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Family {
    /// For a uniform law on [-1, 1].
    Legendre,
    /// For the standard normal law.
    Hermite,
}

/// Products of polynomials up to a total degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    families: Vec<Family>,
    /// Degree in each input, by term; the constant is the first.
    exponents: Vec<Vec<u8>>,
    degree: usize,
}

/// Values and slopes of the one-dimensional polynomials at a point, by input and degree.
pub(super) struct Factors {
    values: Vec<f64>,
    slopes: Vec<f64>,
    stride: usize,
}

impl Family {
    /// Values and slopes of degrees 0, 1, ...
    fn evaluate(self, x: f64, values: &mut [f64], slopes: &mut [f64]) {
        (values[0], slopes[0]) = (1.0, 0.0);
        if values.len() == 1 {
            return;
        }
        match self {
            Family::Legendre => {
                // P_n first, by Bonnet's recurrence; P'_{n+1} = P'_{n-1} + (2n + 1) P_n; then the norms.
                (values[1], slopes[1]) = (x, 1.0);
                for n in 1..values.len() - 1 {
                    let m = n as f64;
                    values[n + 1] = ((2.0 * m + 1.0) * x * values[n] - m * values[n - 1]) / (m + 1.0);
                    slopes[n + 1] = slopes[n - 1] + (2.0 * m + 1.0) * values[n];
                }
                for n in 1..values.len() {
                    let norm = (2.0 * n as f64 + 1.0).sqrt();
                    values[n] *= norm;
                    slopes[n] *= norm;
                }
            }
            Family::Hermite => {
                for n in 0..values.len() - 1 {
                    let (root, below) = ((n as f64).sqrt(), if n > 0 { values[n - 1] } else { 0.0 });
                    let next = (n as f64 + 1.0).sqrt();
                    values[n + 1] = (x * values[n] - root * below) / next;
                    slopes[n + 1] = next * values[n];
                }
            }
        }
    }
}

impl Basis {
    /// All terms up to a total degree.
    pub fn new(families: &[Family], degree: usize) -> Basis {
        let mut exponents = vec![Vec::new()];
        for _ in families {
            let longer = |term: &Vec<u8>| {
                let left = degree - term.iter().map(|e| *e as usize).sum::<usize>();
                (0..=left as u8).map(|e| [&term[..], &[e]].concat()).collect::<Vec<_>>()
            };
            exponents = exponents.iter().flat_map(longer).collect();
        }
        exponents.sort_by_key(|term| term.iter().map(|e| *e as usize).sum::<usize>());
        Basis { families: families.to_vec(), exponents, degree }
    }

    /// Terms of a basis, without making it; `None` beyond what counts can hold.
    pub fn size(inputs: usize, degree: usize) -> Option<usize> {
        (1..=degree).try_fold(1usize, |size, k| Some(size.checked_mul(inputs + k)? / k))
    }

    /// Degree in each input, by term.
    pub fn exponents(&self) -> &[Vec<u8>] {
        &self.exponents
    }

    /// Number of terms.
    pub fn len(&self) -> usize {
        self.exponents.len()
    }

    /// Never: the constant is always there.
    pub fn is_empty(&self) -> bool {
        self.exponents.is_empty()
    }

    pub(super) fn factors(&self, point: &[f64]) -> Factors {
        let stride = self.degree + 1;
        let mut factors = Factors { values: vec![0.0; stride * point.len()], slopes: Vec::new(), stride };
        factors.slopes = factors.values.clone();
        let cells = factors.values.chunks_mut(stride).zip(factors.slopes.chunks_mut(stride));
        for ((family, x), (values, slopes)) in self.families.iter().zip(point).zip(cells) {
            family.evaluate(*x, values, slopes);
        }
        factors
    }

    /// Writes the value of every term, or its slope by one input.
    pub(super) fn terms(&self, factors: &Factors, by: Option<usize>, terms: &mut [f64]) {
        for (term, exponents) in terms.iter_mut().zip(&self.exponents) {
            let factor = |(input, exponent): (usize, &u8)| {
                let at = input * factors.stride + *exponent as usize;
                if by == Some(input) { factors.slopes[at] } else { factors.values[at] }
            };
            *term = exponents.iter().enumerate().map(factor).product();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_are_orthonormal_and_their_slopes_are_slopes() {
        for family in [Family::Legendre, Family::Hermite] {
            let at = |x: f64| {
                let (mut values, mut slopes) = ([0.0; 5], [0.0; 5]);
                family.evaluate(x, &mut values, &mut slopes);
                (values, slopes)
            };
            let (reach, count) = if family == Family::Legendre { (1.0, 200_000) } else { (12.0, 200_000) };
            let h = 2.0 * reach / f64::from(count);
            let mut products = [[0.0; 5]; 5];
            for k in 0..count {
                let x = -reach + (f64::from(k) + 0.5) * h;
                let density = match family {
                    Family::Legendre => 0.5,
                    Family::Hermite => (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt(),
                };
                let (values, _) = at(x);
                (0..25).for_each(|p| products[p / 5][p % 5] += h * density * values[p / 5] * values[p % 5]);
            }
            for p in 0..25 {
                let expected = f64::from(p / 5 == p % 5);
                assert!((products[p / 5][p % 5] - expected).abs() < 1e-8, "{family:?} {p}");
            }
            for x in [-0.7, 0.2, 0.9] {
                let (above, below) = (at(x + 1e-5).0, at(x - 1e-5).0);
                (0..5).for_each(|n| assert!((at(x).1[n] - (above[n] - below[n]) / 2e-5).abs() < 1e-7, "{family:?}"));
            }
        }
    }

    #[test]
    fn bases_have_their_size() {
        for (inputs, degree, size) in [(8, 3, 165), (8, 2, 45), (3, 3, 20), (1, 4, 5), (12, 4, 1820)] {
            let basis = Basis::new(&vec![Family::Legendre; inputs], degree);
            assert_eq!((basis.len(), Basis::size(inputs, degree)), (size, Some(size)));
            assert!(basis.exponents()[0].iter().all(|e| *e == 0));
        }
    }
}
