//! A surface of triangles, as files for other programs hold it.

use super::{Table, TableError};
use crate::model::Vector;

/// Triangles between points, and a table with one row a point.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// (m)
    pub points: &'a [Vector],
    /// Unit normals at the points; empty for none.
    pub normals: &'a [Vector],
    /// Places of their corners in `points`; seen from outside counter-clockwise.
    pub triangles: &'a [[u32; 3]],
    /// One row a point; without columns where nothing is known.
    pub data: &'a Table,
    /// The doubt about the data behind the surface; `None`: no doubt is known.
    pub mark: Option<&'a str>,
}

impl Triangles<'_> {
    /// Whether all parts fit together.
    pub(super) fn check(&self, format: &'static str) -> Result<(), TableError> {
        let count = self.points.len();
        let unwritable = |reason: String| Err(TableError::Unwritable { format, reason });
        if !self.data.columns.is_empty() && self.data.row_count() != count {
            return unwritable(format!("{} rows are given for {count} points", self.data.row_count()));
        }
        if !self.normals.is_empty() && self.normals.len() != count {
            return unwritable(format!("{} normals are given for {count} points", self.normals.len()));
        }
        match self.triangles.iter().flatten().find(|corner| **corner as usize >= count) {
            Some(corner) => unwritable(format!("a triangle names point {corner} of {count}")),
            None => Ok(()),
        }
    }
}

/// Words as places in a sorted list of the distinct ones; −1 where there is no word.
pub(super) fn codes<'a>(words: impl Iterator<Item = &'a str> + Clone) -> (Vec<i16>, Vec<&'a str>) {
    let known: std::collections::BTreeSet<&str> = words.clone().filter(|word| !word.is_empty()).collect();
    let known: Vec<&str> = known.into_iter().collect();
    let code = |word: &str| known.binary_search(&word).ok().and_then(|at| i16::try_from(at).ok()).unwrap_or(-1);
    (words.map(code).collect(), known)
}
