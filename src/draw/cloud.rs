//! Fast painting of many dots, strip by strip: a disc's coverage is tabulated once for each place within a pixel.

use super::DOTS_PER_INCH;
use super::canvas::{Dot, Rect};
use super::colour::Colour;
use rayon::prelude::*;

/// Places within a pixel, along each axis, at which a disc is tabulated.
const PLACES: usize = 4;
/// Subdivisions of a pixel, along each axis, to measure how much of it a disc covers.
const SAMPLES: usize = 8;
/// Subdivisions of a pixel that is covered whole.
const WHOLE: u8 = (SAMPLES * SAMPLES) as u8;
/// Rows of pixels that are painted at a time.
const STRIP: usize = 32;

/// An image with transparency that lies on whole pixels of a page of [`DOTS_PER_INCH`].
pub(super) struct Bitmap {
    /// Its first pixel on the page, from the left and from the top.
    pub corner: [i32; 2],
    /// In pixels.
    pub width: usize,
    /// By rows from the top: red, green, blue, opacity.
    pub pixels: Vec<[u8; 4]>,
}

impl Bitmap {
    /// Paints dots, the last one on top; cut at `clip`, whose upper left corner moves outwards to a whole pixel.
    pub fn new(dots: &[Dot], clip: Rect, radius: f64, rim: f64) -> Bitmap {
        let scale = DOTS_PER_INCH / 72.0;
        let [left, top] = [clip.left, clip.top].map(|x| (x * scale).floor());
        let corner = [left, top].map(|x| x / scale);
        let size = |end: f64, start: f64| (((end - start) * scale).round() as usize).max(1);
        let (width, height) = (size(clip.right(), corner[0]), size(clip.bottom(), corner[1]));
        let discs = Discs::new(radius * scale, (radius - rim) * scale);
        let placed: Vec<Placed> = dots.iter().map(|dot| discs.place(dot, corner, scale)).collect();
        let mut pixels = vec![[255, 255, 255, 0]; width * height];
        let strips = strips(&placed, discs.reach, height);
        pixels.par_chunks_mut(width * STRIP).zip(strips).enumerate().for_each(|(k, (pixels, dots))| {
            let mut strip = Strip::new(k * STRIP, width, pixels);
            dots.iter().rev().for_each(|dot| strip.add(&placed[*dot as usize], &discs));
            strip.paint();
        });
        Bitmap { corner: [left, top].map(|x| x as i32), width, pixels }
    }

    /// In pixels.
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// Where it lies on the page (pt).
    pub fn rect(&self) -> Rect {
        let [left, top] = self.corner.map(|x| f64::from(x) * 72.0 / DOTS_PER_INCH);
        let [width, height] = [self.width, self.height()].map(|x| x as f64 * 72.0 / DOTS_PER_INCH);
        Rect { left, top, width, height }
    }
}

/// A dot in pixels.
struct Placed {
    /// Of the bitmap, that its middle lies in.
    pixel: [i32; 2],
    /// By where in the pixel.
    disc: usize,
    colour: Colour,
    rim: Colour,
}

/// The dots that reach into each strip, in painting order.
fn strips(dots: &[Placed], reach: i32, height: usize) -> Vec<Vec<u32>> {
    let mut strips = vec![Vec::new(); height.div_ceil(STRIP)];
    let last = height as i32 - 1;
    for (k, dot) in dots.iter().enumerate() {
        let y = dot.pixel[1];
        if y + reach >= 0 && y - reach <= last {
            let strip = |y: i32| y.clamp(0, last) as usize / STRIP;
            strips[strip(y - reach)..=strip(y + reach)].iter_mut().for_each(|strip| strip.push(k as u32));
        }
    }
    strips
}

/// What a disc covers of one pixel.
struct Spot {
    /// From the pixel that the disc's middle lies in.
    at: [i32; 2],
    /// Subdivisions that it covers.
    cover: u8,
    /// Share of these within the rim.
    inner: f64,
}

