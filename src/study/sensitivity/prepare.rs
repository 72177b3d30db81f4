//! A sweep that has yet to be run: what its rows need for a study.

use super::options::Options;
use super::outputs::POSE;
use super::shapes::points_asked;
use crate::model::Parameter;
use crate::spec::{Format, OutputQuantity, SweepSpec};

/// The same sweep with derivatives by every axis, by what is uncertain and by what is named, with tip and margin,
/// with what the outputs follow from, and with rows.
pub(super) fn prepared(mut spec: SweepSpec, options: &Options) -> SweepSpec {
    let mut wanted: Vec<Parameter> = spec.axis_parameters().concat();
    wanted.extend(spec.uncertain.iter().flat_map(|axis| axis.parameters.iter().copied()));
    for name in options.inputs.iter().flat_map(|name| name.split('+')) {
        // A name that the scene has not is refused where names are looked at.
        wanted.extend(Parameter::parse(&spec.scene, name.trim()).unwrap_or_default());
    }
    for parameter in wanted {
        if !spec.wrt.contains(&parameter) {
            spec.wrt.push(parameter);
        }
    }
    let mut quantities = vec![OutputQuantity::TipPosition, OutputQuantity::Stability];
    if options.tangent_noise.is_some() || options.outputs.iter().any(|name| name == POSE) {
        quantities.push(OutputQuantity::TipRotation);
    }
    // What is wrong with the number of points is told where outputs are looked at.
    if !matches!(points_asked(&options.outputs), Ok(None)) {
        quantities.push(OutputQuantity::BaseMoment);
    }
    for quantity in quantities {
        if !spec.quantities.contains(&quantity) {
            spec.quantities.push(quantity);
        }
    }
    if spec.format == Format::None {
        spec.format = Format::Parquet;
    }
    spec
}
