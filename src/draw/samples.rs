//! Samples of lines and arrows for legends.

use super::canvas::Stroke;
use super::colour::Colour;
use super::legend::Entry;
use super::symbols::flat_arrow;
use super::ticks::compact;

pub(super) fn line_entry(words: &str, stroke: Stroke) -> Entry {
    Entry::new(words, move |canvas, rect| {
        let y = rect.centre()[1];
        canvas.line([[rect.left + 2.0, y], [rect.right() - 2.0, y]], stroke);
    })
}

/// Words of a legend with the size of a force.
pub(super) fn force_words(words: &str, newtons: f64) -> String {
    let (factor, unit) = if newtons < 0.1 { (1e3, "mN") } else { (1.0, "N") };
    format!("{words}, {} {unit}", compact(newtons * factor))
}

pub(super) fn arrow_entry(words: impl Into<String>, colour: Colour) -> Entry {
    Entry::new(words, move |canvas, rect| {
        let y = rect.centre()[1];
        flat_arrow(canvas, [rect.left + 1.0, y], [rect.right() - 1.0, y], colour, 1.2);
    })
}
