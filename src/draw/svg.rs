//! A canvas as SVG: lines and text stay vectors, large point clouds become an embedded image.

use super::canvas::{Align, Canvas, Dot, Point, Rect, Shape, Stroke, Text};
use super::cloud::Bitmap;
use super::colour::Colour;
use super::{font, png};
use crate::text::xml;
use rayon::prelude::*;
use std::fmt::Write;

/// More dots than this become an image.
const MOST_VECTOR_DOTS: usize = 1500;
/// Pixels along the longer side of an image whose cells keep sharp edges.
const FINE_IMAGE: usize = 800;

/// The canvas, whose clouds of many dots are these bitmaps.
pub(super) fn encode(canvas: &Canvas, clouds: &[Bitmap]) -> String {
    let dots = canvas.shapes.iter().filter_map(|shape| match shape {
        Shape::Dots { dots, .. } => Some(dots),
        _ => None,
    });
    let clouds: Vec<(_, &Bitmap)> = dots.zip(clouds).collect();
    let embed = |(dots, cloud): (&Vec<Dot>, &Bitmap)| {
        let image = || png::encode_image(cloud.width, cloud.height(), &cloud.pixels);
        (dots.len() > MOST_VECTOR_DOTS).then(|| element(&cloud.rect(), "", &image()))
    };
    let embedded: Vec<Option<String>> = clouds.into_par_iter().map(embed).collect();
    let mut writer = Writer { out: String::new(), clips: Vec::new(), embedded: embedded.into_iter() };
    canvas.shapes.iter().for_each(|shape| writer.shape(shape));
    let (width, height) = (number(canvas.width), number(canvas.height));
    let mut page = String::new();
    page.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    page.push_str(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{width}pt\" \
         height=\"{height}pt\" viewBox=\"0 0 {width} {height}\" font-family=\"{}\">\n",
        font::FAMILIES
    ));
    if !writer.clips.is_empty() {
        page.push_str("<defs>\n");
        for (index, clip) in writer.clips.iter().enumerate() {
            page.push_str(&format!("<clipPath id=\"clip{index}\"><rect {}/></clipPath>\n", place(clip)));
        }
        page.push_str("</defs>\n");
    }
    page.push_str(&format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"));
    page.push_str(&writer.out);
    page.push_str("</svg>\n");
    page
}

struct Writer {
    out: String,
    clips: Vec<Rect>,
    /// The clouds to come; `None` for one of few dots.
    embedded: std::vec::IntoIter<Option<String>>,
}

impl Writer {
    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Path { points, closed, fill, stroke, clip } => {
                let mut d = outline(points);
                if *closed {
                    d.push('Z');
                }
                let style = format!("{}{}", style(*fill, *stroke), self.clip(*clip));
                self.line(format_args!("<path d=\"{d}\"{style}/>"));
            }
            Shape::Circle { centre: [x, y], radius, fill, stroke, clip } => {
                let style = format!("{}{}", style(*fill, *stroke), self.clip(*clip));
                let (x, y, r) = (number(*x), number(*y), number(*radius));
                self.line(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{style}/>"));
            }
            Shape::Moving { frames, stroke, seconds } => {
                let Some(first) = frames.first() else { return };
                let values: Vec<String> = frames.iter().map(|frame| outline(frame)).collect();
                let (first, style, values) = (outline(first), style(None, Some(*stroke)), values.join(";"));
                let animate = animate("d", &values, *seconds);
                self.line(format_args!("<path d=\"{first}\"{style}>{animate}</path>"));
            }
            Shape::Growing { points, shares, stroke, seconds } => {
                let hidden: Vec<String> = shares.iter().map(|share| number(1.0 - share)).collect();
                let (d, animate) = (outline(points), animate("stroke-dashoffset", &hidden.join(";"), *seconds));
                let (colour, width) = (stroke.colour.code(), number(stroke.width));
                self.line(format_args!(
                    "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\" \
                     pathLength=\"1\" stroke-dasharray=\"1\">{animate}</path>"
                ));
            }
            Shape::Text(text) => self.text(text),
            Shape::Image { rect, width, height, pixels } => self.image(rect, *width, *height, pixels),
            Shape::Dots { clip, radius, rim, dots } => {
                if let Some(image) = self.embedded.next().flatten() {
                    return self.line(format_args!("{image}"));
                }
                let clip = self.clip(Some(*clip));
                self.line(format_args!("<g{clip}>"));
                for dot in dots {
                    let [x, y] = dot.at.map(number);
                    let rim_stroke = (*rim > 0.0).then(|| Stroke::new(dot.rim(), *rim));
                    let (style, r) = (style(Some(dot.colour), rim_stroke), number(radius - 0.5 * rim));
                    self.line(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{style}/>"));
                }
                self.line(format_args!("</g>"));
            }
        }
    }

    fn line(&mut self, content: std::fmt::Arguments) {
        writeln!(self.out, "{content}").expect("writing to memory");
    }

    fn clip(&mut self, clip: Option<Rect>) -> String {
        let Some(clip) = clip else { return String::new() };
        let index = self.clips.iter().position(|known| *known == clip).unwrap_or_else(|| {
            self.clips.push(clip);
            self.clips.len() - 1
        });
        format!(" clip-path=\"url(#clip{index})\"")
    }

