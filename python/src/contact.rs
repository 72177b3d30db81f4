//! Which force the tip can press where on a wall, as the program finds and draws it.

use super::engine;
use super::job::{Told, run};
use super::sweep::NativeSweep;
use super::table::Table;
use pyo3::prelude::*;
use rodsweep::figures::draw_contact;
use rodsweep::results::make_directory;
use rodsweep::study::contact::{ContactJob, ContactMap, ContactStage, RobustContact};
use std::path::PathBuf;
use std::sync::Arc;

/// Options of a map; `None`: as the sweep says.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ContactOptions {
    engine: String,
    precision: Option<String>,
    threads: Option<usize>,
    voxel: Option<f64>,
    extent: Option<f64>,
    force: Option<f64>,
    minimum_margin: Option<f64>,
    designs: Option<usize>,
}

/// Which force the tip can press where.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeContactMap {
    found: Arc<(ContactMap, Option<RobustContact>)>,
}

#[pymethods]
impl NativeContactMap {
    #[staticmethod]
    #[pyo3(signature = (sweep, options, progress))]
    fn of_sweep(
        py: Python<'_>,
        sweep: &NativeSweep,
        options: ContactOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<NativeContactMap> {
        let request = engine::request(&options.engine, options.precision.as_deref())?;
        let spec = sweep.spec.clone();
        let found = run(py, options.threads, progress.as_ref(), move |line| {
            let tell = |stage: ContactStage| line.tell(Told::Stage(stage.words()));
            let job = ContactJob::of_sweep(&spec)
                .engine(request)
                .spacing(options.voxel.unwrap_or(spec.workspace.voxel))
                .extent(options.extent)
                .force(options.force)
                .minimum_margin(options.minimum_margin.unwrap_or(spec.workspace.minimum_margin))
                .interrupt(&line.stop)
                .progress(Some(&tell));
            let map = job.run()?;
            let robust = options.designs.map(|designs| job.robust(&map, designs)).transpose()?;
            Ok((map, robust))
        })?;
        Ok(NativeContactMap { found: Arc::new(found) })
    }

    /// The account, as JSON.
    fn json(&self) -> String {
        let (map, robust) = &*self.found;
        map.account(robust.as_ref()).json()
    }

    fn text(&self) -> String {
        let (map, robust) = &*self.found;
        map.account(robust.as_ref()).text()
    }

    /// One row a point of the wall.
    fn points(&self) -> PyResult<Table> {
        let (map, robust) = &*self.found;
        Ok(Table::new(map.table(robust.as_ref()))?)
    }

    /// One row a design of the uncertain rod.
    fn designs(&self) -> PyResult<Option<Table>> {
        Ok(self.found.1.as_ref().map(|robust| Table::new(robust.table())).transpose()?)
    }

    /// Writes every file of the study; returns them.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            let (map, robust) = &*found;
            Ok(map.write(&folder, &map.account(robust.as_ref()), robust.as_ref())?)
        })
    }

    /// Draws the figures; returns the files.
    fn draw(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            let (map, robust) = &*found;
            make_directory(&folder)?;
            Ok(draw_contact(map, robust.as_ref(), &folder)?.files)
        })
    }
}
