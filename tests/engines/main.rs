//! Every engine against the mechanics: closed forms, golden results, derivatives, hard cases, and against each other.

#[path = "../common/mod.rs"]
mod common;

mod anchors;
mod base_moment;
mod baselines;
mod branches;
mod buckling;
mod closed_forms;
mod dual;
mod energy;
mod every_engine;
mod false_folds;
mod field_branches;
mod field_combinations;
mod field_energy;
mod field_equilibria;
mod field_folds;
mod field_maps;
mod field_points;
mod field_stretches;
mod fields;
mod golden;
mod hard;
mod invariance;
mod jacobian;
mod judge;
mod jumps;
mod limp;
mod limp_forms;
mod limp_lanes;
mod limp_margins;
mod mixed;
mod operations;
mod passes;
mod physics;
mod reliability;
mod rods;
mod shape;
mod steppers;
mod stretches;
mod terms;
mod trust;
mod turns;
mod twins;
mod workspace;
