//! The voxels of a table as planes: slices, and projections along an axis.

use super::outline::Outline;
use crate::draw::{PanelPlane, VoxelPanel};
use crate::table::{Lattice, Table, Values};
use std::collections::HashMap;

/// Why a voxel lies at the boundary: the words of the column `cause`, by its codes.
pub(super) const CAUSES: [&str; 5] = ["inside", "input-limit", "singular", "branch", "stuck"];
const NAMES: [&str; 3] = ["x", "y", "z"];
/// The axis across each plane.
pub(super) const ACROSS: [usize; 3] = [1, 0, 2];
/// More squares than this along a panel are gathered in fewer.
const MOST_SQUARES: i64 = 500;

/// Which of the voxels behind one another a projection shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    Greatest,
    Least,
}

impl Shown {
    fn of(self, a: f64, b: f64) -> f64 {
        // A number rather than none.
        match self {
            Shown::Greatest => a.max(b),
            Shown::Least => a.min(b),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Shown::Greatest => "greatest",
            Shown::Least => "least",
        }
    }
}

/// The voxels that a figure shows.
pub(super) struct Voxels<'a> {
    pub table: &'a Table,
    lattice: Lattice,
    /// Each with its row.
    pub shown: Vec<([i32; 3], usize)>,
    /// Least and greatest index along each axis.
    bounds: [[i32; 2]; 3],
    /// Place in [`CAUSES`], of each row of the table.
    causes: Option<Vec<usize>>,
    /// Voxels that are not shown, with the cause.
    others: Vec<([i32; 3], usize)>,
    areas: Option<Vec<f64>>,
}

impl<'a> Voxels<'a> {
    /// The voxels that are reached; `None` where none is.
    pub(super) fn reached(table: &'a Table, lattice: Lattice) -> Option<Self> {
        let reached = table.numbers("reached");
        Self::new(table, lattice, |row| reached.as_ref().is_none_or(|reached| reached[row] == 1.0))
    }

    /// Those with a number above zero in a column, whether they are reached or not.
    pub(super) fn positive(table: &'a Table, lattice: Lattice, column: &str) -> Option<Self> {
        let numbers = table.numbers(column)?;
        Self::new(table, lattice, |row| numbers[row] > 0.0)
    }

    fn new(table: &'a Table, lattice: Lattice, is_shown: impl Fn(usize) -> bool) -> Option<Self> {
        let voxels = lattice.voxels(table)?.into_iter().enumerate().filter_map(|(row, voxel)| Some((voxel?, row)));
        let (shown, others): (Vec<_>, Vec<_>) = voxels.partition(|(_, row)| is_shown(*row));
        let first = shown.first()?.0;
        let bounds = shown.iter().fold(first.map(|index| [index; 2]), |bounds, (voxel, _)| {
            std::array::from_fn(|k| [bounds[k][0].min(voxel[k]), bounds[k][1].max(voxel[k])])
        });
        let causes = table.column("cause").map(|column| causes(&column.values));
        let cause = |row: usize| causes.as_ref().map_or(0, |causes: &Vec<usize>| causes[row]);
        let others =
            others.into_iter().map(|(voxel, row)| (voxel, cause(row))).filter(|(_, cause)| *cause > 0).collect();
        Some(Self { table, lattice, shown, bounds, causes, others, areas: table.numbers("area") })
    }

    /// Edge of a voxel (m).
    pub(super) fn spacing(&self) -> f64 {
        self.lattice.spacing
    }

    /// A column, times a factor, where a voxel that is shown has a number in it; one number a row of the table.
    pub(super) fn column(&self, name: &str, factor: f64) -> Option<Vec<f64>> {
        let mut numbers = self.table.numbers(name)?;
        numbers.iter_mut().for_each(|number| *number *= factor);
        self.shown.iter().any(|(_, row)| numbers[*row].is_finite()).then_some(numbers)
    }

    /// Numbers of the voxels that are shown, without what is none, in order; each with the voxel's area where the table
    /// has a column `area`, else with 1.
    pub(super) fn sorted(&self, numbers: &[f64]) -> Vec<(f64, f64)> {
        let weight = |row: usize| self.areas.as_ref().map_or(1.0, |areas| areas[row]);
        let pairs = self.shown.iter().map(|(_, row)| (numbers[*row], weight(*row)));
        let mut sorted: Vec<(f64, f64)> =
            pairs.filter(|(number, weight)| number.is_finite() && *weight > 0.0).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        sorted
    }

    /// Planes through the middle of the voxels, one across each axis.
    pub(super) fn slices(&self, numbers: &[f64], edges: bool) -> Vec<VoxelPanel> {
        let slice = |across: usize| {
            let at = self.slice_index(across);
            let centre = self.lattice.centre([at; 3])[across];
            let title = format!("slice {} = {}", NAMES[across], millimetres(centre));
            self.plane((across, centre), title, numbers, edges, Shown::Greatest, |voxel| voxel[across] == at)
        };
        ACROSS.map(slice).into()
    }

