//! The simulated experiment in words: for the terminal, and as a page.

use super::{ExperimentRun, PlayedTrajectory, Simulation, TRIALS};
use crate::draw::TextTable;

const HEADERS: [&str; 9] = [
    "trajectory",
    "reached",
    "tips lost",
    "RMSE, simulated [mm]",
    "paper (a)",
    "paper (b)",
    "aligned, simulated [mm]",
    "paper",
    "repeatability, simulated [mm]",
];
const NOTES: [&str; 4] = [
    "simulated: median over the catheters, in brackets what 10 % and 90 % stay below",
    "measured by the paper with its own prototype and trajectories, whose sizes are not published: (a) and (b) are the two \
     lists that it gives (Table I, text on Fig. 5), which disagree; taken in the order of the rows",
    "empty cells: no number of the paper is at hand",
    "the simulated tips were not checked against the reference",
];

impl ExperimentRun {
    /// What was simulated, its table and what its columns mean, for the terminal.
    pub fn text(&self) -> String {
        format!(
            "SIMULATION, no measurement: {} catheters (seeds from {}), {TRIALS} trials each, {}\n\n{}\n{}\n",
            self.seeds.len(),
            self.seeds[0],
            self.imperfection.in_words(),
            table(self),
            NOTES.map(|note| format!("{note}.")).join("\n")
        )
    }

    /// The same in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut marked = line(HEADERS.map(str::to_owned).to_vec()) + &line(vec!["---".into(); HEADERS.len()]);
        self.trajectories.iter().for_each(|played| marked += &line(cells(played)));
        let text = self.text().replace(&table(self).to_string(), &marked);
        text.replace(".\n", ".\n\n").trim_end().to_owned() + "\n"
    }
}

fn table(found: &ExperimentRun) -> TextTable {
    let mut table = TextTable::new(HEADERS);
    for played in &found.trajectories {
        table.row(cells(played));
    }
    table
}

fn cells(played: &PlayedTrajectory) -> Vec<String> {
    let quantities: [fn(&Simulation) -> f64; 3] = [|s| s.rmse, |s| s.aligned_rmse, |s| s.repeatability];
    let [rmse, aligned, repeatability] = quantities.map(|of| {
        let [low, median, high] = played.quantiles_mm(of);
        format!("{median:.2} ({low:.2}-{high:.2})")
    });
    let [a, b] = played.measured.rmse.map(|x| format!("{x:.2}"));
    let aligned_paper = played.measured.aligned_rmse.map_or(String::new(), |x| format!("{x:.2}"));
    let reached = format!("{} of {}", played.reached(), played.run.results().len());
    let name = played.run.trajectory().name.clone();
    vec![name, reached, played.lost().to_string(), rmse, a, b, aligned, aligned_paper, repeatability]
}
