//! Multiple shooting: rotation and moment at nodes along the rod are unknown, no integration is longer than an interval.
//!
//! Newton's step and every response solve one almost block diagonal system, MS3 to MS5.

use super::band::{Band, Factored};
use super::chain::{Chain, Variation};
use super::extrapolation::{Extrapolation, RunAway};
use super::places::{Node, Place, all_flexible, ends, march};
use super::shooting::tip_residual;
use super::state::{Column, State, base_state};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Columns of an interval: three by rotation at its node, three by moment; those of the variations follow.
const OWN: usize = 6;

/// Change at a node: rotation, and moment over the node's scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change {
    pub w: Vector3<f64>,
    pub y: Vector3<f64>,
}

/// Every interval passed once from its node, and the system that ties them together.
pub(super) struct Passages {
    /// Where each interval ends, with its columns; p from its node.
    ends: Vec<State>,
    /// What counts as a moment of one at each node.
    scales: Vec<f64>,
    /// Rotation missing to the next node, and moment over its scale; at the tip the residual alone. MS3
    defects: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// m(L) - l_tip in the tip's frame.
    pub residual: Vector3<f64>,
    dresidual: Vec<Vector3<f64>>,
    /// Estimated error of each interval's integration.
    errors: Vec<f64>,
    factored: Factored,
    l_tip: Vector3<f64>,
}

/// The local unit of moment: a rod under the force n is bent by about sqrt(n EI), and by EI / L where no force acts.
fn scale(n: f64, K: f64) -> f64 {
    (n * K).sqrt().max(1.0)
}

fn no_column() -> Column {
    Column { w: Vector3::zeros(), dp: Vector3::zeros(), dm_body: Vector3::zeros() }
}

/// Rotation vector of a rotation that is small, or at least no half turn.
fn logarithm(Q: &Matrix3<f64>) -> Vector3<f64> {
    let sine = 0.5 * Vector3::new(Q.m32 - Q.m23, Q.m13 - Q.m31, Q.m21 - Q.m12);
    let size = sine.norm();
    if size == 0.0 { sine } else { sine * (size.atan2(0.5 * (Q.trace() - 1.0)) / size) }
}

/// The nearest rotation to a matrix that almost is one.
pub(super) fn orthonormal(R: &Matrix3<f64>) -> Matrix3<f64> {
    R * (1.5 * Matrix3::identity() - 0.5 * R.tr_mul(R))
}

impl Passages {
    /// Passes every interval. `None` where one cannot be integrated or the system is singular.
    pub(super) fn new(
        chain: &Chain,
        nodes: &[Node],
        variations: &[Variation],
        integrator: &mut Extrapolation,
    ) -> Option<Self> {
        let scales: Vec<f64> = nodes.iter().map(|node| node_scale(chain, node)).collect();
        let mut all = vec![chain.no_variation(); OWN];
        all.extend_from_slice(variations);
        let flexible = all_flexible(chain, &all);
        let mut passages = Vec::with_capacity(nodes.len());
        let mut errors = Vec::with_capacity(nodes.len());
        integrator.take_spent();
        for (i, (node, end)) in nodes.iter().zip(ends(chain, nodes)).enumerate() {
            let mut state = node.state(unit_columns(scales[i]));
            state.p = Vector3::zeros();
            if i == 0 {
                state.columns.extend(base_state(chain, node.m_body, variations).columns);
            } else {
                state.columns.resize(all.len(), no_column());
            }
            march(chain, &flexible, &all, (node.place, end), &mut state, integrator).ok()?;
            passages.push(state);
            errors.push(integrator.take_spent());
        }
        let (residual, dresidual) = tip_residual(chain, &all, passages.last()?);
        let defect = |i: usize| {
            let (state, next) = (&passages[i], &nodes[i + 1]);
            let moment = (state.m_body - next.m_body) / scales[i + 1];
            (logarithm(&(state.R * next.R.transpose())), moment)
        };
        let mut defects: Vec<_> = (0..nodes.len() - 1).map(defect).collect();
        defects.push((Vector3::zeros(), residual / scales[nodes.len() - 1]));
        let factored = system(&passages, &scales, &dresidual[..OWN]).factor()?;
        let l_tip = chain.numbers.l_tip;
        Some(Self { ends: passages, scales, defects, residual, dresidual, errors, factored, l_tip })
    }

    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// What the rod looks like at its tip.
    pub(super) fn tip(&self) -> &State {
        &self.ends[self.count() - 1]
    }

