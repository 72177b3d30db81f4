//! Camera, colours and colour maps of the figures, so that the page looks as they do.

use rodsweep::draw::{AZIMUTH, Colour, ColourMap, DrawnWall, ELEVATION, RodShape, Surroundings};
use serde_json::{Value, json};

/// Steps of a colour map on the page.
const STEPS: u32 = 256;

/// What the page takes from the figures.
pub fn style() -> Value {
    let map = |map: ColourMap| -> Vec<String> {
        (0..STEPS).map(|k| map.at(f64::from(k) / f64::from(STEPS - 1)).code()).collect()
    };
    json!({
        "azimuth": AZIMUTH,
        "elevation": ELEVATION,
        "colours": {
            "flexible": RodShape::FLEXIBLE_COLOUR.code(),
            "rigid": RodShape::RIGID_COLOUR.code(),
            "coil": RodShape::COIL_COLOUR.code(),
            "dipole": RodShape::DIPOLE_COLOUR.code(),
            "magnet": Surroundings::MAGNET_COLOUR.code(),
            "electromagnet": Surroundings::COIL_COLOUR.code(),
            // Hairlines that fade: more of the field's own colour than in figures.
            "line": Surroundings::LINE_COLOUR.mix(RodShape::FIELD_COLOUR, 0.35).code(),
            "field": RodShape::FIELD_COLOUR.code(),
            "force": RodShape::FORCE_COLOUR.code(),
            "wall": DrawnWall::COLOUR.code(),
            "wall_force": DrawnWall::FORCE_COLOUR.code(),
            "frame": RodShape::FRAME_COLOURS.map(Colour::code),
            "wrong": Colour::VERMILION.code(),
            "right": Colour::GREEN.code(),
            "grey": Colour::GREY.code(),
            "manipulability": Colour::SKY.code(),
            "compliance": Colour::PURPLE.code(),
        },
        "maps": { "sequential": map(ColourMap::Sequential), "diverging": map(ColourMap::Diverging) },
    })
}