    fn text(&mut self, text: &Text) {
        let anchor = match text.align {
            Align::Start => "",
            Align::Middle => " text-anchor=\"middle\"",
            Align::End => " text-anchor=\"end\"",
        };
        let weight = if text.bold { " font-weight=\"bold\"" } else { "" };
        let halo = if text.halo {
            let width = number(0.3 * text.size);
            format!(" paint-order=\"stroke\" stroke=\"#ffffff\" stroke-width=\"{width}\" stroke-linejoin=\"round\"")
        } else {
            String::new()
        };
        let [x, y] = text.at.map(number);
        let turn = if text.angle == 0.0 { String::new() } else { format!(" rotate({})", number(-text.angle)) };
        let (size, baseline) = (number(text.size), number(font::HALF_CAPITAL * text.size));
        let mut content = String::new();
        let mut rise = 0.0;
        for run in font::runs(&text.content) {
            let body = xml(&run.text);
            let shift = number((rise - run.rise) * text.size);
            match (run.size == 1.0, shift.as_str()) {
                (true, "0") => content.push_str(&body),
                (true, _) => content.push_str(&format!("<tspan dy=\"{shift}\">{body}</tspan>")),
                (false, _) => {
                    let size = number(run.size * text.size);
                    content.push_str(&format!("<tspan dy=\"{shift}\" font-size=\"{size}\">{body}</tspan>"));
                }
            }
            rise = run.rise;
        }
        let colour = text.colour.code();
        self.line(format_args!(
            "<text transform=\"translate({x} {y}){turn}\" y=\"{baseline}\" font-size=\"{size}\" \
             fill=\"{colour}\"{anchor}{weight}{halo} xml:space=\"preserve\">{content}</text>"
        ));
    }

    fn image(&mut self, rect: &Rect, width: usize, height: usize, pixels: &[Colour]) {
        // Viewers blur between pixels, whatever they are asked for: cells are repeated to keep their edges.
        let repeat = (FINE_IMAGE / width.max(height)).max(1);
        let cell = |row: usize, column: usize| {
            let Colour { red, green, blue, alpha } = pixels[row / repeat * width + column / repeat];
            [red, green, blue, (255.0 * alpha).round() as u8]
        };
        let cells = (0..height * repeat).flat_map(|row| (0..width * repeat).map(move |column| cell(row, column)));
        let image = png::encode_image(width * repeat, height * repeat, &cells.collect::<Vec<_>>());
        self.line(format_args!("{}", element(rect, " image-rendering=\"optimizeSpeed\"", &image)));
    }
}

/// A PNG stretched over a rectangle.
fn element(rect: &Rect, rendering: &str, image: &[u8]) -> String {
    let (place, data) = (place(rect), base64(image));
    format!("<image {place} preserveAspectRatio=\"none\"{rendering} xlink:href=\"data:image/png;base64,{data}\"/>")
}

/// A line through points.
fn outline(points: &[Point]) -> String {
    let mut d = String::new();
    for (i, [x, y]) in points.iter().enumerate() {
        let step = if i == 0 { 'M' } else { 'L' };
        d.push_str(&format!("{step}{} {}", number(*x), number(*y)));
    }
    d
}

/// An attribute that takes values one after another, endlessly.
fn animate(attribute: &str, values: &str, seconds: f64) -> String {
    let seconds = number(seconds);
    format!(
        "<animate attributeName=\"{attribute}\" dur=\"{seconds}s\" repeatCount=\"indefinite\" values=\"{values}\"/>"
    )
}

fn place(rect: &Rect) -> String {
    let [x, y, width, height] = [rect.left, rect.top, rect.width, rect.height].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

/// At most three decimals: a thousandth of a point is finer than any printer.
fn number(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn style(fill: Option<Colour>, stroke: Option<Stroke>) -> String {
    let mut out = match fill {
        None => " fill=\"none\"".into(),
        Some(fill) if fill.alpha < 1.0 => format!(" fill=\"{}\" fill-opacity=\"{}\"", fill.code(), number(fill.alpha)),
        Some(fill) => format!(" fill=\"{}\"", fill.code()),
    };
    if let Some(stroke) = stroke {
        out.push_str(&format!(" stroke=\"{}\" stroke-width=\"{}\"", stroke.colour.code(), number(stroke.width)));
        if stroke.colour.alpha < 1.0 {
            out.push_str(&format!(" stroke-opacity=\"{}\"", number(stroke.colour.alpha)));
        }
        match stroke.dash {
            Some([on, off]) => out.push_str(&format!(" stroke-dasharray=\"{} {}\"", number(on), number(off))),
            None => out.push_str(" stroke-linecap=\"round\""),
        }
        out.push_str(" stroke-linejoin=\"round\"");
    }
    out
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |k: usize| u32::from(chunk.get(k).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let letter = ALPHABET[(bits >> (18 - 6 * k) & 63) as usize];
            out.push(if k <= chunk.len() { letter as char } else { '=' });
        }
    }
    out
}
