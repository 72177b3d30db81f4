//! A study in words, for the terminal.

use super::blocks::Estimate;
use super::indices::WITHHELD;
use super::notes::NO_NOMINAL;
use super::outputs::DISTANCE;
use super::result::{Identification, Index, Order, Sensitivity};
use crate::draw::{TextTable, count};
use crate::input::quantity_text;
use crate::study::witness::with_mark;

/// Share of a variance from which on an input is named in the headline.
const LEAST_SHARE: f64 = 0.005;

impl Sensitivity {
    /// Indices, bounds, spreads, failures and what else the reader should know.
    pub fn text(&self) -> String {
        let mut text = self.mark.as_ref().map_or(String::new(), |mark| format!("{mark}\n"));
        text += &format!("{}\n\n", self.answer());
        text += &format!(
            "{} of {} rows ({}), intervals of {} %\n",
            count(self.usable),
            count(self.rows),
            self.method,
            100.0 * self.confidence
        );
        for output in names(&self.indices) {
            text += &self.output_text(output);
        }
        text += &self.spread_text();
        text += &self.failure_text();
        if let Some(identification) = &self.identification {
            text += &identification_text(identification);
        }
        self.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
        text + &self.checked + "\n"
    }

    /// The answer in one line: how far the tip is off, and which inputs account for it. It begins with what speaks against
    /// the rows.
    pub fn headline(&self) -> String {
        with_mark(self.mark.as_deref(), self.answer())
    }

    fn answer(&self) -> String {
        let Some(output) = self.first_output() else { return "no output changes with the inputs".into() };
        let spread = self.spreads.iter().find(|spread| spread.output == output);
        let first = match spread {
            Some(spread) if output == DISTANCE => {
                let [_, _, _, median, _, most, _] = spread.quantiles.map(|x| short(x, "m"));
                format!("the tip is off by {median} (median), {most} (95 %) from that of the nominal rod")
            }
            Some(spread) => {
                let [_, low, _, median, _, high, _] = spread.quantiles.map(|x| short(x, &spread.unit));
                format!("{output} is {median} (median), 90 % of the rows lie between {low} and {high}")
            }
            None => format!("{output} changes with the inputs"),
        };
        let lacks_nominal = self.notes.iter().any(|note| note == NO_NOMINAL);
        let before = if lacks_nominal { "the nominal rod has no equilibrium (see below); " } else { "" };
        format!("{before}{first}; {}", self.what_matters(output))
    }

    /// Distance of the tip where it is told, else the first output.
    fn first_output(&self) -> Option<&str> {
        let outputs = || self.spreads.iter().map(|spread| spread.output.as_str()).chain(names(&self.indices));
        let is_told = |output: &&str| self.indices.iter().any(|index| index.output == *output);
        outputs().find(|output| *output == DISTANCE && is_told(output)).or_else(|| outputs().find(is_told))
    }

    /// The three inputs with the largest share of an output's variance.
    fn what_matters(&self, output: &str) -> String {
        let ranked = |order: Order, is_main: bool| {
            let of = self.indices.iter().filter(move |index| index.output == output && index.order == order);
            let mut found: Vec<&Index> =
                of.filter(|index| index.estimate.value.is_finite() && (index.is_main || !is_main)).collect();
            // Of several estimators the first counts.
            let estimator = found.first().map(|index| index.estimator);
            found.retain(|index| Some(index.estimator) == estimator);
            found.sort_by(|a, b| b.estimate.value.total_cmp(&a.estimate.value));
            found
        };
        let choices = [(Order::Total, true), (Order::First, true), (Order::First, false)];
        let Some(found) = choices.into_iter().map(|(order, main)| ranked(order, main)).find(|found| !found.is_empty())
        else {
            return "which inputs account for it is not known, see below".into();
        };
        let share = |index: &&Index| format!("{} ({:.0} %)", index.input, 100.0 * index.estimate.value);
        let some = found.iter().filter(|index| index.estimate.value >= LEAST_SHARE).take(3);
        let words: Vec<String> = some.map(share).collect();
        match words.is_empty() {
            true => "no input accounts for it alone".into(),
            false => format!("what matters most, by share of its variance: {}", words.join(", ")),
        }
    }

