//! A share of a study's equilibria, solved again by the reference.

use crate::backend::{Backend, BackendError};
use crate::engines::witness;
use crate::model::{ContactColumn, Parameter, Plan, PlanError, PlanOptions, Quantity, Scene, Vector};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};

/// Share of the equilibria that is checked, and so many at least and at most.
const SHARE: f64 = 1e-3;
const LEAST: usize = 64;
const MOST: usize = 1024;
/// The same at least where the reference takes 20 ms to 2 s each: limp and taut rods, fields that vary.
const LEAST_OF_SLOW: usize = 8;
/// A tip is elsewhere that is off by so many times its own estimate, and by more than this share of the rod's length. A normal
/// force is another that is off so, the share being of the larger of itself and EI/L².
const WRONG: f64 = 10.0;
const ELSEWHERE: f64 = 1e-4;

/// What the reference says of a share of a study's equilibria.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct WitnessCheck {
    /// Solved again.
    pub checked: usize,
    /// There are so many.
    pub of: usize,
    /// The reference finds another equilibrium, or none.
    pub wrong: usize,
    /// The largest distance of two tips, over the rod's length.
    pub farthest: f64,
    /// The largest difference of two normal forces (N); `None` where none were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_force: Option<f64>,
    /// What speaks against the study, in a sentence; `None`: nothing that is known.
    pub mark: Option<String>,
}

/// An equilibrium from rest that a study found.
#[derive(Clone)]
pub(in crate::study) struct Claim {
    /// Values of the inputs.
    pub inputs: Vec<f64>,
    /// World frame (m).
    pub tip: Vector,
    /// Over the rod's length.
    pub error_estimate: f64,
}

/// The normal force of a tip on a wall, as a study found it.
#[derive(Clone, Copy)]
pub(in crate::study) struct Press {
    /// Along the normal (N).
    pub force: f64,
    /// Its estimated error (N).
    pub error: f64,
}

