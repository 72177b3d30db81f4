//! A verdict in words: doubts about the rows, their inputs, remedies.

use super::directory::WORST_FILE;
use super::store::is_url;
use super::verdict::{Doubt, DoubtKind, InputRange, Verdict};
use crate::backend::{BackendKind, Precision};
use crate::model::Status;
use crate::spec::SolutionMethod;
use std::path::{Path, PathBuf};

/// How a run was solved, so that no message proposes what was just done.
#[derive(Clone, Copy, Debug, Default)]
pub struct Solved<'a> {
    /// Engine, precision, steps; `None` where they are not known.
    pub method: Option<SolutionMethod>,
    /// `true` where every path was followed twice (`--certain`).
    pub certain: bool,
    /// The directory with scenes of wrong samples.
    pub place: Option<&'a Path>,
}

impl Doubt {
    /// One line: the doubt and the number of samples.
    pub fn headline(&self) -> String {
        let (some, of, far) = (self.samples, self.of, number(self.how_far));
        let checked = format!("{some} of {of} samples that were checked against the reference");
        match self.kind {
            DoubtKind::RowsElsewhere => {
                format!("{checked} lie on another equilibrium, up to {far} of the rod's length (or rad) away")
            }
            DoubtKind::RowsPastFold => {
                format!("{checked} are solved here and not by it: they may lie past a fold")
            }
            DoubtKind::FalseFailures => format!("{checked} failed here, and it solves them"),
            DoubtKind::EstimatesBelowError if self.how_far > 0.0 => {
                format!("{checked} are further off than their `error_estimate` says, up to {far} times")
            }
            DoubtKind::EstimatesBelowError => format!("{checked} are further off than their `error_estimate` says"),
            DoubtKind::DerivativeEstimatesBelowError if self.how_far > 0.0 => {
                format!(
                    "derivatives of {checked} are further off than their `derivative_error` says, up to {far} times"
                )
            }
            DoubtKind::DerivativeEstimatesBelowError => {
                format!("derivatives of {checked} are further off than their `derivative_error` says")
            }
            DoubtKind::ToleranceMissed => {
                format!("{some} of {of} samples miss the tolerance by their own estimate, up to {far} times")
            }
            DoubtKind::TooManyFailures => format!("{some} of {of} samples failed, more than the sweep allows"),
            DoubtKind::NothingUsable => format!("none of {of} samples can be used"),
        }
    }

    /// Ranges of the inputs of these samples.
    pub fn ranges(&self) -> String {
        let range = |InputRange { name, unit, from, to }: &InputRange| {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            if from == to {
                format!("{name} = {}{unit}", number(*from))
            } else {
                format!("{name} from {} to {}{unit}", number(*from), number(*to))
            }
        };
        self.inputs.iter().map(range).collect::<Vec<_>>().join(", ")
    }

    /// Remedies, the surest first.
    fn remedies(&self, solved: &Solved<'_>) -> Vec<String> {
        let mut remedies = Vec::new();
        let steps = solved.method.map_or(0, |method| method.steps);
        let is_coarse = solved.method.is_some_and(|method| method.precision != Precision::F64);
        let is_reference = solved.method.is_some_and(|method| method.engine == BackendKind::Reference);
        let finer = if steps > 0 {
            format!("finer steps (`[solver] steps = {}`)", 2 * steps)
        } else {
            "finer steps (`[solver] steps`)".into()
        };
        let certain = "`--certain`, which follows every path a second time by other steps".to_owned();
        match self.kind {
            DoubtKind::RowsElsewhere | DoubtKind::RowsPastFold | DoubtKind::FalseFailures => {
                remedies.extend((!solved.certain).then_some(certain));
                remedies.extend(is_coarse.then(|| "`--precision f64`".to_owned()));
                remedies.push(finer);
                remedies
                    .extend((!is_reference).then(|| "a small sweep of these inputs by `--backend reference`".into()));
            }
            DoubtKind::EstimatesBelowError | DoubtKind::DerivativeEstimatesBelowError => {
                remedies.push(finer);
                remedies.extend(is_coarse.then(|| "`--precision f64`".to_owned()));
            }
            DoubtKind::ToleranceMissed => {
                remedies.push(finer);
                remedies.extend(is_coarse.then(|| "`--precision f64`".to_owned()));
                let kept = solved.method.map(|method| 1.1 * method.tolerance * self.how_far).filter(|kept| *kept < 1.0);
                remedies
                    .extend(kept.map(|kept| format!("a tolerance that they keep (`[solver] tolerance = {kept:.0e}`)")));
            }
            DoubtKind::TooManyFailures => {
                remedies.push("narrower ranges of these inputs".into());
                remedies
                    .extend((!is_reference).then(|| "a small sweep of these inputs by `--backend reference`".into()));
                remedies.push("the share that may fail (`[solver] allow_failures`)".into());
            }
            DoubtKind::NothingUsable if self.is_of_bad_parameters() => {
                remedies.push("other ranges of these inputs: with these values there is no rod".into());
            }
            DoubtKind::NothingUsable => {
                remedies.push("smaller loads, other ranges of these inputs, or another scene".into())
            }
        }
        remedies
    }

    /// Whether none of its samples is a rod.
    fn is_of_bad_parameters(&self) -> bool {
        self.statuses.keys().all(|status| status == Status::BadParameter.name())
    }

