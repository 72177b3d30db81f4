//! Curves of a workspace: shares of its volume, convergence of its size, design studies.

use super::summary::{DesignStudy, Method, MethodPoint, WorkspaceSummary, size_unit, with_error};
use crate::draw::{AxisLabel, Canvas, Colour, Curves, Figure, Marker, Panel, ReportError, Scale, Series, Sheet};
use crate::study::workspace::Estimate;

/// Points of a curve of shares.
const POINTS: usize = 200;

/// How much of a whole has a number that is at least so large; `columns` are sorted numbers with their weights.
pub(super) fn at_least(x: AxisLabel, y: AxisLabel, whole: f64, columns: Vec<(&str, Vec<(f64, f64)>)>) -> Curves {
    let series = columns.into_iter().map(|(name, sorted)| {
        let total: f64 = sorted.iter().map(|(_, weight)| weight).sum();
        // Distinct numbers, and the share at or above each.
        let (mut left, mut steps): (f64, Vec<[f64; 2]>) = (total, Vec::new());
        for (number, weight) in &sorted {
            if steps.last().is_none_or(|step| step[0] != *number) {
                steps.push([*number, whole * left / total]);
            }
            left -= weight;
        }
        let every = steps.len().div_ceil(POINTS).max(1);
        let mut points = Vec::new();
        for step in steps.iter().step_by(every) {
            // Up to each number the share stays that of the number itself.
            points.extend(points.last().map(|last: &[f64; 2]| [last[0], step[1]]));
            points.push(*step);
        }
        points.extend(steps.last().map(|last| [last[0], 0.0]));
        Series::line(name, points)
    });
    Curves { title: String::new(), x, y, series: series.collect() }
}

/// The size by each method, against the edge of a voxel and against the number of solves.
pub(super) struct Convergence<'a>(pub &'a WorkspaceSummary);

impl Figure for Convergence<'_> {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let panels = self.panels();
        Sheet { columns: 2, panels: panels.iter().map(|panel| panel as &dyn Panel).collect() }.draw()
    }
}

impl Convergence<'_> {
    /// Values above; below, where there is a number to compare with, how far they are from it.
    fn panels(&self) -> Vec<Curves> {
        let (name, factor, unit) = size_unit(self.0.dimension);
        let spacing = |point: &MethodPoint| point.spacing.map(|spacing| 1e3 * spacing);
        let solves = |point: &MethodPoint| Some(point.solves as f64);
        let by_spacing = AxisLabel::logarithmic("edge of a voxel", "mm");
        let by_solves = AxisLabel::logarithmic("solves", "");
        let values = |x: &AxisLabel, of: &dyn Fn(&MethodPoint) -> Option<f64>| Curves {
            title: String::new(),
            x: x.clone(),
            y: AxisLabel { label: name.into(), unit: unit.into(), scale: self.scale() },
            series: self.values(factor, of),
        };
        let mut panels = vec![values(&by_spacing, &spacing), values(&by_solves, &solves)];
        if let Some((name, reference)) = &self.0.reference {
            let away = |x: &AxisLabel, of: &dyn Fn(&MethodPoint) -> Option<f64>| Curves {
                title: String::new(),
                x: x.clone(),
                y: AxisLabel::logarithmic(format!("|difference| from {name}"), "%"),
                series: self.differences(*reference, of),
            };
            panels.extend([away(&by_spacing, &spacing), away(&by_solves, &solves)]);
        }
        let shown = |panel: &Curves| panel.series.iter().any(|series| !series.points.is_empty());
        let mut panels: Vec<Curves> = panels.into_iter().filter(shown).collect();
        if let Some(first) = panels.first_mut() {
            first.title = self.0.title.clone();
        }
        panels
    }

    /// Logarithmic where methods differ by more than a factor.
    fn scale(&self) -> Scale {
        let sizes = self.0.methods.iter().flat_map(|method| &method.points).map(|point| point.size.value);
        let (low, high) =
            sizes.filter(|x| *x > 0.0).fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(x), high.max(x)));
        if high > 5.0 * low { Scale::Logarithmic } else { Scale::Linear }
    }

    fn values(&self, factor: f64, x: &dyn Fn(&MethodPoint) -> Option<f64>) -> Vec<Series> {
        let of = |size: Estimate| {
            let Estimate { value, low, high } = size.scaled(factor);
            (value, [low, high])
        };
        let mut series = self.series(x, of);
        let ends = series.iter().flat_map(|series| &series.points).map(|point| point[0]);
        let (low, high) = ends.fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(x), high.max(x)));
        if let Some((name, reference)) = self.0.reference.as_ref().filter(|_| low <= high) {
            let Estimate { value, low: least, high: most } = reference.scaled(factor);
            let line = Series::line(name, vec![[low, value], [high, value]]).colour(Colour::MUTED).dashed().width(0.8);
            let bounds = vec![[least, most]; 2];
            series.insert(0, if least.is_finite() && most.is_finite() { line.band(bounds) } else { line });
        }
        series
    }

    /// How far values are from another (%), with the length of their bars.
    fn differences(&self, reference: Estimate, x: &dyn Fn(&MethodPoint) -> Option<f64>) -> Vec<Series> {
        let of = |size: Estimate| {
            let away = 100.0 * (size.value / reference.value - 1.0).abs();
            let half = 50.0 * (size.high - size.low) / reference.value.abs();
            let low = if half.is_nan() { f64::NAN } else { (away - half).max(0.0) };
            (away, [low, away + half])
        };
        self.series(x, of)
    }

    fn series(&self, x: &dyn Fn(&MethodPoint) -> Option<f64>, of: impl Fn(Estimate) -> (f64, [f64; 2])) -> Vec<Series> {
        let series = |(k, method): (usize, &Method)| {
            let (mut points, mut bounds) = (Vec::new(), Vec::new());
            for point in &method.points {
                if let Some(x) = x(point) {
                    let (value, bars) = of(point.size);
                    points.push([x, value]);
                    bounds.push(bars);
                }
            }
            let marker = Marker::ALL[k % Marker::ALL.len()];
            let colour = Colour::SERIES[k % Colour::SERIES.len()];
            let name = if points.is_empty() { "" } else { method.name.as_str() };
            Series::line(name, points).bars(bounds).marker(marker).colour(colour).width(0.9)
        };
        self.0.methods.iter().enumerate().map(series).filter(|series| !series.points.is_empty()).collect()
    }
}

