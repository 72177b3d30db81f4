//! A fit in words.

use super::{Fit, FitJob};
use crate::draw::{TextTable, engineering};

impl Fit {
    /// The fitted numbers in a table, how well they fit and what cannot be told apart, for the terminal.
    pub fn text(&self, job: &FitJob) -> String {
        let mut table = TextTable::new(["parameter", "start", "fitted", "± 95 %", "unit"]);
        for fitted in &self.parameters {
            let [low, high] = fitted.interval;
            let half = if fitted.deviation.is_finite() { engineering(0.5 * (high - low)) } else { "open".into() };
            let (start, value) = (format!("{:.6e}", fitted.start), format!("{:.6e}", fitted.value));
            table.row([fitted.name.clone(), start, value, half, fitted.unit.to_owned()]);
        }
        let mark = self.mark().map(|mark| format!("{mark}\n")).unwrap_or_default();
        let mut text = format!(
            "{mark}{}: {} shapes, {}, {} evaluations\n{table}",
            if self.converged { "fitted" } else { "not converged" },
            job.observed().shapes.len(),
            observations(job),
            self.evaluations
        );
        let how = if job.given_noise().is_some() { "as given" } else { "estimated" };
        if job.observed().coordinate_count() > 0 {
            text += &format!(
                "points off the model by {} m (rms); noise of a coordinate {} m ({how})\n",
                engineering(self.rms),
                engineering(self.noise)
            );
        }
        if let Some(rms) = self.force_rms {
            text += &format!("normal forces off the model by {} N (rms)\n", engineering(rms));
        }
        let values: Vec<String> = self.directions.iter().map(|d| engineering(d.singular_value)).collect();
        text += &format!("singular values of the scaled sensitivities over the noise: {}\n", values.join(", "));
        for finding in &self.findings {
            text += &format!("identifiability: {finding}\n");
        }
        if self.check.mark.is_none() {
            text += &format!("{}\n", self.check.sentence());
        }
        text
    }
}

/// How many coordinates, and forces where there are any.
fn observations(job: &FitJob) -> String {
    let coordinates = format!("{} coordinates", job.observed().coordinate_count());
    match job.observed().force_count() {
        0 => coordinates,
        forces => format!("{coordinates}, {forces} forces"),
    }
}
