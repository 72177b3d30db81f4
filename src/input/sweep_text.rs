//! A sweep written out again, resolved, so that it reads back to the same sweep.

use super::scene_text::write_inline_scene;
use crate::model::{Parameter, PlanOptions};
use crate::spec::{AxisSpec, Distribution, Method, PrecisionChoice, RESOLVED_TABLE, SweepSpec, WorkspaceOptions};

impl SweepSpec {
    /// The sweep as TOML that reads back to the same sweep: scene inline, SI numbers, names in full.
    ///
    /// The values of `method = "table"` are not in the text: they belong beside it, in [`RESOLVED_TABLE`].
    pub fn to_toml(&self) -> String {
        let name = |parameter: &Parameter| format!("\"{}\"", parameter.name(&self.scene));
        let list = |parameters: &[Parameter]| parameters.iter().map(name).collect::<Vec<_>>().join(", ");
        let mut text = format!("[sampling]\nmethod = \"{}\"\nseed = {}\n", self.method.name(), self.seed);
        match self.method {
            Method::Grid => {}
            Method::Table => text += &format!("file = \"{RESOLVED_TABLE}\"\n"),
            Method::Saltelli => {
                let each = self.saltelli_design().map_or(1, |design| design.rows_per_base());
                text += &format!("samples = {}\n", self.sample_count / each);
            }
            _ => text += &format!("samples = {}\n", self.skeleton.map_or(self.sample_count, |asked| asked.samples)),
        }
        if let Some(dimension) = self.skeleton.and_then(|asked| asked.dimension) {
            text += &format!("dimension = {dimension}\n");
        }
        for axis in self.axes.iter().filter(|_| self.method != Method::Table) {
            text += &format!("\n[[axis]]\nparameters = [{}]\n{}", list(&axis.parameters), law(axis));
            if self.method == Method::Grid {
                text += &format!("points = {}\n", axis.points);
            }
        }
        for number in &self.uncertain {
            text += &format!("\n[[uncertain]]\nparameters = [{}]\n{}", list(&number.parameters), law(number));
        }
        text += &format!("\n[solver]\ntolerance = {:?}\nbranch = \"{}\"\n", self.tolerance, self.branch.name());
        if self.derivative_tolerance != PlanOptions::default().derivative_tolerance {
            text += &format!("derivative_tolerance = {:?}\n", self.derivative_tolerance);
        }
        if self.precision != PrecisionChoice::Usual {
            text += &format!("precision = \"{}\"\n", self.precision.name());
        }
        if !self.anchors {
            text += "anchors = \"off\"\n";
        }
        if let Some(share) = self.allow_failures {
            text += &format!("allow_failures = {share:?}\n");
        }
        if let Some(steps) = self.steps {
            text += &format!("steps = {steps}\n");
        }
        let quantities: Vec<_> = self.quantities.iter().map(|quantity| format!("\"{}\"", quantity.name())).collect();
        text += &format!("\n[output]\nquantities = [{}]\n", quantities.join(", "));
        text += &format!("derivatives = [{}]\nformat = \"{}\"\n", list(&self.wrt), self.format.name());
        if self.single_derivatives {
            text += "derivative_precision = \"f32\"\n";
        }
        if self.rows_in_folder {
            text += "rows_in_folder = true\n";
        }
        text += &workspace(&self.workspace);
        text + "\n" + &write_inline_scene(&self.scene)
    }
}

/// How an axis varies; what is usual is not said.
fn law(axis: &AxisSpec) -> String {
    let scale = if axis.scales { "scale = true\n" } else { "" };
    let law = match &axis.distribution {
        Distribution::Uniform { .. } => String::new(),
        Distribution::Values(values) => format!("values = {values:?}\n"),
        other => format!("distribution = \"{}\"\n", other.name()),
    };
    let number = |(key, number): (&str, f64)| format!("{key} = {number:?}\n");
    let numbers: String = axis.distribution.numbers().into_iter().map(number).collect();
    format!("{scale}{law}{numbers}")
}

/// The block of the workspace; beside the voxel only what is not usual.
fn workspace(options: &WorkspaceOptions) -> String {
    let usual = WorkspaceOptions::default();
    let mut text = format!("\n[workspace]\nvoxel = {:?}\n", options.voxel);
    if options.minimum_margin != usual.minimum_margin {
        text += &format!("minimum_margin = {:?}\n", options.minimum_margin);
    }
    if options.seed != usual.seed {
        text += &format!("seed = {}\n", options.seed);
    }
    if let Some(length) = options.length {
        text += &format!("length = {length:?}\n");
    }
    text
}
