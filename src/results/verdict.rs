//! The verdict on a run: sound, or what speaks against its rows. `manifest.json` holds it, and everybody asks here.
//!
//! A verdict is made while rows are solved ([`sweep`](crate::sweep)) and stands until they are solved again. Verdicts of
//! shards and workers add up.

use super::outcome::{SpotCheck, number_or_null, values_or_null};
use crate::model::Status;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Kinds of doubt about the rows of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum DoubtKind {
    /// The reference finds another equilibrium.
    RowsElsewhere,
    /// The reference says that the path from rest ends before the full load, or that no rod stays there.
    RowsPastFold,
    /// Rows that failed, and that the reference solves.
    FalseFailures,
    /// Tips are further off than their `error_estimate`.
    EstimatesBelowError,
    /// Derivatives are further off than their `derivative_error`.
    DerivativeEstimatesBelowError,
    /// Rows say themselves that they miss the tolerance.
    ToleranceMissed,
    /// More rows failed than the sweep allows.
    TooManyFailures,
    /// No row can be used.
    NothingUsable,
}

impl DoubtKind {
    /// The worst first.
    pub const ALL: [DoubtKind; 8] = [
        DoubtKind::RowsElsewhere,
        DoubtKind::RowsPastFold,
        DoubtKind::FalseFailures,
        DoubtKind::EstimatesBelowError,
        DoubtKind::DerivativeEstimatesBelowError,
        DoubtKind::ToleranceMissed,
        DoubtKind::TooManyFailures,
        DoubtKind::NothingUsable,
    ];

    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            DoubtKind::RowsElsewhere => "rows-elsewhere",
            DoubtKind::RowsPastFold => "rows-past-fold",
            DoubtKind::FalseFailures => "false-failures",
            DoubtKind::EstimatesBelowError => "estimates-below-error",
            DoubtKind::DerivativeEstimatesBelowError => "derivative-estimates-below-error",
            DoubtKind::ToleranceMissed => "tolerance-missed",
            DoubtKind::TooManyFailures => "too-many-failures",
            DoubtKind::NothingUsable => "nothing-usable",
        }
    }

    /// `true` for kinds that follow from the counts of statuses alone.
    fn is_of_counts(self) -> bool {
        matches!(self, DoubtKind::TooManyFailures | DoubtKind::NothingUsable)
    }
}

/// The values of an input among some samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputRange {
    /// Name of the parameter.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Smallest value.
    #[serde(deserialize_with = "number_or_null")]
    pub from: f64,
    /// Largest value.
    #[serde(deserialize_with = "number_or_null")]
    pub to: f64,
}

/// One thing that speaks against the rows of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Doubt {
    /// The kind of doubt.
    pub kind: DoubtKind,
    /// Samples that show it.
    pub samples: u64,
    /// Samples among which it was looked for.
    pub of: u64,
    /// Size of the worst case: tip error over rod length or in rad where rows lie elsewhere, error over estimate where
    /// estimates are too small, estimate over tolerance where that is missed; else 0.
    #[serde(deserialize_with = "number_or_null")]
    pub how_far: f64,
    /// Samples by their status.
    pub statuses: BTreeMap<String, u64>,
    /// Ranges of the swept parameters among these samples.
    pub inputs: Vec<InputRange>,
    /// The worst sample.
    pub worst: Option<u64>,
    /// Swept parameters of the worst sample by name, SI.
    #[serde(deserialize_with = "values_or_null")]
    pub worst_values: Vec<(String, f64)>,
    /// Indices of these samples, where the check found them.
    #[serde(default)]
    pub seen: BTreeSet<u64>,
}

impl Doubt {
    /// A doubt without samples.
    pub(crate) fn new(kind: DoubtKind) -> Doubt {
        Doubt {
            kind,
            samples: 0,
            of: 0,
            how_far: 0.0,
            statuses: BTreeMap::new(),
            inputs: Vec::new(),
            worst: None,
            worst_values: Vec::new(),
            seen: BTreeSet::new(),
        }
    }

    /// Takes in a sample whose values are these, in the order of `names` (name and unit).
    pub(crate) fn add(&mut self, sample: u64, status: Status, how_far: f64, names: &[(String, &str)], values: &[f64]) {
        self.samples += 1;
        *self.statuses.entry(status.name().to_owned()).or_default() += 1;
        if self.inputs.is_empty() {
            let range = |((name, unit), value): (&(String, &str), &f64)| InputRange {
                name: name.clone(),
                unit: (*unit).to_owned(),
                from: *value,
                to: *value,
            };
            self.inputs = names.iter().zip(values).map(range).collect();
        }
        for (range, value) in self.inputs.iter_mut().zip(values) {
            range.from = range.from.min(*value);
            range.to = range.to.max(*value);
        }
        if self.worst.is_none() || how_far > self.how_far {
            self.how_far = how_far;
            self.worst = Some(sample);
            self.worst_values = names.iter().map(|(name, _)| name.clone()).zip(values.iter().copied()).collect();
        }
    }

