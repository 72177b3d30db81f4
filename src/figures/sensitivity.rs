//! Figures of a study of sensitivity: indices, slopes, first order against the rows, how indices settle, failures.

use super::files::Drawn;
use crate::draw::{
    AxisLabel, Colour, Curves, Figure, Interval, IntervalBars, Marker, NumberMatrix, Panel, ReportError, Series, Sheet,
};
use crate::study::sensitivity::{Index, Order, Sensitivity, Spread};
use std::path::Path;

/// Names of inputs that are longer are cut.
const LONGEST: usize = 34;
/// Curves of a panel, and the least index of one that is drawn.
const MOST_CURVES: usize = 6;
const LEAST: f64 = 0.01;

/// Draws what there is to be drawn into a directory that is there: `indices.png`, `slopes.png`, `scatter.png`,
/// `first_order.png`, `convergence.png`, `failures.png`, `identification.png`. What has nothing to draw is left out.
///
/// # Errors
///
/// A file that cannot be written.
pub fn draw_sensitivity(found: &Sensitivity, dir: &Path) -> Result<Drawn, ReportError> {
    let mut drawn = Drawn::default();
    let mut write = |figure: &dyn Figure, name: &str| drawn.write(figure, [dir.join(name)], found.mark.as_deref());
    let bars = index_bars(&found.indices, found);
    sheet(&bars, &mut |page| write(page, "indices.png"))?;
    if let Some(matrix) = slope_matrix(found) {
        write(&Sheet { columns: 1, panels: vec![&matrix] }, "slopes.png")?;
    }
    sheet(&over_the_sweep(found), &mut |page| write(page, "scatter.png"))?;
    let curves: Vec<Curves> = found.spreads.iter().filter_map(quantile_curves).collect();
    sheet(&curves, &mut |page| write(page, "first_order.png"))?;
    sheet(&convergence(found), &mut |page| write(page, "convergence.png"))?;
    sheet(&failures(found), &mut |page| write(page, "failures.png"))?;
    sheet(&deviations(found), &mut |page| write(page, "identification.png"))?;
    Ok(drawn)
}

/// Two panels in a row; nothing without panels.
fn sheet<P: Panel>(
    panels: &[P],
    write: &mut dyn FnMut(&dyn Figure) -> Result<(), ReportError>,
) -> Result<(), ReportError> {
    if panels.is_empty() {
        return Ok(());
    }
    // Where one of several panels has nothing to draw, the others stay.
    let is_empty = |panel: &&P| matches!(panel.draw(), Err(ReportError::Empty { .. }));
    let full: Vec<&P> = panels.iter().filter(|panel| !is_empty(panel)).collect();
    let panels: Vec<&P> = if full.is_empty() { panels.iter().collect() } else { full };
    let panels: Vec<&dyn Panel> = panels.into_iter().map(|panel| panel as &dyn Panel).collect();
    write(&Sheet { columns: panels.len().min(2), panels })
}

/// First order and total of each input with their intervals, and the bound by slopes: a panel an output.
fn index_bars(indices: &[Index], found: &Sensitivity) -> Vec<IntervalBars> {
    let mut panels = Vec::new();
    for output in names(indices.iter().map(|index| &index.output)) {
        let main: Vec<&Index> = indices.iter().filter(|index| index.is_main && index.output == output).collect();
        let bar = |order: Order, input: &str| {
            let index = main.iter().find(|index| index.order == order && index.input == input);
            let nan = Interval { value: f64::NAN, low: f64::NAN, high: f64::NAN };
            index.map_or(nan, |index| {
                let report = index.estimate;
                Interval { value: report.value, low: report.low, high: report.high }
            })
        };
        let has_totals = main.iter().any(|index| index.order == Order::Total);
        let orders: &[Order] = if has_totals { &[Order::First, Order::Total] } else { &[Order::First] };
        let words = |order: &Order| if *order == Order::First { "first order" } else { "total" }.to_owned();
        let row = |input: String| {
            let bound = found.slopes.iter().find(|slopes| slopes.output == output && slopes.input == input);
            let bars = orders.iter().map(|order| bar(*order, &input)).collect();
            // A bound above 1 bounds nothing.
            let cap = bound.map(|slopes| slopes.upper).filter(|upper| *upper <= 1.0).unwrap_or(f64::NAN);
            (short(&input), bars, cap)
        };
        let firsts = main.iter().filter(|index| index.order == Order::First).map(|index| &index.input);
        let rows: Vec<(String, Vec<Interval>, f64)> = names(firsts).into_iter().map(row).collect();
        let is_known = rows.iter().any(|(_, bars, _)| bars.iter().any(|bar| bar.value.is_finite() && bar.value != 0.0));
        if is_known {
            let cap = if rows.iter().any(|(.., cap)| cap.is_finite()) { "bound by slopes" } else { "" };
            panels.push(IntervalBars {
                title: output.clone(),
                label: "share of the variance".into(),
                kinds: orders.iter().map(words).collect(),
                cap: cap.into(),
                rows,
            });
        }
    }
    panels
}