/// Discs of one size with a rim, by the place of their middle within a pixel.
struct Discs {
    reach: i32,
    has_rim: bool,
    spots: Vec<Vec<Spot>>,
}

impl Discs {
    /// Radii in pixels, with and without the rim.
    fn new(radius: f64, inner: f64) -> Discs {
        let reach = radius.ceil() as i32 + 1;
        let spots = (0..PLACES * PLACES).map(|place| {
            let middle = [place % PLACES, place / PLACES].map(|place| (place as f64 + 0.5) / PLACES as f64);
            let pixels = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
            let spot = |at: [i32; 2]| {
                let [cover, within] = [radius, inner].map(|radius| covered(at, middle, radius));
                Spot { at, cover, inner: f64::from(within) / f64::from(cover) }
            };
            pixels.map(spot).filter(|spot| spot.cover > 0).collect()
        });
        Discs { reach, has_rim: inner < radius, spots: spots.collect() }
    }

    /// Where a dot lies on a bitmap that starts at a corner (pt).
    fn place(&self, dot: &Dot, corner: [f64; 2], scale: f64) -> Placed {
        let at: [f64; 2] = std::array::from_fn(|k| (dot.at[k] - corner[k]) * scale);
        // What is far off the bitmap stays off it, in numbers that can be added to.
        let whole = at.map(|x| x.floor().clamp(-1e6, 1e6));
        let [x, y] = std::array::from_fn(|k| (((at[k] - whole[k]) * PLACES as f64) as usize).min(PLACES - 1));
        let rim = if self.has_rim { dot.rim() } else { dot.colour };
        Placed { pixel: whole.map(|x| x as i32), disc: y * PLACES + x, colour: dot.colour, rim }
    }
}

/// Subdivisions of a pixel that a disc covers whose middle lies in the pixel at the origin.
fn covered(pixel: [i32; 2], middle: [f64; 2], radius: f64) -> u8 {
    let step = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
    let from = |axis: usize, k: usize| f64::from(pixel[axis]) + step(k) - middle[axis];
    let within = |k: &usize| from(0, k % SAMPLES).hypot(from(1, k / SAMPLES)) <= radius;
    (0..SAMPLES * SAMPLES).filter(within).count() as u8
}

/// A pixel's share of a dot.
struct Fragment {
    pixel: u32,
    /// Red, green, blue, and subdivisions of the pixel.
    ink: [u8; 4],
}

/// Rows of a bitmap. Dots are added from the front, and what they hide is left out; the rest is painted from the back.
struct Strip<'a> {
    top: i32,
    width: i32,
    height: i32,
    pixels: &'a mut [[u8; 4]],
    is_hidden: Vec<bool>,
    fragments: Vec<Fragment>,
}

