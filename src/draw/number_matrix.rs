//! Numbers in rows and columns, coloured by their size and sign.

use super::canvas::{Align, Canvas, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::{Colour, ColourMap};
use super::{Panel, ReportError};

const ROW: f64 = 17.0;
/// Room for the title (pt).
const ABOVE: f64 = 20.0;
/// Angle of the names of columns (deg).
const ANGLE: f64 = 30.0;

/// Cells of a row share one scale of colours: white for zero, blue and red for the largest of both signs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NumberMatrix {
    /// Above the panel; empty for none.
    pub title: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Names of the rows and their cells; NaN for none.
    pub rows: Vec<(String, Vec<f64>)>,
    /// Digits that count.
    pub digits: usize,
}

impl NumberMatrix {
    fn names_height(&self) -> f64 {
        let widest = self.columns.iter().map(|name| Text::new(name, [0.0; 2], SMALL).width()).fold(0.0, f64::max);
        widest * ANGLE.to_radians().sin() + 12.0
    }

    fn words(&self, value: f64) -> String {
        let size = value.abs();
        if value == 0.0 {
            return "0".into();
        }
        if !(1e-3..1e5).contains(&size) {
            return format!("{value:.*e}", self.digits.saturating_sub(1)).replace('-', "−");
        }
        let before = size.log10().floor() as i64 + 1;
        super::ticks::fixed(value, (self.digits as i64 - before).max(0) as usize)
    }
}

impl Panel for NumberMatrix {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        if self.rows.is_empty() || self.columns.is_empty() {
            return Err(ReportError::Empty { figure: "the matrix", reason: "no cells".into() });
        }
        for (_, cells) in &self.rows {
            let (expected, found) = (self.columns.len(), cells.len());
            if expected != found {
                return Err(ReportError::Length { figure: "the matrix", what: "a row", expected, found });
            }
        }
        let names = self.rows.iter().map(|(name, _)| Text::new(name, [0.0; 2], SMALL).width()).fold(0.0, f64::max);
        let left = rect.left + (14.0 + names).max(42.0);
        // The last name leans over the right edge of its cell.
        let lean = self.columns.last().map_or(0.0, |name| Text::new(name, [0.0; 2], SMALL).width());
        let width = (rect.right() - 8.0 - lean * ANGLE.to_radians().cos() * 0.8 - left) / self.columns.len() as f64;
        let top = rect.top + ABOVE + self.names_height();
        canvas.text(Text::new(&self.title, [rect.left + 42.0, rect.top + 9.0], TITLE).bold());
        for (k, name) in self.columns.iter().enumerate() {
            let at = [left + width * (k as f64 + 0.5), top - 6.0];
            canvas.text(Text::new(name, at, SMALL).angle(ANGLE));
        }
        for (index, (name, cells)) in self.rows.iter().enumerate() {
            let y = top + ROW * index as f64;
            canvas.text(Text::new(name, [left - 5.0, y + 0.5 * ROW], SMALL).align(Align::End));
            let largest = cells.iter().filter(|x| x.is_finite()).fold(0.0f64, |most, x| most.max(x.abs()));
            for (k, value) in cells.iter().enumerate() {
                let cell = Rect { left: left + width * k as f64, top: y, width, height: ROW };
                let share = if largest > 0.0 { value / largest } else { 0.0 };
                let fill = if value.is_finite() { ColourMap::Diverging.at(0.5 + 0.5 * share) } else { Colour::GRID };
                canvas.rect(cell, Some(fill), Some(Stroke::new(Colour::WHITE, 0.8)));
                if value.is_finite() {
                    let ink = if share.abs() > 0.6 { Colour::WHITE } else { Colour::INK };
                    let text = Text::new(self.words(*value), cell.centre(), SMALL);
                    canvas.text(text.align(Align::Middle).colour(ink));
                }
            }
        }
        Ok(())
    }

    fn height(&self, _: f64) -> f64 {
        ABOVE + self.names_height() + ROW * self.rows.len() as f64 + 8.0
    }
}
