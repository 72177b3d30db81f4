//! Questions that take more than one solution a sample: plain data in, plain data out, engines through the trait.

mod branches;

pub use branches::{Branches, MakeEngine, find_branches};
