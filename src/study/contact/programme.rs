//! Small linear programmes: the simplex method on a dense dictionary, with bounds on the variables.

use crate::study::workspace::MOST_INPUTS;

/// Least cost·x where rows·x are at most their limits and x lies within its bounds.
#[derive(Clone, Debug, Default)]
pub(super) struct Programme {
    /// One a variable.
    pub cost: Vec<f64>,
    /// Finite.
    pub low: Vec<f64>,
    /// At least `low`; may be infinite.
    pub high: Vec<f64>,
    /// Coefficients of each row, one row after the other, and its limit.
    pub rows: Vec<f64>,
    pub limits: Vec<f64>,
    /// A variable that begins at its upper bound, such as one that lets every row hold there.
    pub elastic: Option<usize>,
}

/// Numbers below this are zero beside coefficients of about 1.
const ZERO: f64 = 1e-10;
/// What phase one may leave of the largest violation.
const FEASIBLE: f64 = 1e-8;
/// Columns, at most: those of all inputs, a bound, what is elastic, and what is artificial.
const MOST_COLUMNS: usize = MOST_INPUTS + 3;
/// Pivots, at most, and from which on the first improving column is taken in place of the steepest, so that none cycles.
const MOST_PIVOTS: usize = 400;
const CAREFUL: usize = 100;

/// Basic variables by those that are not, which are zero: x_b = value − entries · x_n.
struct Dictionary {
    columns: usize,
    entries: Vec<f64>,
    values: Vec<f64>,
    /// Of the costs of both phases by the variables that are not basic.
    costs: [Vec<f64>; 2],
    /// Variables of rows and columns. First those of the programme, then slacks, at last the artificial one.
    basic: Vec<usize>,
    others: Vec<usize>,
    /// Upper bound of each variable above its lower one.
    room: Vec<f64>,
    /// Variables that are counted down from their upper bound.
    is_flipped: Vec<bool>,
}

impl Programme {
    /// Adds a row.
    pub(super) fn keep(&mut self, row: &[f64], limit: f64) {
        self.rows.extend_from_slice(row);
        self.limits.push(limit);
    }

    /// Values of the variables; `None` where no values satisfy all rows, or the cost has no bound.
    pub(super) fn solve(&self) -> Option<Vec<f64>> {
        let (variables, rows) = (self.cost.len(), self.limits.len());
        let columns = variables + 1;
        assert!(columns <= MOST_COLUMNS, "{variables} variables");
        let artificial = variables + rows;
        let mut room: Vec<f64> = self.low.iter().zip(&self.high).map(|(low, high)| high - low).collect();
        room.resize(artificial + 1, f64::INFINITY);
        let mut entries = Vec::with_capacity(rows * columns);
        let mut values = Vec::with_capacity(rows);
        for (row, limit) in self.rows.chunks_exact(variables).zip(&self.limits) {
            entries.extend_from_slice(row);
            entries.push(-1.0);
            values.push(limit - row.iter().zip(&self.low).map(|(a, low)| a * low).sum::<f64>());
        }
        let mut own = self.cost.clone();
        own.push(0.0);
        let mut first = vec![0.0; columns];
        first[variables] = 1.0;
        let others = (0..variables).chain([artificial]).collect();
        let basic = (variables..artificial).collect();
        let is_flipped = vec![false; artificial + 1];
        let mut at = Dictionary { columns, entries, values, costs: [first, own], basic, others, room, is_flipped };
        if let Some(elastic) = self.elastic.filter(|k| *k < variables && at.room[*k].is_finite()) {
            at.flip_column(elastic);
        }
        let worst = (0..rows).min_by(|a, b| at.values[*a].total_cmp(&at.values[*b]));
        if let Some(row) = worst.filter(|row| at.values[*row] < 0.0) {
            at.pivot(row, variables);
            at.minimise(0)?;
            if at.value(artificial) > FEASIBLE {
                return None;
            }
        }
        at.room[artificial] = 0.0;
        at.minimise(1)?;
        Some((0..variables).map(|k| self.low[k] + at.value(k)).collect())
    }
}

