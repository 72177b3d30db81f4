//! What surrounds a rod in figures: magnets, coils, grids and lines of the field.

mod beyond;
mod bodies;
mod free_places;
mod line;
mod near;
mod scenery;
mod sources;
mod space;
#[cfg(test)]
mod space_tests;
mod spread;
#[cfg(test)]
mod tests;

pub(super) use scenery::Scenery;
pub(super) use sources::widened;
pub use sources::{Cuboid, Cylinder, FieldSource, GridBox, SourceBody, Surroundings};
pub use space::{FieldLine, LinePlace};