    /// First order, total and bound of each input.
    fn output_text(&self, output: &str) -> String {
        let main: Vec<&Index> = self.indices.iter().filter(|index| index.output == output && index.is_main).collect();
        let mut table = TextTable::new(["input", "S1", "S1 ±", "ST", "ST ±", "ST bound"]);
        let inputs: Vec<&str> = {
            let firsts = main.iter().filter(|index| index.order == Order::First);
            firsts.map(|index| index.input.as_str()).collect()
        };
        for input in inputs {
            let of = |order| main.iter().find(|index| index.order == order && index.input == input);
            let [s1, s1_error] = of(Order::First).map_or_else(Default::default, |index| words(&index.estimate));
            let [st, st_error] = of(Order::Total).map_or_else(Default::default, |index| words(&index.estimate));
            let bound = self.slopes.iter().find(|slopes| slopes.output == output && slopes.input == input);
            let bound = bound.filter(|slopes| slopes.upper.is_finite());
            // A share is never above 1: a larger bound says nothing.
            let bound = bound.map(|slopes| match slopes.upper {
                upper if upper > 1.0 => "no bound".to_owned(),
                upper => format!("{upper:.4}"),
            });
            let bound = bound.unwrap_or_default();
            table.row([input.to_owned(), s1, s1_error, st, st_error, bound]);
        }
        let estimator = main.first().map_or("", |index| index.estimator);
        let mut text = format!("\n{output}, by {estimator}\n{table}");
        let mut pairs: Vec<&&Index> = main.iter().filter(|index| index.order == Order::Second).collect();
        pairs.retain(|index| index.estimate.value.is_finite());
        pairs.sort_by(|a, b| b.estimate.value.total_cmp(&a.estimate.value));
        if let Some(largest) = pairs.first() {
            let [value, error] = words(&largest.estimate);
            text += &format!("largest of second order: {} {value} {error}\n", largest.input);
        }
        let mut flags: Vec<&str> = Vec::new();
        for index in self.indices.iter().filter(|index| index.output == output && !index.flag.is_empty()) {
            if !flags.contains(&index.flag.as_str()) {
                flags.push(&index.flag);
                text += &format!("{} {}\n", index.estimator, index.flag);
                if index.flag.starts_with(WITHHELD) {
                    text += "  what helps: more samples; narrower axes, so that fewer rows fail and no tip jumps; \
                             `--estimator slopes`; or [sampling] method = \"saltelli\", which needs no smooth output\n";
                }
            }
        }
        text
    }

    fn spread_text(&self) -> String {
        let mut table = TextTable::new(["output", "mean", "sd", "sd, first order", "ratio", "5 %", "95 %", "unit"]);
        let number = |x: f64| if x.is_finite() { format!("{x:.4e}") } else { String::new() };
        for spread in &self.spreads {
            let ratio = if spread.ratio.is_finite() { format!("{:.3}", spread.ratio) } else { String::new() };
            let [_, low, _, _, _, high, _] = spread.quantiles.map(number);
            let (mean, deviation, first) = (number(spread.mean), number(spread.deviation), number(spread.first_order));
            table.row([spread.output.clone(), mean, deviation, first, ratio, low, high, spread.unit.clone()]);
        }
        let mut text = format!("\n{table}");
        for spread in &self.spreads {
            if !spread.flag.is_empty() {
                text += &format!("{}: {}\n", spread.output, spread.flag);
            }
            if let Some(lumps) = spread.lumps {
                let share = 100.0 * lumps.share_above;
                text += &format!("{}: two lumps, {share:.1} % above {:.4e}\n", spread.output, lumps.at);
            }
        }
        let [nominal, low, least] = self.margins;
        if least.is_finite() {
            text += &format!("stability margin: nominal {nominal:.3}, 1 % below {low:.3}, least {least:.4}\n");
        }
        text
    }

