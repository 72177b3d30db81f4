//! Tables as Arrow data: NumPy views and the Arrow PyCapsule interface, neither with a copy.

use super::failure::{Failure, Kind};
use arrow_array::cast::AsArray;
use arrow_array::ffi::FFI_ArrowSchema;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float32Type, Float64Type, UInt64Type};
use arrow_array::{Array, RecordBatch, RecordBatchIterator, RecordBatchReader};
use numpy::ndarray::ArrayView1;
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyList, PyString};
use rodsweep::results::{Results, write_table};
use rodsweep::table::{Column, Table as Rows, Values};
use rodsweep::text::xml;
use std::path::PathBuf;
use std::sync::Arc;

/// What a text of a table shows.
const SHOWN_COLUMNS: usize = 8;
const SHOWN_ROWS: usize = 5;

/// Named columns of equal length, each with a unit.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// Takes over the columns.
    pub fn new(rows: Rows) -> Result<Table, Failure> {
        let batch = rodsweep_arrow::record_batch(rows).map_err(|error| Failure::new(Kind::Other, error))?;
        Ok(Table { batch })
    }

    /// The library's own form of it.
    pub fn rows(&self) -> Result<Rows, Failure> {
        rodsweep_arrow::table(&self.batch).map_err(|error| Failure::new(Kind::Other, error))
    }

    fn place(&self, name: &str) -> Result<usize, Failure> {
        let names = self.columns();
        let place = names.iter().position(|known| known == name);
        place.ok_or_else(|| {
            let near = rodsweep::model::closest(name, names.iter().map(String::as_str));
            let near = near.map(|near| format!(": did you mean `{near}`?")).unwrap_or_default();
            Failure::at(name, format!("there is no such column{near}"))
        })
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// Units of the columns, SI; empty for none.
    #[getter]
    fn units(&self) -> Vec<String> {
        let unit = |name: &str| self.batch.schema().field_with_name(name).ok()?.metadata().get("unit").cloned();
        self.columns().iter().map(|name| unit(name).unwrap_or_default()).collect()
    }

    /// Rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.batch.num_rows(), self.batch.num_columns())
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.place(name).is_ok()
    }

    /// The names of the columns, so that `dict(table)` holds them.
    fn keys(&self) -> Vec<String> {
        self.columns()
    }

    /// Rows, each a tuple with the names of the columns in `_fields`, as pandas and others take them.
    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rodsweep._frames")?.call_method1("rows", (slf,))?.try_iter().map(|rows| rows.into_any())
    }

    /// The columns as arrays by name; `plain` names them for MATLAB and others that take letters, digits and `_` only.
    #[pyo3(signature = (*, plain=false))]
    fn to_dict<'py>(slf: &Bound<'py, Self>, plain: bool) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rodsweep._frames")?.call_method1("to_dict", (slf, plain))
    }

    /// A data frame of pandas; `frame.attrs["units"]` holds the units.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rodsweep._frames")?.call_method1("to_pandas", (slf,))
    }

    /// A data set of xarray over the dimension `row`; each variable has its unit in `attrs["units"]`.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rodsweep._frames")?.call_method1("to_xarray", (slf,))
    }

    /// Writes it, replacing what is there: `.csv`, `.parquet` (with units) or `.npz` by the name's ending.
    fn save<'py>(slf: &Bound<'py, Self>, path: Bound<'py, PyAny>) -> PyResult<()> {
        slf.py().import("rodsweep._frames")?.call_method1("save", (slf, path))?;
        Ok(())
    }

    /// Writes it as Parquet or, by any other name, as CSV.
    fn _write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let rows = self.rows()?;
        Ok(py.detach(|| write_table(&path, &rows, &[]).map_err(Failure::from))?)
    }

    fn __repr__(&self) -> String {
        let columns = self.columns().into_iter().zip(self.units());
        let named: Vec<String> = columns.map(|(name, unit)| with_unit(&name, &unit)).collect();
        let shown = named.iter().take(SHOWN_COLUMNS).cloned().collect::<Vec<_>>().join(", ");
        let more = if named.len() > SHOWN_COLUMNS { ", ..." } else { "" };
        format!("<Table: {} rows, {} columns: {shown}{more}>", self.batch.num_rows(), named.len())
    }

    /// The first rows and columns.
    fn _repr_html_(&self) -> PyResult<String> {
        let rows = self.rows()?;
        let columns = &rows.columns[..rows.columns.len().min(SHOWN_COLUMNS)];
        let cell = |column: &Column, row: usize| match &column.values {
            Values::Status(values) => values[row].name().to_owned(),
            Values::Text(values) => xml(&values[row]),
            Values::Index(values) => values[row].to_string(),
            Values::Flag(values) => values[row].map(|flag| flag.to_string()).unwrap_or_default(),
            values => format!("{:.6}", values.number(row)),
        };
        let head: String = columns.iter().map(|c| format!("<th>{}</th>", xml(&with_unit(&c.name, &c.unit)))).collect();
        let line = |row| columns.iter().map(|column| format!("<td>{}</td>", cell(column, row))).collect::<String>();
        let count = rows.row_count();
        let lines: String = (0..count.min(SHOWN_ROWS)).map(|row| format!("<tr>{}</tr>", line(row))).collect();
        let size = format!("{count} rows, {} columns", rows.columns.len());
        Ok(format!("<table><tr>{head}</tr>{lines}</table>{size}"))
    }

    /// A column: a read-only view of numbers, an array of words or of flags (None where it is not known).
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let table = slf.get();
        let array = table.batch.column(table.place(name)?);
        if let Some(array) = array.as_primitive_opt::<Float64Type>() {
            return view(slf, array.values());
        }
        if let Some(array) = array.as_primitive_opt::<Float32Type>() {
            return view(slf, array.values());
        }
        if let Some(array) = array.as_primitive_opt::<UInt64Type>() {
            return view(slf, array.values());
        }
        if let Some(array) = array.as_boolean_opt() {
            if array.null_count() == 0 {
                let flags: Vec<bool> = array.values().iter().collect();
                return Ok(flags.into_pyarray(py).into_any());
            }
            let flags: Vec<Option<bool>> = array.iter().collect();
            return py.import("numpy")?.call_method1("array", (flags, "O"));
        }
        let words: Vec<&str> = array.as_string::<i32>().iter().map(Option::unwrap_or_default).collect();
        if words.is_empty() {
            return py.import("numpy")?.call_method1("empty", (0, "U1"));
        }
        py.import("numpy")?.call_method1("array", (words,))
    }

    /// The table through the Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface allows to answer in the table's own types.
        let _ = requested_schema;
        let reader = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        stream(py, Box::new(reader))
    }

    /// Its schema, likewise.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema().as_ref());
        let schema = schema.map_err(|error| Failure::new(Kind::Other, error))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// A table of columns: name, unit, an array of numbers or of flags, or a list of words.
    #[staticmethod]
    fn _of(columns: Vec<(String, String, Bound<'_, PyAny>)>) -> PyResult<Table> {
        let mut all = Vec::new();
        for (name, unit, values) in columns {
            let values = values_of(&name, &values)?;
            if all.first().is_some_and(|first: &Column| first.values.len() != values.len()) {
                return Err(Failure::at(&name, "is not as long as the columns before it").into());
            }
            all.push(Column::new(name, &unit, values));
        }
        Ok(Table::new(Rows::new(all))?)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyList>,))> {
        let py = slf.py();
        let list = PyList::empty(py);
        let table = slf.get();
        for (name, unit) in table.columns().into_iter().zip(table.units()) {
            let column = Table::__getitem__(slf, &name)?;
            list.append((name, unit, column))?;
        }
        Ok((py.get_type::<Table>().getattr("_of")?, (list,)))
    }
}

fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

/// A view of numbers that keeps their owner alive.
fn view<'py, T: Element>(owner: &Bound<'py, Table>, numbers: &[T]) -> PyResult<Bound<'py, PyAny>> {
    // SAFETY: the numbers belong to the batch of `owner`, which never changes and outlives the array, its base.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(numbers), owner.clone().into_any()) };
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any())
}

fn values_of(name: &str, values: &Bound<'_, PyAny>) -> PyResult<Values> {
    if let Ok(numbers) = values.extract::<PyReadonlyArray1<'_, f64>>() {
        return Ok(Values::Double(numbers.as_array().to_vec()));
    }
    if let Ok(numbers) = values.extract::<PyReadonlyArray1<'_, f32>>() {
        return Ok(Values::Single(numbers.as_array().to_vec()));
    }
    if let Ok(numbers) = values.extract::<PyReadonlyArray1<'_, u64>>() {
        return Ok(Values::Index(numbers.as_array().to_vec()));
    }
    let list = values.call_method0("tolist").unwrap_or_else(|_| values.clone());
    if let Ok(flags) = list.extract::<Vec<Option<bool>>>() {
        return Ok(Values::Flag(flags));
    }
    let words: Vec<String> = list.extract().map_err(|_| Failure::at(name, "is no column of numbers or words"))?;
    let status = |word: &String| rodsweep::model::Status::ALL.into_iter().find(|status| status.name() == word);
    match words.iter().map(status).collect::<Option<Vec<_>>>().filter(|_| name == "status") {
        Some(statuses) => Ok(Values::Status(statuses)),
        None => Ok(Values::Text(words)),
    }
}

