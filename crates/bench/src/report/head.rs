//! What ran where, and how quiet it was there.

use super::measured::Report;
use crate::record::Record;

/// Runs differ by more than this: the machine was busy with something else.
const NOISY: f64 = 0.1;
/// What one thread that measures adds to the load average, and a little.
const OWN_LOAD: f64 = 1.6;

impl Report {
    pub(super) fn head(&self) -> String {
        format!(
            "# Speed against error\n\n{} Where error is on the x axis, lower and further left is better.\n",
            self.machine()
        )
    }

    /// What ran where, and how quiet it was there.
    pub(super) fn machine(&self) -> String {
        let word = |key: &str| self.manifest[key].as_str().unwrap_or("unknown").to_owned();
        let gpu = self.manifest["gpu"].as_str().map_or("no GPU".to_owned(), |gpu| format!("GPU: {gpu}"));
        let quick = if self.manifest["quick"] == true { " with `--quick`: few samples and steps" } else { "" };
        format!(
            "Measured on {} by `rodsweep bench` {} (commit {}){quick}, in {} s. {}, {} cores, {}, {}; {gpu}. {}",
            word("date"),
            word("version"),
            word("commit"),
            self.manifest["seconds"],
            word("processor"),
            self.manifest["cores"],
            self.sets().join(", "),
            word("system"),
            self.noise(),
        )
    }

    /// How steady the times are.
    fn noise(&self) -> String {
        let ours = self.records.iter().filter(|record| !record.is_peer());
        let timed: Vec<&Record> = ours.filter(|record| record.spread.is_finite()).collect();
        let noisy = timed.iter().filter(|record| record.spread > NOISY).count();
        let share = noisy as f64 / timed.len().max(1) as f64;
        let load = self.manifest["load_average"].as_f64().filter(|load| *load > OWN_LOAD);
        let others =
            load.map_or(String::new(), |load| format!(" It ended at a load average of {load}, much of it others'."));
        let quiet = share <= 0.1 && load.is_none();
        let verdict = if quiet { "Quiet enough" } else { "The machine was not quiet: trust ratios more than times" };
        format!(
            "{verdict}: in {noisy} of {} measurements the median of the repeats is more than {:.0} % above the least.{others}",
            timed.len(),
            100.0 * NOISY
        )
    }
}
