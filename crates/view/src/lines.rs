//! Lines of the field within the view: traced anew where the field is another, sent where the page has others.

use rodsweep::draw::{FieldLine, Surroundings};
use rodsweep::model::Scene;
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, PoisonError};

/// Positions are rounded to this share of the region at most.
const ROUNDING: f64 = 1e-4;

/// Lines of the field, as they were traced last.
pub struct Lines {
    /// Where they run (m).
    region: [[f64; 2]; 3],
    last: Mutex<Option<Traced>>,
}

struct Traced {
    of: Surroundings,
    number: u64,
    lines: Arc<Value>,
}

impl Lines {
    /// Within limits of x, y and z (m).
    pub fn within(region: [[f64; 2]; 3]) -> Lines {
        Lines { region, last: Mutex::default() }
    }

    /// Where they run (m).
    pub fn region(&self) -> [[f64; 2]; 3] {
        self.region
    }

    /// Lines of a scene's field with their number; `None` where that number is known, or the field is uniform.
    pub fn answer(&self, scene: &Scene, known: u64) -> Option<Value> {
        let around = Surroundings::of(scene)?;
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let traced = match last.take() {
            Some(traced) if traced.of.is_as(&around) => traced,
            other => {
                let lines = around.lines_within(self.region);
                let lines = Arc::new(lines.iter().map(|line| self.on_wire(line)).collect());
                Traced { of: around, number: other.map_or(1, |before| before.number + 1), lines }
            }
        };
        let (number, lines) = (traced.number, Arc::clone(&traced.lines));
        *last = Some(traced);
        (number != known).then(|| json!({ "number": number, "lines": *lines }))
    }

    fn on_wire(&self, line: &FieldLine) -> Value {
        let extent = self.region.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let decimals = (-(ROUNDING * extent).log10()).ceil().clamp(0.0, 12.0) as i32;
        let places = line.places.iter();
        let positions: Vec<f64> = places.clone().flat_map(|place| place.at.map(|x| rounded(x, decimals))).collect();
        let flux_density: Vec<f64> = places.clone().map(|place| significant(place.flux_density)).collect();
        let weights: Vec<f64> = places.map(|place| rounded(place.weight, 3)).collect();
        json!({ "positions": positions, "flux_density": flux_density, "weights": weights })
    }
}

fn rounded(x: f64, decimals: i32) -> f64 {
    let by = 10f64.powi(decimals);
    (x * by).round() / by
}

/// Three digits.
fn significant(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { rounded(x, (2 - x.log10().floor() as i32).clamp(-300, 300)) } else { x }
}
