//! Which figures a table of voxels gives.

use super::curves::{Convergence, at_least};
use super::summary::{WorkspaceSummary, size_unit, words};
use super::voxels::{CAUSES, Shown, Voxels, millimetres};
use crate::draw::{
    AxisLabel, Colour, ColourScale, Figure, NamedBars, Panel, ReportError, Scale, VoxelRows, VoxelSheet, count,
};
use crate::figures::files::Drawn;
use crate::table::{Lattice, Table};
use std::path::Path;

/// Columns that colour the first figure, in order of preference: name, words, unit, factor from SI.
const COLOURS: [(&str, &str, &str, f64); 4] = [
    ("stability.margin", "stability margin", "", 1.0),
    ("input_reserve", "input reserve", "", 1.0),
    ("boundary_distance", "distance to the boundary", "mm", 1e3),
    ("count", "samples", "", 1.0),
];
/// Of the causes that lines along the boundary show.
const CAUSE_WORDS: [(&str, Colour); CAUSES.len()] = [
    ("inside", Colour::WHITE),
    ("input limit", Colour::INK),
    ("singular", Colour::PURPLE),
    ("end of the branch", Colour::VERMILION),
    ("undecided", Colour::GREY),
];
const PROBABILITY: &str = "reach.probability";
/// More solutions than this share a bar.
const MOST_BARS: usize = 6;

/// The figures of a table of voxels. What needs a column that is not there is left out.
///
/// Columns: `voxel.x`, `voxel.y`, `voxel.z` (any point within the voxel, m), and of the following any: `reached` (rows of
/// 0 count for `reach.probability` alone), `cause` (of the boundary, on either side of it: a word, or its place in `inside`,
/// `input-limit`, `singular`, `branch`, `stuck`), `stability.margin`, `stability.margin.least`, `isotropy`, `manipulability` (m to the power of
/// the dimension), `compliance.least`, `compliance.most` (m/N), `density`, `solutions`, `orientations`,
/// `reach.probability`.
#[derive(Clone, Copy, Debug)]
pub struct WorkspaceFigures<'a> {
    /// One row a voxel.
    pub table: &'a Table,
    /// Where the voxels lie.
    pub lattice: Lattice,
    /// What is known besides.
    pub summary: &'a WorkspaceSummary,
}

impl<'a> WorkspaceFigures<'a> {
    /// Every figure for which there are numbers, under its name: `workspace`, `margin`, `dexterity`, `compliance`,
    /// `density`, `multiplicity`, `robust`, `convergence`.
    pub fn figures(&self) -> Vec<(&'static str, Box<dyn Figure + 'a>)> {
        let mut figures: Vec<(&'static str, Box<dyn Figure + 'a>)> = Vec::new();
        let (lattice, summary) = (self.lattice, self.summary);
        if let Some(voxels) = Voxels::reached(self.table, lattice) {
            let sheets = Sheets { voxels, summary };
            let made = [
                ("workspace", sheets.workspace()),
                ("margin", sheets.margin()),
                ("dexterity", sheets.dexterity()),
                ("compliance", sheets.compliance()),
                ("density", sheets.density()),
                ("multiplicity", sheets.multiplicity()),
            ];
            let made = made.into_iter().filter_map(|(name, sheet)| Some((name, sheet?)));
            figures.extend(made.map(|(name, sheet)| (name, Box::new(sheet) as Box<dyn Figure>)));
        }
        let designs = Voxels::positive(self.table, lattice, PROBABILITY);
        if let Some(sheet) = designs.and_then(|voxels| Sheets { voxels, summary }.robust()) {
            figures.push(("robust", Box::new(sheet)));
        }
        if self.summary.methods.iter().any(|method| !method.points.is_empty()) {
            figures.push(("convergence", Box::new(Convergence(self.summary))));
        }
        figures
    }

    /// Writes every figure as PNG and SVG into a folder. What has nothing to draw is left out.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn draw(&self, folder: &Path) -> Result<Drawn, ReportError> {
        self.draw_marked(folder, None)
    }

    /// The same; every figure says what speaks against it.
    ///
    /// # Errors
    ///
    /// As [`WorkspaceFigures::draw`].
    pub fn draw_marked(&self, folder: &Path, mark: Option<&str>) -> Result<Drawn, ReportError> {
        let mut drawn = Drawn::default();
        for (name, figure) in self.figures() {
            write_both(&mut drawn, (name, figure.as_ref()), folder, mark)?;
        }
        Ok(drawn)
    }
}

