//! Camera, colours and colour maps of the figures, so that the page looks as they do.

use rodsweep::report::{AZIMUTH, Colour, ColourMap, ELEVATION, RodShape};
use serde_json::{Value, json};

/// Steps of a colour map on the page.
const STEPS: u32 = 256;

/// What the page takes from the figures.
pub fn style() -> Value {
    let map = |map: ColourMap| -> Vec<String> {
        (0..STEPS).map(|k| hex(map.at(f64::from(k) / f64::from(STEPS - 1)))).collect()
    };
    json!({
        "azimuth": AZIMUTH,
        "elevation": ELEVATION,
        "colours": {
            "flexible": hex(RodShape::FLEXIBLE_COLOUR),
            "rigid": hex(RodShape::RIGID_COLOUR),
            "coil": hex(RodShape::COIL_COLOUR),
            "dipole": hex(RodShape::DIPOLE_COLOUR),
            "field": hex(RodShape::FIELD_COLOUR),
            "force": hex(RodShape::FORCE_COLOUR),
            "frame": RodShape::FRAME_COLOURS.map(hex),
            "wrong": hex(Colour::VERMILION),
            "right": hex(Colour::GREEN),
            "grey": hex(Colour::GREY),
            "manipulability": hex(Colour::SKY),
            "compliance": hex(Colour::PURPLE),
        },
        "maps": { "sequential": map(ColourMap::Sequential), "diverging": map(ColourMap::Diverging) },
    })
}

fn hex(colour: Colour) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue)
}
