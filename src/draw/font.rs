//! The embedded typeface: widths of text and outlines of glyphs.

use ab_glyph::{Font, FontRef, OutlineCurve};
use std::sync::LazyLock;

/// Families an SVG asks for: the first ones share the widths measured here.
pub(super) const FAMILIES: &str = "'Liberation Sans', Arial, Helvetica, sans-serif";
/// Half the height of capitals over the font's size.
pub(super) const HALF_CAPITAL: f64 = 0.344;
const RAISED_SIZE: f64 = 0.70;
const RAISE: f64 = 0.34;

static REGULAR: LazyLock<FontRef<'static>> = LazyLock::new(|| load(include_bytes!("font/LiberationSans-Regular.ttf")));
static BOLD: LazyLock<FontRef<'static>> = LazyLock::new(|| load(include_bytes!("font/LiberationSans-Bold.ttf")));

fn load(bytes: &'static [u8]) -> FontRef<'static> {
    FontRef::try_from_slice(bytes).expect("the embedded font is a valid TrueType file")
}

fn face(bold: bool) -> &'static FontRef<'static> {
    if bold { &BOLD } else { &REGULAR }
}

/// A piece of text at one size: the line itself, or a raised exponent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub text: String,
    /// Over the size of the text.
    pub size: f64,
    /// Height above the baseline over the size of the text.
    pub rise: f64,
}

/// Splits a text so that exponents written with superscript characters are set as smaller raised digits.
pub(super) fn runs(text: &str) -> Vec<Run> {
    const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻";
    const PLAIN: &str = "0123456789−";
    let mut runs: Vec<Run> = Vec::new();
    for c in text.chars() {
        let place = SUPERSCRIPTS.chars().position(|superscript| superscript == c);
        let (c, size, rise) = match place {
            Some(place) => (PLAIN.chars().nth(place).expect("as many plain characters"), RAISED_SIZE, RAISE),
            None => (c, 1.0, 0.0),
        };
        match runs.last_mut() {
            Some(run) if run.size == size => run.text.push(c),
            _ => runs.push(Run { text: c.into(), size, rise }),
        }
    }
    runs
}

/// Width of a text (pt) at `size` (pt).
pub(super) fn width(text: &str, size: f64, bold: bool) -> f64 {
    let font = face(bold);
    let em = f64::from(font.units_per_em().unwrap_or(2048.0));
    let advance = |c| f64::from(font.h_advance_unscaled(font.glyph_id(c))) / em;
    runs(text).iter().map(|run| run.text.chars().map(advance).sum::<f64>() * run.size * size).sum()
}

/// One step of a glyph's outline, in ems, x to the right and y up from the start of the text's baseline.
pub(super) enum Pen {
    Line([[f64; 2]; 2]),
    Quadratic([[f64; 2]; 3]),
    Cubic([[f64; 2]; 4]),
}

/// Outlines of all glyphs of a text.
pub(super) fn outlines(text: &str, bold: bool) -> Vec<Pen> {
    let font = face(bold);
    let em = f64::from(font.units_per_em().unwrap_or(2048.0));
    let mut pens = Vec::new();
    let mut x = 0.0;
    for run in runs(text) {
        for c in run.text.chars() {
            let glyph = font.glyph_id(c);
            let place =
                |p: ab_glyph::Point| [x + run.size * f64::from(p.x) / em, run.rise + run.size * f64::from(p.y) / em];
            for curve in font.outline(glyph).map(|outline| outline.curves).unwrap_or_default() {
                pens.push(match curve {
                    OutlineCurve::Line(a, b) => Pen::Line([place(a), place(b)]),
                    OutlineCurve::Quad(a, b, c) => Pen::Quadratic([place(a), place(b), place(c)]),
                    OutlineCurve::Cubic(a, b, c, d) => Pen::Cubic([place(a), place(b), place(c), place(d)]),
                });
            }
            x += run.size * f64::from(font.h_advance_unscaled(glyph)) / em;
        }
    }
    pens
}
