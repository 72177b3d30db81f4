//! Figures and pages of studies: the room above, which knows what was found and draws it with [`crate::report`].
//!
//! Each is a method of what it shows, such as [`ControlRun::figures`](crate::study::ControlRun::figures).

mod centreline;
mod control;
mod experiment;
mod fit;
mod replay;
mod rod_motion;
mod simulation;
