//! Second paths: rows with a success status are followed from rest once more, by other steps. Where the two ends differ, the
//! reference decides, because it follows in finer steps.
//!
//! A jump stays unseen only if it survives half the first step and half the trust. None of the known jumps did, and no right row
//! was called into question.

use super::check::{Doubts, named_values};
use super::samples::Samples;
use crate::backend::{Backend, BackendError, BackendFactory};
use crate::model::{Batch, Plan, Quantity, Solutions, Status, rotation_angle};
use crate::results::{Doubt, DoubtKind, PathCheck};
use crate::spec::{Sampler, Selection};

/// Which rows are followed twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathCheckOptions {
    /// One of 64, at least 1,024, at most 16,384.
    Share,
    /// Every row.
    All,
}

impl PathCheckOptions {
    fn wanted(self, sample_count: u64) -> u64 {
        match self {
            PathCheckOptions::Share => (sample_count / 64).clamp(1024, 16_384),
            PathCheckOptions::All => sample_count,
        }
    }
}

/// Two ends that differ by less (over the rod's length, or rad) are one equilibrium.
const SAME_END: f64 = 1e-3;
/// Factor of both error estimates, which are added to [`SAME_END`].
const ESTIMATES: f64 = 10.0;
/// Most rows in one call of an engine.
const MAX_BATCH: usize = 1 << 14;

/// Follows rows a second time.
pub(crate) struct SecondPaths<'a> {
    selection: Selection,
    factory: BackendFactory<'a>,
    trusted: BackendFactory<'a>,
    follower: Option<Box<dyn Backend>>,
    judge: Option<Box<dyn Backend>>,
    pub found: PathCheck,
    /// Wrong rows: kind of doubt, then sample, status before, distance (over the rod's length, or rad).
    wrong: Vec<(DoubtKind, (u64, Status, f64))>,
}

impl<'a> SecondPaths<'a> {
    pub fn new(
        sample_count: u64,
        options: PathCheckOptions,
        factory: BackendFactory<'a>,
        trusted: BackendFactory<'a>,
    ) -> SecondPaths<'a> {
        let selection = Selection::new(sample_count, options.wanted(sample_count), 0x9a7);
        let found = PathCheck { all: options == PathCheckOptions::All, ..PathCheck::default() };
        SecondPaths { selection, factory, trusted, follower: None, judge: None, found, wrong: Vec::new() }
    }

    /// Doubts about the rows that were not followed, drawn from those that were; empty where every row was followed.
    pub fn doubts(&self, plan: &Plan, sampler: &Sampler) -> Vec<Doubt> {
        let mut doubts = Doubts::new(plan, sampler, self.found.followed);
        if !self.found.all {
            self.wrong.iter().for_each(|(kind, seen)| doubts.add(*kind, *seen));
        }
        doubts.found
    }

    /// The rows to follow.
    pub fn selection(&self) -> Selection {
        self.selection
    }

    /// Follows the chosen rows among some samples, but for those that are `sure`, in order: the reference has followed them twice. A wrong row is
    /// replaced by the reference's.
    pub fn check(
        &mut self,
        plan: &Plan,
        sampler: &Sampler,
        samples: &Samples<'_>,
        solutions: &mut Solutions,
        sure: &[usize],
    ) -> Result<(), BackendError> {
        let mut places = samples.chosen(self.selection);
        places.retain(|at| solutions.status(*at).is_success());
        let all = places.len();
        places.retain(|at| sure.binary_search(at).is_err());
        let confirmed = (all - places.len()) as u64;
        self.found.followed += confirmed;
        self.found.confirmed += confirmed;
        for group in places.chunks(MAX_BATCH) {
            let again = solve(&mut self.follower, self.factory, plan, |plan| batch(plan, sampler, samples, group))?;
            self.found.followed += group.len() as u64;
            let ends = group.iter().enumerate();
            let differ = ends.filter(|(from, to)| !is_same_end(plan, (solutions, **to), (&again, *from)));
            let differ: Vec<usize> = differ.map(|(_, to)| *to).collect();
            if !differ.is_empty() {
                let truth = solve(&mut self.judge, self.trusted, plan, |plan| batch(plan, sampler, samples, &differ))?;
                for (from, to) in differ.iter().enumerate() {
                    self.decide(plan, sampler, samples.index(*to), (solutions, *to), (&truth, from));
                }
            }
        }
        Ok(())
    }

    /// The reference decides on a row.
    fn decide(
        &mut self,
        plan: &Plan,
        sampler: &Sampler,
        index: u64,
        (solutions, to): (&mut Solutions, usize),
        (truth, from): (&Solutions, usize),
    ) {
        let found = &mut self.found;
        let before = solutions.status(to);
        match decide(plan, (solutions, to), (truth, from)) {
            Decision::Kept => {
                found.confirmed += 1;
                return;
            }
            Decision::Elsewhere(far) => {
                found.elsewhere += 1;
                self.wrong.push((DoubtKind::RowsElsewhere, (index, before, far)));
            }
            Decision::PastFold => {
                found.past_fold += 1;
                self.wrong.push((DoubtKind::RowsPastFold, (index, before, 0.0)));
            }
            Decision::Undecided => found.doubtful += 1,
        }
        if found.sample.is_none_or(|sample| index < sample) {
            found.sample = Some(index);
            found.values = named_values(plan, sampler, index);
        }
    }
}

