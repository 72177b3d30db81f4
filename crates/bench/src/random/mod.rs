//! Reproducible random numbers, rods and scenes: everything follows from a seed.

mod any_field;
mod any_scene;
mod boxes;
mod chains;
mod designs;
mod limp;
mod numbers;
mod rods;
mod sampled;
mod walls;

pub use any_field::RandomScenes;
pub use any_scene::any_scene;
pub use chains::Chain;
pub use numbers::Random;
