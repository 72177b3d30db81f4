//! A sweep that has yet to be run: what its rows need for a study.

use crate::model::Parameter;
use crate::spec::{Format, OutputQuantity, SweepSpec};

/// The same sweep with derivatives by every axis, by what is uncertain and by what is named, with tip and margin, and
/// with rows.
pub(super) fn prepared(mut spec: SweepSpec, names: &[String]) -> SweepSpec {
    let mut wanted: Vec<Parameter> = spec.axis_parameters().concat();
    wanted.extend(spec.uncertain.iter().flat_map(|axis| axis.parameters.iter().copied()));
    for name in names.iter().flat_map(|name| name.split('+')) {
        // A name that the scene has not is refused where names are looked at.
        wanted.extend(Parameter::parse(&spec.scene, name.trim()).unwrap_or_default());
    }
    for parameter in wanted {
        if !spec.wrt.contains(&parameter) {
            spec.wrt.push(parameter);
        }
    }
    for quantity in [OutputQuantity::TipPosition, OutputQuantity::Stability] {
        if !spec.quantities.contains(&quantity) {
            spec.quantities.push(quantity);
        }
    }
    if spec.format == Format::None {
        spec.format = Format::Parquet;
    }
    spec
}
