//! Fast painting of many dots: a disc's coverage is tabulated once for each place within a pixel.

use super::canvas::{Dot, Rect};
use super::colour::Colour;

/// Places within a pixel, along each axis, at which a disc is tabulated.
const PLACES: usize = 4;
/// Subdivisions of a pixel, along each axis, to measure how much of it a disc covers.
const SAMPLES: usize = 8;

/// Dots as a bitmap over `clip` at `scale` pixels per point: width, height, pixels by rows.
pub(super) fn rasterise(dots: &[Dot], clip: Rect, radius: f64, rim: f64, scale: f64) -> (usize, usize, Vec<Colour>) {
    let (width, height) = ((clip.width * scale).round() as usize, (clip.height * scale).round() as usize);
    let (width, height) = (width.max(1), height.max(1));
    let mut pixels = vec![Colour::WHITE.with_alpha(0.0); width * height];
    let radius = radius * scale;
    let reach = radius.ceil() as i64 + 1;
    let size = (2 * reach + 1) as usize;
    let discs = |radius: f64| -> Vec<Vec<f64>> {
        (0..PLACES * PLACES).map(|place| disc(radius, reach, place % PLACES, place / PLACES)).collect()
    };
    let (outer, inner) = (discs(radius), discs(radius - rim * scale));
    for dot in dots {
        let x = (dot.at[0] - clip.left) * scale;
        let y = (dot.at[1] - clip.top) * scale;
        let place = |x: f64| ((x - x.floor()) * PLACES as f64) as usize;
        let disc = place(y).min(PLACES - 1) * PLACES + place(x).min(PLACES - 1);
        let (outer, inner) = (&outer[disc], &inner[disc]);
        for row in 0..size {
            let pixel_y = y.floor() as i64 - reach + row as i64;
            if !(0..height as i64).contains(&pixel_y) {
                continue;
            }
            for column in 0..size {
                let pixel_x = x.floor() as i64 - reach + column as i64;
                let coverage = outer[row * size + column];
                if coverage > 0.0 && (0..width as i64).contains(&pixel_x) {
                    let pixel = &mut pixels[pixel_y as usize * width + pixel_x as usize];
                    let colour = dot.rim().mix(dot.colour, inner[row * size + column] / coverage);
                    *pixel = over(colour, coverage, *pixel);
                }
            }
        }
    }
    (width, height, pixels)
}

fn disc(radius: f64, reach: i64, place_x: usize, place_y: usize) -> Vec<f64> {
    let centre = |place: usize| reach as f64 + (place as f64 + 0.5) / PLACES as f64;
    let size = 2 * reach as usize + 1;
    let within = |x: f64, y: f64| (x - centre(place_x)).hypot(y - centre(place_y)) <= radius;
    let step = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
    (0..size * size)
        .map(|pixel| {
            let (column, row) = ((pixel % size) as f64, (pixel / size) as f64);
            let inside =
                (0..SAMPLES * SAMPLES).filter(|k| within(column + step(k % SAMPLES), row + step(k / SAMPLES))).count();
            inside as f64 / (SAMPLES * SAMPLES) as f64
        })
        .collect()
}

/// Paints a colour with some opacity over another.
fn over(top: Colour, alpha: f64, below: Colour) -> Colour {
    let total = alpha + below.alpha * (1.0 - alpha);
    below.mix(top, alpha / total).with_alpha(total)
}
