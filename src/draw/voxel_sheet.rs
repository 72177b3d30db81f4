//! A page of voxel panels at one scale, with a colour bar for each quantity.

use super::canvas::{Align, Canvas, NORMAL, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::Colour;
use super::colour_bar::{ColourRange, ColourScale};
use super::legend::{self, Entry};
use super::ticks::LengthUnit;
use super::voxels::VoxelPanel;
use super::wall::{DrawnWall, WallScenery};
use super::{Figure, Panel, ReportError, TWO_COLUMNS};

const FIGURE: &str = "the voxels";
/// Room for ticks and labels of a panel, for the colour bar, and between rows (pt).
const LEFT: f64 = 40.0;
const MARGIN: f64 = 60.0;
const ABOVE: f64 = 17.0;
const BELOW: f64 = 31.0;
const UNLABELLED: f64 = 19.0;
const GAP: f64 = 7.0;
/// Most height of what stands under the squares (pt).
const MOST_BELOW: f64 = 150.0;
/// White rim around the squares over the widest panel.
const RIM: f64 = 0.04;
/// Panels are no narrower than this share of the widest, nor lower.
const NARROWEST: f64 = 0.3;
/// Whole numbers that have a colour each.
const MOST_LEVELS: f64 = 10.0;
/// Most height of all rows together (pt).
const TALLEST: f64 = 690.0;

/// Rows of panels that share a colour bar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoxelRows {
    /// What the colours show.
    pub quantity: String,
    /// Its unit; empty for none. Numbers are drawn as given.
    pub unit: String,
    /// How numbers become colours.
    pub scale: ColourScale,
    /// What a linear colour bar spans; by the numbers unless chosen.
    pub range: Option<[f64; 2]>,
    /// From above; panels of a column are equally wide.
    pub rows: Vec<Vec<VoxelPanel>>,
}

/// Planes of voxels in rows, lettered, with a length as long in every panel.
#[derive(Default)]
pub struct VoxelSheet {
    /// Above the panels; empty for none.
    pub title: String,
    /// Small, on the right of the title.
    pub note: String,
    /// From above.
    pub groups: Vec<VoxelRows>,
    /// What lines along edges tell.
    pub edges_title: String,
    /// What lines along edges mean, and their colours.
    pub edges: Vec<(String, Colour)>,
    /// Behind the squares of panels that are planes of the world.
    pub wall: Option<DrawnWall>,
    /// Under the squares, side by side.
    pub below: Vec<Box<dyn Panel>>,
}

/// Where the panels go.
struct Layout {
    unit: LengthUnit,
    /// pt/m
    scale: f64,
    /// Width of each column, and height of each row (pt).
    widths: Vec<f64>,
    heights: Vec<f64>,
    /// Length of the longest side of any panel (m).
    widest: f64,
}

impl Layout {
    /// What a panel spans for squares of an extent (m), with a rim.
    fn roomy(extent: f64, widest: f64) -> f64 {
        extent.max(NARROWEST * widest) + 2.0 * RIM * widest
    }

    /// Of a panel's frame (pt).
    fn frame_height(&self, panel: &VoxelPanel) -> f64 {
        self.scale * Layout::roomy(panel.extents()[1], self.widest)
    }
}

impl Figure for VoxelSheet {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let panels = || self.groups.iter().flat_map(|group| group.rows.iter().flatten());
        if !panels().any(|panel| panel.squares.iter().any(Option::is_some)) {
            return Err(ReportError::Empty { figure: FIGURE, reason: "no voxel is there".into() });
        }
        for panel in panels() {
            let (found, expected) = (panel.squares.len(), panel.rows() * panel.columns);
            if found != expected {
                return Err(ReportError::Length { figure: FIGURE, what: "a plane", expected, found });
            }
        }
        let layout = self.layout();
        let entries = self.entries();
        let mut top = if self.title.is_empty() && self.note.is_empty() { 2.0 } else { 17.0 };
        let edges = Text::new(&self.edges_title, [LEFT, top + 5.5], SMALL);
        let indent = if self.edges_title.is_empty() { LEFT } else { LEFT + edges.width() + 10.0 };
        let legend = legend::flow(None, &entries, [0.0; 2], TWO_COLUMNS - indent);
        let rows: f64 = layout.heights.iter().sum::<f64>() + self.around();
        let columns = self.below.len().max(1) as f64;
        let width = (TWO_COLUMNS - 12.0 * (columns - 1.0)) / columns;
        let below = self.below.iter().map(|panel| panel.height(width)).fold(0.0, f64::max).min(MOST_BELOW);
        let legend_room = if legend > 0.0 { legend + 5.0 } else { 0.0 };
        let mut canvas = Canvas::new(TWO_COLUMNS, top + legend_room + rows - GAP + below + 3.0);
        canvas.text(Text::new(&self.title, [LEFT, 9.0], TITLE).bold());
        let note = Text::new(&self.note, [TWO_COLUMNS - 6.0, 9.0], SMALL).align(Align::End).colour(Colour::MUTED);
        canvas.text(note);
        legend::flow(Some(&mut canvas), &entries, [indent, top], TWO_COLUMNS - indent);
        if legend > 0.0 {
            canvas.text(edges);
        }
        top += legend_room;
        let (mut letters, mut heights) = ('a'..='z', layout.heights.iter());
        for group in &self.groups {
            let start = top;
            let range = group.range();
            for (k, row) in group.rows.iter().enumerate() {
                let labelled = k + 1 == group.rows.len();
                let mut left = LEFT;
                for (panel, width) in row.iter().zip(&layout.widths) {
                    let height = layout.frame_height(panel);
                    let frame = Rect { left, top: top + ABOVE, width: *width, height };
                    panel.draw(
                        &mut canvas,
                        frame,
                        (layout.scale, layout.unit, labelled),
                        range.as_ref(),
                        &self.edges,
                        self.wall.as_ref(),
                    );
                    let letter = letters.next().map(String::from).unwrap_or_default();
                    let at = [left, top + ABOVE - 7.0];
                    canvas.text(Text::new(letter, at, TITLE).bold());
                    canvas.text(Text::new(&panel.title, [at[0] + 10.0, at[1]], NORMAL));
                    left += width + LEFT;
                }
                let below = if labelled { BELOW } else { UNLABELLED };
                top += ABOVE + heights.next().copied().unwrap_or_default() + below + GAP;
            }
            let bottom = top - BELOW - GAP;
            let height = (bottom - start - ABOVE).min(170.0);
            let bar = Rect { left: TWO_COLUMNS - MARGIN + 12.0, top: start + ABOVE, width: 0.0, height };
            if let Some(range) = range {
                range.draw(&mut canvas, bar, &group.quantity, &group.unit);
            }
        }
        for (k, panel) in self.below.iter().enumerate() {
            let rect = Rect { left: k as f64 * (width + 12.0), top, width, height: below };
            panel.draw_into(&mut canvas, rect)?;
            if let Some(letter) = letters.next() {
                canvas.text(Text::new(letter, [rect.left + 6.0, top + 9.0], TITLE).bold());
            }
        }
        Ok(canvas)
    }
}