    fn failure_text(&self) -> String {
        let mut text = String::new();
        for share in self.statuses.iter().filter(|share| !share.status.is_success()) {
            let [value, low, high] = [share.share, share.interval[0], share.interval[1]].map(|x| 100.0 * x);
            let name = share.status.name();
            text += &format!("{name}: {} rows, {value:.3} % ({low:.3} to {high:.3})\n", count(share.rows));
        }
        for output in names(&self.failure_indices) {
            let of = self.failure_indices.iter().filter(|index| index.output == output && index.is_main);
            let order = if of.clone().any(|index| index.order == Order::Total) { Order::Total } else { Order::First };
            let mut ranked: Vec<&Index> = of.filter(|index| index.order == order).collect();
            ranked.retain(|index| index.estimate.value.is_finite());
            ranked.sort_by(|a, b| b.estimate.value.total_cmp(&a.estimate.value));
            let best = ranked.iter().take(3).map(|index| format!("{} {:.2}", index.input, index.estimate.value));
            text += &format!("what makes `{output}`, by {}: {}\n", order.name(), best.collect::<Vec<_>>().join(", "));
        }
        for worst in self.worst_cases.iter().filter(|worst| worst.changes_order) {
            text += &format!("{}: missing values could change the order of the inputs\n", worst.output);
        }
        text
    }
}

/// A value with a unit that reads well, to three digits.
fn short(value: f64, unit: &str) -> String {
    quantity_text(format!("{value:.2e}").parse().unwrap_or(value), unit)
}

/// Outputs, in their order.
fn names(indices: &[Index]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for index in indices {
        if !names.contains(&index.output.as_str()) {
            names.push(&index.output);
        }
    }
    names
}

/// Value, and half the width of its interval.
fn words(estimate: &Estimate) -> [String; 2] {
    let Estimate { value, low, high, .. } = *estimate;
    if !value.is_finite() {
        return ["withheld".into(), String::new()];
    }
    let error = 0.5 * (high - low);
    [format!("{value:.4}"), if error.is_finite() { format!("±{error:.1e}") } else { String::new() }]
}

fn identification_text(found: &Identification) -> String {
    let mut table = TextTable::new(["parameter", "sd, all candidates", "sd, chosen"]);
    let number = |x: &f64| if x.is_finite() { format!("{x:.3e}") } else { "open".into() };
    for (k, name) in found.parameters.iter().enumerate() {
        let chosen = found.chosen.as_ref().map(|chosen| number(&chosen.information.deviations[k])).unwrap_or_default();
        table.row([name.clone(), number(&found.all.deviations[k]), chosen]);
    }
    let mut text = format!(
        "\nmeasured tips with a noise of {} mm{}, {} candidates with a margin of at least {}; deviations are relative, of \
         curvatures times the rod's length\n{table}",
        1e3 * found.noise,
        found.tangent_noise.map(|noise| format!(" and tangents of {:.3} deg", noise.to_degrees())).unwrap_or_default(),
        count(found.candidates),
        found.minimum_margin
    );
    let information = found.chosen.as_ref().map_or(&found.all, |chosen| &chosen.information);
    information.findings.iter().for_each(|finding| text += &format!("identifiability: {finding}\n"));
    if let Some(chosen) = &found.chosen {
        let samples: Vec<String> = chosen.samples.iter().map(u64::to_string).collect();
        let value = chosen.information.log_determinant;
        text += &format!("chosen samples: {}; log det of the information {value:.3}", samples.join(", "));
        if let Some((worst, end)) = &chosen.worst {
            text += &format!(", at worst {worst:.3} ({end})");
        }
        text += "\n";
    }
    text
}
