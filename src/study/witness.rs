//! A share of a study's equilibria, solved again by the reference.

use crate::backend::BackendError;
use crate::engines::witness;
use crate::model::{Parameter, Plan, PlanError, PlanOptions, Quantity, Scene, Vector};
use serde::Serialize;

/// Share of the equilibria that is checked, and so many at least and at most.
const SHARE: f64 = 1e-3;
const LEAST: usize = 64;
const MOST: usize = 1024;
/// The same at least where the reference takes 20 ms to 2 s each: limp and taut rods, fields that vary.
const LEAST_OF_SLOW: usize = 8;
/// A tip is elsewhere that is off by so many times its own estimate, and by more than this share of the rod's length.
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
            (None, some) => format!(
                "{some} of {} equilibria were checked against the reference: tips differ by at most {:.1e} of the length",
                self.of, self.farthest
            ),
        }
    }

    /// Solves an even choice of equilibria again; `inputs` are what each value of a claim drives.
    pub(in crate::study) fn of(
        scene: &Scene,
        inputs: &[Vec<Parameter>],
        count: usize,
        claim: &mut dyn FnMut(usize) -> Option<Claim>,
    ) -> Result<WitnessCheck, CheckError> {
        let rod = scene.rod();
        let least = if rod.field.is_some() || rod.is_too_limp() { LEAST_OF_SLOW } else { LEAST };
        let wanted = ((count as f64 * SHARE).ceil() as usize).clamp(least, MOST).min(count);
        let chosen = (0..wanted).map(|k| k * count / wanted.max(1));
        let claims: Vec<Claim> = chosen.filter_map(claim).collect();
        let mut check = WitnessCheck { checked: claims.len(), of: count, ..WitnessCheck::default() };
        if claims.is_empty() {
            return Ok(check);
        }
        let plan = Plan::new(scene, inputs, &[], PlanOptions::default())?;
        let batch = plan.batch(claims.len(), |at, row| {
            if let Some(claim) = claims.get(at) {
                row.copy_from_slice(&claim.inputs);
            }
        });
        let truth = witness(&plan).solve(&batch)?;
        for (at, claim) in claims.iter().enumerate() {
            let p = truth.vector(at, Quantity::TipPosition);
            let length = plan.sample_rod(&batch, at).total_length();
            let far = (0..3).map(|k| (p[k] - claim.tip[k]).powi(2)).sum::<f64>().sqrt() / length;
            if truth.status(at).name() == "doubtful" {
                // It cannot decide.
                check.checked -= 1;
                continue;
            }
            let is_solved = truth.status(at).is_success();
            if is_solved {
                check.farthest = check.farthest.max(far);
            }
            let allowed = ELSEWHERE.max(WRONG * claim.error_estimate);
            check.wrong += usize::from(!is_solved || far.is_nan() || far > allowed);
        }
        check.mark = (check.wrong > 0).then(|| {
            format!(
                "DISTRUSTED: {} of {} equilibria that were checked against the reference are not those that it finds",
                check.wrong, check.checked
            )
        });
        Ok(check)
    }
}

#[cfg(test)]
mod tests {
    use super::{Claim, WitnessCheck};
    use crate::engines::cpu_f64;
    use crate::input::parse_scene;
    use crate::model::{Parameter, Plan, PlanOptions, Quantity};

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
}