/// Writes a figure as PNG and SVG.
pub(in crate::figures) fn write_both(
    drawn: &mut Drawn,
    (name, figure): (&str, &dyn Figure),
    folder: &Path,
    mark: Option<&str>,
) -> Result<(), ReportError> {
    drawn.write(figure, ["png", "svg"].map(|extension| folder.join(format!("{name}.{extension}"))), mark)
}

struct Sheets<'a> {
    voxels: Voxels<'a>,
    summary: &'a WorkspaceSummary,
}

/// A column and how it is drawn.
struct Quantity<'a> {
    column: &'a str,
    words: &'a str,
    unit: &'a str,
    factor: f64,
    scale: ColourScale,
    range: Option<[f64; 2]>,
    shown: Shown,
}

impl<'a> Quantity<'a> {
    fn new(column: &'a str, words: &'a str) -> Self {
        let (scale, shown) = (ColourScale::Linear, Shown::Greatest);
        Self { column, words, unit: "", factor: 1.0, scale, range: None, shown }
    }

    fn unit(self, unit: &'a str, factor: f64) -> Self {
        Self { unit, factor, ..self }
    }

    fn scale(self, scale: ColourScale) -> Self {
        Self { scale, ..self }
    }

    fn range(self, range: [f64; 2]) -> Self {
        Self { range: Some(range), ..self }
    }

    fn least(self) -> Self {
        Self { shown: Shown::Least, ..self }
    }
}

