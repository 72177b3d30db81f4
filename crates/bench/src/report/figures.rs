//! The figures of the report.

use super::costs::names;
use super::measured::{Report, WORK};
use crate::record::Record;
use rodsweep::draw::Canvas;
use rodsweep::draw::{AxisLabel, Colour, Curves, Figure, Marker, NamedBars, Panel, ReportError, Series, Sheet};

/// Scenes in a panel: more curves cannot be told apart.
const CURVES: usize = 4;
/// Of those that this program is compared with.
const OTHERS: [Colour; 7] =
    [Colour::INK, Colour::GREY, Colour::PURPLE, Colour::VERMILION, Colour::GREEN, Colour::ORANGE, Colour::SKY];

/// Panels that a sheet owns.
struct Page {
    panels: Vec<Box<dyn Panel>>,
    columns: usize,
}

impl Figure for Page {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let panels = self.panels.iter().map(AsRef::as_ref).collect();
        Sheet { panels, columns: self.columns }.draw()
    }
}

type Named = (String, Box<dyn Figure>);

fn page(name: impl Into<String>, panels: Vec<Box<dyn Panel>>, columns: usize) -> Option<Named> {
    let page: Box<dyn Figure> = Box::new(Page { panels, columns });
    let named = (name.into(), page);
    // Figures without data are no figures.
    named.1.draw().is_ok().then_some(named)
}

/// One after the other, so that curves differ by more than their colour.
fn marker(index: usize) -> Marker {
    Marker::ALL[index % Marker::ALL.len()]
}

fn micro(record: &Record) -> f64 {
    1e6 * record.seconds
}

fn boxed(title: &str, x: AxisLabel, y: AxisLabel, series: Vec<Series>) -> Box<dyn Panel> {
    Box::new(Curves { title: title.into(), x, y, series })
}

fn error_axis(words: &str) -> AxisLabel {
    AxisLabel::logarithmic(words, "")
}

fn time_axis() -> AxisLabel {
    AxisLabel::logarithmic("time of a sample", "µs")
}

/// The fastest at each error: what is slower and no better is left out.
fn front(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.retain(|point| point.iter().all(|x| x.is_finite() && *x > 0.0));
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for point in points {
        if kept.last().is_none_or(|last| point[1] < last[1]) {
            kept.push(point);
        }
    }
    kept
}

impl Report {
    pub(super) fn precision_figures(&self) -> Vec<Named> {
        let mut all: Vec<Named> = Vec::new();
        for (case, _) in self.scenes() {
            let panels = |words: &str, error: fn(&Record) -> f64| -> Vec<Box<dyn Panel>> {
                let works = WORK.iter().filter(|(work, _)| self.points(&case, work).next().is_some());
                let all = works.flat_map(|(work, title)| ["f64", "f32"].map(|precision| (*work, *title, precision)));
                all.map(|(work, title, precision)| self.curves(&case, work, title, precision, words, error)).collect()
            };
            let mut tip = panels("tip error / length, 95 %", |record| record.tip[1]);
            if self.part("peers").any(|record| record.case == case) {
                tip.push(self.others(&case, "tip error / length, 95 %", |record| record.tip[1]));
                tip.push(self.others(&case, "error of the Jacobian's worst column, 95 %", |record| record.column[1]));
            }
            all.extend(page(format!("work-precision-{case}"), tip, 2));
            if self.part("precision").any(|record| record.case == case && record.is_literature()) {
                let jacobian = panels("error of the Jacobian's norm, 95 %", |record| record.norm[1]);
                all.extend(page(format!("work-precision-{case}-jacobian"), jacobian, 2));
            }
        }
        all.extend(self.spread_figure());
        all.extend(self.sets_figure());
        all.extend(self.scenes_figure());
        all
    }

    /// A curve for each stepper and backend in a precision, and the literature's beside f64.
    fn curves(
        &self,
        case: &str,
        work: &str,
        title: &str,
        precision: &str,
        words: &str,
        error: fn(&Record) -> f64,
    ) -> Box<dyn Panel> {
        let best = self.best_set();
        let points: Vec<&Record> = self
            .points(case, work)
            .filter(|record| record.precision == precision)
            .filter(|record| record.engine == best || record.is_gpu() || record.is_literature())
            .collect();
        let mut series: Vec<Series> = Vec::new();
        for engine in names(points.iter().copied()) {
            for (index, stepper) in self.steppers().iter().enumerate() {
                let curve = points.iter().filter(|record| record.engine_name() == engine && record.method == *stepper);
                let places: Vec<[f64; 2]> = curve.clone().map(|record| [error(record), micro(record)]).collect();
                let Some(one) = curve.clone().next() else { continue };
                let (colour, marker) = (Colour::SERIES[index % 7], marker(index));
                let plain = |name: &str| Series::line(name, places.clone());
                series.push(match one.engine.trim_start_matches("literature: ") {
                    engine if engine.ends_with("differences") => {
                        plain(engine).marker(Marker::Diamond).colour(Colour::GREY)
                    }
                    engine if engine.ends_with("ode_solvers") => {
                        plain(engine).marker(Marker::Square).colour(Colour::PURPLE).dashed()
                    }
                    engine if one.is_literature() => plain(engine).marker(Marker::Triangle).colour(Colour::INK),
                    engine if one.is_gpu() => {
                        plain(&format!("{stepper}, {engine}")).marker(marker).colour(colour).dashed().hollow()
                    }
                    _ => plain(stepper).marker(marker).colour(colour),
                });
            }
        }
        boxed(&format!("{precision}: {title}"), error_axis(words), time_axis(), series)
    }