    /// Lines with statuses, ranges of inputs, and the worst sample.
    pub fn details(&self) -> String {
        let mut text = String::new();
        let statuses: Vec<String> = self.statuses.iter().map(|(name, count)| format!("{count} {name}")).collect();
        if !statuses.is_empty() {
            text += &format!("  status: {}\n", statuses.join(", "));
        }
        if !self.inputs.is_empty() {
            text += &format!("  inputs: {}\n", self.ranges());
        }
        if let Some(sample) = self.worst {
            let values = self.worst_values.iter().map(|(name, value)| format!("{name} = {value}"));
            text += &format!("  worst: sample {sample}: {}\n", values.collect::<Vec<_>>().join(", "));
        }
        text
    }

    /// The scene of the worst sample of this doubt. Older versions wrote one for the whole run; `None` where there is none.
    fn scene(&self, place: &Path) -> Option<PathBuf> {
        let mut known = [self.scene_file().as_str(), WORST_FILE].map(|name| place.join(name)).into_iter();
        if is_url(place) { known.next() } else { known.find(|path| path.exists()) }
    }

    /// File name of the scene of the worst sample, beside the results.
    pub(crate) fn scene_file(&self) -> String {
        format!("distrusted-{}.toml", self.kind.name())
    }
}

impl Verdict {
    /// One line for titles, banners and figures; `None` where the run is sound.
    pub fn headline(&self) -> Option<String> {
        let first = self.doubts.first()?;
        let more = match self.doubts.len() - 1 {
            0 => String::new(),
            some => format!(" (and {some} more)"),
        };
        Some(format!("DISTRUSTED: {}{more}", first.headline()))
    }

    /// All doubts: inputs, remedies, and a command that shows one wrong row; empty where the run is sound.
    pub fn explain(&self, solved: &Solved<'_>) -> String {
        let mut text = String::new();
        for doubt in &self.doubts {
            text += &format!("do not trust these rows: {}\n", doubt.headline());
            text += &doubt.details();
            text += &format!("  what helps, in a new directory: {}\n", doubt.remedies(solved).join("; or "));
            if let Some(scene) = solved.place.filter(|_| doubt.worst.is_some()).and_then(|place| doubt.scene(place)) {
                let scene = crate::text::shell_word(&scene.to_string_lossy());
                let is_reference = solved.method.is_some_and(|method| method.engine == BackendKind::Reference);
                let again = if is_reference { "" } else { ", and again with --backend reference" };
                text += &format!("  see one: rodsweep solve {scene}{again}\n");
            }
        }
        text
    }

    /// The number of rows that were checked against the reference, in a sentence.
    pub fn checked_sentence(&self) -> String {
        match self.checked {
            0 => "these rows were not checked against the reference".into(),
            some => format!("{some} of {} samples were checked against the reference", self.samples),
        }
    }
}

/// Four significant digits.
fn number(x: f64) -> String {
    let size = x.abs();
    match x {
        _ if !x.is_finite() => "an unknown number".into(),
        0.0 => "0".into(),
        _ if (1e-3..1e5).contains(&size) => {
            let digits = (3 - size.log10().floor() as i32).max(0) as usize;
            let text = format!("{x:.digits$}");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        _ => format!("{x:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Solved, number};
    use crate::backend::{BackendKind, Precision};
    use crate::model::{Status, Stepper};
    use crate::results::verdict::{Doubt, DoubtKind, Verdict};
    use crate::spec::SolutionMethod;

    #[test]
    fn nobody_is_told_to_do_what_was_just_done() {
        for kind in DoubtKind::ALL {
            let mut doubt = Doubt::new(kind);
            doubt.add(7, Status::Ok, 0.2, &[("coil.current.x".into(), "A")], &[0.05]);
            let failures = Some(doubt.clone());
            let verdict = Verdict { samples: 1, doubts: vec![doubt], failures, ..Verdict::default() }.settled();
            let mut method = SolutionMethod {
                engine: BackendKind::Cpu,
                precision: Precision::F64,
                stepper: Stepper::ALL[0],
                steps: 24,
                tolerance: 1e-6,
                error_share: 0.5,
                error_floor: 0.0,
                derivative_scale: Default::default(),
                anchors: false,
            };
            let folder = tempfile::tempdir().expect("a directory");
            let place = folder.path().join("a b");
            std::fs::create_dir(&place).expect("a directory");
            std::fs::write(place.join(format!("distrusted-{}.toml", kind.name())), "").expect("a scene");
            let place = Some(place.as_path());
            let told = verdict.explain(&Solved { method: Some(method), certain: true, place });
            for wrong in ["--backend cpu", "--precision f64", "--certain"] {
                assert!(!told.contains(wrong), "{kind:?}: {told}");
            }
            assert!(told.contains("coil.current.x = 0.05 A") || told.contains("samples"), "{told}");
            assert!(told.contains("rodsweep solve '") && told.contains("/a b/distrusted-"), "{told}");
            method.engine = BackendKind::Reference;
            let told = verdict.explain(&Solved { method: Some(method), certain: false, place: None });
            assert!(!told.contains("by `--backend reference`"), "{told}");
        }
    }

    #[test]
    fn numbers_are_short() {
        for (x, text) in
            [(0.05, "0.05"), (-12.345_67, "-12.35"), (1e-9, "1.000e-9"), (123_456.0, "1.235e5"), (2.0, "2")]
        {
            assert_eq!(number(x), text);
        }
        assert_eq!(number(f64::NAN), "an unknown number");
    }
}
