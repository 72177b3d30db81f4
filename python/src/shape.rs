//! Points along the rods of many solved samples.

use super::failure::Failure;
use super::job::run;
use super::scene::NativeScene;
use super::solve::values_of;
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use rodsweep::model::Parameter;
use rodsweep::study::RodPoints;
use std::sync::atomic::Ordering;

/// Numbers of a point without derivatives: arc length, position, rotation by rows, curvature.
const POINT: usize = 1 + 3 + 9 + 3;

/// Points at shares of the length; `moments` holds three numbers a sample. A rod without base moment gives NaN.
///
/// Numbers come sample after sample, point after point, and are cut into arrays by the caller.
#[pyfunction]
#[pyo3(signature = (scene, names, columns, count, wrt, moments, shares, threads))]
#[allow(clippy::too_many_arguments)]
pub fn shape<'py>(
    py: Python<'py>,
    scene: &Bound<'py, NativeScene>,
    names: Vec<String>,
    columns: Vec<PyReadonlyArray1<'py, f64>>,
    count: usize,
    wrt: Vec<String>,
    moments: PyReadonlyArray1<'py, f64>,
    shares: Vec<f64>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = scene.get();
    let axes: Vec<Vec<Parameter>> = names.iter().map(|name| scene.parse(name)).collect::<Result<_, _>>()?;
    let wrt = scene.parse_all(&wrt)?;
    let columns = values_of(&names, &columns, count)?;
    let moments = moments.as_slice()?.to_vec();
    if moments.len() != 3 * count {
        return Err(Failure::input("there are not three moments a sample").into());
    }
    let (points, slopes) = (shares.len(), wrt.len());
    let scene = scene.scene.clone();
    let work = move |line: &super::job::Line| {
        let rods = RodPoints::at(&scene, &axes, &wrt, shares)?;
        let batch = rods.batch(count, |row, values| {
            for (value, column) in values.iter_mut().zip(&columns) {
                *value = if column.len() == 1 { column[0] } else { column.get(row).copied().unwrap_or(0.0) };
            }
        });
        let too_many = || Failure::input("so many points do not fit into memory: ask for fewer at once");
        let width = POINT + 9 * slopes;
        let size = count.checked_mul(points).and_then(|n| n.checked_mul(width)).ok_or_else(too_many)?;
        Vec::<f64>::new().try_reserve_exact(size).map_err(|_| too_many())?;
        let mut numbers = vec![0.0; size];
        numbers.par_chunks_mut((points * width).max(1)).enumerate().for_each(|(row, to)| {
            let moment = [moments[3 * row], moments[3 * row + 1], moments[3 * row + 2]];
            let stopped = line.stop.load(Ordering::Relaxed);
            match if stopped { None } else { rods.of(&batch, row, moment) } {
                Some(poses) if poses.len() == points => {
                    for (pose, to) in poses.iter().zip(to.chunks_exact_mut(width)) {
                        to[0] = pose.arc_length;
                        to[1..4].copy_from_slice(&pose.position);
                        to[4..13].copy_from_slice(pose.rotation.as_flattened());
                        to[13..16].copy_from_slice(&pose.curvature);
                        for (slope, to) in pose.derivatives.iter().zip(to[16..].chunks_exact_mut(9)) {
                            to[..3].copy_from_slice(&slope.dp);
                            to[3..6].copy_from_slice(&slope.w);
                            to[6..].copy_from_slice(&slope.du);
                        }
                    }
                }
                _ => to.fill(f64::NAN),
            }
        });
        Ok(numbers)
    };
    let numbers = run(py, threads, None, work)?;
    let dict = PyDict::new(py);
    dict.set_item("numbers", numbers.into_pyarray(py))?;
    dict.set_item("width", POINT + 9 * slopes)?;
    Ok(dict)
}