/// Changes of the outputs by one standard deviation of each input.
fn slope_matrix(found: &Sensitivity) -> Option<NumberMatrix> {
    let known: Vec<_> = found.local.iter().filter(|local| local.per_deviation.is_finite()).collect();
    let columns = names(known.iter().map(|local| &local.input));
    let row = |output: String| {
        let cell = |input: &String| {
            let local = known.iter().find(|local| local.output == output && local.input == *input);
            local.map_or(f64::NAN, |local| 1e3 * local.per_deviation)
        };
        (format!("{output} (mm)"), columns.iter().map(cell).collect())
    };
    let rows: Vec<(String, Vec<f64>)> = names(known.iter().map(|local| &local.output)).into_iter().map(row).collect();
    let title = "Change by one standard deviation of the input, nominal sample".into();
    let columns: Vec<String> = columns.iter().map(|name| short(name)).collect();
    (!rows.is_empty()).then_some(NumberMatrix { title, columns, rows, digits: 3 })
}

/// What one standard deviation of each uncertain number does to the outputs over the sweep: median, 5 to 95 %.
fn over_the_sweep(found: &Sensitivity) -> Vec<IntervalBars> {
    let is_input = |name: &str| found.inputs.iter().any(|(input, ..)| input == name);
    let told: Vec<_> =
        found.local.iter().filter(|local| !is_input(&local.input) && local.quantiles[1].is_finite()).collect();
    let panel = |output: String| {
        let of = told.iter().filter(|local| local.output == output);
        let row = |local: &&crate::study::sensitivity::Local| {
            let [low, value, high] = local.quantiles.map(|x| 1e3 * x);
            (short(&local.input), vec![Interval { value, low, high }], f64::NAN)
        };
        IntervalBars {
            title: format!("{output}: one standard deviation of what is uncertain"),
            label: "change of the output over the sweep (mm)".into(),
            kinds: vec!["median, 5 to 95 % of the rows".into()],
            cap: String::new(),
            rows: of.map(row).collect(),
        }
    };
    // The length of the vector says more than its components.
    let outputs = names(told.iter().map(|local| &local.output));
    let whole: Vec<String> = outputs.iter().filter(|name| outputs.contains(&format!("{name}.x"))).cloned().collect();
    if whole.is_empty() { outputs } else { whole }.into_iter().map(panel).collect()
}

/// Standard deviations of what is to be found: by all candidates, by the chosen measurements.
fn deviations(found: &Sensitivity) -> Vec<IntervalBars> {
    let Some(told) = &found.identification else { return Vec::new() };
    let bar = |value: f64| Interval { value, low: f64::NAN, high: f64::NAN };
    let row = |(k, name): (usize, &String)| {
        let chosen = told.chosen.as_ref().map(|chosen| bar(chosen.information.deviations[k]));
        (short(name), std::iter::once(bar(told.all.deviations[k])).chain(chosen).collect(), f64::NAN)
    };
    let count = told.chosen.as_ref().map(|chosen| format!("{} chosen measurements", chosen.samples.len()));
    vec![IntervalBars {
        title: "What measurements of the tip would tell".into(),
        label: "standard deviation, relative or curvature times length".into(),
        kinds: std::iter::once(format!("all {} candidates", told.candidates)).chain(count).collect(),
        cap: String::new(),
        rows: told.parameters.iter().enumerate().map(row).collect(),
    }]
}

/// Percentiles of the rows against those of the first order.
fn quantile_curves(spread: &Spread) -> Option<Curves> {
    let factor = if spread.unit == "m" { 1e3 } else { 1.0 };
    let unit = if spread.unit == "m" { "mm" } else { &spread.unit };
    let points: Vec<[f64; 2]> = spread.percentiles.iter().map(|pair| pair.map(|x| factor * x)).collect();
    if points.is_empty() || points.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let ends =
        points.iter().flatten().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)]);
    let ratio = if spread.ratio.is_finite() { format!(", sd ratio {:.3}", spread.ratio) } else { String::new() };
    Some(Curves {
        title: format!("{}{ratio}", spread.output),
        x: AxisLabel::linear("percentile by first order", unit),
        y: AxisLabel::linear("percentile of the rows", unit),
        series: vec![
            Series::line("equal", ends.map(|x| [x, x]).to_vec()).dashed().colour(Colour::GREY),
            Series::scatter("1 to 99 %", points, Marker::Circle).colour(Colour::BLUE),
        ],
    })
}

