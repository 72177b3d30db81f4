//! One target after another, each from where the last one ended; where that is plain, several together.

use super::descent::{Descent, Ended, State};
use super::window::{HISTORY, WINDOW};
use super::{ControlError, Controller, Outcome, TargetResult};
use crate::model::Solutions;
use crate::spec::{Redundancy, Target};
use std::sync::Arc;
use std::time::Instant;

/// What each target took.
struct Effort {
    equilibria: Vec<usize>,
    seconds: Vec<f64>,
}

impl Controller {
    /// Inputs for each target of a trajectory. The first is reached from rest.
    ///
    /// Points that follow from those before without doubt are solved together. It makes no difference to what is found.
    ///
    /// # Errors
    ///
    /// No stable equilibrium to begin from, or an engine that fails.
    pub fn follow(&mut self, targets: &[Target]) -> Result<Vec<TargetResult>, ControlError> {
        self.follow_by(targets, WINDOW)
    }

    /// The same, a point at a time: as a controller would that learns of each target when the last is reached.
    ///
    /// # Errors
    ///
    /// As [`Controller::follow`].
    pub fn follow_singly(&mut self, targets: &[Target]) -> Result<Vec<TargetResult>, ControlError> {
        self.follow_by(targets, 1)
    }

    fn follow_by(&mut self, targets: &[Target], most: usize) -> Result<Vec<TargetResult>, ControlError> {
        let mut effort = Effort { equilibria: vec![0; targets.len()], seconds: vec![0.0; targets.len()] };
        // Within the thread pool, or every step would wait for one of its threads to wake.
        let resolution = self.engines.resolution;
        let ended = rayon::scope(|_| self.descend(targets, most, &mut effort));
        self.engines.resolution = resolution;
        let ended = ended?;
        let mut results = self.results(&ended)?;
        for (result, (equilibria, seconds)) in results.iter_mut().zip(effort.equilibria.into_iter().zip(effort.seconds))
        {
            (result.iterations, result.seconds) = (equilibria, seconds);
        }
        Ok(results)
    }

    /// At the lowest resolution that suffices for every point.
    fn descend(&mut self, targets: &[Target], most: usize, effort: &mut Effort) -> Result<Vec<Ended>, ControlError> {
        let (tolerance, finest) = (self.engines.fine_enough(), self.engines.finest());
        for resolution in 0..finest {
            self.engines.resolution = resolution;
            if let Some(ended) = self.descend_at(targets, most, tolerance, effort)? {
                return Ok(ended);
            }
        }
        self.engines.resolution = finest;
        Ok(self.descend_at(targets, most, f64::INFINITY, effort)?.unwrap_or_default())
    }

    /// `None` as soon as a point is not reached, or to less than the tolerance of the integration, unless that is infinite.
    fn descend_at(
        &mut self,
        targets: &[Target],
        most: usize,
        tolerance: f64,
        effort: &mut Effort,
    ) -> Result<Option<Vec<Ended>>, ControlError> {
        let task = Arc::clone(&self.task);
        // Currents that relax depend on the way there.
        let can_advance = task.options.redundancy == Redundancy::LeastChange;
        // The last states, the latest first; more than one where they were reached.
        let mut last = vec![self.start(self.home)?];
        let mut ended: Vec<Ended> = Vec::with_capacity(targets.len());
        let mut together = 1;
        let mut solutions = Solutions::default();
        while ended.len() < targets.len() {
            let begun = Instant::now();
            let at = ended.len();
            let mut count = 1;
            let mut states = Vec::new();
            if can_advance && ended.last().is_some_and(|point| point.outcome == Outcome::Reached) {
                count = together.min(targets.len() - at);
                let (targets, spent) = (&targets[at..at + count], &mut effort.equilibria[at..at + count]);
                states = self.advance(&last, targets, spent, &mut solutions)?;
                together = if states.len() == count { (2 * together).min(most) } else { 1 };
            }
            if states.is_empty() && count == 1 {
                let descent = self.descend_to(&targets[at], &last[0], at == 0, &mut solutions)?;
                effort.equilibria[at] += descent.iterations;
                if descent.outcome != Some(Outcome::Reached) {
                    last.clear();
                }
                last.insert(0, descent.at.clone());
                ended.push(descent.ended(&task));
            }
            for state in states {
                last.insert(0, state.clone());
                ended.push(Descent::new(&task, state, targets[ended.len()]).ended(&task));
            }
            let share = begun.elapsed().as_secs_f64() / count as f64;
            effort.seconds[at..at + count].iter_mut().for_each(|seconds| *seconds += share);
            let is_good = |point: &Ended| point.outcome == Outcome::Reached && point.error(&task) <= tolerance;
            if tolerance.is_finite() && !ended[at..].iter().all(is_good) {
                return Ok(None);
            }
            last.truncate(HISTORY);
        }
        Ok(Some(ended))
    }

    /// The way to one target from a state; the first time by equilibria from rest.
    fn descend_to(
        &mut self,
        target: &Target,
        from: &State,
        is_first: bool,
        solutions: &mut Solutions,
    ) -> Result<Descent, ControlError> {
        let task = Arc::clone(&self.task);
        let mut descent = Descent::new(&task, from.clone(), *target);
        while let Some((z, m0)) = descent.propose(&task) {
            if is_first {
                *solutions = self.engines.solve_from_rest(&[z])?;
            } else {
                self.engines.continued(&[(z, m0)], solutions)?;
            }
            descent.judge(&task, solutions, 0);
        }
        Ok(descent)
    }
}
