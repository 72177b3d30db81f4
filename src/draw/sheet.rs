//! Several panels on one page.

use super::canvas::{Canvas, Rect, TITLE, Text};
use super::{Figure, ONE_COLUMN, ReportError, TWO_COLUMNS};

/// Height of a panel over its width.
const ASPECT: f64 = 0.74;

/// Something that can be drawn in a part of a page.
pub trait Panel {
    /// Draws it into a rectangle of a page.
    ///
    /// # Errors
    ///
    /// Nothing to draw, or data that do not fit together.
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError>;

    /// Height of the panel at a width (pt).
    fn height(&self, width: f64) -> f64 {
        ASPECT * width
    }
}

impl<P: Panel> Figure for P {
    /// On its own, a panel is as wide as one column.
    fn draw(&self) -> Result<Canvas, ReportError> {
        let (width, height) = (ONE_COLUMN, self.height(ONE_COLUMN));
        let mut canvas = Canvas::new(width, height);
        self.draw_into(&mut canvas, Rect { left: 0.0, top: 0.0, width, height })?;
        Ok(canvas)
    }
}

/// Panels in rows, lettered, on a page as wide as two columns.
pub struct Sheet<'a> {
    /// By rows from the upper left.
    pub panels: Vec<&'a dyn Panel>,
    /// Panels in a row.
    pub columns: usize,
}

impl Figure for Sheet<'_> {
    fn draw(&self) -> Result<Canvas, ReportError> {
        if self.panels.is_empty() || self.columns == 0 {
            return Err(ReportError::Empty { figure: "the sheet", reason: "no panels were given".into() });
        }
        let gap = 12.0;
        let columns = self.columns.min(self.panels.len());
        let width = (TWO_COLUMNS - gap * (columns - 1) as f64) / columns as f64;
        let mut canvas = Canvas::new(TWO_COLUMNS, 0.0);
        let mut letters = 'a'..='z';
        for row in self.panels.chunks(columns) {
            let top = if canvas.height > 0.0 { canvas.height + gap } else { 0.0 };
            let height = row.iter().map(|panel| panel.height(width)).fold(0.0, f64::max);
            for (column, panel) in row.iter().enumerate() {
                let left = column as f64 * (width + gap);
                panel.draw_into(&mut canvas, Rect { left, top, width, height })?;
                if let Some(letter) = letters.next().filter(|_| self.panels.len() > 1) {
                    canvas.text(Text::new(letter, [left + 6.0, top + 9.0], TITLE).bold());
                }
            }
            canvas.height = top + height;
        }
        Ok(canvas)
    }
}
