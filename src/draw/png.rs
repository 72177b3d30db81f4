//! A canvas as PNG: lines and text antialiased by tiny-skia.

use super::canvas::{Align, Canvas, Point, Rect, Shape, Stroke, Text};
use super::cloud::Bitmap;
use super::colour::Colour;
use super::font::{self, Pen};
use super::{DOTS_PER_INCH, ReportError};
use tiny_skia::{
    FillRule, FilterQuality, LineCap, LineJoin, Mask, Paint, PathBuilder, Pixmap, PixmapPaint, PixmapRef,
    PremultipliedColorU8, StrokeDash, Transform,
};

/// Draws the canvas, whose clouds of dots are these bitmaps, and compresses it.
pub(super) fn encode(canvas: &Canvas, clouds: &[Bitmap]) -> Result<Vec<u8>, ReportError> {
    let scale = DOTS_PER_INCH / 72.0;
    let (width, height) = ((canvas.width * scale).round(), (canvas.height * scale).round());
    let mut pixmap = Pixmap::new(width as u32, height as u32).ok_or(ReportError::Bitmap { width, height })?;
    pixmap.fill(tiny_skia::Color::WHITE);
    let mut painter = Painter { pixmap, scale, mask: None };
    let mut clouds = clouds.iter();
    for shape in &canvas.shapes {
        match shape {
            Shape::Dots { .. } => clouds.next().into_iter().for_each(|cloud| painter.cloud(cloud)),
            shape => painter.shape(shape),
        }
    }
    let pixels = painter.pixmap.data();
    let mut opaque = vec![0; pixels.len() / 4 * 3];
    for (opaque, pixel) in opaque.chunks_exact_mut(3).zip(pixels.chunks_exact(4)) {
        opaque.copy_from_slice(&pixel[..3]);
    }
    let per_metre = (DOTS_PER_INCH / 0.0254).round() as u32;
    Ok(compress(width as u32, height as u32, png::ColorType::Rgb, &opaque, Some(per_metre)))
}

/// An image with transparency as PNG.
pub(super) fn encode_image(width: usize, height: usize, pixels: &[[u8; 4]]) -> Vec<u8> {
    compress(width as u32, height as u32, png::ColorType::Rgba, pixels.as_flattened(), None)
}

fn compress(width: u32, height: u32, colour: png::ColorType, bytes: &[u8], per_metre: Option<u32>) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    // The best filter of every line takes six times as long, for 2 to 10 % of a cloud's bytes.
    encoder.set_filter(png::Filter::Sub);
    encoder.set_pixel_dims(per_metre.map(|density| png::PixelDimensions {
        xppu: density,
        yppu: density,
        unit: png::Unit::Meter,
    }));
    let mut writer = encoder.write_header().expect("writing to memory");
    writer.write_image_data(bytes).expect("as many bytes as pixels");
    writer.finish().expect("writing to memory");
    out
}

struct Painter {
    pixmap: Pixmap,
    /// Pixels per point.
    scale: f64,
    /// The last clip used.
    mask: Option<(Rect, Mask)>,
}

