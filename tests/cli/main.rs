//! The program `rodsweep`, as it is started from a shell.

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod bench_report;
mod branches;
mod clusters;
mod contact;
mod control;
mod distrust;
mod experiment;
mod faults;
mod first_steps;
mod gpu_cache;
mod hostile;
mod import;
mod no_gpu;
mod paper;
mod program;
mod readme;
mod sandbox;
mod sensitivity;
mod stretches;
mod tip_moment;
mod view;
mod walls;
mod workspace;
