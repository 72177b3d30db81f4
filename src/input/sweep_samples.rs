//! How many samples a sweep file asks for.

use super::error::{InputError, Problem};
use super::toml::Reader;
use crate::spec::{AxisSpec, Format, MAX_ROWS, MAX_SOBOL_DIMENSIONS, Method, SaltelliDesign};
use crate::spec::{SkeletonError, SkeletonSampling, grouped};

/// Points of a Sobol' net.
const MAX_SOBOL_POINTS: u64 = 1 << 32;

/// How many samples there are, and what faces of the axes' box they lie on.
pub(super) fn samples(
    root: &Reader,
    sampling: &Reader,
    method: Method,
    axes: &[AxisSpec],
    table_rows: Option<u64>,
    format: Format,
    notes: &mut Vec<String>,
) -> Result<(u64, Option<SkeletonSampling>), InputError> {
    let samples = sampling.count("samples", 1)?;
    if samples.is_some() && matches!(method, Method::Grid | Method::Table) {
        let remedy = "the axes' points or the table's rows give the number: remove it".into();
        return Err(sampling.error("samples", Problem::Conflict { with: "method".into(), remedy }));
    }
    for (key, owner, remedy) in [
        ("file", Method::Table, "only method = \"table\" reads a file: remove it"),
        ("extra_columns", Method::Table, "only method = \"table\" reads a file: remove it"),
        ("dimension", Method::Skeleton, "only method = \"skeleton\" has it: remove it"),
    ] {
        if sampling.has(key) && method != owner {
            let remedy = remedy.into();
            return Err(sampling.error(key, Problem::Conflict { with: "method".into(), remedy }));
        }
    }
    let drawn = || samples.ok_or_else(|| sampling.missing("samples", "say how many samples to draw"));
    let limits = Limits { root, key: if method == Method::Grid { "axis" } else { "sampling.samples" }, format };
    let count = match method {
        Method::Grid => {
            let product = axes.iter().try_fold(1u64, |product, axis| product.checked_mul(axis.points));
            product.ok_or_else(|| limits.too_many("more than 2^64".into(), MAX_ROWS, "lower `points`"))?
        }
        Method::Table => table_rows.unwrap_or(0),
        Method::Sobol => limits.power_of_two(drawn()?, axes.len(), "", notes)?,
        Method::Saltelli => {
            let design = SaltelliDesign { axis_count: axes.len() };
            let base_rows = limits.power_of_two(drawn()?, 2 * axes.len(), "base rows", notes)?;
            let (each, base) = (design.rows_per_base(), grouped(base_rows));
            let count = limits.check(base_rows.checked_mul(each))?;
            notes.push(format!("{} samples: {base} base rows with {each} each", grouped(count)));
            count
        }
        Method::Skeleton => {
            let dimension = sampling.count("dimension", 1)?;
            let dimension = dimension.map(|dimension| usize::try_from(dimension).unwrap_or(usize::MAX));
            let skeleton = SkeletonSampling { samples: drawn()?, dimension };
            let count = skeleton.sample_count(axes.len(), format.most_samples());
            let count = count.map_err(|error| limits.skeleton_problem(sampling, skeleton, error))?;
            notes.extend(skeleton.note(axes.len(), count));
            return Ok((count, Some(skeleton)));
        }
        Method::LatinHypercube | Method::Uniform => drawn()?,
    };
    Ok((limits.check(Some(count))?, None))
}

/// What bounds the samples of a sweep.
struct Limits<'a> {
    root: &'a Reader<'a>,
    /// What says how many there are.
    key: &'static str,
    format: Format,
}

impl Limits<'_> {
    fn too_many(&self, count: String, limit: u64, remedy: &'static str) -> InputError {
        let (count, limit) = (format!("{count} samples"), grouped(limit));
        self.root.error(self.key, Problem::TooMany { what: "asks for", count, limit, remedy })
    }

    /// The number of samples, `None` where it is 2⁶⁴ or more, if there may be so many.
    fn check(&self, count: Option<u64>) -> Result<u64, InputError> {
        let remedy = match self.format {
            Format::None => "lower the number of samples",
            _ => "lower the number of samples, or write no rows with [output] format = \"none\"",
        };
        let limit = self.format.most_samples();
        match count {
            Some(count) if count <= limit => Ok(count),
            Some(count) => Err(self.too_many(grouped(count), limit, remedy)),
            None => Err(self.too_many("more than 2^64".into(), limit, remedy)),
        }
    }

    /// Points of a Sobol' net of at least this number, and what they are.
    fn power_of_two(
        &self,
        count: u64,
        dimensions: usize,
        what: &str,
        notes: &mut Vec<String>,
    ) -> Result<u64, InputError> {
        let count = self.check(Some(count))?;
        if dimensions > MAX_SOBOL_DIMENSIONS {
            let (count, limit, remedy) = match what {
                "" => (dimensions, MAX_SOBOL_DIMENSIONS, "use latin_hypercube or uniform"),
                _ => (dimensions / 2, MAX_SOBOL_DIMENSIONS / 2, "leave out axes that matter least"),
            };
            let (count, limit) = (format!("{count} axes"), limit.to_string());
            return Err(self.root.error("axis", Problem::TooMany { what: "has", count, limit, remedy }));
        }
        if count > MAX_SOBOL_POINTS {
            return Err(self.too_many(grouped(count), MAX_SOBOL_POINTS, "use uniform"));
        }
        let rounded = count.next_power_of_two();
        if rounded != count {
            let what = if what.is_empty() { "samples" } else { what };
            let (count, rounded) = (grouped(count), grouped(rounded));
            notes.push(format!("{count} {what} rounded up to {rounded} (a power of two, for Sobol')"));
        }
        Ok(rounded)
    }

    fn skeleton_problem(&self, sampling: &Reader, skeleton: SkeletonSampling, error: SkeletonError) -> InputError {
        match error {
            SkeletonError::Dimension { dimension, axis_count } => {
                let expected = format!("a whole number from 1 to {axis_count}, the number of axes");
                sampling.error("dimension", Problem::Range { value: dimension.to_string(), expected })
            }
            SkeletonError::TooManyFaces { dimension, axis_count } => {
                let count = format!("more faces of dimension {dimension} than can be counted on {axis_count} axes");
                let (limit, remedy) = (grouped(self.format.most_samples()), "give a larger `dimension`");
                sampling.error("dimension", Problem::TooMany { what: "asks for", count, limit, remedy })
            }
            SkeletonError::TooManySamples { face_count, limit, .. } => {
                let faces = if face_count == 1 { "face" } else { "faces" };
                let count = format!("{} samples on {} {faces}", grouped(skeleton.samples), grouped(face_count));
                let (limit, remedy) = (grouped(limit), "give a larger `dimension`, or fewer samples");
                self.root.error(self.key, Problem::TooMany { what: "asks for", count, limit, remedy })
            }
        }
    }
}