impl Dictionary {
    /// Moves along improving columns to the least cost of a phase; `None` where there is none.
    fn minimise(&mut self, phase: usize) -> Option<()> {
        for count in 0..MOST_PIVOTS {
            let costs = &self.costs[phase];
            let improving = (0..self.columns).filter(|column| costs[*column] < -ZERO);
            let column = match count < CAREFUL {
                true => improving.min_by(|a, b| costs[*a].total_cmp(&costs[*b])),
                false => improving.min_by_key(|column| self.others[*column]),
            };
            let Some(column) = column else { return Some(()) };
            let mut step = self.room[self.others[column]];
            let mut leaves: Option<(usize, bool)> = None;
            for row in 0..self.values.len() {
                let (a, value, room) = (self.entry(row, column), self.values[row].max(0.0), self.room[self.basic[row]]);
                let (to, rises) = match a {
                    a if a > ZERO => (value / a, false),
                    a if a < -ZERO && room.is_finite() => ((room - value).max(0.0) / -a, true),
                    _ => continue,
                };
                let is_first = leaves.is_none_or(|(other, _)| self.basic[row] < self.basic[other]);
                if to < step || (to == step && leaves.is_some() && is_first) {
                    (step, leaves) = (to, Some((row, rises)));
                }
            }
            match leaves {
                Some((row, rises)) => {
                    if rises {
                        self.flip_row(row);
                    }
                    self.pivot(row, column);
                }
                None if step.is_finite() => self.flip_column(column),
                None => return None,
            }
        }
        None
    }

    fn entry(&self, row: usize, column: usize) -> f64 {
        self.entries[row * self.columns + column]
    }

    /// Of a variable, above its lower bound.
    fn value(&self, variable: usize) -> f64 {
        let value = self.basic.iter().position(|other| *other == variable).map_or(0.0, |row| self.values[row]);
        if self.is_flipped[variable] { self.room[variable] - value } else { value }
    }

    /// Counts a variable that is not basic from its other bound.
    fn flip_column(&mut self, column: usize) {
        let variable = self.others[column];
        let room = self.room[variable];
        for row in 0..self.values.len() {
            let entry = &mut self.entries[row * self.columns + column];
            self.values[row] -= *entry * room;
            *entry = -*entry;
        }
        self.costs.iter_mut().for_each(|costs| costs[column] = -costs[column]);
        self.is_flipped[variable] = !self.is_flipped[variable];
    }

    /// Counts a basic variable from its other bound.
    fn flip_row(&mut self, row: usize) {
        let variable = self.basic[row];
        self.values[row] = self.room[variable] - self.values[row];
        self.entries[row * self.columns..(row + 1) * self.columns].iter_mut().for_each(|a| *a = -*a);
        self.is_flipped[variable] = !self.is_flipped[variable];
    }

    /// The variables of a row and of a column change places.
    fn pivot(&mut self, row: usize, column: usize) {
        let columns = self.columns;
        let inverse = 1.0 / self.entry(row, column);
        let own = row * columns;
        self.entries[own..own + columns].iter_mut().for_each(|a| *a *= inverse);
        self.entries[own + column] = inverse;
        self.values[row] *= inverse;
        let mut of_row = [0.0; MOST_COLUMNS];
        of_row[..columns].copy_from_slice(&self.entries[own..own + columns]);
        let value = self.values[row];
        let rows = self.entries.chunks_exact_mut(columns).zip(&mut self.values).enumerate();
        for (_, (entries, to)) in rows.filter(|(other, _)| *other != row) {
            let factor = entries[column];
            if factor != 0.0 {
                entries[column] = 0.0;
                entries.iter_mut().zip(&of_row).for_each(|(a, b)| *a -= factor * b);
                *to -= factor * value;
            }
        }
        for costs in &mut self.costs {
            let factor = costs[column];
            costs[column] = 0.0;
            costs.iter_mut().zip(&of_row).for_each(|(c, b)| *c -= factor * b);
        }
        std::mem::swap(&mut self.basic[row], &mut self.others[column]);
    }
}

#[cfg(test)]
mod tests {
    use super::Programme;

