//! The map from inputs to tips that is asked about: an engine behind it, or a closed form in a test.

use crate::backend::BackendError;
use crate::model::Vector;
pub(super) use crate::model::vectors::{dot, norm};

/// Most inputs of one workspace.
pub const MOST_INPUTS: usize = 12;

/// Inputs over half their range: from -1 to 1; those beyond the number of inputs are zero.
pub type Inputs = [f64; MOST_INPUTS];

/// The internal load at the base of an equilibrium, from which it is found again, and its neighbours are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseLoad {
    /// Moment (N·m).
    pub moment: Vector,
    /// Force (N); NaN where the loads of the rod tell it, as in a uniform field.
    pub force: Vector,
}

impl BaseLoad {
    /// No load.
    pub const NONE: BaseLoad = BaseLoad { moment: [f64::NAN; 3], force: [f64::NAN; 3] };
}

/// One equilibrium: its tip and what the inputs do to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// Whether it is a stable equilibrium.
    pub usable: bool,
    /// Of the tip (m).
    pub position: Vector,
    /// Unit tangent at the tip.
    pub tangent: Vector,
    /// Stability margin.
    pub margin: f64,
    /// Load at the base, from which a neighbour is followed.
    pub base: BaseLoad,
    /// Normal force of the wall on the tip (N); 0 away from the wall, NaN without one.
    pub normal_force: f64,
    /// By each input over half its range: of the position (m).
    pub jacobian: [Vector; MOST_INPUTS],
    /// Derivatives of the moment at the base by each input over half its range (N·m). Zero where nobody asked.
    pub moment_rates: [Vector; MOST_INPUTS],
    /// Derivatives of the force at the base by each input over half its range (N). Zero where nobody asked.
    pub force_rates: [Vector; MOST_INPUTS],
}

impl Tip {
    /// No equilibrium.
    pub const NONE: Tip = Tip {
        usable: false,
        position: [f64::NAN; 3],
        tangent: [f64::NAN; 3],
        margin: f64::NAN,
        base: BaseLoad::NONE,
        normal_force: f64::NAN,
        jacobian: [[0.0; 3]; MOST_INPUTS],
        moment_rates: [[0.0; 3]; MOST_INPUTS],
        force_rates: [[0.0; 3]; MOST_INPUTS],
    };

    /// Whether it is stable with this margin at least.
    pub fn counts(&self, minimum_margin: f64) -> bool {
        self.usable && self.margin >= minimum_margin
    }

    /// Where the tip goes with a small change of the inputs, to first order (m).
    pub fn position_after(&self, change: &Inputs) -> Vector {
        advanced(self.position, &self.jacobian, change)
    }

    /// The load at the base after a small change of the inputs, to first order.
    pub fn base_after(&self, change: &Inputs) -> BaseLoad {
        BaseLoad {
            moment: advanced(self.base.moment, &self.moment_rates, change),
            force: advanced(self.base.force, &self.force_rates, change),
        }
    }
}

fn advanced(from: Vector, rates: &[Vector; MOST_INPUTS], change: &Inputs) -> Vector {
    let mut to = from;
    for (rate, change) in rates.iter().zip(change) {
        (0..3).for_each(|axis| to[axis] += rate[axis] * change);
    }
    to
}

/// Which equilibrium of some inputs is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// The one that is reached from rest.
    FromRest,
    /// The stable one that continues that of the neighbour from which a search comes.
    Neighbour,
}

/// Where inputs take the tip.
pub trait TipMap {
    /// Number of inputs, at most [`MOST_INPUTS`].
    fn input_count(&self) -> usize;

    /// Equilibria from rest, one for each row of inputs.
    ///
    /// # Errors
    ///
    /// An engine that fails; inputs without a usable equilibrium are no error.
    fn solve_from_rest(&mut self, inputs: &[Inputs]) -> Result<Vec<Tip>, BackendError>;

    /// Stable equilibria near given loads at the base, one for each row of inputs.
    ///
    /// # Errors
    ///
    /// As [`TipMap::solve_from_rest`].
    fn near(&mut self, inputs: &[(Inputs, BaseLoad)]) -> Result<Vec<Tip>, BackendError>;

    /// Whether an equilibrium near a known one takes much less time than one from rest.
    fn near_is_quick(&self) -> bool {
        false
    }
}

/// Distance of two points.
pub(super) fn distance(a: Vector, b: Vector) -> f64 {
    norm(difference(a, b))
}

pub(super) fn difference(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Inputs of which those beyond the number in use are zero.
pub(super) fn padded(values: &[f64]) -> Inputs {
    let mut inputs = [0.0; MOST_INPUTS];
    inputs[..values.len()].copy_from_slice(values);
    inputs
}
