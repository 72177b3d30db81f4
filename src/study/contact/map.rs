//! What a tip can press where: answers point by point, and their account.

use super::lattice::WallLattice;
use super::robust::{RobustAccount, RobustContact};
use crate::draw::count;
use crate::model::Scene;
use crate::spec::SolutionMethod;
use crate::study::columns::Columns;
use crate::study::witness::{WitnessCheck, with_mark};
use crate::study::workspace::{InputAccount, Inputs, WorkspaceInput};
use crate::table::Table;
use serde::Serialize;

/// Why a point cannot be pressed on, or that it can.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// It can.
    Reached,
    /// An input is at its limit.
    InputLimit,
    /// Friction does not hold the tip, though no input is at its limit.
    Friction,
    /// Rod and wall are less stable than was asked for.
    Margin,
    /// The way there leads past the end of stable equilibria.
    Branch,
    /// Another part of the rod would be in the wall.
    ThroughWall,
    /// It is farther from the base than the rod is long.
    OutOfReach,
}

impl Cause {
    /// Every cause.
    pub const ALL: [Cause; 7] = [
        Cause::Reached,
        Cause::InputLimit,
        Cause::Friction,
        Cause::Margin,
        Cause::Branch,
        Cause::ThroughWall,
        Cause::OutOfReach,
    ];

    /// The word written to files.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Reached => "reached",
            Cause::InputLimit => "input-limit",
            Cause::Friction => "friction",
            Cause::Margin => "margin",
            Cause::Branch => "branch",
            Cause::ThroughWall => "through-wall",
            Cause::OutOfReach => "out-of-reach",
        }
    }
}

/// An equilibrium from rest that holds the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Over half their ranges.
    pub inputs: Inputs,
    /// Along the normal (N).
    pub force: f64,
    /// Force along the wall over the normal force.
    pub ratio: f64,
    /// Between the direction into the wall and the tip's tangent (rad).
    pub angle: f64,
    /// Stability margin of rod and wall together.
    pub margin: f64,
}

/// What came of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointResult {
    /// With the most normal force; where a force was given, with the least friction.
    pub most: Option<Answer>,
    /// With the least normal force; `None` where a force was given.
    pub least: Option<Answer>,
    /// Why there is no answer.
    pub cause: Cause,
}

/// Which force the tip can press where.
#[derive(Clone, Debug)]
pub struct ContactMap {
    /// The rod with its wall, its numbers beside the inputs.
    pub scene: Scene,
    /// What is commanded.
    pub inputs: Vec<WorkspaceInput>,
    /// Where.
    pub lattice: WallLattice,
    /// One a point of the lattice.
    pub points: Vec<PointResult>,
    /// The normal force that was given (N).
    pub force: Option<f64>,
    /// Coefficient of friction of the wall.
    pub friction: Option<f64>,
    /// Least margin that counts.
    pub minimum_margin: f64,
    /// How far from the middle points are, where that was given (m).
    pub extent: Option<f64>,
    /// Equilibria computed.
    pub solves: u64,
    /// What computed them.
    pub engine: String,
    /// Precision, steps and tolerance.
    pub method: SolutionMethod,
    /// On the clock (s).
    pub seconds: f64,
    /// A share of the answers, solved again by the reference.
    pub check: WitnessCheck,
    /// Remarks for the user.
    pub notes: Vec<String>,
}

/// The answer that stands out, and where.
#[derive(Clone, Debug, Serialize)]
pub struct Outstanding {
    /// Along the normal (N).
    pub force: f64,
    /// Coefficient of friction that it takes.
    pub ratio: f64,
    /// Place (m).
    pub point: [f64; 3],
    /// Values of the inputs, SI.
    pub inputs: Vec<f64>,
    /// Stability margin.
    pub margin: f64,
}

