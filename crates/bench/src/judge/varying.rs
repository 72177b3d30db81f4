//! Elimination in a field that varies: places of nodes and strains of elements are moved, too.

use super::chain::Chain;
use super::load::{Arms, Potential, potential};
use super::state::{Look, Move, State, bend, firmness, softness};
use super::turn::{hat, second_order};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Strain of an element, rotation of the node behind it, place and rotation of the node before it.
const Y: usize = 0;
const NEXT: usize = 3;
const P: usize = 6;
const W: usize = 9;

type Block = SMatrix<f64, 12, 12>;
/// Newton's step, and the slope by the load.
type Sides = SMatrix<f64, 12, 2>;

/// What elimination keeps of an element: strain and rotation are -sides - by (p, w) of the node before.
#[derive(Clone, Copy)]
struct Kept {
    by: SMatrix<f64, 6, 12>,
    sides: SMatrix<f64, 6, 2>,
}

/// Newton's step and the tangent of the path; with the moment at the tip as it is, or the symmetric part alone.
pub fn eliminate(chain: &Chain, state: &State, share: f64, arms: Arms, with_moment: bool) -> Option<Look> {
    let last = chain.elements.len();
    let mut kept = Vec::with_capacity(last);
    let (mut softest, mut whole) = (f64::INFINITY, 1.0);
    let loads = |i: usize| potential(chain, i, (&state.p[i], &state.R[i]), share, arms);
    let mut ahead = loads(last);
    if let Some(moment) = chain.tip_moment.filter(|_| with_moment) {
        ahead.ww -= 0.5 * share * hat(&moment);
    }
    // Gradient by a shift of all beyond; elimination changes `ahead.p`, not this.
    let mut force = ahead.p;
    for i in (0..last).rev() {
        let (mut block, mut sides, at_rest) = assemble(chain, state, i, &ahead, &force, arms)?;
        let mut one = Kept { by: SMatrix::zeros(), sides: SMatrix::zeros() };
        for (at, at_rest) in [(Y, at_rest[0]), (NEXT, at_rest[1])] {
            let pivot = block.fixed_view::<3, 3>(at, at).into_owned();
            whole *= firmness(&pivot, &at_rest);
            softest = softest.min(softness(&pivot, &at_rest));
            let inverse = pivot.try_inverse()?;
            let rows = inverse * block.fixed_view::<3, 12>(at, 0);
            let own = inverse * sides.fixed_view::<3, 2>(at, 0);
            let columns = block.fixed_view::<12, 3>(0, at).into_owned();
            block -= columns * rows;
            sides -= columns * own;
            one.by.fixed_view_mut::<3, 12>(at, 0).copy_from(&rows);
            one.sides.fixed_view_mut::<3, 2>(at, 0).copy_from(&own);
        }
        kept.push(one);
        let part = |row, col| block.fixed_view::<3, 3>(row, col).into_owned();
        let side = |row: usize, col: usize| sides.fixed_view::<3, 1>(row, col).into_owned();
        let mut before = if i > 0 { loads(i) } else { Potential::default() };
        force += before.p;
        before.add(&Potential {
            p: side(P, 0),
            w: side(W, 0),
            p_slope: side(P, 1),
            w_slope: side(W, 1),
            pp: part(P, P),
            pw: part(P, W),
            wp: part(W, P),
            ww: part(W, W),
        });
        ahead = before;
    }
    kept.reverse();
    let softest = if with_moment && chain.tip_moment.is_some() { whole } else { softest };
    Some(Look { softest, ..back(chain, state, &kept) })
}

