//! Dragging the tip: the search of `rodsweep control` for the inputs that bring it to a place, gone on with as the place
//! moves.

use crate::error::Refusal;
use rodsweep::engines::EngineRequest;
use rodsweep::model::{Plan, Scene, Vector};
use rodsweep::spec::{ControlInput, Redundancy, Target};
use rodsweep::study::{ControlError, ControlOptions, Controller, Outcome, TargetOptions, TargetResult};
use serde_json::{Value, json};

/// What may be left of a target (m).
const TOLERANCE: f64 = 1e-7;
/// The same while a pointer moves, over the rod's length: less than a pixel. A finer search would spend currents on the
/// last micrometres of places that cannot be reached.
const ROUGH: f64 = 1e-3;
/// Equilibria for one place of the pointer; the page asks again where they did not suffice.
const MOST_ITERATIONS: usize = 60;
/// Where the way from the present inputs ends short of a place: starts all over the permitted inputs, and how many of them
/// are tried.
const STARTS: usize = 512;
const ATTEMPTS: usize = 2;
/// Other inputs are worth a jump where they bring the tip nearer by so much (over the rod's length), a few pixels.
const WORTH: f64 = 5e-3;
/// No coordinate is larger (m).
const LARGEST: f64 = 1e3;

/// How a search begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beginning {
    /// Whether a number was typed; a pointer asks for less.
    pub is_precise: bool,
    /// The direction of view, a unit vector: the tip is free along it. `None` where the place has a depth, too.
    pub along: Option<Vector>,
}

/// A search that goes on from place to place.
pub struct Drag {
    /// The scene at its beginning.
    scene: Scene,
    inputs: Vec<ControlInput>,
    controller: Controller,
    last: Option<TargetResult>,
    /// Nearer by less than this is no reason to jump (m).
    worth: f64,
}

impl Drag {
    /// Begins at a scene's own values.
    pub fn new(scene: Scene, inputs: Vec<ControlInput>, beginning: Beginning) -> Result<Drag, Refusal> {
        if inputs.is_empty() {
            return Err(Refusal::wrong("the scene has no current to search for: drag is for rods with coils"));
        }
        let length = scene.total_length();
        let tolerance = if beginning.is_precise { TOLERANCE } else { ROUGH * length };
        let options = ControlOptions::default()
            .with_tolerance(tolerance)
            .with_free_direction(beginning.along)
            .with_most_iterations(MOST_ITERATIONS)
            // Small currents keep to the equilibria that are reached from rest.
            .with_redundancy(Redundancy::LeastCurrent);
        let engine = EngineRequest::any().choose_for_one(&scene, TOLERANCE).map_err(Refusal::failed)?;
        let mut make = |plan: &Plan| engine.make_for_one(plan);
        let controller =
            Controller::new(&scene, &inputs, options, engine.steppers()[0], &mut make).map_err(of_control)?;
        Ok(Drag { scene, inputs, controller, last: None, worth: WORTH * length })
    }

    /// Goes on to a place (m): inputs by name, the tip, how the search ended, which limits hold it back.
    pub fn follow(&mut self, position: Vector) -> Result<Value, Refusal> {
        if !position.iter().all(|x| x.abs() <= LARGEST) {
            return Err(Refusal::wrong("`target`: give three coordinates in metres"));
        }
        let target = Target::at(position);
        // From where it is, by equilibria that are all reached from rest: the page draws no others.
        if let Some(last) = &self.last {
            self.controller.begin_at(&last.inputs);
        }
        let found = self.controller.follow(&[target]).map_err(of_control)?.pop();
        let mut found = found.ok_or_else(|| Refusal::failed("the search gave no result"))?;
        if !matches!(found.outcome, Outcome::Reached | Outcome::IterationLimit | Outcome::Inaccurate) {
            let starts = TargetOptions::default().with_table(STARTS).with_attempts(ATTEMPTS).with_further(ATTEMPTS);
            let elsewhere = self.controller.reach(&[target], &starts, &mut |_| {}).map_err(of_control)?;
            let worth = self.worth;
            let is_worth = |other: &TargetResult| other.from_rest && other.residual + worth < found.residual;
            if let Some(other) = elsewhere.into_iter().find(is_worth) {
                found = other;
            }
        }
        let answer = self.answer(&found);
        self.last = Some(found);
        Ok(answer)
    }

    fn answer(&self, found: &TargetResult) -> Value {
        let name = |input: &ControlInput| input.name(&self.scene);
        let pairs = || self.inputs.iter().zip(&found.inputs);
        let values: serde_json::Map<String, Value> =
            pairs().map(|(input, value)| (name(input), json!(value))).collect();
        // The page draws no finer than this.
        let outcome = if found.outcome == Outcome::Inaccurate { Outcome::Reached } else { found.outcome };
        let is_held = found.outcome == Outcome::AtLimit;
        let held: Vec<String> = pairs()
            .filter(|(input, value)| is_held && (**value <= input.low || **value >= input.high))
            .map(|(input, _)| name(input))
            .collect();
        json!({
            "values": values,
            "outcome": outcome.name(),
            "held": held,
            "tip": found.tip,
            "residual": found.residual,
        })
    }
}

fn of_control(error: ControlError) -> Refusal {
    Refusal::wrong(error)
}