    /// Adds another part's account of the same kind.
    fn merge(&mut self, other: &Doubt) {
        if !other.seen.is_empty() && other.seen.is_subset(&self.seen) {
            self.of = self.of.saturating_add(other.of);
            return;
        }
        let twice = self.seen.intersection(&other.seen).count() as u64;
        self.seen.extend(&other.seen);
        self.samples = (self.samples + other.samples).saturating_sub(twice);
        self.of = self.of.saturating_add(other.of);
        for (status, count) in &other.statuses {
            *self.statuses.entry(status.clone()).or_default() += count;
        }
        for range in &other.inputs {
            match self.inputs.iter_mut().find(|own| own.name == range.name) {
                Some(own) => (own.from, own.to) = (own.from.min(range.from), own.to.max(range.to)),
                None => self.inputs.push(range.clone()),
            }
        }
        if self.worst.is_none() || other.how_far > self.how_far {
            self.how_far = other.how_far;
            self.worst = other.worst;
            self.worst_values.clone_from(&other.worst_values);
        }
    }
}

/// The judgement on the rows of a run, or of a part of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Verdict {
    /// `true` where nothing speaks against the rows.
    pub sound: bool,
    /// Samples that were solved again by the reference.
    pub checked: u64,
    /// Samples that the verdict covers.
    pub samples: u64,
    /// Samples with an equilibrium that can be used.
    pub usable: u64,
    /// Share of the samples that may fail; `None`: only failures that the scene explains, such as folds, may occur.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allow_failures: Option<f64>,
    /// Samples that failed, whether the sweep allows it or not.
    pub failures: Option<Doubt>,
    /// Doubts about the rows, the worst first.
    pub doubts: Vec<Doubt>,
}

impl Default for Verdict {
    fn default() -> Self {
        Verdict {
            sound: true,
            checked: 0,
            samples: 0,
            usable: 0,
            allow_failures: None,
            failures: None,
            doubts: Vec::new(),
        }
    }
}

/// `true` for failures of the scene, such as a fold; `false` for failures of the solver.
pub(crate) fn is_explained(status: &str) -> bool {
    let explained = [
        Status::Fold,
        Status::Unstable,
        Status::BadParameter,
        Status::TooNearMagnet,
        Status::OutsideMap,
        Status::ThroughWall,
        Status::OutOfReach,
    ];
    explained.iter().any(|other| other.name() == status)
}

impl Verdict {
    /// Settles what follows from counts, and the order of doubts.
    pub(crate) fn settled(mut self) -> Verdict {
        self.doubts.retain(|doubt| !doubt.kind.is_of_counts() && doubt.samples > 0);
        if let Some(failures) = &self.failures {
            let of = |kind| Doubt { kind, of: self.samples, ..failures.clone() };
            let unexplained = failures.statuses.iter().filter(|(status, _)| !is_explained(status));
            let is_beyond = match self.allow_failures {
                Some(share) => failures.samples as f64 / self.samples.max(1) as f64 > share,
                None => unexplained.map(|(_, count)| count).sum::<u64>() > 0,
            };
            let too_many = is_beyond.then(|| of(DoubtKind::TooManyFailures));
            let is_empty = self.usable == 0 && self.samples > 0 && self.allow_failures.is_none_or(|share| share < 1.0);
            let nothing = is_empty.then(|| of(DoubtKind::NothingUsable));
            self.doubts.extend(too_many.into_iter().chain(nothing));
        }
        self.doubts.sort_by_key(|doubt| doubt.kind);
        self.sound = self.doubts.is_empty();
        self
    }