impl VoxelSheet {
    /// Height of all that stands above and below the frames of the panels (pt).
    fn around(&self) -> f64 {
        let rows: usize = self.groups.iter().map(|group| group.rows.len()).sum();
        let labelled = self.groups.iter().filter(|group| !group.rows.is_empty()).count();
        rows as f64 * (ABOVE + UNLABELLED + GAP) + labelled as f64 * (BELOW - UNLABELLED)
    }

    fn layout(&self) -> Layout {
        let rows = || self.groups.iter().flat_map(|group| &group.rows);
        let extents = || rows().flatten().map(VoxelPanel::extents);
        let widest = extents().flatten().fold(0.0, f64::max);
        let roomy = |extent: f64| Layout::roomy(extent, widest);
        let columns = rows().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| rows().filter_map(move |row| row.get(column)).map(|panel| panel.extents()[0]);
        let widths: Vec<f64> = (0..columns).map(|column| roomy(width(column).fold(0.0, f64::max))).collect();
        let height = |row: &Vec<VoxelPanel>| row.iter().map(|panel| panel.extents()[1]).fold(0.0, f64::max);
        let heights: Vec<f64> = rows().map(|row| roomy(height(row))).collect();
        let free = TWO_COLUMNS - MARGIN - LEFT * columns as f64;
        let below = if self.below.is_empty() { 0.0 } else { MOST_BELOW };
        let tall = TALLEST - self.around() - below;
        let scale = (free / widths.iter().sum::<f64>()).min(tall / heights.iter().sum::<f64>());
        // Where the height decides the scale, the columns become wider.
        let spare = (free - scale * widths.iter().sum::<f64>()) / columns.max(1) as f64;
        let furthest = rows().flatten().map(VoxelPanel::furthest).fold(0.0, f64::max);
        Layout {
            unit: LengthUnit::for_extent(furthest.min(10.0 * widest)),
            scale,
            widths: widths.into_iter().map(|width| scale * width + spare).collect(),
            heights: heights.into_iter().map(|height| scale * height).collect(),
            widest,
        }
    }

    fn entries(&self) -> Vec<Entry> {
        let used = |kind: usize| {
            let panels = self.groups.iter().flat_map(|group| group.rows.iter().flatten());
            panels.flat_map(|panel| &panel.edges).any(|edge| edge.kind == kind)
        };
        let entry = |(_, (words, colour)): (usize, &(String, Colour))| {
            let stroke = Stroke::new(*colour, 1.2);
            Entry::new(words, move |canvas, rect| {
                let y = rect.centre()[1];
                canvas.line([[rect.left, y], [rect.right(), y]], stroke);
            })
        };
        let mut entries: Vec<Entry> =
            self.edges.iter().enumerate().filter(|(kind, _)| used(*kind)).map(entry).collect();
        entries.extend(self.wall.iter().flat_map(|wall| WallScenery::in_plane(wall, [0.0; 3]).entries()));
        entries
    }
}

impl VoxelRows {
    /// The colours; `None` where no number can be shown.
    fn range(&self) -> Option<ColourRange> {
        let squares = self.rows.iter().flatten().flat_map(|panel| &panel.squares).flatten();
        let shown = |value: &f64| value.is_finite() && (self.scale != ColourScale::Logarithmic || *value > 0.0);
        let values: Vec<f64> = squares.copied().filter(shown).collect();
        if values.is_empty() {
            return None;
        }
        Some(match (self.scale, self.range) {
            (ColourScale::Linear, Some([low, high])) => ColourRange::exactly(low, high),
            (ColourScale::Linear, None) => ColourRange::new(values, None),
            (ColourScale::Logarithmic, _) => ColourRange::logarithmic(values),
            (ColourScale::Whole, _) if span(&values) < MOST_LEVELS => ColourRange::whole(values),
            (ColourScale::Whole, _) => ColourRange::new(values, None),
        })
    }
}

fn span(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most - values.iter().copied().fold(f64::INFINITY, f64::min)
}