    /// This program's fastest settings, and everyone else's, from rest with the Jacobian in f64.
    fn others(&self, case: &str, words: &str, error: fn(&Record) -> f64) -> Box<dyn Panel> {
        let front_of = |records: &mut dyn Iterator<Item = &Record>| {
            front(records.map(|record| [error(record), micro(record)]).collect())
        };
        let own = front_of(&mut self.ours(case, "cold", "f64"));
        let mut series = vec![Series::line("this program", own).marker(Marker::Circle).colour(Colour::BLUE)];
        for (index, name) in self.rival_names(case).into_iter().enumerate() {
            let places = front_of(&mut self.rivals(case, "cold").filter(|record| record.engine == name));
            let label = name.trim_start_matches("literature: ");
            series.push(
                Series::line(label, places).marker(marker(index + 1)).colour(OTHERS[index % OTHERS.len()]).hollow(),
            );
        }
        boxed("f64: others, equilibrium + Jacobian, from rest", error_axis(words), time_axis(), series)
    }

    /// Median, 95 % and worst of the samples.
    fn spread_figure(&self) -> Option<Named> {
        let (case, best) = (self.first_scene(), self.best_set());
        let panel = |title: &str, words: &str, error: fn(&Record) -> [f64; 3]| {
            let mut series = Vec::new();
            let steppers = self.steppers();
            // The lowest and the highest order: more cannot be told apart.
            let ends = [steppers.first(), steppers.last().filter(|_| steppers.len() > 1)];
            for (index, stepper) in ends.into_iter().flatten().enumerate() {
                let of = |which: usize| -> Vec<[f64; 2]> {
                    self.part("precision")
                        .filter(|record| record.case == case && record.work == "cold" && record.engine == best)
                        .filter(|record| record.precision == "f64" && record.method == *stepper)
                        .map(|record| [error(record)[which], micro(record)])
                        .collect()
                };
                let colour = Colour::SERIES[index % 7];
                series.push(Series::line(format!("{stepper}, median"), of(0)).dashed().colour(colour));
                series.push(Series::line(format!("{stepper}, 95 %"), of(1)).marker(Marker::Circle).colour(colour));
                series
                    .push(Series::scatter(format!("{stepper}, worst"), of(2), Marker::Diamond).hollow().colour(colour));
            }
            boxed(title, error_axis(words), time_axis(), series)
        };
        let tip = panel("Samples differ: the tip", "tip error / length", |record| record.tip);
        let column = panel("The Jacobian's worst column", "relative error", |record| record.column);
        page("spread", vec![tip, column], 2)
    }

    /// The fastest settings of each instruction set.
    fn sets_figure(&self) -> Option<Named> {
        let case = self.first_scene();
        let panel = |precision: &str| {
            let of = |engine: &str, precision: &str| {
                let points = self.part("precision").filter(|record| record.case == case && record.work == "cold");
                let points = points.filter(|record| record.engine == engine && record.precision == precision);
                front(points.map(|record| [record.tip[1], micro(record)]).collect())
            };
            let mut series: Vec<Series> = self
                .sets()
                .iter()
                .zip(Colour::SERIES)
                .enumerate()
                .map(|(index, (set, colour))| {
                    let line = Series::line(set, of(set, precision)).marker(marker(index)).colour(colour);
                    // Curves that lie on one another are told apart by what shines through.
                    if index == 1 { line.dashed().hollow() } else { line }
                })
                .collect();
            let paper = "literature: paper's form";
            let mut paper = Series::line("paper's form, scalar f64", of(paper, "f64"));
            // What lies far beyond the other curves would press them together.
            let finest = series.iter().flat_map(|series| &series.points).map(|point| point[0]).fold(1.0, f64::min);
            paper.points.retain(|point| point[0] > 1e-2 * finest);
            series.push(paper.marker(Marker::Diamond).colour(Colour::INK));
            boxed(precision, error_axis("tip error / length, 95 %"), time_axis(), series)
        };
        page("instruction-sets", vec![panel("f64"), panel("f32")], 2)
    }

    /// The fastest settings on each scene.
    fn scenes_figure(&self) -> Option<Named> {
        let best = self.best_set();
        let scenes = self.scenes();
        let mut panels = Vec::new();
        for (precision, words) in [("f64", "f64, from rest"), ("f32", "f32, from rest")] {
            for part in scenes.chunks(CURVES) {
                let curve = |(index, ((case, title), colour)): (usize, (&(String, String), Colour))| {
                    let points = self.part("precision").filter(|record| record.case == *case && record.work == "cold");
                    let points = points.filter(|record| record.engine == best && record.precision == precision);
                    let front = front(points.map(|record| [record.tip[1], micro(record)]).collect());
                    Series::line(title, front).marker(marker(index)).colour(colour)
                };
                let series: Vec<Series> = part.iter().zip(Colour::SERIES).enumerate().map(curve).collect();
                panels.push(boxed(words, error_axis("tip error / length, 95 %"), time_axis(), series));
            }
        }
        page("scenes", panels, 2)
    }

