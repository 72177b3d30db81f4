//! Places for words that hide neither the data nor each other.

use super::super::canvas::{Align, NORMAL, Point, Rect, Text};

/// What a panel holds already.
pub(in crate::draw) struct Taken {
    pub panel: Rect,
    /// Of the data.
    points: Vec<Point>,
    words: Vec<Rect>,
}

impl Taken {
    pub fn new(panel: Rect, points: Vec<Point>) -> Taken {
        Taken { panel, points, words: Vec::new() }
    }

    /// Keeps a place free.
    pub fn keep(&mut self, rect: Rect) {
        self.words.push(rect);
    }

    /// The text at the place where it hides no words and the fewest points, of equal ones the first; `None` where there
    /// is none.
    pub fn settle(&mut self, text: &Text, places: &[(Point, Align)]) -> Option<Text> {
        let placed = |(at, align): &(Point, Align)| {
            let text = Text { at: *at, align: *align, ..text.clone() };
            let rect = extent(&text);
            let is_whole = rect.corners().into_iter().all(|corner| self.panel.contains(corner));
            let hides_words = self.words.iter().any(|other| overlap(&rect, other));
            let hidden = self.points.iter().filter(|point| rect.inset(-1.5).contains(**point)).count();
            (is_whole && !hides_words).then_some((hidden, rect, text))
        };
        let (_, rect, text) = places.iter().filter_map(placed).min_by_key(|(hidden, ..)| *hidden)?;
        self.words.push(rect);
        Some(text)
    }
}

/// Where a text stands.
pub(super) fn extent(text: &Text) -> Rect {
    let width = text.width();
    let left = match text.align {
        Align::Start => text.at[0],
        Align::Middle => text.at[0] - 0.5 * width,
        Align::End => text.at[0] - width,
    };
    let height = 1.15 * text.size;
    Rect { left, top: text.at[1] - 0.5 * height, width, height }
}

/// The place of a letter about its middle.
pub(in crate::draw) fn letter([x, y]: Point) -> Rect {
    Rect { left: x - 0.5 * NORMAL, top: y - 0.5 * NORMAL, width: NORMAL, height: NORMAL }
}

pub(super) fn overlap(a: &Rect, b: &Rect) -> bool {
    a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom()
}