    /// The verdicts of parts of a run put together.
    pub fn sum<'a>(parts: impl IntoIterator<Item = &'a Verdict>) -> Verdict {
        let mut sum = Verdict::default();
        for part in parts {
            sum.checked = sum.checked.saturating_add(part.checked);
            sum.samples = sum.samples.saturating_add(part.samples);
            sum.usable = sum.usable.saturating_add(part.usable);
            sum.allow_failures = sum.allow_failures.or(part.allow_failures);
            if let Some(failures) = &part.failures {
                sum.failures.get_or_insert_with(|| Doubt::new(DoubtKind::TooManyFailures)).merge(failures);
            }
            for doubt in &part.doubts {
                match sum.doubts.iter_mut().find(|own| own.kind == doubt.kind) {
                    Some(own) => own.merge(doubt),
                    None => sum.doubts.push(doubt.clone()),
                }
            }
        }
        sum.settled()
    }

    /// Doubts that the check of an earlier call found, restricted to samples that were not solved again since.
    pub(crate) fn kept(&self, is_kept: &dyn Fn(u64) -> bool) -> Vec<Doubt> {
        let of_check = self.doubts.iter().filter(|doubt| !doubt.seen.is_empty());
        let kept = of_check.map(|doubt| {
            let seen: BTreeSet<u64> = doubt.seen.iter().copied().filter(|sample| is_kept(*sample)).collect();
            // This call adds the samples that it checks.
            Doubt { samples: seen.len() as u64, seen, of: 0, ..doubt.clone() }
        });
        kept.filter(|doubt| doubt.samples > 0).collect()
    }

    /// The verdict that follows from a spot check, for runs of versions that wrote no verdict.
    pub(crate) fn of_spot_check(check: &SpotCheck, samples: u64, failed: u64) -> Verdict {
        let doubt = |kind, samples: u64, sample: Option<u64>, values: &[(String, f64)], how_far: f64| {
            let range = |(name, value): &(String, f64)| InputRange {
                name: name.clone(),
                unit: String::new(),
                from: *value,
                to: *value,
            };
            Doubt {
                samples,
                of: check.checked,
                how_far,
                inputs: values.iter().map(range).collect(),
                worst: sample,
                worst_values: values.to_vec(),
                seen: sample.into_iter().collect(),
                ..Doubt::new(kind)
            }
        };
        let far = check.position.max.max(check.rotation.max);
        let wrong = if far > ELSEWHERE { DoubtKind::RowsElsewhere } else { DoubtKind::EstimatesBelowError };
        let doubts = vec![
            doubt(wrong, check.wrong, check.worst_sample, &check.worst_values, far),
            doubt(DoubtKind::RowsPastFold, check.only_run, check.only_run_sample, &check.only_run_values, 0.0),
            doubt(DoubtKind::FalseFailures, check.only_trusted, None, &[], 0.0),
            doubt(DoubtKind::DerivativeEstimatesBelowError, check.derivatives_beyond, None, &[], 0.0),
        ];
        let usable = samples.saturating_sub(failed);
        Verdict { checked: check.checked, samples, usable, doubts, ..Verdict::default() }.settled()
    }

    /// The doubt of this kind, if there is one.
    pub fn doubt(&self, kind: DoubtKind) -> Option<&Doubt> {
        self.doubts.iter().find(|doubt| doubt.kind == kind)
    }

    /// Samples that the check found wrong. Pages and plots mark them.
    pub fn seen(&self) -> BTreeSet<u64> {
        self.doubts.iter().flat_map(|doubt| doubt.seen.iter().copied()).collect()
    }
}

/// Tips that are so far off (over the rod's length, or rad), and beyond their estimate, belong to another equilibrium.
pub(crate) const ELSEWHERE: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::{Doubt, DoubtKind, Verdict};
    use crate::model::Status;

    fn verdict(kind: DoubtKind, samples: &[u64]) -> Verdict {
        let names = [("coil.current.x".to_owned(), "A")];
        let mut doubt = Doubt::new(kind);
        for sample in samples {
            doubt.add(*sample, Status::Ok, *sample as f64, &names, &[0.1 * *sample as f64]);
            doubt.seen.insert(*sample);
        }
        Verdict { checked: 8, samples: 100, usable: 100, doubts: vec![doubt], ..Verdict::default() }.settled()
    }

    #[test]
    fn verdicts_add_up_and_no_sample_counts_twice() {
        let [a, b] = [&[3, 5][..], &[5, 9]].map(|samples| verdict(DoubtKind::RowsElsewhere, samples));
        let sum = Verdict::sum([&a, &b, &Verdict::default()]);
        assert!(!sum.sound && sum.doubts.len() == 1);
        let doubt = sum.doubt(DoubtKind::RowsElsewhere).expect("a doubt");
        assert_eq!((doubt.samples, doubt.worst, doubt.how_far), (3, Some(9), 9.0));
        assert!((doubt.inputs[0].from - 0.3).abs() < 1e-12 && (doubt.inputs[0].to - 0.9).abs() < 1e-12);
        assert_eq!(Verdict::sum([&sum]).doubts, sum.doubts);
        assert!(Verdict::sum([&Verdict::default(), &Verdict::default()]).sound);
        let kept = a.kept(&|sample| sample == 5);
        assert_eq!(kept.iter().map(|doubt| doubt.samples).collect::<Vec<_>>(), [1]);
        let text = serde_json::to_string(&sum).expect("JSON");
        assert_eq!(serde_json::from_str::<Verdict>(&text).expect("a verdict"), sum);
    }

    #[test]
    fn failures_are_judged_by_what_the_sweep_allows() {
        let of = |status: Status, count: u64, allow_failures: Option<f64>| {
            let mut failures = Doubt::new(DoubtKind::TooManyFailures);
            (0..count).for_each(|sample| failures.add(sample, status, 0.0, &[], &[]));
            let failures = Some(failures);
            Verdict { samples: 10, usable: 10 - count, allow_failures, failures, ..Verdict::default() }.settled()
        };
        let kinds = |verdict: Verdict| verdict.doubts.iter().map(|doubt| doubt.kind).collect::<Vec<_>>();
        assert!(of(Status::Fold, 9, None).sound);
        assert_eq!(kinds(of(Status::Fold, 10, None)), [DoubtKind::NothingUsable]);
        assert_eq!(kinds(of(Status::StepLimit, 1, None)), [DoubtKind::TooManyFailures]);
        assert_eq!(kinds(of(Status::StepLimit, 2, Some(0.1))), [DoubtKind::TooManyFailures]);
        assert!(of(Status::StepLimit, 1, Some(0.1)).sound && of(Status::NonFinite, 10, Some(1.0)).sound);
    }
}
