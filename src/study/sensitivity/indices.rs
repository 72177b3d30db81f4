//! Indices of every output from the sums of a pass, and which of them may be trusted.

use super::blocks::Estimate;
use super::chaos::{Chaos, GOOD};
use super::cosine::{Cosines, ORDERS, Source};
use super::design::{Design, Layout};
use super::estimator::Estimator;
use super::inputs::Input;
use super::options::EstimatorChoice;
use super::outputs::{Output, Outputs};
use super::pass::ScalarSums;
use super::pick_freeze::{PairedEstimate, PickFreeze};
use super::result::{Convergence, Index, Order, Slopes};
use super::sums::Share;

/// Above this share of missing rows a polynomial only extrapolates, and nothing shows it.
const MISSING_LIMIT: f64 = 0.05;
pub(super) const WITHHELD: &str = "withheld: ";

/// What the indices are made of.
pub(super) struct Evidence<'a> {
    pub layout: &'a Layout,
    pub inputs: &'a [Input],
    /// Inputs that are told of.
    pub chosen: &'a [usize],
    pub outputs: &'a Outputs,
    pub sums: &'a [ScalarSums],
    /// By scalar; `None` where none could be fitted.
    pub chaos: &'a [Option<Chaos>],
    pub estimator: EstimatorChoice,
    pub confidence: f64,
    pub rows: u64,
    /// Share of the rows that are missing.
    pub missing: f64,
}

/// One output's part of it.
struct OfOutput<'a> {
    evidence: &'a Evidence<'a>,
    output: &'a Output,
    sums: Vec<&'a ScalarSums>,
    /// Why nothing that rests on slopes may be told.
    jumps: Option<String>,
}

impl Evidence<'_> {
    fn of<'a>(&'a self, output: &'a Output) -> OfOutput<'a> {
        let sums = output.components.iter().map(|scalar| &self.sums[*scalar]).collect();
        let mut of = OfOutput { evidence: self, output, sums, jumps: None };
        let jumping = (0..self.inputs.len())
            .filter(|input| of.has_slopes() && Cosines::jumps(&of.cosine_sums(*input), self.missing));
        let shares = jumping.filter_map(|input| Some((input, of.jump_share(input)?)));
        let most = shares.reduce(|most, next| if next.1 > most.1 { next } else { most });
        of.jumps = most.map(|(input, share)| {
            format!(
                "slopes do not see {:.1} % of the variance, where the output jumps or is steeper in {} than the rows resolve: only \
                 pick-freeze and values may be trusted",
                100.0 * share,
                self.inputs[input].name
            )
        });
        of
    }

    /// Indices of one output: the ones to read first, and others that can be had.
    pub fn indices(&self, output: &Output) -> Vec<Index> {
        let of = self.of(output);
        let mut found = match self.layout.design {
            Design::PickFreeze(_) => of.pick_freeze(self.estimator.pick_freeze()),
            Design::Grid(_) => of.grid(),
            Design::Sample => of.cosines(),
        };
        let chaos = of.chaos();
        let is_asked = self.estimator == EstimatorChoice::Chaos;
        let is_better = matches!(self.layout.design, Design::Sample) && self.estimator == EstimatorChoice::Auto;
        let is_whole = !chaos.is_empty() && chaos.iter().all(|index| !index.flag.starts_with(WITHHELD));
        let is_main = is_asked || is_better && is_whole && !output.is_indicator;
        if self.estimator == EstimatorChoice::Slopes && !matches!(self.layout.design, Design::Sample) {
            found.extend(of.cosines());
        }
        found.extend(chaos);
        let main = match self.estimator {
            _ if is_main => "chaos",
            EstimatorChoice::Slopes => of.cosine_name(),
            _ => found.first().map_or("", |index| index.estimator),
        };
        found.iter_mut().for_each(|index| index.is_main = index.estimator == main);
        found.sort_by_key(|index| !index.is_main);
        found
    }

    /// Bounds of one output by its slopes; none where there are no slopes.
    pub fn slopes(&self, output: &Output) -> Vec<Slopes> {
        let of = self.of(output);
        let of = &of;
        if !of.has_slopes() || of.sums.len() > 1 {
            return Vec::new();
        }
        let bound = |input: &usize| {
            let cosines = &of.sums[0].cosines[*input];
            let [mean, deviation, mean_square] = cosines.slope_moments();
            let constant = self.inputs[*input].law.poincare();
            let upper = constant * mean_square / cosines.variance();
            Slopes {
                output: of.output.name.clone(),
                input: self.inputs[*input].name.clone(),
                mean_square,
                constant,
                upper: if of.jumps.is_some() { f64::NAN } else { upper },
                mean,
                deviation,
                jump_share: of.jump_share(*input).unwrap_or(f64::NAN),
                flag: of.jumps.as_ref().map(|why| format!("{WITHHELD}{why}")).unwrap_or_default(),
            }
        };
        self.chosen.iter().map(bound).collect()
    }

    /// Whether slopes miss a part of an output, and which.
    pub fn jumps(&self, output: &Output) -> Option<String> {
        self.of(output).jumps
    }

    /// How the indices of one output settle as more blocks count; none on a grid.
    pub fn convergence(&self, output: &Output) -> Vec<Convergence> {
        let of = self.of(output);
        let mut found = Vec::new();
        for input in self.chosen {
            let mut add = |order, steps: Vec<(u64, f64)>| {
                let (output, input) = (of.output.name.clone(), self.inputs[*input].name.clone());
                found.push(Convergence { output, input, order, steps });
            };
            match self.layout.design {
                Design::PickFreeze(_) => {
                    let (parts, estimator) = (of.pick_freeze_sums(), self.estimator.pick_freeze());
                    let first = PickFreeze::settling(&parts, |sums| sums.first(estimator, *input));
                    let total = PickFreeze::settling(&parts, |sums| sums.total(estimator, *input));
                    add(Order::First, first);
                    add(Order::Total, total);
                }
                Design::Sample => add(Order::First, Cosines::settling(&of.cosine_sums(*input), of.source(), ORDERS)),
                Design::Grid(_) => {}
            }
        }
        found
    }
}

