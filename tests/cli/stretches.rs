//! Sweeps under a tip moment: a path from rest goes on where the symmetric part of the stiffness is not positive, and ends where the
//! rod diverges.

use crate::common::root;
use crate::sandbox::Sandbox;
use rodsweep::spec::SweepSpec;

#[test]
fn a_sweep_beyond_a_turn_has_no_usable_rows() {
    for (sweep, code, words) in [
        ("mmsweep.toml", 0, "64 ramped; 100.000 % usable"),
        // A run of which no row can be used is distrusted.
        ("far_step_sweep.toml", 4, "64 fold; 0.000 % usable"),
    ] {
        let path = root().join("tests/data/attack").join(sweep);
        let spec = SweepSpec::read(&path).expect("the sweep reads");
        assert_eq!(spec.sample_count, 64);
        let sandbox = Sandbox::new();
        let sweep = path.to_str().expect("a path of words");
        let output = sandbox.run(&["run", sweep, "--out", "out", "--backend", "cpu", "--no-figures"]);
        assert_eq!(output.code, code, "{}", output.stderr);
        assert!(output.stderr.contains(words), "{}", output.stderr);
    }
}
