//! Potential of the loads of one node: its gradient and Hessian by the node's place (p) and rotation (w).

use super::chain::{Chain, Node};
use super::turn::{hat, second_order};
use nalgebra::{Matrix3, Vector3};

/// Gradient and Hessian of a potential, and how the gradient changes with the load. Rows are what is varied, columns what moves.
#[derive(Clone, Copy, Default)]
pub struct Potential {
    pub p: Vector3<f64>,
    pub w: Vector3<f64>,
    pub p_slope: Vector3<f64>,
    pub w_slope: Vector3<f64>,
    pub pp: Matrix3<f64>,
    pub pw: Matrix3<f64>,
    pub wp: Matrix3<f64>,
    pub ww: Matrix3<f64>,
}

/// Whether rigid segments add to displacements that do work, and to those that move (1 or 0). Without the arm of forces the
/// balance of moments has only the second, and stability neither.
#[derive(Clone, Copy)]
pub struct Arms {
    pub work: f64,
    pub motion: f64,
}

impl Potential {
    /// Adds -b · a, a turning with the node.
    fn turns(&mut self, a: &Vector3<f64>, b: &Vector3<f64>) {
        self.w -= a.cross(b);
        self.ww -= second_order(a, b);
    }

    /// Adds another.
    pub fn add(&mut self, other: &Potential) {
        self.p += other.p;
        self.w += other.w;
        self.p_slope += other.p_slope;
        self.w_slope += other.w_slope;
        self.pp += other.pp;
        self.pw += other.pw;
        self.wp += other.wp;
        self.ww += other.ww;
    }
}

/// The loads of node i at p, R under a share of the full load; where a wall comes, under the full load after a share of its way.
pub fn potential(chain: &Chain, i: usize, (p, R): (&Vector3<f64>, &Matrix3<f64>), share: f64, arms: Arms) -> Potential {
    let node: &Node = &chain.nodes[i];
    let (share, on_the_way) = if chain.wall.is_some() { (1.0, share) } else { (share, 0.0) };
    let mut sum = Potential::default();
    let t = R.column(2).into_owned();
    sum.turns(&t, &node.c);
    sum.turns(&(R * node.mu), &chain.B);
    if let Some(field) = &chain.field {
        sum.p -= node.f;
        for point in &node.points {
            let mu = R * point.mu;
            let at = field.at(&(p + point.offset * t), &mu);
            let (by_work, by_motion) = (arms.work * point.offset, arms.motion * point.offset);
            let F = at.G * mu;
            sum.p -= F;
            sum.turns(&mu, &at.B);
            sum.turns(&t, &(by_work * F));
            let (by_mu, by_t) = (hat(&mu), hat(&t));
            sum.pp -= at.T;
            sum.pw += at.G * by_mu + by_motion * at.T * by_t;
            sum.wp -= by_mu * at.G + by_work * by_t * at.T;
            sum.ww += by_motion * by_mu * at.G * by_t + by_work * by_t * at.G * by_mu;
            sum.ww += by_work * by_motion * by_t * at.T * by_t;
        }
    }
    (sum.p_slope, sum.w_slope) = (sum.p, sum.w);
    (sum.p, sum.w) = (share * sum.p, share * sum.w);
    (sum.pp, sum.ww) = (share * sum.pp, share * sum.ww);
    (sum.pw, sum.wp) = (share * sum.pw, share * sum.wp);
    for k in [i.wrapping_sub(1), i] {
        if let Some(element) = chain.elements.get(k).filter(|element| element.yields() && chain.field.is_none()) {
            strain(&mut sum, &element.n, &element.compliance, R, 0.5 * element.h, share);
        }
    }
    if let Some(moment) = chain.tip_moment.filter(|_| i + 1 == chain.nodes.len()) {
        sum.w -= share * moment;
        sum.w_slope -= moment;
    }
    if let Some(wall) = &chain.wall {
        (sum.p_slope, sum.w_slope) = (Vector3::zeros(), Vector3::zeros());
        if i + 1 == chain.nodes.len() {
            let (by_work, by_motion) = (arms.work * node.jump, arms.motion * node.jump);
            let push = wall.push(&(p + node.jump * t), on_the_way);
            sum.p -= push.F;
            sum.p_slope -= push.slope;
            sum.w_slope -= by_work * t.cross(&push.slope);
            sum.turns(&t, &(by_work * push.F));
            let by_t = hat(&t);
            sum.pp -= push.D;
            sum.pw += by_motion * push.D * by_t;
            sum.wp -= by_work * by_t * push.D;
            sum.ww += by_work * by_motion * by_t * push.D * by_t;
        }
    }
    sum
}

/// Adds -n · C n / 2 over a length, C turning with the node: what shear and stretch yield under a known force.
fn strain(sum: &mut Potential, n: &Vector3<f64>, compliance: &Vector3<f64>, R: &Matrix3<f64>, length: f64, share: f64) {
    let C = R * Matrix3::from_diagonal(compliance) * R.transpose();
    let y = C * n;
    let slope = -length * y.cross(n);
    let across = hat(n);
    sum.w += share * share * slope;
    sum.w_slope += 2.0 * share * slope;
    sum.ww += share * share * length * (across * C * across - second_order(n, &y));
}
