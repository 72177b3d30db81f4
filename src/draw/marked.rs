//! A figure that says what speaks against what it shows.

use super::canvas::{Canvas, NORMAL, Rect, Text};
use super::colour::Colour;
use super::{Figure, ReportError};

/// Space around the words (pt).
const MARGIN: f64 = 6.0;
/// Height of a line (pt).
const LINE: f64 = 11.0;

/// A figure above a bar that warns: a reader sees it wherever the figure goes.
pub struct Marked<'a> {
    /// What is shown.
    pub figure: &'a dyn Figure,
    /// What speaks against it.
    pub mark: &'a str,
}

impl Figure for Marked<'_> {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let mut canvas = self.figure.draw()?;
        let lines = wrapped(self.mark, canvas.width - 2.0 * MARGIN);
        let (top, width) = (canvas.height, canvas.width);
        let height = lines.len() as f64 * LINE + 2.0 * MARGIN;
        canvas.rect(Rect { left: 0.0, top, width, height }, Some(Colour::VERMILION), None);
        for (number, line) in lines.into_iter().enumerate() {
            let at = [MARGIN, top + MARGIN + (number as f64 + 0.5) * LINE];
            canvas.text(Text::new(line, at, NORMAL).bold().colour(Colour::WHITE));
        }
        canvas.height = top + height;
        Ok(canvas)
    }
}

/// Words in lines that are no wider (pt).
fn wrapped(words: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}"));
        match longer.filter(|line| Text::new(line.as_str(), [0.0; 2], NORMAL).bold().width() <= width) {
            Some(longer) => *lines.last_mut().expect("a line") = longer,
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::{Figure, Marked, wrapped};
    use crate::draw::{AxisLabel, Curves, ImageFormat, Series, encode};

    #[test]
    fn the_mark_stands_below_and_breaks_into_lines() {
        let figure = Curves {
            title: "tips".into(),
            x: AxisLabel::linear("current", "A"),
            y: AxisLabel::linear("tip", "mm"),
            series: vec![Series::line("x", vec![[0.0, 0.0], [1.0, 1.0]])],
        };
        let mark = "DISTRUSTED: 27 of 256 samples that were checked against the reference lie on another equilibrium";
        let marked = Marked { figure: &figure, mark };
        let (plain, drawn) = (figure.draw().expect("draws"), marked.draw().expect("draws"));
        assert!(drawn.height > plain.height + 20.0 && drawn.width == plain.width);
        let svg = String::from_utf8(encode(&marked, ImageFormat::Svg).expect("SVG")).expect("text");
        assert!(svg.contains("DISTRUSTED: 27 of 256"));
        assert!(
            !String::from_utf8(encode(&figure, ImageFormat::Svg).expect("SVG")).expect("text").contains("DISTRUSTED")
        );
        assert!(wrapped(mark, 200.0).len() > 1 && wrapped(mark, 1e6).len() == 1 && wrapped("", 9.0).is_empty());
        assert!(!encode(&marked, ImageFormat::Png).expect("PNG").is_empty());
    }
}
