//! Colours that stay apart for colour-blind readers and in print.

use std::f64::consts::PI;

/// A colour in sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// 0 to 255.
    pub red: u8,
    /// 0 to 255.
    pub green: u8,
    /// 0 to 255.
    pub blue: u8,
    /// Opacity, 0 to 1.
    pub alpha: f64,
}

impl Colour {
    /// Of text and of what matters.
    pub const INK: Colour = Colour::hex(0x1a1a1a);
    /// Of frames and notes.
    pub const MUTED: Colour = Colour::hex(0x595959);
    /// Of lines behind the data.
    pub const GRID: Colour = Colour::hex(0xe3e3e3);
    /// Of the walls behind a figure in space.
    pub const PANE: Colour = Colour::hex(0xf7f7f7);
    /// Paper.
    pub const WHITE: Colour = Colour::hex(0xffffff);
    /// Darker than ink.
    pub const BLACK: Colour = Colour::hex(0x000000);
    /// Of what stands back.
    pub const GREY: Colour = Colour::hex(0x8c8c8c);
    /// Of Okabe and Ito's palette, like those below.
    pub const ORANGE: Colour = Colour::hex(0xe69f00);
    /// A light blue.
    pub const SKY: Colour = Colour::hex(0x56b4e9);
    /// A bluish green.
    pub const GREEN: Colour = Colour::hex(0x009e73);
    /// Too light for lines.
    pub const YELLOW: Colour = Colour::hex(0xf0e442);
    /// The first of a series.
    pub const BLUE: Colour = Colour::hex(0x0072b2);
    /// Of what went wrong.
    pub const VERMILION: Colour = Colour::hex(0xd55e00);
    /// A reddish purple.
    pub const PURPLE: Colour = Colour::hex(0xcc79a7);

    /// Colours of series, in the order in which they are used.
    pub const SERIES: [Colour; 7] = [
        Colour::BLUE,
        Colour::VERMILION,
        Colour::GREEN,
        Colour::PURPLE,
        Colour::ORANGE,
        Colour::SKY,
        Colour::hex(0x4d4d4d),
    ];

    /// Of a code such as 0x0072b2, opaque.
    pub const fn hex(code: u32) -> Self {
        Self { red: (code >> 16) as u8, green: (code >> 8) as u8, blue: code as u8, alpha: 1.0 }
    }

    /// As `#rrggbb`, without the opacity.
    pub fn code(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.red, self.green, self.blue)
    }

    /// The same with an opacity, 0 to 1.
    pub fn with_alpha(self, alpha: f64) -> Self {
        Self { alpha, ..self }
    }

    /// Mixes in sRGB; 0 gives `self`, 1 gives `other`.
    pub fn mix(self, other: Colour, share: f64) -> Self {
        let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a)) + 0.5) as u8;
        Self {
            red: mix(self.red, other.red),
            green: mix(self.green, other.green),
            blue: mix(self.blue, other.blue),
            alpha: self.alpha + share * (other.alpha - self.alpha),
        }
    }
}

/// How a number becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Viridis, from dark violet to yellow.
    Sequential,
    /// Blue, white, red; lightness falls evenly on both sides.
    Diverging,
}

/// Viridis (CC0) at even steps.
const VIRIDIS: [u32; 20] = [
    0x440154, 0x481567, 0x482677, 0x453781, 0x404788, 0x39568c, 0x33638d, 0x2d708e, 0x287d8e, 0x238a8d, 0x1f968b,
    0x20a387, 0x29af7f, 0x3cbb75, 0x55c667, 0x73d055, 0x95d840, 0xb8de29, 0xdce319, 0xfde725,
];

impl ColourMap {
    /// Colour at `share` of the range, 0 to 1; held at both ends.
    pub fn at(self, share: f64) -> Colour {
        let share = share.clamp(0.0, 1.0);
        match self {
            ColourMap::Sequential => {
                let place = share * (VIRIDIS.len() - 1) as f64;
                let left = (place as usize).min(VIRIDIS.len() - 2);
                Colour::hex(VIRIDIS[left]).mix(Colour::hex(VIRIDIS[left + 1]), place - left as f64)
            }
            ColourMap::Diverging => {
                let signed = 2.0 * share - 1.0;
                let hue = if signed < 0.0 { 255.0 } else { 32.0 };
                oklch(0.94 - 0.52 * signed.abs(), 0.15 * signed.abs(), hue)
            }
        }
    }
}

/// Oklab's lightness, chroma and hue (deg) as sRGB.
fn oklch(lightness: f64, chroma: f64, hue: f64) -> Colour {
    let (a, b) = (chroma * (hue * PI / 180.0).cos(), chroma * (hue * PI / 180.0).sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    let channel = |linear: f64| {
        let linear = linear.clamp(0.0, 1.0);
        let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    };
    Colour {
        red: channel(4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s),
        green: channel(-1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s),
        blue: channel(-0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s),
        alpha: 1.0,
    }
}