/// Indices as more and more of the rows count: those of the inputs that matter most.
fn convergence(found: &Sensitivity) -> Vec<Curves> {
    let mut panels = Vec::new();
    for output in names(found.convergence.iter().map(|one| &one.output)) {
        let of = || found.convergence.iter().filter(|one| one.output == output && one.steps.len() > 1);
        let order = if of().any(|one| one.order == Order::Total) { Order::Total } else { Order::First };
        let mut shown: Vec<_> = of().filter(|one| one.order == order).collect();
        let last = |steps: &[(u64, f64)]| steps.last().map_or(0.0, |(_, value)| *value);
        shown.sort_by(|a, b| last(&b.steps).total_cmp(&last(&a.steps)));
        // An input has the same colour in every panel.
        let colour = |input: &str| {
            let place = found.inputs.iter().position(|(name, ..)| name == input).unwrap_or(0);
            Colour::SERIES[place % Colour::SERIES.len()]
        };
        let series = shown.into_iter().filter(|one| last(&one.steps) >= LEAST).take(MOST_CURVES).map(|one| {
            let points = one.steps.iter().map(|(rows, value)| [*rows as f64, *value]).collect();
            Series::line(short(&one.input), points).marker(Marker::Circle).colour(colour(&one.input))
        });
        let series: Vec<Series> = series.collect();
        if !series.is_empty() {
            let [what, rows] = match order {
                Order::Total => ["total index", "base rows"],
                _ => ["index of first order", "rows"],
            };
            panels.push(Curves {
                title: output.clone(),
                x: AxisLabel::logarithmic(rows, ""),
                y: AxisLabel::linear(what, ""),
                series,
            });
        }
    }
    panels
}

/// Shares of rows that failed, by status, and what makes them fail.
fn failures(found: &Sensitivity) -> Vec<IntervalBars> {
    let failed = found.statuses.iter().filter(|share| !share.status.is_success());
    let rows: Vec<(String, Vec<Interval>, f64)> = failed
        .map(|share| {
            let [low, high] = share.interval.map(|x| 100.0 * x);
            let name = share.status.name().to_owned();
            (name, vec![Interval { value: 100.0 * share.share, low, high }], f64::NAN)
        })
        .collect();
    let mut panels = Vec::new();
    if !rows.is_empty() {
        panels.push(IntervalBars {
            title: "Rows without a usable equilibrium".into(),
            label: "share of the rows (%)".into(),
            kinds: vec!["share, Wilson's interval".into()],
            cap: String::new(),
            rows,
        });
    }
    panels.extend(
        index_bars(&found.failure_indices, found)
            .into_iter()
            .map(|bars| IntervalBars { title: format!("What makes `{}`", bars.title), ..bars }),
    );
    panels
}

/// Distinct names in their order.
fn names<'a>(all: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in all {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

/// What several parameters have in common, said once: `youngs_modulus (proximal, distal)`; a long name without its middle.
fn short(name: &str) -> String {
    let parts: Vec<&str> = name.split('+').collect();
    let heads: Option<Vec<(&str, &str)>> = parts.iter().map(|part| part.split_once('.')).collect();
    let tails: Option<Vec<(&str, &str)>> = parts.iter().map(|part| part.rsplit_once('.')).collect();
    let joined = |words: Vec<&str>| words.join(", ");
    let name = match (heads, tails) {
        _ if parts.len() < 2 => name.to_owned(),
        (Some(heads), _) if heads.iter().all(|(_, tail)| *tail == heads[0].1) => {
            format!("{} ({})", heads[0].1, joined(heads.iter().map(|(head, _)| *head).collect()))
        }
        (_, Some(tails)) if tails.iter().all(|(head, _)| *head == tails[0].0) => {
            format!("{} ({})", tails[0].0, joined(tails.iter().map(|(_, tail)| *tail).collect()))
        }
        _ => name.to_owned(),
    };
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= LONGEST {
        return name;
    }
    let (head, tail) = (&letters[..LONGEST / 2], &letters[letters.len() - LONGEST / 2 + 1..]);
    head.iter().chain(&['…']).chain(tail).collect()
}