/// All that is known of a map as a whole; SI units.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ContactAccount {
    /// Of the wall where the tip can press (m²).
    pub area: f64,
    /// Over the area of all points.
    pub share: f64,
    /// All points.
    pub points: usize,
    /// Points by cause.
    pub causes: Vec<(&'static str, usize)>,
    /// The largest normal force; where a force was given, the answer that takes the least friction.
    pub best: Option<Outstanding>,
    /// The given normal force (N).
    pub force: Option<f64>,
    /// Coefficient of friction of the wall.
    pub friction: Option<f64>,
    /// Share of the area on which the wall's own coefficient suffices for the given force.
    pub held_share: Option<f64>,
    /// What uncertain designs have in common.
    pub robust: Option<RobustAccount>,
    /// Least margin that counts.
    pub minimum_margin: f64,
    /// Distance of neighbouring points (m).
    pub voxel: f64,
    /// How far from the middle points are (m).
    pub extent: Option<f64>,
    /// What is commanded.
    pub inputs: Vec<InputAccount>,
    /// Equilibria computed.
    pub solves: u64,
    /// What computed them.
    pub engine: String,
    /// Precision, steps and tolerance.
    pub method: String,
    /// On the clock (s).
    pub seconds: f64,
    /// Of the rod.
    pub scene: String,
    /// Remarks for the user.
    pub notes: Vec<String>,
    /// A share of the answers, solved again by the reference.
    pub check: WitnessCheck,
    /// The doubt about the answers; `None`: no doubt is known.
    pub distrusted: Option<String>,
    /// Of the program.
    pub version: &'static str,
}

impl ContactMap {
    /// Points with an answer.
    pub fn reached(&self) -> impl Iterator<Item = (usize, &Answer)> {
        self.points.iter().enumerate().filter_map(|(at, point)| Some((at, point.most.as_ref()?)))
    }

    /// The doubt about the answers; `None`: no doubt is known.
    pub fn mark(&self) -> Option<&str> {
        self.check.mark.as_deref()
    }

    /// Of the wall where the tip can press (m²).
    pub fn area(&self) -> f64 {
        self.reached().map(|(at, _)| self.lattice.areas[at]).sum()
    }

    /// Values of the inputs of an answer, SI.
    pub fn values(&self, answer: &Answer) -> Vec<f64> {
        self.inputs.iter().zip(answer.inputs).map(|(input, t)| input.value(t)).collect()
    }

    /// One row a point: place, normal, `reached`, `cause`, forces, inputs of each, friction, angle, margin, and what designs say.
    pub fn table(&self, robust: Option<&RobustContact>) -> Table {
        let mut columns = Columns::default();
        columns.vectors("point", "m", &self.lattice.points);
        columns.vectors("normal", "", &self.lattice.normals);
        columns.numbers("area", "m²", self.lattice.areas.iter().copied());
        columns.flags("reached", self.points.iter().map(|point| point.most.is_some()));
        columns.words("cause", self.points.iter().map(|point| point.cause.name().to_owned()));
        let of = |answer: Option<Answer>, number: &dyn Fn(&Answer) -> f64| answer.as_ref().map_or(f64::NAN, number);
        let mut put = |name: String, unit: &str, is_least: bool, number: &dyn Fn(&Answer) -> f64| {
            let answers = self.points.iter().map(|point| if is_least { point.least } else { point.most });
            columns.numbers(name, unit, answers.map(|answer| of(answer, number)));
        };
        if self.force.is_none() {
            put("force.least".into(), "N", true, &|answer| answer.force);
            put("force.most".into(), "N", false, &|answer| answer.force);
        } else {
            put("force".into(), "N", false, &|answer| answer.force);
        }
        put("ratio".into(), "", false, &|answer| answer.ratio);
        put("angle".into(), "rad", false, &|answer| answer.angle);
        put("margin".into(), "", false, &|answer| answer.margin);
        for (k, input) in self.inputs.iter().enumerate() {
            let (name, unit) = (input.name(&self.scene), input.unit());
            let value = |answer: &Answer| input.value(answer.inputs[k]);
            if self.force.is_none() {
                put(format!("least:{name}"), unit, true, &value);
                put(format!("most:{name}"), unit, false, &value);
            } else {
                put(name, unit, false, &value);
            }
        }
        let mut table = columns.finish();
        table.columns.extend(robust.into_iter().flat_map(RobustContact::columns));
        table
    }