    pub(super) fn cost_figures(&self) -> Vec<Named> {
        let mut panels: Vec<Box<dyn Panel>> = Vec::new();
        let terms = self.part("terms").filter(|record| record.precision == "f64");
        let bars = terms.map(|record| (record.case.clone(), self.relative(record))).collect();
        let (title, label) = ("Terms, f64".into(), "time over the plainest scene's".into());
        panels.push(Box::new(NamedBars { title, label, bars, decimals: 2, mark: Some(1.0) }));
        for (part, words) in [("columns", "derivatives"), ("segments", "flexible segments"), ("coils", "coils")] {
            let curve = |(precision, colour, marker): (&str, Colour, Marker)| {
                let points = self.part(part).filter(|record| record.precision == precision);
                let points = points.map(|record| [record.size, self.relative(record)]).collect();
                Series::line(precision, points).marker(marker).colour(colour)
            };
            let both = [("f64", Colour::BLUE, Marker::Circle), ("f32", Colour::VERMILION, Marker::Square)];
            let series = both.map(curve).into();
            let y = AxisLabel::linear("time over the plainest scene's", "");
            panels.push(boxed("", AxisLabel::linear(format!("number of {words}"), ""), y, series));
        }
        let mut all: Vec<Named> = page("features", panels, 2).into_iter().collect();
        all.extend(self.throughput_figure());
        all
    }

    fn throughput_figure(&self) -> Option<Named> {
        let curve = |part: &str, engine: &String, index: usize, y: &dyn Fn(&Record) -> f64| {
            let points = self.part(part).filter(|record| record.engine_name() == *engine);
            let points = points.map(|record| [record.size, y(record)]).collect();
            Series::line(engine, points).marker(marker(index)).colour(Colour::SERIES[index % 7])
        };
        let each = |part: &str, y: &dyn Fn(&Record) -> f64| -> Vec<Series> {
            names(self.part(part)).iter().enumerate().map(|(index, engine)| curve(part, engine, index, y)).collect()
        };
        let rate = AxisLabel::logarithmic("samples a second", "");
        let batches = each("batch", &|record| 1.0 / record.seconds);
        let mut panels =
            vec![boxed("Batches, all threads", AxisLabel::logarithmic("samples in a batch", ""), rate, batches)];
        let one = |record: &Record| {
            let first = self.part("threads").find(|other| other.size == 1.0 && other.precision == record.precision);
            first.map_or(f64::NAN, |first| first.seconds / record.seconds)
        };
        let mut threads = each("threads", &one);
        let most = self.part("threads").map(|record| record.size).fold(1.0, f64::max);
        threads.push(Series::line("ideal", vec![[1.0, 1.0], [most, most]]).dashed().colour(Colour::GREY));
        let (x, y) = (AxisLabel::logarithmic("threads", ""), AxisLabel::logarithmic("speed over one thread's", ""));
        panels.push(boxed("Threads", x, y, threads));
        for precision in ["f64", "f32"] {
            let stages = self.part("stages").filter(|record| record.precision == precision);
            let bars = stages.map(|record| (record.case.clone(), record.seconds)).collect();
            let title = format!("Workspace map by stage, {precision}");
            panels.push(Box::new(NamedBars { title, label: "busy time (s)".into(), bars, decimals: 2, mark: None }));
        }
        page("throughput", panels, 2)
    }

    pub(super) fn trust_figures(&self) -> Vec<Named> {
        let panel = |precision: &str| {
            let of = |stepper: &String| -> Vec<[f64; 2]> {
                let points = self.part("estimate").filter(|record| record.precision == precision);
                let points = points.filter(|record| record.method == *stepper);
                points.map(|record| [record.tip[0].max(1e-17), record.estimate]).collect()
            };
            let mut series: Vec<Series> = self
                .steppers()
                .iter()
                .enumerate()
                .map(|(index, stepper)| {
                    let scatter = Series::scatter(stepper, of(stepper), marker(index));
                    scatter.hollow().colour(Colour::SERIES[index % 7])
                })
                .collect();
            let places: Vec<f64> = series.iter().flat_map(|series| series.points.iter().flatten()).copied().collect();
            let low = places.iter().copied().fold(f64::INFINITY, f64::min);
            let high = places.iter().copied().fold(0.0, f64::max);
            series.push(Series::line("estimate = error", vec![[low, low], [high, high]]).colour(Colour::INK));
            let (x, y) = (AxisLabel::logarithmic("true error", ""), AxisLabel::logarithmic("estimated error", ""));
            boxed(&format!("{precision}: bounded above the line"), x, y, series)
        };
        page("estimates", vec![panel("f64"), panel("f32")], 2).into_iter().collect()
    }
}
