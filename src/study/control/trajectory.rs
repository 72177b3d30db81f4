//! One target after another, each from where the last one ended.

use super::descent::Descent;
use super::{Control, ControlError, Controlled, Target};
use std::time::Instant;

impl Control {
    /// Inputs for each target of a trajectory. The first is reached from rest.
    pub fn follow(&mut self, targets: &[Target]) -> Result<Vec<Controlled>, ControlError> {
        // Within the thread pool, or every step would wait for one of its threads to wake.
        let (ended, seconds) = rayon::scope(|_| self.descend(targets))?;
        let mut results = self.results(&ended)?;
        results.iter_mut().zip(seconds).for_each(|(result, seconds)| result.seconds = seconds);
        Ok(results)
    }

    fn descend(&mut self, targets: &[Target]) -> Result<(Vec<Descent>, Vec<f64>), ControlError> {
        let mut state = self.start(self.task.home)?;
        let (mut ended, mut seconds) = (Vec::new(), Vec::new());
        for (index, target) in targets.iter().enumerate() {
            let begun = Instant::now();
            let mut descent = Descent::new(&self.task, state.clone(), *target);
            while let Some((z, m0)) = descent.propose(&self.task) {
                let solutions = if index == 0 { self.solve_from_rest(&[z])? } else { self.continued(&[(z, m0)])? };
                descent.judge(&self.task, &solutions, 0);
            }
            seconds.push(begun.elapsed().as_secs_f64());
            state = descent.at.clone();
            ended.push(descent);
        }
        Ok((ended, seconds))
    }
}
