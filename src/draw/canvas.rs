//! What a figure draws on: shapes in points (1/72 inch), x to the right, y down, later shapes on top.

use super::colour::Colour;
use super::font;

/// A place on the page (pt).
pub type Point = [f64; 2];

/// Size of tick labels (pt).
pub const SMALL: f64 = 7.0;
/// Size of axis labels (pt).
pub const NORMAL: f64 = 8.0;
/// Size of titles (pt).
pub const TITLE: f64 = 9.0;

/// An upright rectangle (pt).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Distance from the left edge of the page.
    pub left: f64,
    /// Distance from the upper edge of the page.
    pub top: f64,
    /// From left to right.
    pub width: f64,
    /// From top to bottom.
    pub height: f64,
}

impl Rect {
    /// Its right edge (pt).
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Its lower edge (pt).
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Its middle (pt).
    pub fn centre(&self) -> Point {
        [self.left + 0.5 * self.width, self.top + 0.5 * self.height]
    }

    /// Whether a place lies in it or on its edge.
    pub fn contains(&self, [x, y]: Point) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }

    /// Its corners (pt), clockwise from the upper left one.
    pub fn corners(&self) -> [Point; 4] {
        let (left, top, right, bottom) = (self.left, self.top, self.right(), self.bottom());
        [[left, top], [right, top], [right, bottom], [left, bottom]]
    }

    /// Moves every side inwards (pt), outwards when negative.
    pub fn inset(&self, by: f64) -> Rect {
        let (width, height) = (self.width - 2.0 * by, self.height - 2.0 * by);
        Rect { left: self.left + by, top: self.top + by, width, height }
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Of the line.
    pub colour: Colour,
    /// Of the line (pt).
    pub width: f64,
    /// Lengths on and off (pt).
    pub dash: Option<[f64; 2]>,
}

impl Stroke {
    /// A line without dashes, so wide (pt).
    pub fn new(colour: Colour, width: f64) -> Self {
        Self { colour, width, dash: None }
    }
}

/// Which end of a text its place refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// One line of text; `at` lies at half the height of its capitals.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// The words; superscript digits are set as smaller raised ones.
    pub content: String,
    /// Where it stands.
    pub at: Point,
    /// Of the letters (pt).
    pub size: f64,
    /// Whether letters are bold.
    pub bold: bool,
    /// Of the letters.
    pub colour: Colour,
    /// Which end stands at `at`.
    pub align: Align,
    /// Counter-clockwise (deg).
    pub angle: f64,
    /// A white rim keeps the text readable on top of data.
    pub halo: bool,
}

impl Text {
    /// Plain text in ink that starts at a place, in a size (pt).
    pub fn new(content: impl Into<String>, at: Point, size: f64) -> Self {
        let colour = Colour::INK;
        Self { content: content.into(), at, size, bold: false, colour, align: Align::Start, angle: 0.0, halo: false }
    }

    /// Lets its place refer to another end.
    pub fn align(self, align: Align) -> Self {
        Self { align, ..self }
    }

    /// In bold letters.
    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// In a colour.
    pub fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// Turned counter-clockwise (deg).
    pub fn angle(self, angle: f64) -> Self {
        Self { angle, ..self }
    }

    /// With a white rim.
    pub fn halo(self) -> Self {
        Self { halo: true, ..self }
    }

    /// Its width (pt).
    pub fn width(&self) -> f64 {
        font::width(&self.content, self.size, self.bold)
    }
}

/// One dot of a point cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dot {
    pub at: Point,
    pub colour: Colour,
}

impl Dot {
    pub(super) fn rim(&self) -> Colour {
        self.colour.mix(Colour::BLACK, 0.45)
    }
}

/// What a canvas is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    Path {
        points: Vec<Point>,
        closed: bool,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
        clip: Option<Rect>,
    },
    Circle {
        centre: Point,
        radius: f64,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
        clip: Option<Rect>,
    },
    Text(Text),
    /// A line that runs through places of as many points each, evenly within `seconds`, again and again; a still shows
    /// the first.
    Moving {
        frames: Vec<Vec<Point>>,
        stroke: Stroke,
        seconds: f64,
    },
    /// A line of which more and more is shown, these shares of its length, evenly within `seconds`; a still shows all.
    Growing {
        points: Vec<Point>,
        shares: Vec<f64>,
        stroke: Stroke,
        seconds: f64,
    },
    /// `width` by `height` cells by rows from the top, stretched over `rect`, with sharp edges.
    Image {
        rect: Rect,
        width: usize,
        height: usize,
        pixels: Vec<Colour>,
    },
    /// Dots in painting order, cut at `clip`, with a darker rim; a [`Bitmap`](super::cloud::Bitmap) in every format when
    /// they are many.
    Dots {
        clip: Rect,
        radius: f64,
        rim: f64,
        dots: Vec<Dot>,
    },
}

/// A page and the shapes on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    /// From left to right (pt).
    pub width: f64,
    /// From top to bottom (pt).
    pub height: f64,
    pub(super) shapes: Vec<Shape>,
}

impl Canvas {
    /// An empty page (pt).
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, shapes: Vec::new() }
    }

    /// Draws a line through places.
    pub fn line(&mut self, points: impl Into<Vec<Point>>, stroke: Stroke) {
        let points = points.into();
        self.shapes.push(Shape::Path { points, closed: false, fill: None, stroke: Some(stroke), clip: None });
    }

    /// Draws a line through places, cut off at a rectangle.
    pub fn clipped_line(&mut self, points: impl Into<Vec<Point>>, stroke: Stroke, clip: Rect) {
        let points = points.into();
        self.shapes.push(Shape::Path { points, closed: false, fill: None, stroke: Some(stroke), clip: Some(clip) });
    }

    /// Draws a closed outline, filled, stroked or both.
    pub fn polygon(&mut self, points: impl Into<Vec<Point>>, fill: Option<Colour>, stroke: Option<Stroke>) {
        self.shapes.push(Shape::Path { points: points.into(), closed: true, fill, stroke, clip: None });
    }

    /// Draws a rectangle.
    pub fn rect(&mut self, rect: Rect, fill: Option<Colour>, stroke: Option<Stroke>) {
        self.polygon(rect.corners(), fill, stroke);
    }

    /// Draws a circle of a radius (pt).
    pub fn circle(&mut self, centre: Point, radius: f64, fill: Option<Colour>, stroke: Option<Stroke>) {
        self.shapes.push(Shape::Circle { centre, radius, fill, stroke, clip: None });
    }

    /// Writes a line of text; nothing where it is empty.
    pub fn text(&mut self, text: Text) {
        if !text.content.is_empty() {
            self.shapes.push(Shape::Text(text));
        }
    }
}
