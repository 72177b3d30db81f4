//! A hard case and what is right for it.

use rodsweep::backend::Precision;
use rodsweep::model::{Plan, PlanOptions, Scene, Vector};
use rodsweep::reference::solve_rod;

/// Error of a tip over the length: what steps and round-off leave in f64, ...
const LIMIT_F64: f64 = 1e-9;
/// ... and in f32: round-off of 6e-8 over some hundred stages.
const LIMIT_F32: f64 = 2e-5;

/// A scene, and what makes it hard.
#[non_exhaustive]
pub struct Case {
    /// The rod in its field.
    pub scene: Scene,
    /// What makes it hard.
    pub why: String,
    /// What is right.
    pub truth: Truth,
}

/// Where the tip is on the branch from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    /// By independent programs or in closed form (m).
    Tip(Vector),
    /// Where the reference finds it.
    Reference,
    /// The branch ends before the full load.
    Nowhere,
}

/// The truth of a case, found once for all engines.
pub struct Answer {
    /// In m
    pub(super) tip: Option<Vector>,
    /// Errors of a residual are amplified so at the tip, where the rod is near a fold or a flip.
    amplification: f64,
}

impl Case {
    /// A case for which the reference knows the truth.
    pub(super) fn new(scene: Scene, why: &str) -> Case {
        Case { scene, why: why.into(), truth: Truth::Reference }
    }

    /// Its scene's name.
    pub fn name(&self) -> &str {
        &self.scene.name
    }

    /// What is right for it, by the reference where nothing better is known.
    pub fn answer(&self) -> Answer {
        let found = solve_rod(&self.scene.rod(), &[]);
        let is_known = found.status.is_success();
        let tip = match self.truth {
            Truth::Tip(tip) => Some(tip),
            Truth::Reference => is_known.then_some(found.p_tip),
            Truth::Nowhere => None,
        };
        Answer { tip, amplification: if is_known { 1.0 / found.margin.min(1.0) } else { 1.0 } }
    }

    pub(super) fn plan(&self) -> Plan {
        Plan::single(&self.scene, &[], PlanOptions::default()).expect("the built-in cases make rods")
    }
}

impl Answer {
    pub(super) fn limit(&self, precision: Precision) -> f64 {
        self.amplification
            * match precision {
                Precision::F64 => LIMIT_F64,
                Precision::F32 => LIMIT_F32,
            }
    }
}
