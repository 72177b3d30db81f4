//! A sweep whose path from rest loses stability on the way: no row may be called usable.

use crate::common::root;
use crate::sandbox::Sandbox;
use rodsweep::spec::SweepSpec;

#[test]
fn a_sweep_beyond_the_stretch_has_no_usable_rows() {
    let path = root().join("tests/data/attack/mmsweep.toml");
    let spec = SweepSpec::read(&path).expect("the sweep reads");
    assert_eq!(spec.sample_count, 64);
    let sandbox = Sandbox::new();
    let sweep = path.to_str().expect("a path of words");
    let output = sandbox.run(&["run", sweep, "--out", "out", "--backend", "cpu", "--no-figures"]);
    // A run of which no row can be used is distrusted.
    assert_eq!(output.code, 4, "{}", output.stderr);
    assert!(output.stderr.contains("64 fold; 0.000 % usable"), "{}", output.stderr);
}
