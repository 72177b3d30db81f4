//! Boxes over parameters of P6 that anchors are tried on, as axes of a sweep file, and the sweep.

use super::root;
use rodsweep::spec::SweepSpec;

pub fn axis(name: &str, from: f64, to: f64) -> String {
    format!("[[axis]]\nparameter = \"{name}\"\nfrom = {from}\nto = {to}\n")
}

/// The three currents, within these limits (A).
pub fn currents(limit: f64) -> String {
    ["x", "y", "z"].map(|letter| axis(&format!("coil.current.{letter}"), -limit, limit)).concat()
}

/// Where equilibria from rest are torn apart between the anchors.
pub fn torn() -> String {
    axis("coil.current.x", -0.002, 0.002) + &axis("coil.current.y", -0.2, 0.05) + &axis("coil.current.z", -0.06, 0.06)
}

/// The same by rest curvature.
pub fn bent() -> String {
    axis("proximal.rest_curvature.x", -30.0, 30.0)
        + &axis("coil.current.y", -0.3, 0.3)
        + &axis("loads.tip_force.z", -5e-3, 5e-3)
}

/// So many samples of a box; `more` are the tables that follow.
pub fn sweep(samples: u64, axes: &str, more: &str) -> SweepSpec {
    let text = format!(
        "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = {samples}\nseed = 3\n{axes}{more}"
    );
    let spec = SweepSpec::parse(&root().join("sweeps/s.toml"), &text);
    spec.unwrap_or_else(|error| panic!("{error}\n{text}"))
}