    /// All voxels seen along each axis.
    pub(super) fn projections(&self, numbers: &[f64], shown: Shown) -> Vec<VoxelPanel> {
        let projection = |across: usize| {
            let title = format!("{} along {}", shown.words(), NAMES[across]);
            let [low, high] = self.bounds[across].map(|index| self.lattice.centre([index; 3])[across]);
            self.plane((across, 0.5 * (low + high)), title, numbers, false, shown, |_| true)
        };
        ACROSS.map(projection).into()
    }

    /// The plane through the middle of the voxels; where that cuts less than half as many as the fullest, the fullest.
    fn slice_index(&self, across: usize) -> i32 {
        let mut counts: HashMap<i32, u64> = HashMap::new();
        let mut sum = 0.0;
        for (voxel, _) in &self.shown {
            *counts.entry(voxel[across]).or_default() += 1;
            sum += f64::from(voxel[across]);
        }
        let middle = (sum / self.shown.len() as f64).round() as i32;
        let count = |index: &i32| counts.get(index).copied().unwrap_or(0);
        let away = |index: &i32| (f64::from(*index) - f64::from(middle)).abs();
        let fullest = counts
            .keys()
            .copied()
            .max_by(|a, b| count(a).cmp(&count(b)).then(away(b).total_cmp(&away(a))).then(a.cmp(b)));
        fullest.filter(|fullest| 2 * count(&middle) < count(fullest)).unwrap_or(middle)
    }

    fn plane(
        &self,
        (across, depth): (usize, f64),
        title: String,
        numbers: &[f64],
        edges: bool,
        shown: Shown,
        is_in: impl Fn(&[i32; 3]) -> bool,
    ) -> VoxelPanel {
        let count = |axis: usize| i64::from(self.bounds[axis][1]) - i64::from(self.bounds[axis][0]) + 1;
        let [u, w] = match across {
            0 => [1, 2],
            1 => [0, 2],
            // The longer one lies across.
            _ if count(1) > count(0) => [1, 0],
            _ => [0, 1],
        };
        let gather = count(u).max(count(w)).div_euclid(MOST_SQUARES) + 1;
        let [columns, rows] = [u, w].map(|axis| ((count(axis) - 1) / gather + 1) as usize);
        let mut squares = vec![None; columns * rows];
        let square = |voxel: &[i32; 3]| {
            [u, w].map(|axis| (i64::from(voxel[axis]) - i64::from(self.bounds[axis][0])).div_euclid(gather))
        };
        for (voxel, row) in self.shown.iter().filter(|(voxel, _)| is_in(voxel)) {
            let [column, line] = square(voxel);
            let at = line as usize * columns + column as usize;
            let number = numbers[*row];
            squares[at] = Some(squares[at].map_or(number, |other| shown.of(other, number)));
        }
        let mut outline = Outline::new(columns, rows);
        if let Some(causes) = self.causes.as_ref().filter(|_| edges) {
            let shown = self.shown.iter().map(|(voxel, row)| (voxel, true, causes[*row]));
            let others = self.others.iter().map(|(voxel, cause)| (voxel, false, *cause));
            for (voxel, is_there, cause) in shown.chain(others).filter(|(voxel, ..)| is_in(voxel)) {
                let [column, line] = square(voxel);
                outline.set(column, line, is_there, cause);
            }
        }
        let middle = |axis: usize| {
            self.bounds[axis].map(|index| 0.5 * self.lattice.centre([index; 3])[axis]).iter().sum::<f64>()
        };
        let corner = |axis: usize| self.lattice.centre([self.bounds[axis][0]; 3])[axis] - 0.5 * self.lattice.spacing;
        VoxelPanel {
            title,
            axes: [u, w].map(|axis| NAMES[axis].to_owned()),
            corner: [corner(u), corner(w)],
            spacing: self.lattice.spacing * gather as f64,
            columns,
            squares,
            edges: outline.edges(),
            plane: Some(PanelPlane {
                axes: [u, w],
                through: std::array::from_fn(|k| if k == across { depth } else { middle(k) }),
            }),
        }
    }
}

fn causes(values: &Values) -> Vec<usize> {
    let known = |word: &str| CAUSES.iter().position(|cause| *cause == word).unwrap_or(0);
    match values {
        Values::Text(words) => words.iter().map(|word| known(word)).collect(),
        values => values.numbers().into_iter().map(|code| (code as usize).min(CAUSES.len() - 1)).collect(),
    }
}

/// A length (m) in words.
pub(in crate::figures) fn millimetres(length: f64) -> String {
    let text = format!("{:.1}", 1e3 * length);
    let text = text.strip_suffix(".0").unwrap_or(&text);
    format!("{} mm", if text == "-0" { "0".into() } else { text.replace('-', "−") })
}