/// Decision of the reference on a row whose two paths do not end alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Decision {
    /// The row stays: the reference finds the same equilibrium, or has none to put in the place of a row that failed.
    Kept,
    /// The reference finds another equilibrium, so far away (over the rod's length, or rad): its row is taken, as `refined`.
    Elsewhere(f64),
    /// The reference finds a fold before the full load: its row is taken.
    PastFold,
    /// The reference finds nothing certain: the row becomes `doubtful`.
    Undecided,
}

/// Decides on a row by the reference's solution of the same sample, and replaces the row where the reference contradicts it.
/// Sweeps and single solutions both call this.
pub(crate) fn decide(
    plan: &Plan,
    (solutions, to): (&mut Solutions, usize),
    (truth, from): (&Solutions, usize),
) -> Decision {
    let is_solved = solutions.status(to).is_success();
    match truth.status(from) {
        status if status.is_success() => {
            if is_solved && is_same_end(plan, (solutions, to), (truth, from)) {
                return Decision::Kept;
            }
            let far = apart(plan, (solutions, to), (truth, from));
            solutions.copy_row(to, truth, from);
            solutions.set_status(to, Status::Refined);
            Decision::Elsewhere(far)
        }
        _ if !is_solved => Decision::Kept,
        Status::Fold => {
            solutions.copy_row(to, truth, from);
            Decision::PastFold
        }
        Status::ThroughWall if apart(plan, (solutions, to), (truth, from)) <= SAME_END => {
            solutions.set_status(to, Status::ThroughWall);
            Decision::Kept
        }
        _ => {
            solutions.set_status(to, Status::Doubtful);
            Decision::Undecided
        }
    }
}

/// Solves a batch by a backend that is made at the first call; the backend may have a plan of its own.
fn solve<'a>(
    backend: &mut Option<Box<dyn Backend>>,
    factory: BackendFactory<'a>,
    plan: &Plan,
    batch: impl FnOnce(&Plan) -> Batch,
) -> Result<Solutions, BackendError> {
    let made = match backend.take() {
        Some(made) => made,
        None => factory(plan)?,
    };
    let made = backend.insert(made);
    let batch = batch(made.plan());
    made.solve(&batch)
}

fn batch(plan: &Plan, sampler: &Sampler, samples: &Samples<'_>, places: &[usize]) -> Batch {
    plan.batch(places.len(), |at, row| {
        if let Some(place) = places.get(at) {
            sampler.values(samples.index(*place), row);
        }
    })
}

/// Whether two rows are the same equilibrium; `false` where the second row failed.
pub(crate) fn is_same_end(plan: &Plan, (a, at): (&Solutions, usize), (b, from): (&Solutions, usize)) -> bool {
    let estimates = a.get(at, Quantity::ErrorEstimate) + b.get(from, Quantity::ErrorEstimate);
    b.status(from).is_success() && apart(plan, (a, at), (b, from)) <= SAME_END + ESTIMATES * estimates
}

/// Distance of two tips: position over the rod's length, or rotation in radians, whichever is larger.
pub(super) fn apart(plan: &Plan, (a, at): (&Solutions, usize), (b, from): (&Solutions, usize)) -> f64 {
    let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(from, Quantity::TipPosition));
    let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / plan.scene.total_length();
    dp.max(rotation_angle(&a.tip_rotation(at), &b.tip_rotation(from)))
}

#[cfg(test)]
mod tests {
    use super::{Decision, decide};
    use crate::model::{Plan, PlanOptions, Quantity, Solutions, Status};

    const SCENE: &str = r#"name = "rod"
[[segment]]
name = "rod"
kind = "flexible"
length = "100 mm"
stiffness = { bending = "1e-5 N·m²", torsion = "1e-5 N·m²" }
"#;

    fn row(plan: &Plan, status: Status, x: f64) -> Solutions {
        let mut row = Solutions::new(plan, 1);
        row.set_vector(0, Quantity::TipPosition, [x, 0.0, 0.1]);
        row.set_vector(0, Quantity::TipD1, [1.0, 0.0, 0.0]);
        row.set_vector(0, Quantity::TipTangent, [0.0, 0.0, 1.0]);
        row.set(0, Quantity::ErrorEstimate, 1e-9);
        row.set_status(0, status);
        row
    }

    #[test]
    fn the_reference_decides_alike_for_sweeps_and_single_solutions() {
        let scene = crate::input::parse_scene("scene.toml".as_ref(), SCENE).expect("a scene");
        let plan = Plan::single(&scene, &[], PlanOptions::default()).expect("a plan");
        let decided = |own: Status, truth: Status, apart: f64| {
            let mut own = row(&plan, own, 0.0);
            let decision = decide(&plan, (&mut own, 0), (&row(&plan, truth, apart), 0));
            (decision, own.status(0), own.vector(0, Quantity::TipPosition)[0])
        };
        assert_eq!(decided(Status::Ok, Status::Ok, 1e-6), (Decision::Kept, Status::Ok, 0.0));
        assert_eq!(decided(Status::Ok, Status::Fold, 0.01), (Decision::PastFold, Status::Fold, 0.01));
        assert_eq!(decided(Status::Ok, Status::StepLimit, 0.01), (Decision::Undecided, Status::Doubtful, 0.0));
        assert_eq!(decided(Status::Fold, Status::Fold, 0.01), (Decision::Kept, Status::Fold, 0.0));
        for own in [Status::Ramped, Status::Fold] {
            let (decision, status, x) = decided(own, Status::Ok, 0.01);
            let Decision::Elsewhere(far) = decision else { panic!("{decision:?}") };
            assert!((far - 0.1).abs() < 1e-9 && status == Status::Refined && x == 0.01, "{far} {status:?} {x}");
        }
    }
}
