//! The boundary of a plane of voxels, as lines by their cause.

use crate::draw::VoxelEdge;

/// Squares of a plane with those just around it: whether each is there, and a kind; kind 0 has no line.
pub(in crate::figures) struct Outline {
    columns: usize,
    rows: usize,
    is_there: Vec<bool>,
    /// Of squares that are there, and of those that are not.
    kinds: [Vec<usize>; 2],
}

impl Outline {
    /// Nothing is there.
    pub(in crate::figures) fn new(columns: usize, rows: usize) -> Self {
        let count = (columns + 2) * (rows + 2);
        Self { columns, rows, is_there: vec![false; count], kinds: [vec![0; count], vec![0; count]] }
    }

    /// Of several kinds of one square the greatest counts.
    pub(in crate::figures) fn set(&mut self, column: i64, row: i64, is_there: bool, kind: usize) {
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        if (-1..=columns).contains(&column) && (-1..=rows).contains(&row) {
            let at = self.place((column + 1) as usize, (row + 1) as usize);
            self.is_there[at] |= is_there;
            let kinds = &mut self.kinds[usize::from(!is_there)];
            kinds[at] = kinds[at].max(kind);
        }
    }

    fn place(&self, column: usize, row: usize) -> usize {
        row * (self.columns + 2) + column
    }

    /// Of the line between two squares: that of the one that is there, or where it has none that of the other.
    fn between(&self, a: usize, b: usize) -> usize {
        let (inside, outside) = match (self.is_there[a], self.is_there[b]) {
            (true, false) => (a, b),
            (false, true) => (b, a),
            _ => return 0,
        };
        if self.kinds[0][inside] > 0 { self.kinds[0][inside] } else { self.kinds[1][outside] }
    }

    /// Lines between squares that are there and squares that are not.
    pub(in crate::figures) fn edges(&self) -> Vec<VoxelEdge> {
        let mut edges = Vec::new();
        for row in 0..=self.rows {
            let kind = |column: usize| self.between(self.place(column + 1, row), self.place(column + 1, row + 1));
            add_runs(&mut edges, self.columns, kind, |column| [column, row]);
        }
        for column in 0..=self.columns {
            let kind = |row: usize| self.between(self.place(column, row + 1), self.place(column + 1, row + 1));
            add_runs(&mut edges, self.rows, kind, |row| [column, row]);
        }
        edges
    }
}

/// Runs of one kind along a line of edges, as one line each.
fn add_runs(
    edges: &mut Vec<VoxelEdge>,
    count: usize,
    kind: impl Fn(usize) -> usize,
    corner: impl Fn(usize) -> [usize; 2],
) {
    let mut start = 0;
    for at in 1..=count {
        let here = kind(start);
        if at == count || kind(at) != here {
            if here > 0 {
                edges.push(VoxelEdge { corners: vec![corner(start), corner(at)], kind: here });
            }
            start = at;
        }
    }
}