fn stream<'py>(py: Python<'py>, reader: Box<dyn RecordBatchReader + Send>) -> PyResult<Bound<'py, PyCapsule>> {
    PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(reader), c"arrow_array_stream")
}

/// Parts of a result directory, read as they are asked for.
#[pyclass(module = "rodsweep._rodsweep")]
pub struct Parts {
    results: Arc<Results>,
    names: Vec<String>,
    left: std::vec::IntoIter<u64>,
}

impl Parts {
    /// The named columns of every sound part.
    pub fn new(results: Arc<Results>, names: Vec<String>) -> Result<Parts, Failure> {
        let wanted: Vec<&str> = names.iter().map(String::as_str).collect();
        // Refuses names that are not there.
        drop(results.parts(&wanted)?);
        let left = results.part_numbers()?.into_iter();
        Ok(Parts { results, names, left })
    }

    fn read_next(&mut self) -> Option<Result<Rows, Failure>> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        Some(self.results.read_part(self.left.next()?, &names).map_err(Failure::from))
    }

    /// The columns without rows.
    fn empty(&self) -> Rows {
        let columns = self.results.columns().iter();
        let wanted = |column: &&Column| self.names.is_empty() || self.names.contains(&column.name);
        Rows { columns: columns.filter(wanted).cloned().collect() }
    }
}

#[pymethods]
impl Parts {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&mut self, py: Python<'_>) -> PyResult<Option<Table>> {
        let next = py.detach(|| self.read_next());
        Ok(next.transpose()?.map(Table::new).transpose()?)
    }

    fn __len__(&self) -> usize {
        self.left.len()
    }

    /// What is left of the parts as one Arrow stream, read as the consumer goes on.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &mut self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let left = std::mem::take(&mut self.left);
        let mut parts = Parts { results: self.results.clone(), names: self.names.clone(), left };
        let schema = Table::new(parts.empty())?.batch.schema();
        let batches = std::iter::from_fn(move || {
            let external = |error: Failure| arrow_schema::ArrowError::ExternalError(format!("{error:?}").into());
            let part = parts.read_next()?;
            Some(part.and_then(Table::new).map(|table| table.batch).map_err(external))
        });
        stream(py, Box::new(RecordBatchIterator::new(batches, schema)))
    }

    fn __repr__<'py>(&self, py: Python<'py>) -> Bound<'py, PyString> {
        PyString::new(py, &format!("<Parts: {} left>", self.left.len()))
    }
}
