//! Where the tip should be, what may be commanded to bring it there, and a whole trajectory of such targets.

use crate::model::{Parameter, Scene, Vector};

/// A place for the tip, perhaps with a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target {
    /// Where the tip should be, world frame (m).
    pub position: Vector,
    /// The unit vector along which the tip's tangent should point, world frame; `None` leaves it free.
    pub tangent: Option<Vector>,
    /// The force of the scene's wall on the tip, along the wall's normal (N); `None` leaves it free.
    pub normal_force: Option<f64>,
}

impl Target {
    /// A place (m) without a direction.
    pub fn at(position: Vector) -> Target {
        Target { position, ..Target::default() }
    }

    /// The same place with a direction, a unit vector.
    pub fn along(self, tangent: Vector) -> Target {
        Target { tangent: Some(tangent), ..self }
    }

    /// A target at the same place, at which the tip presses on the wall with a normal force (N).
    pub fn pressing(self, normal_force: f64) -> Target {
        Target { normal_force: Some(normal_force), ..self }
    }
}

/// Which numbers of a target are controlled; the others are free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coordinates {
    /// Those of the tip: x, y and z.
    pub position: [bool; 3],
    /// The normal force of the scene's wall on the tip.
    pub normal_force: bool,
}

/// Coordinates of the tip alone.
impl From<[bool; 3]> for Coordinates {
    fn from(position: [bool; 3]) -> Coordinates {
        Coordinates { position, normal_force: false }
    }
}

/// A parameter that may be commanded, and its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlInput {
    /// What is commanded.
    pub parameter: Parameter,
    /// Lower limit, SI.
    pub low: f64,
    /// Upper limit, SI.
    pub high: f64,
}

impl ControlInput {
    /// A parameter between two limits, SI.
    pub fn new(parameter: Parameter, low: f64, high: f64) -> ControlInput {
        ControlInput { parameter, low, high }
    }

    /// A parameter of either sign, up to a limit, SI.
    pub fn within(parameter: Parameter, limit: f64) -> ControlInput {
        ControlInput::new(parameter, -limit, limit)
    }

    /// The parameter's name in a scene, such as `coil.current.x`.
    pub fn name(&self, scene: &Scene) -> String {
        self.parameter.name(scene)
    }
}

/// What becomes of inputs that the tip does not need.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Redundancy {
    /// They change as little as possible, as in the paper.
    #[default]
    LeastChange,
    /// Currents relax towards zero.
    LeastCurrent,
}

impl Redundancy {
    /// Every choice.
    pub const ALL: [Redundancy; 2] = [Redundancy::LeastChange, Redundancy::LeastCurrent];

    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Redundancy::LeastChange => "least-change",
            Redundancy::LeastCurrent => "least-current",
        }
    }
}

/// Targets, and how they are to be reached. What is `None` or empty is left to the program.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Trajectory {
    /// For titles and file names.
    pub name: String,
    /// In order.
    pub targets: Vec<Target>,
    /// Whether the way goes on from the last target to the first.
    pub closed: bool,
    /// Which of x, y and z are controlled; the others are free.
    pub coordinates: [bool; 3],
    /// What is commanded; empty for every current.
    pub inputs: Vec<ControlInput>,
    /// Of the whole trajectory (s).
    pub duration: Option<f64>,
    /// A target is reached where so much is left of it (m).
    pub tolerance: Option<f64>,
    /// Equilibria for one target, at most.
    pub most_iterations: Option<usize>,
    /// Length by which a tangent's error counts (m).
    pub tangent_weight: Option<f64>,
    /// What becomes of inputs that the tip does not need.
    pub redundancy: Option<Redundancy>,
}

impl Trajectory {
    /// An open trajectory through targets; all three coordinates are controlled.
    pub fn new(name: impl Into<String>, targets: Vec<Target>) -> Trajectory {
        Trajectory {
            name: name.into(),
            targets,
            closed: false,
            coordinates: [true; 3],
            inputs: Vec::new(),
            duration: None,
            tolerance: None,
            most_iterations: None,
            tangent_weight: None,
            redundancy: None,
        }
    }
}

/// Targets under the name `targets`.
impl From<Vec<Target>> for Trajectory {
    fn from(targets: Vec<Target>) -> Trajectory {
        Trajectory::new("targets", targets)
    }
}