    /// Its account.
    pub fn account(&self, robust: Option<&RobustContact>) -> ContactAccount {
        let all: f64 = self.lattice.areas.iter().sum();
        let key = |answer: &Answer| if self.force.is_some() { -answer.ratio } else { answer.force };
        let best = self.reached().max_by(|(_, a), (_, b)| key(a).total_cmp(&key(b)));
        let best = best.map(|(at, answer)| Outstanding {
            force: answer.force,
            ratio: answer.ratio,
            point: self.lattice.points[at],
            inputs: self.values(answer),
            margin: answer.margin,
        });
        let held = |friction: f64| {
            let own = self.reached().filter(|(_, answer)| answer.ratio <= friction);
            own.map(|(at, _)| self.lattice.areas[at]).sum::<f64>() / all
        };
        let number = |cause: Cause| self.points.iter().filter(|point| point.cause == cause).count();
        ContactAccount {
            area: self.area(),
            share: self.area() / all,
            points: self.points.len(),
            causes: Cause::ALL.into_iter().map(|cause| (cause.name(), number(cause))).collect(),
            best,
            force: self.force,
            friction: self.friction,
            robust: robust.map(|robust| robust.account(&self.lattice)),
            held_share: self.friction.filter(|_| self.force.is_some()).map(held),
            minimum_margin: self.minimum_margin,
            voxel: self.lattice.spacing,
            extent: self.extent,
            inputs: self
                .inputs
                .iter()
                .map(|input| InputAccount {
                    name: input.name(&self.scene),
                    unit: input.unit(),
                    low: input.low,
                    high: input.high,
                })
                .collect(),
            solves: self.solves,
            engine: self.engine.clone(),
            method: self.method.to_string(),
            seconds: self.seconds,
            scene: self.scene.name.clone(),
            notes: self.notes.clone(),
            check: self.check.clone(),
            distrusted: self.mark().map(str::to_owned),
            version: env!("CARGO_PKG_VERSION"),
        }
    }
}

impl ContactAccount {
    /// As JSON; what does not apply is null.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// The answer in one line; it begins with what speaks against it.
    pub fn headline(&self) -> String {
        with_mark(self.distrusted.as_deref(), self.answer())
    }

    fn answer(&self) -> String {
        let Some(best) = &self.best else {
            let most = self.causes.iter().max_by_key(|(_, count)| *count).map_or("", |(name, _)| *name);
            return format!("the tip can press on none of {} points; most: {most}", count(self.points as u64));
        };
        let [x, y, z] = best.point.map(|x| 1e3 * x);
        let place = format!("at {x:.1} {y:.1} {z:.1} mm");
        let area = format!("{:.2} cm² of the wall ({:.1} %)", 1e4 * self.area, 100.0 * self.share);
        match (self.force, self.held_share) {
            (None, _) => format!("the tip can press on {area}, with at most {} {place}", newtons(best.force)),
            (Some(force), Some(share)) => format!(
                "the tip can press with {} on {area}, held by friction on {:.1} %; it takes at least {:.3} {place}",
                newtons(force),
                100.0 * share,
                best.ratio
            ),
            (Some(force), None) => format!(
                "the tip can press with {} on {area}; it takes a friction of at least {:.3} {place}",
                newtons(force),
                best.ratio
            ),
        }
    }

    /// For a person: what speaks against the answer, the answer and a few lines.
    pub fn text(&self) -> String {
        let mut lines: Vec<String> = self.distrusted.iter().cloned().collect();
        lines.push(self.answer());
        let named = self.causes.iter().filter(|(_, count)| *count > 0);
        let causes: Vec<String> = named.map(|(name, number)| format!("{name} {}", count(*number as u64))).collect();
        let all = count(self.points as u64);
        lines.push(format!("{all} points {:.3} mm apart: {}", 1e3 * self.voxel, causes.join(", ")));
        if let Some(best) = &self.best {
            let inputs = self.inputs.iter().zip(&best.inputs);
            let inputs: Vec<String> =
                inputs.map(|(input, value)| format!("{} {value:.5} {}", input.name, input.unit)).collect();
            let which = if self.force.is_some() { "least friction" } else { "most force" };
            let inputs = inputs.join(", ");
            lines.push(format!("{which}: margin {:.3}, friction {:.3}; {inputs}", best.margin, best.ratio));
        }
        lines.extend(self.robust.as_ref().map(RobustAccount::text));
        lines.push(self.check.sentence());
        lines.push(format!("{} equilibria in {:.1} s on {}", count(self.solves), self.seconds, self.engine));
        lines.join("\n")
    }
}

/// A force in words.
fn newtons(force: f64) -> String {
    match force {
        f if f >= 1.0 => format!("{f:.3} N"),
        f if f >= 1e-3 => format!("{:.3} mN", 1e3 * f),
        f => format!("{:.3} µN", 1e6 * f),
    }
}
