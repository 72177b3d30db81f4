//! Figures of results: what studies and runs have found, drawn with [`draw`](crate::draw).
//!
//! Drawings of a study take what it gives and are a [`Figure`](crate::draw::Figure).

mod centreline;
mod contact;
mod control;
mod experiment;
mod field;
mod files;
mod fit;
mod replay;
mod rod_motion;
mod run;
mod sensitivity;
mod shape;
mod simulation;
mod wall;
mod workspace;

pub use contact::draw_contact;
pub use control::draw_control;
pub use experiment::ExperimentFigure;
pub use files::Drawn;
pub use fit::fit;
pub use replay::replay;
pub use run::{RunFigures, RunFiguresError};
pub use sensitivity::draw_sensitivity;
pub use shape::{NothingToDraw, rod_shape};
pub use simulation::simulation;
pub use workspace::{DesignStudy, Method, MethodPoint, WorkspaceFigures, WorkspaceSummary, draw_workspace};