    /// Tip position from the base.
    pub(super) fn tip_position(&self) -> Vector3<f64> {
        self.ends.iter().map(|end| end.p).sum()
    }

    /// Newton's step at every node. MS4
    pub(super) fn newton_step(&self) -> Vec<Change> {
        self.solve(&self.defects)
    }

    /// How the nodes change with variation k, the rod staying in equilibrium. MS5
    pub(super) fn response(&self, k: usize) -> Vec<Change> {
        let last = self.count() - 1;
        let sources = (0..last).map(|i| {
            let column = &self.ends[i].columns[OWN + k];
            (column.w, column.dm_body / self.scales[i + 1])
        });
        let tip = (Vector3::zeros(), self.dresidual[OWN + k] / self.scales[last]);
        self.solve(&sources.chain([tip]).collect::<Vec<_>>())
    }

    /// Change of the base moment by unit moments at the tip, which is -(dr/dm0)^-1 and does not grow. MS6
    pub(super) fn inverse(&self) -> Matrix3<f64> {
        self.inverse_by(&self.factored)
    }

    /// Sign of det(dr/dm0), and the logarithm of its size. It is that of the whole system, which does not grow.
    pub(super) fn determinant(&self) -> (f64, f64) {
        let (sign, size) = self.factored.determinant();
        let scales = self.scales[self.count() - 1] / self.scales[0];
        (sign, size + scales.ln())
    }

    fn inverse_by(&self, factored: &Factored) -> Matrix3<f64> {
        let last = self.count() - 1;
        let column = |k: usize| {
            let mut b = vec![0.0; OWN * self.count() - 3];
            b[OWN * last + k] = -1.0 / self.scales[last];
            factored.solve(&mut b);
            Vector3::new(b[0], b[1], b[2]) * self.scales[0]
        };
        Matrix3::from_columns(&[column(0), column(1), column(2)])
    }

    /// The same with the part by tip rotation made symmetric, which a dead tip moment l is not: dr + (w x l) / 2.
    pub(super) fn symmetric_inverse(&self) -> Option<Matrix3<f64>> {
        let tip = self.tip();
        let turned = |k: usize| 0.5 * tip.R.tr_mul(&tip.columns[k].w.cross(&self.l_tip));
        let dresidual: Vec<Vector3<f64>> = (0..OWN).map(|k| self.dresidual[k] - turned(k)).collect();
        let factored = system(&self.ends, &self.scales, &dresidual).factor()?;
        Some(self.inverse_by(&factored))
    }

    /// What becomes of the tip: change of its position and its rotation, `own` being the variation, if any, that acts
    /// along the rod, too.
    pub(super) fn tip_change(&self, changes: &[Change], own: Option<usize>) -> (Vector3<f64>, Vector3<f64>) {
        let of = |i: usize| self.end_change(i, &changes[i], own);
        let dp = (0..self.count()).map(|i| of(i).dp).sum();
        (dp, of(self.count() - 1).w)
    }

    /// Columns at every node: total changes by variation k.
    pub(super) fn node_columns(&self, k: usize, variation: &Variation) -> Vec<Column> {
        let changes = self.response(k);
        let mut dp = variation.dp0;
        let column = |(i, change): (usize, &Change)| {
            let w = if i == 0 { variation.w0 } else { change.w };
            let dm0 = if i == 0 { variation.dm0_body } else { Vector3::zeros() };
            let column = Column { w, dp, dm_body: dm0 + change.y * self.scales[i] };
            let along = self.end_change(i, change, Some(k)).dp;
            dp = if i == 0 { along } else { dp + along };
            column
        };
        changes.iter().enumerate().map(column).collect()
    }

