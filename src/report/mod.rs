//! Figures for publication and tables for the terminal. Plain data in; a PNG or an SVG out.
//!
//! A figure draws itself once, in points, on a [`Canvas`]; `png` and `svg` write that canvas, so both files show the
//! same figure. Text is set in Liberation Sans, whose widths equal those of Arial and Helvetica.

mod axes;
mod bars;

mod canvas;
mod cloud;
mod colour;
mod colour_bar;
mod curves;
mod failure_map;
mod font;
mod legend;
mod named_bars;
mod png;
mod rod_motion;
mod rod_shape;
mod sheet;
mod svg;
mod symbols;
mod text_table;
mod ticks;
mod tip_cloud;
mod tip_path;
mod views;

pub use axes::{AxisLabel, Scale};
pub use bars::{Counts, Histogram};
pub use canvas::{Canvas, Rect};
pub use colour::{Colour, ColourMap};
pub use curves::{Curves, Marker, PlaneCurves, Series};
pub use failure_map::{FailureMap, SweptAxis};
pub use named_bars::NamedBars;
pub use rod_motion::RodMotion;
pub use rod_shape::{RodShape, Stretch, StretchKind};
pub use sheet::{Panel, Sheet};
pub use text_table::{TextTable, count, engineering};
pub use tip_cloud::Cloud;
pub use tip_path::TipPath;
pub use views::{FourViews, View};

use std::path::{Path, PathBuf};

/// Two columns of a journal page, 183 mm [pt].
pub const TWO_COLUMNS: f64 = 183.0 / 25.4 * 72.0;
/// One column of a journal page, 89 mm [pt].
pub const ONE_COLUMN: f64 = 89.0 / 25.4 * 72.0;
/// Resolution of PNG files [1/inch].
pub const DOTS_PER_INCH: f64 = 300.0;

/// Why a figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    #[error("cannot write a figure to {}: end the file name in .png or .svg", path.display())]
    Extension { path: PathBuf },
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    #[error("the figure is too large for a bitmap: {width} x {height} pixels")]
    Bitmap { width: f64, height: f64 },
    #[error("nothing to draw in {figure}: {reason}")]
    Empty { figure: &'static str, reason: String },
    #[error("{figure}: {expected} values of {what} expected, {found} given")]
    Length { figure: &'static str, what: &'static str, expected: usize, found: usize },
}

/// Something that can be drawn on a page of its own.
pub trait Figure {
    fn draw(&self) -> Result<Canvas, ReportError>;
}

/// Formats of figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageFormat {
    /// A bitmap of [`DOTS_PER_INCH`].
    Png,
    /// Lines and text; clouds of many points are bitmaps within it.
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
    let canvas = figure.draw()?;
    match format {
        ImageFormat::Png => png::encode(&canvas, DOTS_PER_INCH),
        ImageFormat::Svg => Ok(svg::encode(&canvas).into_bytes()),
    }
}

/// Writes a figure as PNG or SVG, by the extension of `path`. An existing file is replaced.
///
/// # Errors
///
/// Another extension, a figure that cannot be drawn, a file that cannot be written.
pub fn write(figure: &(impl Figure + ?Sized), path: &Path) -> Result<(), ReportError> {
    let bytes = encode(figure, ImageFormat::of(path)?)?;
    std::fs::write(path, bytes).map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
