//! Fields that vary in space: forces act along with torques, and the force at the base is unknown, too. F0 to F7
//!
//! State and columns carry the internal force. Each step is an interval of its own with a 12 x 12 transfer; their
//! product is dr/d(n0, m0), and elimination from the tip counts the index. Its shaders know no maps.

mod acting;
mod answer;
mod arrival;
mod base_load;
mod block;
mod chord;
mod crossing;
mod crossing_columns;
mod curve;
mod ends;
mod first;
mod fold;
mod free_tip;
mod group;
mod index;
mod map;
mod matrix;
mod parameters;
mod pass;
mod path;
mod press;
mod press_curve;
mod program_field;
mod program_wall;
mod rest;
mod search;
mod space;
mod state;
mod step;
mod wall;
mod wall_rows;
mod workspace;

pub use arrival::VARYING_END_COLUMNS;
pub use block::{follow_block, press_block};
pub use free_tip::FREE_COLUMNS;
pub use group::PassVarying;
pub use pass::{Pass, VaryingPasses};
pub use program_field::ProgramField;
pub use program_wall::ProgramWall;
pub use rest::REST_COLUMNS;
pub use workspace::VaryingWorkspace;
