//! Nothing but a list of features, in `Cargo.toml`: with them library, program, tests and wheel are made of the same compiled crates.
