//! Figures for publication and tables for the terminal. Plain data in; a PNG or an SVG out.
//!
//! A [`Figure`] draws itself once on a [`Canvas`], in points (1/72 inch). Both formats write that canvas, so both files
//! show the same figure. A [`Panel`] is a figure that also fits into a [`Sheet`] beside others. Text is set in
//! Liberation Sans, whose widths equal those of Arial and Helvetica.
//!
//! ```
//! use rodsweep::draw::{AxisLabel, Curves, ImageFormat, Marker, Series, encode};
//!
//! let bend = (0..20).map(|k| 0.1 * f64::from(k)).map(|x| [x, x.sin()]).collect();
//! let figure = Curves {
//!     title: "Bending".into(),
//!     x: AxisLabel::linear("current", "A"),
//!     y: AxisLabel::linear("tip height", "mm"),
//!     series: vec![Series::line("measured", bend).marker(Marker::Circle)],
//! };
//! let svg = encode(&figure, ImageFormat::Svg)?;
//! # assert!(String::from_utf8_lossy(&svg).contains("tip height (mm)"));
//! # Ok::<(), rodsweep::draw::ReportError>(())
//! ```

mod axes;
mod bars;
mod canvas;
mod cloud;
mod colour;
mod colour_bar;
mod curves;
mod failure_map;
mod field;
mod font;
mod interval_bars;
mod legend;
mod marked;
mod named_bars;
mod number_matrix;
mod png;
mod rod_motion;
mod rod_shape;
mod samples;
mod sheet;
mod svg;
mod symbols;
mod text_table;
mod ticks;
mod tip_cloud;
mod tip_path;
mod vectors;
mod views;
mod voxel_sheet;
mod voxels;
mod wall;

pub use axes::{AxisLabel, Scale};
pub use bars::{Counts, Histogram};
pub use canvas::{Align, Canvas, NORMAL, Point, Rect, SMALL, Stroke, TITLE, Text};
pub use colour::{Colour, ColourMap};
pub use colour_bar::{ColourRange, ColourScale};
pub use curves::{Curves, Marker, PlaneCurves, Series};
pub use failure_map::{FailureMap, SweptAxis};
pub use field::{Cuboid, Cylinder, FieldLine, FieldSource, GridBox, LinePlace, SourceBody, Surroundings};
pub use interval_bars::{Interval, IntervalBars};
pub use marked::Marked;
pub use named_bars::NamedBars;
pub use number_matrix::NumberMatrix;
pub use rod_motion::RodMotion;
pub use rod_shape::{ForceAt, RodShape, Stretch, StretchKind};
pub use sheet::{Panel, Sheet};
pub use text_table::{TextTable, count, engineering};
pub use ticks::LengthUnit;
pub use tip_cloud::Cloud;
pub use tip_path::TipPath;
pub use views::{AZIMUTH, ELEVATION, FourViews, View};
pub use voxel_sheet::{VoxelRows, VoxelSheet};
pub use voxels::{PanelPlane, VoxelEdge, VoxelPanel};
pub use wall::{DrawnWall, WallPress};

use crate::files;
use canvas::Shape;
use cloud::Bitmap;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Two columns of a journal page, 183 mm (pt).
pub const TWO_COLUMNS: f64 = 183.0 / 25.4 * 72.0;
/// One column of a journal page, 89 mm (pt).
pub const ONE_COLUMN: f64 = 89.0 / 25.4 * 72.0;
/// Resolution of PNG files (1/inch).
pub const DOTS_PER_INCH: f64 = 300.0;

/// Why a figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// No format is known by the file's extension.
    #[error("cannot write a figure to {}: end the file name in .png or .svg", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The page has more pixels than fit into memory.
    #[error("the figure is too large for a bitmap: {width} x {height} pixels")]
    Bitmap {
        /// In pixels
        width: f64,
        /// In pixels
        height: f64,
    },
    /// There is nothing that can be shown.
    #[error("nothing to draw in {figure}: {reason}")]
    Empty {
        /// The figure, in words.
        figure: &'static str,
        /// Why there is nothing.
        reason: String,
    },
    /// Data do not fit together.
    #[error("{figure}: {expected} values of {what} expected, {found} given")]
    Length {
        /// The figure, in words.
        figure: &'static str,
        /// The data, in words.
        what: &'static str,
        /// As many as there should be.
        expected: usize,
        /// As many as there are.
        found: usize,
    },
}