impl Sheets<'_> {
    fn workspace(&self) -> Option<VoxelSheet> {
        let coloured = |(column, words, unit, factor)| self.rows(Quantity::new(column, words).unit(unit, factor), true);
        let mut sheet = self.sheet("", [COLOURS.into_iter().find_map(coloured)])?;
        sheet.edges_title = "Boundary in slices:".into();
        sheet.edges = CAUSE_WORDS.map(|(words, colour)| (words.to_owned(), colour)).into();
        Some(sheet)
    }

    fn margin(&self) -> Option<VoxelSheet> {
        let columns = [("stability.margin", "best in the voxel"), ("stability.margin.least", "least in the voxel")];
        let best = Quantity::new(columns[0].0, "stability margin, best");
        let least = Quantity::new(columns[1].0, "stability margin, least").least();
        let mut sheet = self.sheet("stability margin", [self.rows(best, false), self.rows(least, false)])?;
        sheet.below.extend(self.shares(AxisLabel::linear("stability margin", ""), &columns));
        Some(sheet)
    }

    fn dexterity(&self) -> Option<VoxelSheet> {
        let unit = ["", "cm", "cm²", "cm³"][self.summary.dimension.min(3)];
        let factor = 100f64.powi(self.summary.dimension.min(3) as i32);
        let volume = Quantity::new("manipulability", "manipulability").unit(unit, factor);
        let isotropy = self.rows(Quantity::new("isotropy", "isotropy"), false);
        let mut sheet =
            self.sheet("dexterity", [isotropy, self.rows(volume.scale(ColourScale::Logarithmic), false)])?;
        sheet.below.extend(self.shares(AxisLabel::linear("isotropy", ""), &[("isotropy", "")]));
        Some(sheet)
    }

    fn compliance(&self) -> Option<VoxelSheet> {
        let columns =
            [("compliance.most", "most compliant direction"), ("compliance.least", "least compliant direction")];
        let rows = columns.map(|(column, _)| {
            let words = if column.ends_with("most") { "greatest compliance" } else { "least compliance" };
            self.rows(Quantity::new(column, words).unit("m/N", 1.0).scale(ColourScale::Logarithmic), false)
        });
        let mut sheet = self.sheet("compliance of the tip", rows)?;
        sheet.below.extend(self.shares(AxisLabel::logarithmic("compliance", "m/N"), &columns));
        Some(sheet)
    }

    fn density(&self) -> Option<VoxelSheet> {
        let density = Quantity::new("density", "count per sample and voxel").scale(ColourScale::Logarithmic);
        self.sheet("density of samples", [self.rows(density, false)])
    }

    fn multiplicity(&self) -> Option<VoxelSheet> {
        let solutions = Quantity::new("solutions", "solutions").scale(ColourScale::Whole);
        let orientations = Quantity::new("orientations", "share of directions");
        let mut sheet =
            self.sheet("solutions in a voxel", [self.rows(solutions, false), self.rows(orientations, false)])?;
        sheet.below.extend(self.solution_bars());
        Some(sheet)
    }

    fn robust(&self) -> Option<VoxelSheet> {
        let quantity = Quantity::new(PROBABILITY, "share of designs").range([0.0, 1.0]);
        let mut sheet = self.sheet("robust workspace", [self.rows(quantity, false)])?;
        let numbers = self.voxels.sorted(&self.voxels.column(PROBABILITY, 1.0)?);
        if self.summary.dimension == 3 && !numbers.is_empty() {
            let (name, factor, unit) = size_unit(3);
            let whole = factor * self.voxels.spacing().powi(3) * numbers.len() as f64;
            let x = AxisLabel::linear("reached in at least this share of designs", "");
            let y = AxisLabel::linear(name, unit);
            sheet.below.push(Box::new(at_least(x, y, whole, vec![("", numbers)])));
        }
        Some(sheet)
    }

    /// A page of what is there; `None` where nothing is.
    fn sheet<const COUNT: usize>(&self, words: &str, groups: [Option<VoxelRows>; COUNT]) -> Option<VoxelSheet> {
        let groups: Vec<VoxelRows> = groups.into_iter().flatten().collect();
        let title = [self.summary.title.as_str(), words].into_iter().filter(|part| !part.is_empty());
        let title = title.collect::<Vec<_>>().join(": ");
        (!groups.is_empty()).then(|| VoxelSheet {
            title,
            note: self.note(),
            groups,
            wall: self.summary.wall.clone(),
            ..VoxelSheet::default()
        })
    }

    fn note(&self) -> String {
        let voxels = self.voxels.shown.len();
        let voxels = format!("{} voxel{}", count(voxels as u64), if voxels == 1 { "" } else { "s" });
        let voxels = format!("{voxels} of {}", millimetres(self.voxels.spacing()));
        let (name, factor, unit) = size_unit(self.summary.dimension);
        match self.summary.size {
            Some(size) => format!("{name} {} {unit} · {voxels}", words(size.scaled(factor))),
            None => voxels,
        }
    }

    /// Slices and projections of a quantity; of a surface, projections alone. `None` where it has no number.
    fn rows(&self, quantity: Quantity, edges: bool) -> Option<VoxelRows> {
        let numbers = self.voxels.column(quantity.column, quantity.factor)?;
        if quantity.scale == ColourScale::Logarithmic
            && self.voxels.sorted(&numbers).last().is_none_or(|(most, _)| *most <= 0.0)
        {
            return None;
        }
        let projections = self.voxels.projections(&numbers, quantity.shown);
        let rows = if self.summary.dimension < 3 {
            vec![projections]
        } else {
            vec![self.voxels.slices(&numbers, edges), projections]
        };
        Some(VoxelRows {
            quantity: quantity.words.into(),
            unit: quantity.unit.into(),
            scale: quantity.scale,
            range: quantity.range,
            rows,
        })
    }

    /// The share of voxels in which columns are at least so large.
    fn shares(&self, x: AxisLabel, columns: &[(&'static str, &'static str)]) -> Option<Box<dyn Panel>> {
        let sorted = |name: &str| Some(self.voxels.sorted(&self.voxels.column(name, 1.0)?));
        let is_shown =
            |sorted: &[(f64, f64)]| sorted.last().is_some_and(|(most, _)| x.scale == Scale::Linear || *most > 0.0);
        let columns: Vec<(&str, Vec<(f64, f64)>)> = columns
            .iter()
            .filter_map(|(name, words)| Some((*words, sorted(name).filter(|sorted| is_shown(sorted))?)))
            .collect();
        let y = AxisLabel::linear(format!("{} at or above", size_unit(self.summary.dimension).0), "%");
        (!columns.is_empty()).then(|| Box::new(at_least(x, y, 100.0, columns)) as Box<dyn Panel>)
    }

    /// The share of voxels with each number of solutions.
    fn solution_bars(&self) -> Option<Box<dyn Panel>> {
        let numbers = self.voxels.sorted(&self.voxels.column("solutions", 1.0)?);
        let whole: f64 = numbers.iter().map(|(_, weight)| weight).sum();
        let share = |is_in: &dyn Fn(usize) -> bool| {
            let here = numbers.iter().filter(|(number, _)| is_in(number.round() as usize));
            100.0 * here.map(|(_, weight)| weight).sum::<f64>() / whole
        };
        let mut bars: Vec<(String, f64)> =
            (1..MOST_BARS).map(|k| (format!("{k}"), share(&|number| number == k))).collect();
        bars.push((format!("{MOST_BARS} or more"), share(&|number| number >= MOST_BARS)));
        while bars.last().is_some_and(|(_, share)| *share == 0.0) {
            bars.pop();
        }
        let label = format!("share of {} (%)", size_unit(self.summary.dimension).0);
        let title = "Distinct solutions in a voxel".into();
        (!bars.is_empty())
            .then(|| Box::new(NamedBars { title, label, bars, decimals: 1, mark: None }) as Box<dyn Panel>)
    }
}