    /// Change of the end of interval i, its node's position held.
    fn end_change(&self, i: usize, change: &Change, own: Option<usize>) -> Column {
        let columns = &self.ends[i].columns;
        let mut sum = own.map_or(no_column(), |k| columns[OWN + k]);
        let parts = change.w.iter().chain(change.y.iter()).zip(columns);
        for (size, column) in parts {
            sum.w += *size * column.w;
            sum.dp += *size * column.dp;
            sum.dm_body += *size * column.dm_body;
        }
        sum
    }

    /// Moves the nodes, which also get their positions. MS4
    pub(super) fn moved(&self, nodes: &[Node], changes: &[Change]) -> Vec<Node> {
        let mut p = Vector3::zeros();
        let node = |(i, node): (usize, &Node)| {
            let change = &changes[i];
            let moved = Node {
                place: node.place,
                p,
                R: if i == 0 { node.R } else { orthonormal(&(Rotation3::new(change.w).matrix() * node.R)) },
                m_body: node.m_body + change.y * self.scales[i],
            };
            p += self.ends[i].p + self.end_change(i, change, None).dp;
            moved
        };
        nodes.iter().enumerate().map(node).collect()
    }

    /// Changes of nodes by columns there.
    pub(super) fn tangent_columns(&self, changes: &[Change]) -> Vec<Column> {
        let column =
            |(change, scale): (&Change, &f64)| Column { w: change.w, dm_body: change.y * *scale, ..no_column() };
        changes.iter().zip(&self.scales).map(column).collect()
    }

    /// What the errors of all intervals may do to the tip, position or rotation: the sum over nodes of response times
    /// error. `round_off` is added to the error of each interval. MS7
    pub(super) fn tip_error(&self, round_off: f64) -> f64 {
        let last = self.count() - 1;
        let error = |i: usize| self.errors[i] + round_off;
        let moment_error = |i: usize| {
            let next = (i + 1).min(last);
            error(i) * self.ends[i].m_body.amax().max(1.0) / self.scales[next]
        };
        let mut worst: f64 = 0.0;
        for row in 0..OWN {
            let mut b = self.tip_row(row);
            self.factored.solve_transposed(&mut b);
            let mut sum = 0.0;
            for i in 0..last {
                let [w, m] = [0, 3].map(|at| (0..3).map(|k| b[OWN * i + at + k].abs()).sum::<f64>());
                sum += w * error(i) + m * moment_error(i);
            }
            sum += (0..3).map(|k| b[OWN * last + k].abs()).sum::<f64>() * moment_error(last);
            sum += if row < 3 { (0..=last).map(error).sum() } else { error(last) };
            // Also takes NaN as the worst.
            if sum.is_nan() || sum > worst {
                worst = sum;
            }
        }
        worst
    }

    /// Row of d(tip position, tip rotation) by all unknowns.
    fn tip_row(&self, row: usize) -> Vec<f64> {
        let mut b = vec![0.0; OWN * self.count() - 3];
        for (i, end) in self.ends.iter().enumerate() {
            if row >= 3 && i + 1 < self.count() {
                continue;
            }
            for (k, column) in end.columns[..OWN].iter().enumerate() {
                if let Some(at) = unknown(i, k) {
                    b[at] = if row < 3 { column.dp[row] } else { column.w[row - 3] };
                }
            }
        }
        b
    }

    /// Changes at the nodes that make up for what the right-hand sides bring in.
    fn solve(&self, sources: &[(Vector3<f64>, Vector3<f64>)]) -> Vec<Change> {
        let last = self.count() - 1;
        let mut b = Vec::with_capacity(OWN * self.count());
        for (i, (w, m)) in sources.iter().enumerate() {
            if i < last {
                b.extend(w.iter().map(|x| -x));
            }
            b.extend(m.iter().map(|x| -x));
        }
        self.factored.solve(&mut b);
        let get = |i: usize, first: usize| -> Vector3<f64> {
            Vector3::from_fn(|k, _| unknown(i, first + k).map_or(0.0, |at| b[at]))
        };
        (0..self.count()).map(|i| Change { w: get(i, 0), y: get(i, 3) }).collect()
    }
}

