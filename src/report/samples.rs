//! Samples of lines and arrows for legends.

use super::canvas::Stroke;
use super::colour::Colour;
use super::legend::Entry;
use super::symbols::flat_arrow;

pub(super) fn line_entry(words: &str, stroke: Stroke) -> Entry {
    Entry::new(words, move |canvas, rect| {
        let y = rect.centre()[1];
        canvas.line([[rect.left + 2.0, y], [rect.right() - 2.0, y]], stroke);
    })
}

pub(super) fn arrow_entry(words: impl Into<String>, colour: Colour) -> Entry {
    Entry::new(words, move |canvas, rect| {
        let y = rect.centre()[1];
        flat_arrow(canvas, [rect.left + 1.0, y], [rect.right() - 1.0, y], colour, 1.2);
    })
}
