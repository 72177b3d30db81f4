//! A wall that the tip touches: its equations, how it comes to a free rod, and what a row says of it. W1 to W6

pub mod course;
pub mod free_rods;
pub mod free_tip;
pub mod press;
pub mod press_curve;
pub mod program_wall;
pub mod wall;
pub mod wall_rows;