/// Largest rotation, or moment over scale, of all nodes.
pub(super) fn size(changes: &[Change]) -> f64 {
    let of = |change: &Change| change.w.norm().max(change.y.norm());
    changes.iter().map(of).fold(0.0, |a: f64, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
}

/// Takes nodes and columns there, changes by `variation`, to other places.
pub(super) fn carried(
    chain: &Chain,
    (nodes, columns): (&[Node], &[Column]),
    variation: &Variation,
    places: &[Place],
    integrator: &mut Extrapolation,
) -> Result<(Vec<Node>, Vec<Column>), RunAway> {
    let variations = std::slice::from_ref(variation);
    let flexible = all_flexible(chain, variations);
    let (mut new_nodes, mut new_columns) = (Vec::new(), Vec::new());
    let mut from = 0;
    let mut state = nodes[0].state(vec![columns[0]]);
    let mut at = nodes[0].place;
    for place in places {
        while nodes.get(from + 1).is_some_and(|next| next.place.is_up_to(*place)) {
            from += 1;
            (state, at) = (nodes[from].state(vec![columns[from]]), nodes[from].place);
        }
        march(chain, &flexible, variations, (at, *place), &mut state, integrator)?;
        at = *place;
        new_nodes.push(Node { place: at, p: state.p, R: orthonormal(&state.R), m_body: state.m_body });
        new_columns.push(state.columns[0]);
    }
    Ok((new_nodes, new_columns))
}

/// Nodes moved along their columns.
pub(super) fn along(nodes: &[Node], columns: &[Column], size: f64) -> Vec<Node> {
    let moved = |(node, column): (&Node, &Column)| Node {
        R: orthonormal(&(Rotation3::new(column.w * size).matrix() * node.R)),
        m_body: node.m_body + column.dm_body * size,
        ..*node
    };
    nodes.iter().zip(columns).map(moved).collect()
}

/// Largest change along columns.
pub(super) fn columns_size(chain: &Chain, nodes: &[Node], columns: &[Column]) -> f64 {
    let change = |(node, column): (&Node, &Column)| Change { w: column.w, y: column.dm_body / node_scale(chain, node) };
    size(&nodes.iter().zip(columns).map(change).collect::<Vec<_>>())
}

fn node_scale(chain: &Chain, node: &Node) -> f64 {
    let Place { segment, s } = node.place;
    let numbers = &chain.numbers.segments[segment];
    if !chain.is_flexible[segment] {
        return scale(chain.n_end[segment].norm(), 1.0);
    }
    let n = chain.n_end[segment] + numbers.load * (numbers.length - s);
    scale(n.norm(), numbers.K.x.max(numbers.K.y))
}

/// Changes by rotation and by moment where an interval begins.
fn unit_columns(scale: f64) -> Vec<Column> {
    let unit = |k: usize| Vector3::ith(k, 1.0);
    let turned = (0..3).map(|k| Column { w: unit(k), ..no_column() });
    turned.chain((0..3).map(|k| Column { dm_body: scale * unit(k), ..no_column() })).collect()
}

/// Where unknown k of node i stands: the base turns with nothing.
fn unknown(i: usize, k: usize) -> Option<usize> {
    (OWN * i + k).checked_sub(3)
}

/// Rows of MS4: six for each inner node, three for the tip.
fn system(ends: &[State], scales: &[f64], dresidual: &[Vector3<f64>]) -> Band {
    let last = ends.len() - 1;
    let mut band = Band::new(OWN * ends.len() - 3);
    for (i, end) in ends.iter().enumerate() {
        for (k, (column, dr)) in end.columns.iter().zip(dresidual).enumerate() {
            let Some(at) = unknown(i, k) else { continue };
            let rows = if i < last {
                [column.w, column.dm_body / scales[i + 1]]
            } else {
                [*dr / scales[last], Vector3::zeros()]
            };
            for (row, value) in rows.iter().flat_map(|v| v.iter()).enumerate().take(if i < last { OWN } else { 3 }) {
                band.set(OWN * i + row, at, *value);
            }
        }
        if i < last {
            (0..OWN).for_each(|row| band.set(OWN * i + row, OWN * (i + 1) + row - 3, -1.0));
        }
    }
    band
}
