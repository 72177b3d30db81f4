//! Dragging the tip: the search of `rodsweep control` for the inputs that bring it to a point, gone on with as the point
//! moves.

use crate::error::Refusal;
use rodsweep::engines::EngineRequest;
use rodsweep::model::{Plan, Scene, Vector};
use rodsweep::spec::{ControlInput, Redundancy, Target};
use rodsweep::study::{ControlError, ControlOptions, Controller, TargetResult};
use serde_json::{Value, json};

/// What may be left of a target (m).
const TOLERANCE: f64 = 1e-7;
/// The same while a pointer moves, over the rod's length: less than a pixel. A finer search would spend currents on the
/// last micrometres of places that cannot be reached.
const ROUGH: f64 = 2e-3;
/// Equilibria for one place of the pointer.
const MOST_ITERATIONS: usize = 40;
/// No coordinate is larger (m).
const LARGEST: f64 = 1e3;

/// A search that goes on from place to place.
pub struct Drag {
    /// The scene at its beginning.
    scene: Scene,
    inputs: Vec<ControlInput>,
    controller: Controller,
    last: Option<TargetResult>,
}

impl Drag {
    /// Begins at a scene's own values; a pointer asks for less precision than a number.
    pub fn new(scene: Scene, inputs: Vec<ControlInput>, is_precise: bool) -> Result<Drag, Refusal> {
        if inputs.is_empty() {
            return Err(Refusal::wrong("the scene has no current to search for: drag is for rods with coils"));
        }
        let tolerance = if is_precise { TOLERANCE } else { ROUGH * scene.total_length() };
        let options = ControlOptions::default().with_tolerance(tolerance).with_most_iterations(MOST_ITERATIONS);
        // Small currents keep to the equilibria that are reached from rest.
        let options = options.with_redundancy(Redundancy::LeastCurrent);
        let engine = EngineRequest::any().choose_for_one(TOLERANCE).map_err(Refusal::failed)?;
        let mut make = |plan: &Plan| engine.make_for_one(plan);
        let controller =
            Controller::new(&scene, &inputs, options, engine.steppers()[0], &mut make).map_err(of_control)?;
        Ok(Drag { scene, inputs, controller, last: None })
    }

    /// Searches from where the drag began, by equilibria that are all reached from rest.
    fn afresh(&mut self, target: Target) -> Result<Option<TargetResult>, Refusal> {
        Ok(self.controller.follow(&[target]).map_err(of_control)?.pop())
    }

    /// Goes on to a place (m): inputs by name, the tip, how the search ended.
    pub fn follow(&mut self, position: Vector) -> Result<Value, Refusal> {
        if !position.iter().all(|x| x.abs() <= LARGEST) {
            return Err(Refusal::wrong("`target`: give three coordinates in metres"));
        }
        let target = Target::at(position);
        let before = self.last.clone();
        let result = match before.clone() {
            None => self.afresh(target)?,
            Some(mut last) => {
                last.target = target;
                let mut results = [last];
                self.controller.finish(&mut results).map_err(of_control)?;
                let [result] = results;
                Some(result)
            }
        };
        let result = result.ok_or_else(|| Refusal::failed("the search gave no result"))?;
        // A catheter that is switched on would not come there: another way may lead there, or it stays where it was.
        let result = if result.from_rest { result } else { self.afresh(target)?.unwrap_or(result) };
        let is_from_rest = result.from_rest;
        let taken = if is_from_rest { result } else { before.unwrap_or(result) };
        let names = self.inputs.iter().map(|input| input.name(&self.scene));
        let values: serde_json::Map<String, Value> =
            names.zip(&taken.inputs).map(|(name, value)| (name, json!(value))).collect();
        let answer = json!({
            "values": values,
            "outcome": taken.outcome.name(),
            "tip": taken.tip,
            "residual": taken.residual,
            "from_rest": is_from_rest,
        });
        self.last = Some(taken);
        Ok(answer)
    }
}

fn of_control(error: ControlError) -> Refusal {
    Refusal::wrong(error)
}
