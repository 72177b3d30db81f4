//! A plane of voxels: squares coloured by a quantity, and lines along their edges.

use super::axes::{Axes, Axis, AxisLabel};
use super::canvas::{Canvas, Point, Rect, Shape, Stroke};
use super::colour::Colour;
use super::colour_bar::ColourRange;
use super::ticks::{self, LengthUnit};
use super::vectors::cross;
use super::views::View;
use super::wall::{DrawnWall, WallScenery};
use crate::model::Vector;

/// Least distance between marks of the axis to the right and of the one upwards (pt).
const MARKS: [f64; 2] = [21.0, 13.0];
/// Of a square with something in it that has no number.
const NO_NUMBER: Colour = Colour::hex(0xcfcfcf);

/// A line along edges of squares.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelEdge {
    /// Corners of squares: (0, 0) is the lower left corner of the first.
    pub corners: Vec<[usize; 2]>,
    /// Place in the sheet's [`edges`](super::VoxelSheet::edges).
    pub kind: usize,
}

/// Where a panel lies in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelPlane {
    /// To the right and upwards: x, y or z.
    pub axes: [usize; 2],
    /// A point of it (m): a wall is drawn where it cuts this plane.
    pub through: Vector,
}

/// Squares of a plane, each with a number or without.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoxelPanel {
    /// Above the panel.
    pub title: String,
    /// Names of the axis to the right and of the one upwards.
    pub axes: [String; 2],
    /// Of the first square, its lower left corner (m).
    pub corner: [f64; 2],
    /// Edge of a square (m).
    pub spacing: f64,
    /// Squares in a row.
    pub columns: usize,
    /// By rows from below; `None` for an empty square, NaN for one without a number.
    pub squares: Vec<Option<f64>>,
    /// On top of the squares.
    pub edges: Vec<VoxelEdge>,
    /// `None` where it is no plane of the world.
    pub plane: Option<PanelPlane>,
}

impl VoxelPanel {
    /// Rows of squares.
    pub fn rows(&self) -> usize {
        self.squares.len().checked_div(self.columns).unwrap_or(0)
    }

    /// Width and height of all squares together (m).
    pub(super) fn extents(&self) -> [f64; 2] {
        [self.columns, self.rows()].map(|count| count as f64 * self.spacing)
    }

    /// Coordinates (m) furthest from zero.
    pub(super) fn furthest(&self) -> f64 {
        let extents = self.extents();
        (0..2).map(|k| self.corner[k].abs().max((self.corner[k] + extents[k]).abs())).fold(0.0, f64::max)
    }

    /// Draws it at a scale (pt/m) in the middle of a frame, with or without a label under it; `edges` are the words and
    /// colours of lines. The wall lies behind its squares.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas,
        frame: Rect,
        (scale, unit, labelled): (f64, LengthUnit, bool),
        range: Option<&ColourRange>,
        edges: &[(String, Colour)],
        wall: Option<&DrawnWall>,
    ) {
        let extents = self.extents();
        let middle: [f64; 2] = std::array::from_fn(|k| self.corner[k] + 0.5 * extents[k]);
        let axis = |k: usize, extent: f64| {
            let half = 0.5 * extent / scale;
            let label = AxisLabel::linear(&self.axes[k], unit.name);
            Axis::exactly(&label, (middle[k] - half) / unit.metres, (middle[k] + half) / unit.metres)
        };
        let axes = Axes { rect: frame, x: axis(0, frame.width), y: axis(1, frame.height) };
        axes.draw_multiples(canvas, MARKS.map(|mark| ticks::round_up(mark / scale / unit.metres)), [labelled, true]);
        if let (Some(wall), Some(plane)) = (wall, self.plane) {
            WallScenery::in_plane(wall, plane.through).draw_behind(canvas, &plane.view(middle, frame, scale));
        }
        let place = |[column, row]: [usize; 2]| -> Point {
            let at = [column, row].map(|count| count as f64 * self.spacing);
            axes.place(std::array::from_fn(|k| (self.corner[k] + at[k]) / unit.metres))
        };
        let [left, top] = place([0, self.rows()]);
        let [right, bottom] = place([self.columns, 0]);
        let rect = Rect { left, top, width: right - left, height: bottom - top };
        let colour = |square: &Option<f64>| match square {
            None => Colour::WHITE.with_alpha(0.0),
            Some(value) => range.and_then(|range| range.shown(*value)).unwrap_or(NO_NUMBER),
        };
        let pixels: Vec<Colour> = self.squares.chunks(self.columns.max(1)).rev().flatten().map(colour).collect();
        if !pixels.is_empty() {
            let (width, height) = (self.columns, self.rows());
            canvas.shapes.push(Shape::Image { rect, width, height, pixels });
        }
        for edge in &self.edges {
            if let Some((_, colour)) = edges.get(edge.kind) {
                let line: Vec<Point> = edge.corners.iter().map(|corner| place(*corner)).collect();
                canvas.line(line, Stroke::new(*colour, 0.9));
            }
        }
        canvas.rect(frame, None, Some(Stroke::new(Colour::MUTED, 0.6)));
    }
}

impl PanelPlane {
    /// The plane with this point (m) in the middle of a frame.
    fn view(&self, middle: [f64; 2], frame: Rect, scale: f64) -> View {
        let [u, w] = self.axes;
        let unit = |axis: usize| -> Vector { std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 }) };
        let mut centre = self.through;
        (centre[u], centre[w]) = (middle[0], middle[1]);
        View {
            rect: frame,
            right: unit(u),
            up: unit(w),
            toward: cross(unit(u), unit(w)),
            scale,
            centre,
            middle: frame.centre(),
            axes: Some(self.axes),
        }
    }
}