impl Painter {
    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Path { points, closed, fill, stroke, clip } => {
                let mut builder = PathBuilder::new();
                for (i, &[x, y]) in points.iter().enumerate() {
                    if i == 0 { builder.move_to(x as f32, y as f32) } else { builder.line_to(x as f32, y as f32) }
                }
                if *closed {
                    builder.close();
                }
                self.paint(builder, *fill, *stroke, *clip);
            }
            Shape::Circle { centre, radius, fill, stroke, clip } => {
                let mut builder = PathBuilder::new();
                builder.push_circle(centre[0] as f32, centre[1] as f32, *radius as f32);
                self.paint(builder, *fill, *stroke, *clip);
            }
            Shape::Moving { frames, stroke, .. } => {
                let points = frames.first().cloned().unwrap_or_default();
                self.shape(&Shape::Path { points, closed: false, fill: None, stroke: Some(*stroke), clip: None });
            }
            Shape::Growing { points, stroke, .. } => {
                let points = points.clone();
                self.shape(&Shape::Path { points, closed: false, fill: None, stroke: Some(*stroke), clip: None });
            }
            Shape::Text(text) => self.text(text),
            Shape::Image { rect, width, height, pixels } => self.image(*rect, *width, *height, pixels),
            // A cloud is a bitmap.
            Shape::Dots { .. } => {}
        }
    }

    /// Lays a bitmap over the page, which is opaque.
    fn cloud(&mut self, cloud: &Bitmap) {
        let (width, height) = (self.pixmap.width() as i32, self.pixmap.height() as i32);
        let page = self.pixmap.pixels_mut();
        for (row, pixels) in cloud.pixels.chunks(cloud.width).enumerate() {
            let y = cloud.corner[1] + row as i32;
            for (column, &[red, green, blue, alpha]) in pixels.iter().enumerate() {
                let x = cloud.corner[0] + column as i32;
                if alpha == 0 || !(0..width).contains(&x) || !(0..height).contains(&y) {
                    continue;
                }
                let below = &mut page[(y * width + x) as usize];
                let over = |top: u8, below: u8| {
                    let [alpha, top, below] = [alpha, top, below].map(u32::from);
                    ((alpha * top + (255 - alpha) * below + 127) / 255) as u8
                };
                let [red, green, blue] = [over(red, below.red()), over(green, below.green()), over(blue, below.blue())];
                *below = PremultipliedColorU8::from_rgba(red, green, blue, 255).unwrap_or(*below);
            }
        }
    }

    fn paint(&mut self, builder: PathBuilder, fill: Option<Colour>, stroke: Option<Stroke>, clip: Option<Rect>) {
        let Some(path) = builder.finish() else { return };
        if let Some(clip) = clip {
            self.prepare_mask(clip);
        }
        let mask = clip.and(self.mask.as_ref().map(|(_, mask)| mask));
        let transform = Transform::from_scale(self.scale as f32, self.scale as f32);
        if let Some(fill) = fill {
            self.pixmap.fill_path(&path, &ink(fill), FillRule::Winding, transform, mask);
        }
        if let Some(stroke) = stroke {
            let dash = stroke.dash.and_then(|dash| StrokeDash::new(dash.map(|x| x as f32).to_vec(), 0.0));
            let line_cap = if dash.is_some() { LineCap::Butt } else { LineCap::Round };
            let pen = tiny_skia::Stroke {
                width: stroke.width as f32,
                line_cap,
                line_join: LineJoin::Round,
                dash,
                ..Default::default()
            };
            self.pixmap.stroke_path(&path, &ink(stroke.colour), &pen, transform, mask);
        }
    }

    fn prepare_mask(&mut self, clip: Rect) {
        if self.mask.as_ref().is_some_and(|(rect, _)| *rect == clip) {
            return;
        }
        let Some(mut mask) = Mask::new(self.pixmap.width(), self.pixmap.height()) else { return };
        let (width, height) = (clip.width as f32, clip.height as f32);
        if let Some(rect) = tiny_skia::Rect::from_xywh(clip.left as f32, clip.top as f32, width, height) {
            let transform = Transform::from_scale(self.scale as f32, self.scale as f32);
            mask.fill_path(&PathBuilder::from_rect(rect), FillRule::Winding, true, transform);
        }
        self.mask = Some((clip, mask));
    }

    fn text(&mut self, text: &Text) {
        let start = match text.align {
            Align::Start => 0.0,
            Align::Middle => -0.5 * text.width(),
            Align::End => -text.width(),
        };
        let (sin, cos) = text.angle.to_radians().sin_cos();
        let place = |[x, y]: Point| {
            let (x, y) = (start + text.size * x, text.size * (font::HALF_CAPITAL - y));
            [(text.at[0] + cos * x + sin * y) as f32, (text.at[1] - sin * x + cos * y) as f32]
        };
        let mut builder = PathBuilder::new();
        let mut last = None;
        for pen in font::outlines(&text.content, text.bold) {
            let from = match &pen {
                Pen::Line([a, _]) => *a,
                Pen::Quadratic([a, ..]) => *a,
                Pen::Cubic([a, ..]) => *a,
            };
            if last != Some(from) {
                let [x, y] = place(from);
                builder.move_to(x, y);
            }
            last = Some(match pen {
                Pen::Line([_, b]) => {
                    let [x, y] = place(b);
                    builder.line_to(x, y);
                    b
                }
                Pen::Quadratic([_, b, c]) => {
                    let ([x1, y1], [x, y]) = (place(b), place(c));
                    builder.quad_to(x1, y1, x, y);
                    c
                }
                Pen::Cubic([_, b, c, d]) => {
                    let ([x1, y1], [x2, y2], [x, y]) = (place(b), place(c), place(d));
                    builder.cubic_to(x1, y1, x2, y2, x, y);
                    d
                }
            });
        }
        if text.halo {
            self.paint(builder.clone(), None, Some(Stroke::new(Colour::WHITE, 0.3 * text.size)), None);
        }
        self.paint(builder, Some(text.colour), None, None);
    }

    fn image(&mut self, rect: Rect, width: usize, height: usize, pixels: &[Colour]) {
        let bytes: Vec<u8> = pixels
            .iter()
            .flat_map(|pixel| {
                let part = |channel: u8| (f64::from(channel) * pixel.alpha).round() as u8;
                let alpha = (255.0 * pixel.alpha).round() as u8;
                let colour =
                    PremultipliedColorU8::from_rgba(part(pixel.red), part(pixel.green), part(pixel.blue), alpha);
                let colour = colour.unwrap_or(PremultipliedColorU8::TRANSPARENT);
                [colour.red(), colour.green(), colour.blue(), colour.alpha()]
            })
            .collect();
        let Some(image) = PixmapRef::from_bytes(&bytes, width as u32, height as u32) else { return };
        let transform = Transform::from_row(
            (rect.width * self.scale / width as f64) as f32,
            0.0,
            0.0,
            (rect.height * self.scale / height as f64) as f32,
            (rect.left * self.scale) as f32,
            (rect.top * self.scale) as f32,
        );
        let paint = PixmapPaint { quality: FilterQuality::Nearest, ..Default::default() };
        self.pixmap.draw_pixmap(0, 0, image, &paint, transform, None);
    }
}

fn ink(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(colour.red, colour.green, colour.blue, (255.0 * colour.alpha).round() as u8);
    paint.anti_alias = true;
    paint
}
