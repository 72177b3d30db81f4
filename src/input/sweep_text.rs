//! A sweep written out again, resolved, so that it reads back to the same sweep.

use super::scene_text::write_inline_scene;
use crate::model::Parameter;
use crate::spec::{Method, RESOLVED_TABLE, SweepSpec};

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
            _ => text += &format!("samples = {}\n", self.sample_count),
        }
        for axis in self.axes.iter().filter(|_| self.method != Method::Table) {
            let (from, to) = (axis.from, axis.to);
            text += &format!("\n[[axis]]\nparameters = [{}]\nfrom = {from:?}\nto = {to:?}\n", list(&axis.parameters));
            if self.method == Method::Grid {
                text += &format!("points = {}\n", axis.points);
            }
        }
        text += &format!("\n[solver]\ntolerance = {:?}\nbranch = \"{}\"\n", self.tolerance, self.branch.name());
        if let Some(steps) = self.steps {
            text += &format!("steps = {steps}\n");
        }
        let quantities: Vec<_> = self.quantities.iter().map(|quantity| format!("\"{}\"", quantity.name())).collect();
        text += &format!("\n[output]\nquantities = [{}]\n", quantities.join(", "));
        text += &format!("derivatives = [{}]\nformat = \"{}\"\n", list(&self.wrt), self.format.name());
        text += &format!("\n[workspace]\nvoxel = {:?}\n\n", self.voxel);
        text + &write_inline_scene(&self.scene)
    }
}
