//! Butcher tableaux of the steppers.

use crate::model::Stepper;

/// An explicit Runge-Kutta method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Row i holds the weights of stages 0..=i in stage i + 1.
    rows: &'static [&'static [f64]],
    /// Weights of the stages in the step.
    pub b: &'static [f64],
}

impl Tableau {
    pub fn of(stepper: Stepper) -> Self {
        match stepper {
            Stepper::Rk4 => Self { rows: &RK4_ROWS, b: &RK4_B },
            Stepper::Dop853 => Self { rows: &DOP853_ROWS, b: &DOP853_B },
        }
    }

    pub fn stage_count(&self) -> usize {
        self.b.len()
    }

    /// Weight of stage j in stage i; zero from the diagonal on.
    pub fn a(&self, i: usize, j: usize) -> f64 {
        if j < i { self.rows[i - 1][j] } else { 0.0 }
    }

    /// Abscissa of stage i: its row's sum.
    pub fn c(&self, i: usize) -> f64 {
        (0..i).map(|j| self.a(i, j)).sum()
    }
}

const RK4_ROWS: [&[f64]; 3] = [&[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]];

const RK4_B: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// Dormand and Prince's eighth-order method as in Hairer, Norsett and Wanner, Solving Ordinary Differential
/// Equations I.
const DOP853_ROWS: [&[f64]; 11] = [
    &[0.05260015195876773],
    &[0.0197250569845379, 0.0591751709536137],
    &[0.02958758547680685, 0.0, 0.08876275643042054],
    &[0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792],
    &[0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242],
    &[0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125],
    &[
        0.03709200011850479,
        0.0,
        0.0,
        0.17038392571223998,
        0.10726203044637328,
        -0.015319437748624402,
        0.008273789163814023,
    ],
    &[
        0.6241109587160757,
        0.0,
        0.0,
        -3.3608926294469414,
        -0.868219346841726,
        27.59209969944671,
        20.154067550477894,
        -43.48988418106996,
    ],
    &[
        0.47766253643826434,
        0.0,
        0.0,
        -2.4881146199716677,
        -0.590290826836843,
        21.230051448181193,
        15.279233632882423,
        -33.28821096898486,
        -0.020331201708508627,
    ],
    &[
        -0.9371424300859873,
        0.0,
        0.0,
        5.186372428844064,
        1.0914373489967295,
        -8.149787010746927,
        -18.52006565999696,
        22.739487099350505,
        2.4936055526796523,
        -3.0467644718982196,
    ],
    &[
        2.273310147516538,
        0.0,
        0.0,
        -10.53449546673725,
        -2.0008720582248625,
        -17.9589318631188,
        27.94888452941996,
        -2.8589982771350235,
        -8.87285693353063,
        12.360567175794303,
        0.6433927460157636,
    ],
];

const DOP853_B: [f64; 12] = [
    0.054293734116568765,
    0.0,
    0.0,
    0.0,
    0.0,
    4.450312892752409,
    1.8915178993145003,
    -5.801203960010585,
    0.3111643669578199,
    -0.1521609496625161,
    0.20136540080403034,
    0.04471061572777259,
];

#[cfg(test)]
mod tests {
    use super::Tableau;
    use crate::model::Stepper;

    /// Order conditions of quadrature and of the bushy trees one level deeper.
    #[test]
    fn satisfies_its_order_conditions() {
        for stepper in Stepper::ALL {
            let tableau = Tableau::of(stepper);
            let stages = 0..tableau.stage_count();
            assert_eq!(tableau.stage_count(), stepper.stage_count());
            for power in 0..stepper.order() as i32 {
                let sum: f64 = stages.clone().map(|i| tableau.b[i] * tableau.c(i).powi(power)).sum();
                assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-13, "{stepper:?} {power}: {sum}");
                // sum b_i c_i^p a_ij c_j^q = 1 / ((q + 1) (p + q + 2))
                for q in 1..stepper.order() as i32 - power - 1 {
                    let inner = |i: usize| (0..i).map(|j| tableau.a(i, j) * tableau.c(j).powi(q)).sum::<f64>();
                    let sum: f64 = stages.clone().map(|i| tableau.b[i] * tableau.c(i).powi(power) * inner(i)).sum();
                    let exact = 1.0 / f64::from((q + 1) * (power + q + 2));
                    assert!((sum - exact).abs() < 1e-13, "{stepper:?} {power} {q}: {sum} {exact}");
                }
            }
        }
    }
}