/// Something that can be drawn on a page of its own.
///
/// ```
/// use rodsweep::draw::{Canvas, Colour, Figure, ImageFormat, ReportError, Stroke, encode};
///
/// struct Diagonal;
///
/// impl Figure for Diagonal {
///     fn draw(&self) -> Result<Canvas, ReportError> {
///         let mut canvas = Canvas::new(100.0, 50.0);
///         canvas.line([[0.0, 0.0], [100.0, 50.0]], Stroke::new(Colour::INK, 1.0));
///         Ok(canvas)
///     }
/// }
///
/// let svg = encode(&Diagonal, ImageFormat::Svg)?;
/// assert!(svg.starts_with(b"<?xml"));
/// # Ok::<(), ReportError>(())
/// ```
pub trait Figure {
    /// Draws it on a page.
    ///
    /// # Errors
    ///
    /// Nothing to draw, or data that do not fit together.
    fn draw(&self) -> Result<Canvas, ReportError>;
}

/// Formats of figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageFormat {
    /// A bitmap of [`DOTS_PER_INCH`].
    Png,
    /// Lines and text; a cloud of many points is a bitmap within it.
    Svg,
}

impl ImageFormat {
    /// The format that a file name asks for by its extension, in whatever case.
    ///
    /// # Errors
    ///
    /// [`ReportError::Extension`] for any other extension, or none.
    pub fn of(path: &Path) -> Result<ImageFormat, ReportError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(ImageFormat::Png),
            Some("svg") => Ok(ImageFormat::Svg),
            _ => Err(ReportError::Extension { path: path.to_owned() }),
        }
    }
}

/// A figure as the bytes of a file.
///
/// # Errors
///
/// A figure that cannot be drawn, or is too large for a bitmap.
pub fn encode(figure: &(impl Figure + ?Sized), format: ImageFormat) -> Result<Vec<u8>, ReportError> {
    Page::new(figure)?.encode(format)
}

/// Writes a figure as PNG or SVG, by the extension of `path`: whole or not at all. An existing file is replaced.
///
/// # Errors
///
/// Another extension, a figure that cannot be drawn, a file that cannot be written.
pub fn write(figure: &(impl Figure + ?Sized), path: &Path) -> Result<(), ReportError> {
    write_all(figure, &[path])
}

/// Writes a figure with a bar that warns, where `mark` holds the words of a warning; else as [`write()`].
///
/// # Errors
///
/// As [`write()`].
pub fn write_marked(figure: &dyn Figure, path: &Path, mark: Option<&str>) -> Result<(), ReportError> {
    match mark {
        Some(mark) => write(&Marked { figure, mark }, path),
        None => write(figure, path),
    }
}

/// Writes a figure to several files: the figure is drawn once, and the files are written side by side.
///
/// # Errors
///
/// As [`write()`].
pub fn write_all(figure: &(impl Figure + ?Sized), paths: &[impl AsRef<Path> + Sync]) -> Result<(), ReportError> {
    write_with(figure, paths, &files::replace)
}

/// The same; `put` writes the bytes of a file.
///
/// # Errors
///
/// As [`write()`].
pub fn write_with(
    figure: &(impl Figure + ?Sized),
    paths: &[impl AsRef<Path> + Sync],
    put: &(dyn Fn(&Path, &[u8]) -> std::io::Result<()> + Sync),
) -> Result<(), ReportError> {
    let formats = paths.iter().map(|path| ImageFormat::of(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    let page = Page::new(figure)?;
    let write = |(path, format): (&_, ImageFormat)| {
        let path: &Path = AsRef::as_ref(path);
        let bytes = page.encode(format)?;
        put(path, &bytes).map_err(|source| ReportError::Write { path: path.to_owned(), source })
    };
    let written: Vec<_> = paths.par_iter().zip(formats).map(write).collect();
    written.into_iter().collect()
}

/// A figure that is drawn, its clouds of dots as bitmaps in their order.
struct Page {
    canvas: Canvas,
    clouds: Vec<Bitmap>,
}

impl Page {
    fn new(figure: &(impl Figure + ?Sized)) -> Result<Page, ReportError> {
        let canvas = figure.draw()?;
        let bitmap = |shape: &Shape| match shape {
            Shape::Dots { clip, radius, rim, dots } => Some(Bitmap::new(dots, *clip, *radius, *rim)),
            _ => None,
        };
        let clouds = canvas.shapes.par_iter().filter_map(bitmap).collect();
        Ok(Page { canvas, clouds })
    }

    fn encode(&self, format: ImageFormat) -> Result<Vec<u8>, ReportError> {
        match format {
            ImageFormat::Png => png::encode(&self.canvas, &self.clouds),
            ImageFormat::Svg => Ok(svg::encode(&self.canvas, &self.clouds).into_bytes()),
        }
    }
}
