//! Explicit Runge-Kutta methods by name; the tableaux belong to the engines.

/// Integration method of the engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stepper {
    /// Classical fourth order, four stages.
    Rk4,
    /// Dormand and Prince's eighth order (DOP853), twelve stages.
    Dop853,
}

impl Stepper {
    pub const ALL: [Stepper; 2] = [Stepper::Rk4, Stepper::Dop853];

    pub fn name(self) -> &'static str {
        match self {
            Stepper::Rk4 => "rk4",
            Stepper::Dop853 => "dop853",
        }
    }

    pub fn order(self) -> u32 {
        match self {
            Stepper::Rk4 => 4,
            Stepper::Dop853 => 8,
        }
    }

    pub fn stage_count(self) -> usize {
        match self {
            Stepper::Rk4 => 4,
            Stepper::Dop853 => 12,
        }
    }
}