    /// Numbers from -1 to 1, the same at each call.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// Solution of a square system; `None` where it is next to singular.
    fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
        let n = b.len();
        for k in 0..n {
            let pivot = (k..n).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs()))?;
            if a[pivot][k].abs() < 1e-9 {
                return None;
            }
            a.swap(k, pivot);
            b.swap(k, pivot);
            for i in 0..n {
                if i != k {
                    let factor = a[i][k] / a[k][k];
                    (0..n).for_each(|j| a[i][j] -= factor * a[k][j]);
                    b[i] -= factor * b[k];
                }
            }
        }
        Some((0..n).map(|k| b[k] / a[k][k]).collect())
    }

    /// Choices of `count` of `from`.
    fn choices(from: usize, count: usize) -> Vec<Vec<usize>> {
        if count == 0 {
            return vec![Vec::new()];
        }
        let with = |last: usize| choices(last, count - 1).into_iter().map(move |choice| [choice, vec![last]].concat());
        (0..from).flat_map(with).collect()
    }

    fn rows_of(of: &Programme) -> Vec<(Vec<f64>, f64)> {
        of.rows.chunks(of.cost.len()).map(<[f64]>::to_vec).zip(of.limits.iter().copied()).collect()
    }

    /// The least cost over all corners.
    fn least_of_corners(of: &Programme) -> Option<f64> {
        let n = of.cost.len();
        let unit = |k: usize, sign: f64| (0..n).map(|j| if j == k { sign } else { 0.0 }).collect::<Vec<f64>>();
        let mut all = rows_of(of);
        all.extend((0..n).map(|k| (unit(k, 1.0), of.high[k])));
        all.extend((0..n).map(|k| (unit(k, -1.0), -of.low[k])));
        let corners = choices(all.len(), n).into_iter().filter_map(|chosen| {
            let x = solved(
                chosen.iter().map(|row| all[*row].0.clone()).collect(),
                chosen.iter().map(|row| all[*row].1).collect(),
            )?;
            let holds = |(row, limit): &(Vec<f64>, f64)| dot(row, &x) <= limit + 1e-9;
            all.iter().all(holds).then(|| dot(&of.cost, &x))
        });
        corners.reduce(f64::min)
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn no_corner_is_better() {
        let mut numbers = Numbers(7);
        let mut impossible = 0;
        for case in 0..600 {
            let (n, m) = (1 + case % 4, case % 7);
            let mut vector = |n: usize| (0..n).map(|_| numbers.next()).collect::<Vec<f64>>();
            let low: Vec<f64> = vector(n).iter().map(|x| -x.abs()).collect();
            let high: Vec<f64> = vector(n).iter().map(|x| x.abs()).collect();
            let cost = vector(n);
            let elastic = (case % 3 == 0).then_some(0);
            let mut programme = Programme { cost, low, high, elastic, ..Programme::default() };
            (0..m).for_each(|_| programme.keep(&vector(n), 0.4 * vector(1)[0] + 0.1));
            let (found, best) = (programme.solve(), least_of_corners(&programme));
            impossible += usize::from(best.is_none());
            match (found, best) {
                (Some(x), Some(best)) => {
                    assert!((dot(&programme.cost, &x) - best).abs() < 1e-8, "{case}: {x:?}, {best}");
                    let holds = |(row, limit): &(Vec<f64>, f64)| dot(row, &x) <= limit + 1e-8;
                    assert!(rows_of(&programme).iter().all(holds), "{case}: {x:?}");
                    let within = |k: usize| programme.low[k] - 1e-9 <= x[k] && x[k] <= programme.high[k] + 1e-9;
                    assert!((0..n).all(within), "{case}: {x:?}");
                }
                (None, None) => {}
                (found, best) => panic!("{case}: {found:?}, {best:?}: {programme:?}"),
            }
        }
        assert!(impossible > 20, "{impossible}");
    }

    #[test]
    fn a_circle_of_many_sides_ends() {
        // Every side touches the same point: corners coincide.
        let mut programme = Programme {
            cost: vec![0.1, 0.2, 1.0],
            low: vec![-1.0, -1.0, 0.0],
            high: vec![1.0, 1.0, f64::INFINITY],
            ..Programme::default()
        };
        for k in 0..24 {
            let angle = k as f64 * std::f64::consts::TAU / 24.0;
            programme.keep(&[angle.cos(), angle.sin(), -1.0], 0.0);
        }
        let x = programme.solve().expect("solved");
        assert!(x.iter().all(|x| x.abs() < 1e-9), "{x:?}");
    }

    #[test]
    fn what_has_no_bound_has_no_answer() {
        let (cost, low, high) = (vec![-1.0], vec![0.0], vec![f64::INFINITY]);
        assert_eq!(Programme { cost, low, high, ..Programme::default() }.solve(), None);
    }
}
