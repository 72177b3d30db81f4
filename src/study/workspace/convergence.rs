//! The same workspace by other lattices, other rods and other methods, quickly.

use super::error::WorkspaceError;
use super::job::{Origin, WorkspaceJob};
use super::lattice::CellMap;
use super::measures::Estimate;
use super::seeds::net_points;
use super::tip_map::{Inputs, padded};
use super::work::Work;
use super::workspace::Workspace;
use crate::model::Scene;
use crate::table::Lattice;

/// Equilibria of the nominal design that another one is grown from, at most.
const DESIGN_SEEDS: usize = 8192;

/// The size by one method at one cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    /// In words.
    pub method: &'static str,
    /// Edge of a voxel (m); `None` for a method without voxels.
    pub edge: Option<f64>,
    /// Equilibria that it took.
    pub solves: u64,
    /// m³, m² or m; bounds that are not known are NaN.
    pub size: Estimate,
}

impl WorkspaceJob<'_> {
    /// The workspace of another rod on the nominal one's lattice, grown from the nominal inputs.
    pub(super) fn of_design(
        &self,
        nominal: &Workspace,
        scene: Scene,
        lattice: Lattice,
    ) -> Result<Workspace, WorkspaceError> {
        // One for each voxel of the lattice.
        let (grown, mut cells) = (&nominal.grown, CellMap::default());
        let is_first =
            |at: &usize| cells.insert(lattice.cell(grown.lattice.centre(grown.voxels[*at].cell)), ()).is_none();
        let reached: Vec<usize> = grown.reached().filter(is_first).collect();
        let every = reached.len().div_ceil(DESIGN_SEEDS).max(1);
        let inputs = nominal.inputs.clone();
        let starts: Vec<Inputs> = match reached.is_empty() {
            // Voxels too coarse for any of their centres to be reached.
            true => net_points(inputs.len(), DESIGN_SEEDS as u64, self.seed),
            false => reached.iter().step_by(every).map(|at| padded(nominal.grown.inputs_of(*at))).collect(),
        };
        let job = WorkspaceJob {
            origin: Origin::Sweep(self.spec()),
            scene: Some(scene),
            lattice: Some(lattice),
            with_values: false,
            fast: false,
            progress: None,
            ..self.clone()
        };
        let mut map = job.map(&inputs)?;
        let watch = |stage| job.goes_on(stage);
        let mut work = Work::new(job.options(&watch), &mut map, lattice);
        work.is_design = true;
        work.seed(&starts)?;
        // The dimension is the nominal one's: it decides what is counted.
        let found = work.measured(nominal.dimension)?;
        job.assemble(found, inputs, Vec::new(), CellMap::default(), &mut map)
    }

    /// The size by coarser voxels, by counting touched voxels, by painting, and by change of variables: what the figure
    /// of convergence shows beside the workspace itself.
    ///
    /// # Errors
    ///
    /// As [`WorkspaceJob::run`].
    pub fn convergence(&self, nominal: &Workspace) -> Result<Vec<Convergence>, WorkspaceError> {
        // Coarser voxels show no more than these, which show nothing.
        let size = nominal.size().filter(|_| nominal.grown.reached_count() > 0);
        let Some(size) = size else { return Ok(Vec::new()) };
        let grown = "centres reached";
        let edge = nominal.grown.lattice.spacing;
        let mut rows = Vec::new();
        for factor in [8.0, 4.0, 2.0] {
            let lattice = Lattice { spacing: factor * edge, ..nominal.grown.lattice };
            let found = self.of_design(nominal, nominal.scene.clone(), lattice)?;
            if found.grown.reached_count() == 0 {
                continue;
            }
            let estimate = found.size().unwrap_or(size);
            rows.push(Convergence { method: grown, edge: Some(lattice.spacing), solves: found.solves, size: estimate });
        }
        rows.push(Convergence { method: grown, edge: Some(edge), solves: nominal.solves, size });
        let samples = nominal.counts.values().map(|count| u64::from(*count)).sum();
        let touched = nominal.counts.len() as f64 * edge.powi(nominal.grown.dimension as i32);
        rows.push(Convergence {
            method: "voxels touched",
            edge: Some(edge),
            solves: samples,
            size: Estimate::without_bounds(touched),
        });
        if let Some(check) = nominal.check {
            let integral = check.by_change_of_variables;
            let size = Estimate::symmetric(integral.value, 1.96 * integral.standard_error);
            rows.push(Convergence { method: "change of variables", edge: None, solves: integral.samples, size });
        }
        Ok(rows)
    }
}