impl<'a> OfOutput<'a> {
    fn has_slopes(&self) -> bool {
        let evidence = self.evidence;
        let known = evidence.inputs.iter().all(|input| input.law.is_steady());
        let scalars = &evidence.outputs.scalars;
        let is_sampled = !matches!(evidence.layout.design, Design::Grid(_));
        known && is_sampled && self.output.components.iter().all(|scalar| scalars[*scalar].has_slopes)
    }

    fn jump_share(&self, input: usize) -> Option<f64> {
        if !self.has_slopes() { None } else { Cosines::jump_share(&self.cosine_sums(input)) }
    }

    fn cosine_sums(&self, input: usize) -> Vec<&'a Cosines> {
        self.sums.iter().map(|sums| &sums.cosines[input]).collect()
    }

    fn pick_freeze_sums(&self) -> Vec<&'a PickFreeze> {
        self.sums.iter().filter_map(|sums| sums.pick_freeze.as_ref()).collect()
    }

    /// What cosines are taken of.
    fn source(&self) -> Source {
        if self.has_slopes() && self.jumps.is_none() { Source::Mix } else { Source::Values }
    }

    fn cosine_name(&self) -> &'static str {
        match self.source() {
            Source::Mix => "slopes",
            _ => "cosines",
        }
    }

    fn index(&self, order: Order, input: String, estimator: &'static str, found: PairedEstimate) -> Index {
        let PairedEstimate { estimate, pairs } = found;
        let (output, rows) = (self.output.name.clone(), self.evidence.rows);
        Index { output, input, order, estimator, is_main: false, estimate, pairs, rows, flag: self.given_success() }
    }

    fn given_success(&self) -> String {
        match self.evidence.missing > 0.0 && self.output.name != super::outputs::FAILED {
            true => format!("given success: {:.2} % of the rows are missing", 100.0 * self.evidence.missing),
            false => String::new(),
        }
    }

    fn name(&self, input: usize) -> String {
        self.evidence.inputs[input].name.clone()
    }

    /// Every two of the inputs that are told of, with their name.
    fn pairs(&self) -> Vec<([usize; 2], String)> {
        let chosen = self.evidence.chosen;
        let mut pairs = Vec::new();
        for (k, i) in chosen.iter().enumerate() {
            pairs.extend(chosen[k + 1..].iter().map(|j| ([*i, *j], format!("{}*{}", self.name(*i), self.name(*j)))));
        }
        pairs
    }

    fn pick_freeze(&self, estimator: Estimator) -> Vec<Index> {
        let (sums, confidence) = (self.pick_freeze_sums(), self.evidence.confidence);
        let mut found = Vec::new();
        for input in self.evidence.chosen {
            let first = PickFreeze::first(&sums, estimator, *input, confidence);
            let total = PickFreeze::total(&sums, estimator, *input, confidence);
            found.push(self.index(Order::First, self.name(*input), estimator.name(), first));
            found.push(self.index(Order::Total, self.name(*input), estimator.name(), total));
        }
        for (pair, name) in self.pairs() {
            let second = PickFreeze::second(&sums, estimator, pair, confidence);
            found.push(self.index(Order::Second, name, estimator.name(), second));
        }
        found
    }

    fn grid(&self) -> Vec<Index> {
        let sums: Vec<_> = self.sums.iter().filter_map(|sums| sums.grid.as_ref()).collect();
        let pairs = sums.iter().map(|sums| sums.row_count()).min().unwrap_or(0);
        let mut found = Vec::new();
        let mut add = |order, input, shares: Option<Share>| {
            let estimate = Estimate::exact(shares.map_or(f64::NAN, |share| share.value()));
            let mut index = self.index(order, input, "grid", PairedEstimate { estimate, pairs });
            if shares.is_none() {
                index.flag = format!("{WITHHELD}the grid is too large");
            }
            found.push(index);
        };
        for input in self.evidence.chosen {
            add(Order::First, self.name(*input), Some(sums.iter().map(|sums| sums.first(*input)).sum()));
            add(Order::Total, self.name(*input), sums.iter().map(|sums| sums.total(*input)).sum());
        }
        for (pair, name) in self.pairs() {
            add(Order::Second, name, sums.iter().map(|sums| sums.second(pair)).sum());
        }
        found
    }

    fn cosines(&self) -> Vec<Index> {
        let of = |input: &usize| {
            let sums = self.cosine_sums(*input);
            let estimate = Cosines::first(&sums, self.source(), ORDERS, self.evidence.confidence);
            let pairs = sums.iter().map(|sums| sums.row_count()).min().unwrap_or(0);
            let found = PairedEstimate { estimate, pairs };
            let mut index = self.index(Order::First, self.name(*input), self.cosine_name(), found);
            if let Some(why) = self.jumps.as_ref().filter(|_| self.evidence.estimator == EstimatorChoice::Slopes) {
                index.flag = format!("by values alone: {why}");
            }
            index
        };
        self.evidence.chosen.iter().map(of).collect()
    }

    /// Indices by polynomials; none where there is none for each component.
    fn chaos(&self) -> Vec<Index> {
        let chaos: Option<Vec<&Chaos>> =
            self.output.components.iter().map(|scalar| self.evidence.chaos[*scalar].as_ref()).collect();
        let Some(chaos) = chaos.filter(|_| !self.output.is_indicator) else { return Vec::new() };
        // Of a vector as of its indices: components count by their variance.
        let predicted = chaos.iter().map(|chaos| Chaos::predicted_share(chaos)).sum::<Share>().value();
        let pairs = chaos.iter().map(|chaos| chaos.rows as u64).min().unwrap_or(0);
        let withheld = self.no_chaos(predicted);
        let mut found = Vec::new();
        let mut add = |order, input, share: Share| {
            // The error of an index is about what the polynomial does not predict.
            let estimate = Estimate::within(if withheld.is_some() { f64::NAN } else { share.value() }, 1.0 - predicted);
            let index = self.index(order, input, "chaos", PairedEstimate { estimate, pairs });
            let missing = 100.0 * self.evidence.missing;
            let flag = match &withheld {
                Some(why) => format!("{WITHHELD}{why}"),
                None if missing > 0.0 => format!("extrapolates over {missing:.2} % of the rows, which are missing"),
                None => String::new(),
            };
            found.push(Index { flag, ..index });
        };
        for input in self.evidence.chosen {
            add(Order::First, self.name(*input), chaos.iter().map(|chaos| chaos.first(*input)).sum());
            add(Order::Total, self.name(*input), chaos.iter().map(|chaos| chaos.total(*input)).sum());
        }
        for (pair, name) in self.pairs() {
            add(Order::Second, name, chaos.iter().map(|chaos| chaos.second(pair)).sum());
        }
        found
    }

    /// Why a polynomial is not to be trusted.
    fn no_chaos(&self, predicted: f64) -> Option<String> {
        let missing = self.evidence.missing;
        if missing > MISSING_LIMIT {
            return Some(format!(
                "{:.1} % of the rows are missing, and a polynomial extrapolates there unseen; above {:.0} % it is not told",
                100.0 * missing,
                100.0 * MISSING_LIMIT
            ));
        }
        if predicted < GOOD || predicted.is_nan() {
            return Some(format!("the polynomial predicts {predicted:.4} of the held-out variance, less than {GOOD}"));
        }
        self.jumps.clone()
    }
}
