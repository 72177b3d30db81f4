//! Blocks of samples: a batch, its blocks, their registers, and the table of kernels.

pub mod alike;
pub mod batch;
pub mod block;
pub mod by_nodes;
pub mod count;
pub mod field_block;
pub mod field_group;
pub mod group;
pub mod kernels;
pub mod memory;
pub mod scratch;
pub mod table;
pub mod tally;
pub mod tools;