/// Second variation and gradient of an element and of all behind it, and pivots of the element alone.
fn assemble(
    chain: &Chain,
    state: &State,
    i: usize,
    ahead: &Potential,
    force: &Vector3<f64>,
    arms: Arms,
) -> Option<(Block, Sides, [Matrix3<f64>; 2])> {
    let element = &chain.elements[i];
    let bend = bend(element, &state.q[i], &state.q[i + 1], &state.R[i])?;
    let (half, C) = (0.5 * element.h, Matrix3::from_diagonal(&element.compliance));
    let (R, R_next) = (&state.R[i], &state.R[i + 1]);
    let along = Vector3::z() + C * state.y[i];
    let (along_here, along_next) = (half * (R * along), half * (R_next * along));
    let jump = |arm: f64| arm * chain.nodes[i].jump * R.column(2) + along_here;
    let (work, motion) = (jump(arms.work), jump(arms.motion));
    // How the place of the node behind moves, by columns y, w behind, p, w; and by rows for what does work.
    let strained = half * (R + R_next) * C;
    let (mut moves, mut works) = (SMatrix::<f64, 3, 12>::zeros(), SMatrix::<f64, 3, 12>::zeros());
    for (all, reach) in [(&mut moves, &motion), (&mut works, &work)] {
        all.fixed_view_mut::<3, 3>(0, Y).copy_from(&strained);
        all.fixed_view_mut::<3, 3>(0, NEXT).copy_from(&-hat(&along_next));
        all.fixed_view_mut::<3, 3>(0, P).copy_from(&Matrix3::identity());
        all.fixed_view_mut::<3, 3>(0, W).copy_from(&-hat(reach));
    }
    let mut block: Block = works.transpose() * ahead.pp * moves;
    let mut rows = block.fixed_view_mut::<3, 12>(NEXT, 0);
    rows += ahead.wp * moves;
    let mut columns = block.fixed_view_mut::<12, 3>(0, NEXT);
    columns += works.transpose() * ahead.pw;
    let mut add = |row: usize, col: usize, m: Matrix3<f64>| {
        let mut part = block.fixed_view_mut::<3, 3>(row, col);
        part += m;
    };
    let twist = 0.5 * hat(&bend.m);
    add(NEXT, NEXT, ahead.ww + bend.H + second_order(&along_next, force));
    add(NEXT, W, -bend.H - twist);
    add(W, NEXT, -bend.H + twist);
    add(W, W, bend.H + second_order(&work, force));
    let rigid = element.compliance.map(|c| if c == 0.0 { 1.0 } else { 0.0 });
    let strain = element.h * C + Matrix3::from_diagonal(&rigid);
    add(Y, Y, strain);
    for (at, R) in [(NEXT, R_next), (W, R)] {
        let pulled = half * C * R.transpose() * hat(force);
        add(Y, at, pulled);
        add(at, Y, pulled.transpose());
    }
    let mut sides = Sides::zeros();
    sides.column_mut(0).copy_from(&(works.transpose() * ahead.p));
    sides.column_mut(1).copy_from(&(works.transpose() * ahead.p_slope));
    let mut add = |row: usize, col: usize, v: Vector3<f64>| {
        let mut part = sides.fixed_view_mut::<3, 1>(row, col);
        part += v;
    };
    add(NEXT, 0, ahead.w + bend.m);
    add(NEXT, 1, ahead.w_slope);
    add(W, 0, -bend.m);
    add(Y, 0, element.h * C * state.y[i]);
    Some((block, sides, [strain, bend.H]))
}

/// From the base to the tip.
fn back(chain: &Chain, state: &State, kept: &[Kept]) -> Look {
    let nothing = Move { w: vec![Vector3::zeros()], y: Vec::new() };
    let mut found = Look { step: nothing.clone(), tangent: nothing, softest: 0.0 };
    for (side, of) in [&mut found.step, &mut found.tangent].into_iter().enumerate() {
        let mut dp = Vector3::zeros();
        for (i, element) in chain.elements.iter().enumerate() {
            let (one, w) = (&kept[i], of.w[i]);
            let mut next = -one.sides.fixed_view::<3, 1>(NEXT, side).into_owned();
            next -= one.by.fixed_view::<3, 3>(NEXT, P) * dp + one.by.fixed_view::<3, 3>(NEXT, W) * w;
            let mut y = -one.sides.fixed_view::<3, 1>(Y, side).into_owned();
            y -= one.by.fixed_view::<3, 3>(Y, NEXT) * next;
            y -= one.by.fixed_view::<3, 3>(Y, P) * dp + one.by.fixed_view::<3, 3>(Y, W) * w;
            let (half, C) = (0.5 * element.h, &element.compliance);
            let along = Vector3::z() + C.component_mul(&state.y[i]);
            let (R, R_next) = (&state.R[i], &state.R[i + 1]);
            dp += w.cross(&(chain.nodes[i].jump * R.column(2) + half * (R * along)));
            dp += half * (next.cross(&(R_next * along)) + (R + R_next) * C.component_mul(&y));
            of.w.push(next);
            of.y.push(y);
        }
    }
    found
}