impl Figure for DesignStudy {
    /// Sizes with their bounds and the slope; margins beside them.
    fn draw(&self) -> Result<Canvas, ReportError> {
        let panels = self.panels();
        Sheet { columns: 2, panels: panels.iter().map(|panel| panel as &dyn Panel).collect() }.draw()
    }
}

impl DesignStudy {
    fn panels(&self) -> Vec<Curves> {
        let (size, factor, unit) = size_unit(self.dimension);
        let x = AxisLabel::linear(&self.name, &self.unit);
        let pairs = || self.values.iter().copied().zip(self.sizes.iter().map(|size| size.scaled(factor)));
        let points: Vec<[f64; 2]> = pairs().map(|(value, size)| [value, size.value]).collect();
        let bounds = pairs().map(|(_, size)| [size.low, size.high]).collect();
        let mut series = Vec::new();
        if let Some([slope, error]) = self.slope {
            let per = if self.unit.contains(['/', '·']) { format!("({})", self.unit) } else { self.unit.clone() };
            let unit = if per.is_empty() { unit.to_owned() } else { format!("{unit}/{per}") };
            let name = format!("slope {} {unit}", with_error(factor * slope, factor * error));
            series.push(self.line(&points, factor * slope, name));
        }
        series.push(Series::scatter("", points, Marker::Circle).bars(bounds).colour(Colour::BLUE));
        let mut panels =
            vec![Curves { title: self.title.clone(), x: x.clone(), y: AxisLabel::linear(size, unit), series }];
        let quantile = |(k, (share, margins)): (usize, &(f64, Vec<f64>))| {
            let points = self.values.iter().copied().zip(margins.iter().copied()).map(|(x, y)| [x, y]).collect();
            let name = format!("{} % of the {size} below", (100.0 * share).round());
            Series::line(name, points).marker(Marker::ALL[k % Marker::ALL.len()])
        };
        if !self.margins.is_empty() {
            let series = self.margins.iter().enumerate().map(quantile).collect();
            panels.push(Curves { title: String::new(), x, y: AxisLabel::linear("stability margin", ""), series });
        }
        panels
    }

    /// The slope as a line through the mean of the points.
    fn line(&self, points: &[[f64; 2]], slope: f64, name: String) -> Series {
        let finite: Vec<&[f64; 2]> = points.iter().filter(|point| point.iter().all(|x| x.is_finite())).collect();
        let mean = |k: usize| finite.iter().map(|point| point[k]).sum::<f64>() / finite.len() as f64;
        let ends = finite.iter().map(|point| point[0]);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let at = |x: f64| [x, mean(1) + slope * (x - mean(0))];
        let points = if finite.is_empty() { Vec::new() } else { vec![at(low), at(high)] };
        Series::line(name, points).colour(Colour::MUTED).dashed().width(0.9)
    }
}
