//! Questions that take more than one solution a sample: plain data in, plain data out, engines through the trait.
