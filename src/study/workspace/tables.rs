//! A workspace as tables: a row a voxel, and of surfaces a row a section.

use super::growth::Grown;
use super::reach::Reach;
use super::workspace::Workspace;
use crate::model::Vector;
use crate::study::columns::Columns;
use crate::table::Lattice;
use crate::table::Table;

impl Workspace {
    /// One row a voxel, those around the workspace included: centre, `count` of rows, `reached`, `cause`, inputs,
    /// margins, dexterity, compliance, reserve, signed distance to the boundary, solutions, orientations, density.
    pub fn voxel_table(&self) -> Table {
        let grown = &self.grown;
        let order = sorted(grown);
        // Values are kept for reached voxels alone, in their order.
        let mut number = vec![usize::MAX; grown.voxels.len()];
        grown.reached().enumerate().for_each(|(k, at)| number[at] = k);
        let mut columns = Columns::default();
        let centres: Vec<Vector> = order.iter().map(|at| grown.lattice.centre(grown.voxels[*at].cell)).collect();
        columns.vectors("voxel", "m", &centres);
        let count = |at: &usize| u64::from(self.counts.get(&grown.voxels[*at].cell).copied().unwrap_or(0));
        columns.counts("count", order.iter().map(count));
        columns.flags("reached", order.iter().map(|at| grown.voxels[*at].is_reached()));
        columns.words("cause", order.iter().map(|at| self.causes[*at].name().to_owned()));
        for (k, input) in self.inputs.iter().enumerate() {
            let value = |at: &usize| match grown.voxels[*at].is_reached() {
                true => input.value(grown.inputs_of(*at)[k]),
                false => f64::NAN,
            };
            columns.numbers(input.name(&self.scene), input.unit(), order.iter().map(value));
        }
        let margin = |at: &usize| if number[*at] == usize::MAX { f64::NAN } else { grown.voxels[*at].margin };
        columns.numbers("stability.margin", "", order.iter().map(margin));
        let values = &self.values;
        let of = |at: &usize, all: &dyn Fn(usize) -> f64| {
            if number[*at] == usize::MAX { f64::NAN } else { all(number[*at]) }
        };
        if !values.sigma.is_empty() {
            let mut put = |name: &str, unit: &str, all: &dyn Fn(usize) -> f64| {
                columns.numbers(name, unit, order.iter().map(|at| of(at, all)));
            };
            put("stability.margin.least", "", &|k| values.least_margin[k]);
            let rank = self.dimension.rank.max(1);
            for s in 0..rank {
                put(&format!("sigma.{}", s + 1), "m", &|k| values.sigma[k][s]);
            }
            let unit = ["", "m", "m²", "m³"][rank];
            put("manipulability", unit, &|k| values.sigma[k][..rank].iter().product());
            put("isotropy", "", &|k| values.sigma[k][rank - 1] / values.sigma[k][0]);
            put("compliance.least", "m/N", &|k| values.compliance[k].0);
            put("compliance.most", "m/N", &|k| values.compliance[k].1);
            for (axis, name) in ["x", "y", "z"].iter().enumerate() {
                put(&format!("compliance.direction.{name}"), "", &|k| values.compliance[k].2[axis]);
            }
            if self.scene.wall.is_some() {
                put("contact.normal_force", "N", &|k| values.normal_force[k]);
            }
            put("input_reserve", "", &|k| values.reserve[k]);
        }
        if !self.distances.is_empty() {
            columns.numbers("boundary_distance", "m", order.iter().map(|at| self.distances[*at]));
        }
        if !values.sigma.is_empty() {
            let known =
                |at: &usize| if number[*at] == usize::MAX { 0 } else { u64::from(values.solutions[number[*at]]) };
            columns.counts("solutions", order.iter().map(known));
            columns.numbers("orientations", "", order.iter().map(|at| of(at, &|k| values.orientations[k])));
            columns.numbers("density", "", order.iter().map(|at| of(at, &|k| values.density[k])));
        }
        columns.finish()
    }

    /// Of a surface, or of the middle of a thin body: one row a section, with its voxel, foot point, normal and area.
    pub fn surface_table(&self) -> Option<Table> {
        let surface = match (&self.surface, self.dimension.rank) {
            (Some(surface), _) => surface,
            (None, 2) => &self.grown,
            _ => return None,
        };
        let order: Vec<usize> = sorted(surface).into_iter().filter(|at| surface.voxels[*at].is_reached()).collect();
        let centres: Vec<Vector> = order.iter().map(|at| surface.lattice.centre(surface.voxels[*at].cell)).collect();
        let feet: Vec<Vector> = order.iter().map(|at| foot(surface, &surface.lattice, *at)).collect();
        let normals: Vec<Vector> = order.iter().map(|at| surface.voxels[*at].normal.map(f64::from)).collect();
        let mut columns = Columns::default();
        columns.vectors("voxel", "m", &centres);
        columns.vectors("foot", "m", &feet);
        columns.vectors("normal", "", &normals);
        columns.numbers("area", "m²", order.iter().map(|at| surface.voxels[*at].measure));
        columns.numbers("stability.margin", "", order.iter().map(|at| surface.voxels[*at].margin));
        Some(columns.finish())
    }

    /// The answers as a table: target, `status`, inputs, margin, reserve, distance to the boundary, nearest tip.
    pub fn reach_table(&self, answers: &[Reach]) -> Table {
        let mut columns = Columns::default();
        columns.vectors("target.position", "m", &answers.iter().map(|a| a.target.position).collect::<Vec<Vector>>());
        let has_tangent = answers.iter().any(|answer| answer.target.tangent.is_some());
        if has_tangent {
            let tangents = answers.iter().map(|answer| answer.target.tangent.unwrap_or([f64::NAN; 3]));
            columns.vectors("target.tangent", "", &tangents.collect::<Vec<Vector>>());
        }
        columns.words("status", answers.iter().map(|answer| answer.status.to_owned()));
        for (k, input) in self.inputs.iter().enumerate() {
            columns.numbers(input.name(&self.scene), input.unit(), answers.iter().map(|a| input.value(a.inputs[k])));
        }
        columns.numbers("stability.margin", "", answers.iter().map(|answer| answer.margin));
        columns.numbers("input_reserve", "", answers.iter().map(|answer| answer.reserve));
        columns.numbers("boundary_distance", "m", answers.iter().map(|answer| answer.boundary_distance));
        columns.vectors("nearest", "m", &answers.iter().map(|answer| answer.tip).collect::<Vec<Vector>>());
        columns.numbers("reach.probability", "", answers.iter().map(|answer| answer.probability));
        columns.numbers("tangent_error", "rad", answers.iter().map(|answer| answer.tangent_error));
        columns.finish()
    }
}

/// Where the tip is that a voxel was reached by (m).
pub(super) fn foot(grown: &Grown, lattice: &Lattice, at: usize) -> Vector {
    let voxel = &grown.voxels[at];
    let centre = lattice.centre(voxel.cell);
    std::array::from_fn(|axis| centre[axis] + f64::from(voxel.offset[axis]))
}

/// Voxels by their place, whatever order they were met in.
fn sorted(grown: &Grown) -> Vec<usize> {
    let mut order: Vec<usize> = (0..grown.voxels.len()).filter(|at| grown.voxels[*at].end.is_some()).collect();
    order.sort_unstable_by_key(|at| grown.voxels[*at].cell);
    order
}
