//! Marks at the edge of a panel for sources beyond it: where to, which, and how far from the rod.

use super::super::canvas::{Align, Canvas, Point, Rect, SMALL, Text};
use super::super::colour::Colour;
use super::super::ticks::LengthUnit;
use super::super::vectors::distance;
use super::super::views::View;
use super::free_places::Taken;
use super::sources::FieldSource;
use crate::model::Vector;

/// Marks nearer than this are one (pt).
const TOGETHER: f64 = 14.0;
/// Of a mark from the panel's edge (pt).
const INSET: f64 = 3.0;
/// Of a mark (pt).
const LENGTH: f64 = 6.5;
/// Words are this far apart along an edge (pt).
const LINE: f64 = 9.0;
pub(super) const MARK: Colour = Colour::MUTED;

/// Sources that lie beyond a panel in about the same direction.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::draw) struct Beyond {
    /// Of the mark's tip.
    pub at: Point,
    /// Of length one, on the page.
    pub outwards: Point,
    /// What stands beside it.
    pub words: String,
}

/// Marks for sources that are drawn outside of a projection's panel; those before or behind it have none.
pub(in crate::draw) fn beyond(view: &View, from: Vector, rod: &[Vector], sources: &[&FieldSource]) -> Vec<Beyond> {
    let mut groups: Vec<(Point, Point, Vec<&FieldSource>)> = Vec::new();
    for source in sources {
        let Some((at, outwards)) = exit(view, view.place(from), view.place(source.position)) else { continue };
        let near = groups.iter_mut().find(|(other, ..)| (other[0] - at[0]).hypot(other[1] - at[1]) < TOGETHER);
        match near {
            Some((.., together)) => together.push(source),
            None => groups.push((at, outwards, vec![source])),
        }
    }
    let mark = |(at, outwards, together): (Point, Point, Vec<&FieldSource>)| {
        let away = together.iter().map(|source| from_rod(source, rod));
        let (least, most) = away.fold((f64::INFINITY, 0.0f64), |(least, most), x| (least.min(x), most.max(x)));
        let words = format!("{}: {}", names(&together), distances(least, most));
        Beyond { at, outwards, words }
    };
    groups.into_iter().map(mark).collect()
}

/// How far a source's middle is from a rod (m).
pub(super) fn from_rod(source: &FieldSource, rod: &[Vector]) -> f64 {
    rod.iter().map(|point| distance(*point, source.position)).fold(f64::INFINITY, f64::min)
}

/// Where the way from one place to another leaves the panel, and its direction there; `None` where it stays.
fn exit(view: &View, from: Point, to: Point) -> Option<(Point, Point)> {
    if view.rect.contains(to) {
        return None;
    }
    let inner = view.rect.inset(INSET);
    let way = [to[0] - from[0], to[1] - from[1]];
    let sides = [[inner.left, inner.right()], [inner.top, inner.bottom()]];
    let share = |k: usize| {
        let side = if way[k] > 0.0 { sides[k][1] } else { sides[k][0] };
        if way[k] == 0.0 { f64::INFINITY } else { ((side - from[k]) / way[k]).max(0.0) }
    };
    let share = share(0).min(share(1));
    let length = way[0].hypot(way[1]);
    Some(([from[0] + share * way[0], from[1] + share * way[1]], way.map(|x| x / length)))
}

/// Names, what they have in common said once, and the signs of currents: `array 5 (+), 8 (−)`.
fn names(together: &[&FieldSource]) -> String {
    let signed = |name: &str, source: &FieldSource| match source.current {
        Some(_) if source.is_swept => format!("{name} (±)"),
        Some(current) => format!("{name} ({})", sign(current)),
        None if source.is_swept => format!("{name} (swept)"),
        None => name.to_owned(),
    };
    let head = |source: &FieldSource| source.name.rsplit_once(' ').map(|(head, _)| head.to_owned());
    let mut words: Vec<String> = Vec::new();
    let mut last = None;
    for source in together {
        let head = head(source);
        let tail = source.name.rsplit_once(' ').map_or(source.name.as_str(), |(_, tail)| tail);
        let name = if head.is_some() && head == last { tail } else { &source.name };
        words.push(signed(name, source));
        last = head;
    }
    words.join(", ")
}

/// Of a current: `+`, `−` or `0`.
pub(super) fn sign(current: f64) -> &'static str {
    match current {
        x if x > 0.0 => "+",
        x if x < 0.0 => "−",
        _ => "0",
    }
}

/// One distance, or two where they differ.
fn distances(least: f64, most: f64) -> String {
    let LengthUnit { name, metres } = LengthUnit::for_extent(most);
    let decimals = if most / metres < 10.0 { 1 } else { 0 };
    let [least, most] = [least, most].map(|x| format!("{:.decimals$}", x / metres));
    if least == most { format!("{most} {name}") } else { format!("{least} to {most} {name}") }
}

/// Draws marks, and the words of each where they find a place.
pub(super) fn draw(canvas: &mut Canvas, taken: &mut Taken, marks: &[Beyond]) {
    for mark in marks {
        let Beyond { at: [x, y], outwards: [u, v], .. } = mark;
        let back = mark.back();
        let half = 0.42 * LENGTH;
        let corners = [[*x, *y], [back[0] - half * v, back[1] + half * u], [back[0] + half * v, back[1] - half * u]];
        canvas.polygon(corners, Some(MARK), None);
        taken.keep(Rect {
            left: x - LENGTH * u - half,
            top: y - LENGTH * v - half,
            width: 2.0 * half,
            height: 2.0 * half,
        });
    }
    for mark in marks {
        let text = Text::new(&mark.words, [0.0; 2], SMALL - 0.5).colour(MARK).halo();
        if let Some(text) = taken.settle(&text, &places(mark.back(), mark.outwards, text.width(), taken.panel)) {
            canvas.text(text);
        }
    }
}

impl Beyond {
    /// Where the mark begins.
    fn back(&self) -> Point {
        [self.at[0] - LENGTH * self.outwards[0], self.at[1] - LENGTH * self.outwards[1]]
    }
}

/// Places for words beside a mark: inwards from it or on its sides, then along the edge.
fn places(back: Point, [u, v]: Point, width: f64, panel: Rect) -> Vec<(Point, Align)> {
    let (right, left) = (([back[0] + 7.0, back[1]], Align::Start), ([back[0] - 7.0, back[1]], Align::End));
    let is_side = u.abs() > v.abs();
    let mut places = if u > 0.0 { vec![left, right] } else { vec![right, left] };
    let (first, align) = places[0];
    let ends = [panel.left + 0.5 * width + 3.0, (panel.right() - 0.5 * width - 3.0).max(panel.left)];
    let middle = back[0].clamp(ends[0].min(ends[1]), ends[1]);
    let near_end = if (back[0] - ends[0]).abs() < (back[0] - ends[1]).abs() { ends[0] } else { ends[1] };
    for k in 1..=6 {
        let by = LINE * f64::from(k);
        match is_side {
            true => places.extend([-by, by].map(|by| ([first[0], back[1] + by], align))),
            false => places.extend([middle, near_end].map(|x| ([x, back[1] - v.signum() * by], Align::Middle))),
        }
    }
    places
}
