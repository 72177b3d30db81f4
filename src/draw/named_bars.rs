//! Horizontal bars with names and numbers.

use super::canvas::{Align, Canvas, NORMAL, Rect, SMALL, Stroke, TITLE, Text};
use super::colour::Colour;
use super::{Panel, ReportError};

const STEP: f64 = 15.0;

/// Bars of numbers that are not negative, one below another, from zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NamedBars {
    /// Above the panel; empty for none.
    pub title: String,
    /// What the bars show, under them.
    pub label: String,
    /// Names and numbers, from the top.
    pub bars: Vec<(String, f64)>,
    /// Digits after the point.
    pub decimals: usize,
    /// A line to compare with.
    pub mark: Option<f64>,
}

impl Panel for NamedBars {
    fn draw_into(&self, canvas: &mut Canvas, rect: Rect) -> Result<(), ReportError> {
        let most = self.bars.iter().map(|(_, value)| *value).filter(|value| value.is_finite()).fold(0.0, f64::max);
        if most <= 0.0 {
            return Err(ReportError::Empty { figure: "the bars", reason: "no number above zero".into() });
        }
        let width = |text: &str| Text::new(text, [0.0; 2], SMALL).width();
        let words = |value: f64| super::ticks::fixed(value, self.decimals);
        let names = self.bars.iter().map(|(name, _)| width(name)).fold(0.0, f64::max);
        let numbers = self.bars.iter().map(|(_, value)| width(&words(*value))).fold(0.0, f64::max);
        let left = rect.left + (16.0 + names).max(42.0);
        let top = rect.top + 20.0;
        let longest = rect.right() - 14.0 - numbers - left;
        canvas.text(Text::new(&self.title, [rect.left + 42.0, rect.top + 9.0], TITLE).bold());
        let bottom = top + STEP * self.bars.len() as f64;
        for (index, (name, value)) in self.bars.iter().enumerate() {
            let y = top + STEP * (index as f64 + 0.5);
            let value = if value.is_finite() { *value } else { 0.0 };
            let bar = Rect { left, top: y - 0.34 * STEP, width: longest * value / most, height: 0.68 * STEP };
            canvas.rect(bar, Some(Colour::BLUE), None);
            canvas.text(Text::new(name, [left - 5.0, y], SMALL).align(Align::End));
            canvas.text(Text::new(words(value), [bar.right() + 4.0, y], SMALL));
        }
        canvas.line([[left, top], [left, bottom]], Stroke::new(Colour::MUTED, 0.6));
        if let Some(mark) = self.mark {
            let x = left + longest * mark / most;
            let stroke = Stroke { dash: Some([3.5, 2.5]), ..Stroke::new(Colour::INK, 0.8) };
            canvas.line([[x, top - 2.0], [x, bottom + 2.0]], stroke);
        }
        let at = [left + 0.5 * longest, bottom + 10.0];
        canvas.text(Text::new(&self.label, at, NORMAL).align(Align::Middle));
        Ok(())
    }

    fn height(&self, _: f64) -> f64 {
        20.0 + STEP * self.bars.len() as f64 + 18.0
    }
}