/// Whether the caller wants a job ended.
pub(in crate::study) fn is_raised(interrupt: Option<&AtomicBool>) -> bool {
    interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// The answer of a study in one line: it begins with what speaks against it.
pub(in crate::study) fn with_mark(mark: Option<&str>, answer: String) -> String {
    match mark {
        Some(mark) => format!("{mark}; {answer}"),
        None => answer,
    }
}

/// Why a check cannot be made.
#[derive(Debug, thiserror::Error)]
pub(in crate::study) enum CheckError {
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
}

impl WitnessCheck {
    /// In a sentence, for those who read results.
    pub fn sentence(&self) -> String {
        match (&self.mark, self.checked) {
            (Some(mark), _) => mark.clone(),
            (None, 0) => "not checked against the reference".into(),
            (None, some) => {
                let forces = self
                    .farthest_force
                    .map_or(String::new(), |most| format!(", normal forces by at most {most:.1e} N"));
                format!(
                    "{some} of {} equilibria were checked against the reference: tips differ by at most {:.1e} of the length{forces}",
                    self.of, self.farthest
                )
            }
        }
    }

    /// Solves an even choice of equilibria again; `inputs` are what each value of a claim drives.
    pub(in crate::study) fn of(
        scene: &Scene,
        inputs: &[Vec<Parameter>],
        count: usize,
        claim: &mut dyn FnMut(usize) -> Option<Claim>,
    ) -> Result<WitnessCheck, CheckError> {
        let mut bare = |at| claim(at).map(|claim| (claim, None));
        Ok(WitnessCheck::of_presses(scene, inputs, count, &mut bare, None)?.unwrap_or_default())
    }

    /// Solves an even choice of equilibria again and compares normal forces, too; `None` where the flag was raised.
    pub(in crate::study) fn of_presses(
        scene: &Scene,
        inputs: &[Vec<Parameter>],
        count: usize,
        claim: &mut dyn FnMut(usize) -> Option<(Claim, Option<Press>)>,
        interrupt: Option<&AtomicBool>,
    ) -> Result<Option<WitnessCheck>, CheckError> {
        let rod = scene.rod();
        let least = if rod.field.is_some() || rod.is_too_limp() { LEAST_OF_SLOW } else { LEAST };
        let wanted = ((count as f64 * SHARE).ceil() as usize).clamp(least, MOST).min(count);
        let chosen = (0..wanted).map(|k| k * count / wanted.max(1));
        let claims: Vec<(Claim, Option<Press>)> = chosen.filter_map(claim).collect();
        let mut check = WitnessCheck { checked: claims.len(), of: count, ..WitnessCheck::default() };
        if claims.is_empty() {
            return Ok(Some(check));
        }
        let plan = Plan::new(scene, inputs, &[], PlanOptions::default())?;
        let mut witness = witness(&plan);
        // A flag is looked at after as many rows as there are threads.
        let size = if interrupt.is_some() { rayon::current_num_threads() } else { claims.len() };
        for claims in claims.chunks(size) {
            if is_raised(interrupt) {
                return Ok(None);
            }
            check.compare(&plan, witness.as_mut(), claims)?;
        }
        check.mark = (check.wrong > 0).then(|| {
            format!(
                "DISTRUSTED: {} of {} equilibria that were checked against the reference are not those that it finds",
                check.wrong, check.checked
            )
        });
        Ok(Some(check))
    }

    /// Solves some equilibria again, and counts those that are others.
    fn compare(
        &mut self,
        plan: &Plan,
        witness: &mut dyn Backend,
        claims: &[(Claim, Option<Press>)],
    ) -> Result<(), CheckError> {
        let batch = plan.batch(claims.len(), |at, row| {
            if let Some((claim, _)) = claims.get(at) {
                row.copy_from_slice(&claim.inputs);
            }
        });
        let truth = witness.solve(&batch)?;
        for (at, (claim, press)) in claims.iter().enumerate() {
            if truth.status(at).name() == "doubtful" {
                // It cannot decide.
                self.checked -= 1;
                continue;
            }
            let p = truth.vector(at, Quantity::TipPosition);
            let length = plan.sample_rod(&batch, at).total_length();
            let far = (0..3).map(|k| (p[k] - claim.tip[k]).powi(2)).sum::<f64>().sqrt() / length;
            let other = press.map(|press| {
                let force = truth.contact(at, ContactColumn::NormalForce);
                let allowed = (ELSEWHERE * force.abs().max(plan.units.force)).max(WRONG * press.error);
                ((force - press.force).abs(), allowed)
            });
            let is_solved = truth.status(at).is_success();
            if is_solved {
                self.farthest = self.farthest.max(far);
                if let Some((off, _)) = other {
                    self.farthest_force = Some(self.farthest_force.map_or(off, |most| most.max(off)));
                }
            }
            let is_off = |off: f64, allowed: f64| off.is_nan() || off > allowed;
            let is_elsewhere = is_off(far, ELSEWHERE.max(WRONG * claim.error_estimate));
            let presses_otherwise = other.is_some_and(|(off, allowed)| is_off(off, allowed));
            self.wrong += usize::from(!is_solved || is_elsewhere || presses_otherwise);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Claim, Press, WitnessCheck, with_mark};
    use crate::engines::cpu_f64;
    use crate::input::parse_scene;
    use crate::model::{ContactColumn, Parameter, Plan, PlanOptions, Quantity};
    use std::sync::atomic::AtomicBool;

    const SCENE: &str = r#"name = "rod"
[field]
flux_density = [0, 0, 3]
[[segment]]
name = "tube"
kind = "flexible"
length = "50 mm"
stiffness = { bending = "4e-6 N·m²", torsion = "3e-6 N·m²" }
[[segment]]
name = "coil"
kind = "rigid"
length = "10 mm"
coil = { turns_area = [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]], current = [0, 0, 0] }
"#;

    /// 200 tips along a line of currents, of which some are moved by a share of the rod's length; what the check says of them.
    fn check(moved: &[usize], by: f64, error_estimate: f64) -> WitnessCheck {
        let scene = parse_scene("scene.toml".as_ref(), SCENE).unwrap();
        let inputs = [Parameter::parse(&scene, "coil.current.y").unwrap()];
        let plan = Plan::new(&scene, &inputs, &[], PlanOptions::default()).unwrap();
        let current = |at: usize| 1e-4 * at as f64;
        let batch = plan.batch(200, |at, row| row[0] = current(at));
        let rows = cpu_f64(&plan).unwrap().solve(&batch).unwrap();
        let length = scene.rod().total_length();
        let mut claim = |at: usize| {
            let mut tip = rows.vector(at, Quantity::TipPosition);
            if moved.contains(&at) {
                tip[1] += by * length;
            }
            Some(Claim { inputs: vec![current(at)], tip, error_estimate })
        };
        WitnessCheck::of(&scene, &inputs, 200, &mut claim).unwrap()
    }

    #[test]
    fn tips_elsewhere_are_marked() {
        let sound = check(&[], 0.0, 1e-8);
        assert_eq!((sound.checked, sound.of, sound.wrong), (64, 200, 0), "{sound:?}");
        assert!(sound.mark.is_none() && sound.farthest < 1e-6, "{sound:?}");
        assert!(sound.sentence().starts_with("64 of 200 equilibria were checked"), "{}", sound.sentence());
        // Samples 0, 3, 6, 9, ... are checked.
        let wrong = check(&[0, 9, 10], 2e-3, 1e-8);
        assert_eq!(wrong.wrong, 2, "{wrong:?}");
        assert!((wrong.farthest - 2e-3).abs() < 1e-5, "{wrong:?}");
        let mark = wrong.mark.as_deref().unwrap_or_default();
        assert!(mark.starts_with("DISTRUSTED: 2 of 64 equilibria"), "{mark}");
        assert_eq!(wrong.sentence(), mark);
        // A distance that the estimate allows counts as the same place.
        assert_eq!(check(&[0, 9], 2e-3, 1e-3).wrong, 0);
        let not_a_number = check(&[0], f64::NAN, 1e-8);
        assert_eq!(not_a_number.wrong, 1, "{not_a_number:?}");
    }

    const WALL: &str = r#"name = "wire"
[wall]
kind = "plane"
position = ["2 mm", 0, 0]
normal = [1, 0, 0]
stiffness = "10 N/m"
[[segment]]
name = "wire"
kind = "flexible"
length = "100 mm"
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
"#;

    /// Normal forces of a wire that is pushed aside, of which some are off by a share of themselves.
    fn check_forces(off: &[usize], by: f64, error: f64, interrupt: Option<&AtomicBool>) -> Option<WitnessCheck> {
        let scene = parse_scene("scene.toml".as_ref(), WALL).unwrap();
        let inputs = [Parameter::parse(&scene, "base.position.x").unwrap()];
        let plan = Plan::new(&scene, &inputs, &[], PlanOptions::default()).unwrap();
        let place = |at: usize| 1e-5 * at as f64;
        let batch = plan.batch(64, |at, row| row[0] = place(at));
        let rows = cpu_f64(&plan).unwrap().solve(&batch).unwrap();
        let mut claim = |at: usize| {
            let right = rows.contact(at, ContactColumn::NormalForce);
            assert!(right > 0.0, "{at}: {right} N");
            let force = right * if off.contains(&at) { 1.0 + by } else { 1.0 };
            let tip = rows.vector(at, Quantity::TipPosition);
            Some((Claim { inputs: vec![place(at)], tip, error_estimate: 1e-8 }, Some(Press { force, error })))
        };
        WitnessCheck::of_presses(&scene, &inputs, 64, &mut claim, interrupt).unwrap()
    }

    #[test]
    fn other_normal_forces_are_marked() {
        // Beside a wall samples 0, 8, 16, ... are checked.
        let sound = check_forces(&[], 0.0, 0.0, None).expect("no flag");
        assert_eq!((sound.checked, sound.wrong), (8, 0), "{sound:?}");
        assert!(sound.farthest_force.is_some_and(|most| most < 1e-9), "{sound:?}");
        assert!(sound.sentence().contains("normal forces by at most"), "{}", sound.sentence());
        let wrong = check_forces(&[8, 9, 24], 0.1, 0.0, None).expect("no flag");
        assert_eq!(wrong.wrong, 2, "{wrong:?}");
        assert!(wrong.farthest < 1e-6, "the tips are where they were: {wrong:?}");
        // A difference that the estimate allows counts as the same force.
        assert_eq!(check_forces(&[8, 24], 0.1, 1.0, None).expect("no flag").wrong, 0);
        assert_eq!(check_forces(&[8], f64::NAN, 1.0, None).expect("no flag").wrong, 1);
        let raised = AtomicBool::new(true);
        assert_eq!(check_forces(&[], 0.0, 0.0, Some(&raised)), None);
    }

    #[test]
    fn an_answer_begins_with_what_speaks_against_it() {
        assert_eq!(with_mark(Some("DISTRUSTED: 1 of 2"), "area = 3".into()), "DISTRUSTED: 1 of 2; area = 3");
        assert_eq!(with_mark(None, "area = 3".into()), "area = 3");
    }
}