impl Strip<'_> {
    fn new(top: usize, width: usize, pixels: &mut [[u8; 4]]) -> Strip<'_> {
        let is_hidden = vec![false; pixels.len()];
        let [top, width, height] = [top, width, pixels.len() / width].map(|x| x as i32);
        Strip { top, width, height, pixels, is_hidden, fragments: Vec::new() }
    }

    /// Adds a dot behind those before.
    fn add(&mut self, dot: &Placed, discs: &Discs) {
        let Strip { top, width, height, is_hidden, fragments, .. } = self;
        let (width, height) = (*width, *height);
        let [x, y] = [dot.pixel[0], dot.pixel[1] - *top];
        let Colour { red, green, blue, .. } = dot.colour;
        for spot in &discs.spots[dot.disc] {
            let (column, row) = (x + spot.at[0], y + spot.at[1]);
            if !((0..width).contains(&column) && (0..height).contains(&row)) {
                continue;
            }
            let pixel = (row * width + column) as u32;
            let is_hidden = &mut is_hidden[pixel as usize];
            if *is_hidden {
                continue;
            }
            *is_hidden = spot.cover == WHOLE;
            let mut ink = [red, green, blue, spot.cover];
            if discs.has_rim {
                let Colour { red, green, blue, .. } = dot.rim.mix(dot.colour, spot.inner);
                ink = [red, green, blue, spot.cover];
            }
            fragments.push(Fragment { pixel, ink });
        }
    }

    fn paint(self) {
        let mut opacity = vec![0.0; self.pixels.len()];
        for Fragment { pixel, ink: [red, green, blue, cover] } in self.fragments.into_iter().rev() {
            let (below, opacity) = (&mut self.pixels[pixel as usize], &mut opacity[pixel as usize]);
            let (colour, cover, whole) = ([red, green, blue], u32::from(cover), u32::from(WHOLE));
            if *opacity == 1.0 {
                for (below, top) in below.iter_mut().zip(colour) {
                    *below = (((whole - cover) * u32::from(*below) + cover * u32::from(top) + whole / 2) / whole) as u8;
                }
            } else {
                let alpha = f64::from(cover) / f64::from(whole);
                *opacity = alpha + *opacity * (1.0 - alpha);
                for (below, top) in below.iter_mut().zip(colour) {
                    let [from, to] = [*below, top].map(f64::from);
                    *below = (from + alpha / *opacity * (to - from) + 0.5) as u8;
                }
                below[3] = (255.0 * *opacity).round() as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIP: Rect = Rect { left: 20.3, top: 31.9, width: 37.0, height: 25.0 };

    /// Dots in and around the clip, by a linear congruential generator.
    fn dots(count: usize) -> Vec<Dot> {
        let mut state = 12345u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let dot = |_| Dot {
            at: [CLIP.left + 41.0 * random() - 2.0, CLIP.top + 29.0 * random() - 2.0],
            colour: Colour::hex((random() * f64::from(0x1000000)) as u32),
        };
        (0..count).map(dot).chain([Dot { at: [-1e300, 1e300], colour: Colour::INK }]).collect()
    }

    /// One dot after the other from the back, each over what is there.
    fn painted_plainly(dots: &[Dot], radius: f64, rim: f64, width: usize, height: usize) -> Vec<[u8; 4]> {
        let scale = DOTS_PER_INCH / 72.0;
        let discs = Discs::new(radius * scale, (radius - rim) * scale);
        let corner = [CLIP.left, CLIP.top].map(|x| (x * scale).floor() / scale);
        let mut page = vec![Colour::WHITE.with_alpha(0.0); width * height];
        for dot in dots {
            let placed = discs.place(dot, corner, scale);
            for spot in &discs.spots[placed.disc] {
                let [x, y] = [0, 1].map(|k| placed.pixel[k] + spot.at[k]);
                if (0..width as i32).contains(&x) && (0..height as i32).contains(&y) {
                    let below = &mut page[y as usize * width + x as usize];
                    let top = dot.rim().mix(dot.colour, spot.inner);
                    let alpha = f64::from(spot.cover) / 64.0;
                    let total = alpha + below.alpha * (1.0 - alpha);
                    *below = below.mix(top, alpha / total).with_alpha(total);
                }
            }
        }
        page.iter().map(|p| [p.red, p.green, p.blue, (255.0 * p.alpha).round() as u8]).collect()
    }

    #[test]
    fn strips_give_the_picture_of_one_dot_after_the_other_on_any_number_of_threads() {
        for (count, radius, rim) in [(4000, 0.36, 0.0), (1500, 0.8, 0.3), (60, 2.4, 0.0), (0, 1.0, 0.0)] {
            let dots = dots(count);
            let bitmap = Bitmap::new(&dots, CLIP, radius, rim);
            assert!(bitmap.height() > 3 * STRIP && bitmap.rect().contains([CLIP.left, CLIP.top]));
            let plain = painted_plainly(&dots, radius, rim, bitmap.width, bitmap.height());
            let differing = bitmap.pixels.iter().zip(&plain).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{count} dots of {radius} pt");
            for threads in [1, 5] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                assert!(pool.install(|| Bitmap::new(&dots, CLIP, radius, rim)).pixels == bitmap.pixels);
            }
        }
    }
}
