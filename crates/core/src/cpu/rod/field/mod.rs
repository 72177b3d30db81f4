//! The pass in a field that varies in space: forces act along with torques, and the force at the base is unknown, too. F0 to F7
//!
//! State and columns carry the internal force. Each step is an interval of its own with a 12 x 12 transfer; their
//! product is dr/d(n0, m0), and elimination from the tip counts the index. Its shaders know no maps.

pub mod acting;
pub mod axis;
pub mod crossing;
pub mod crossing_columns;
pub mod cuboid;
pub mod cylinder;
pub mod ends;
pub mod first;
pub mod index;
pub mod map;
pub mod matrix;
pub mod nearest;
pub mod parameters;
pub mod pass;
pub mod program_field;
pub mod space;
pub mod state;
pub mod step;
pub mod workspace;
