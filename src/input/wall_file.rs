//! `[wall]` of a scene file.

use super::error::{InputError, Problem};
use super::toml::Reader;
use super::words::choice;
use crate::model::{Scene, Segment, Side, Surface, TipOnWall, Vector, Wall, WallShape};

const KEYS: [&str; 12] = [
    "kind",
    "position",
    "normal",
    "axis",
    "radius",
    "side",
    "rotation",
    "tip_radius",
    "stiffness",
    "friction",
    "tip",
    "anchor",
];
/// Keys that belong to some kinds alone, and to which.
const OF_KINDS: [(&str, &[Surface]); 4] = [
    ("normal", &[Surface::Plane]),
    ("axis", &[Surface::Cylinder]),
    ("radius", &[Surface::Sphere, Surface::Cylinder]),
    ("side", &[Surface::Sphere, Surface::Cylinder]),
];
const SURFACES: [Surface; 3] = [Surface::Plane, Surface::Sphere, Surface::Cylinder];
const SIDES: [Side; 2] = [Side::Inside, Side::Outside];
/// Words of `tip`: whether the tip is held.
const TIPS: [bool; 2] = [false, true];

/// The word for a surface in scene files.
pub(super) fn surface_word(surface: Surface) -> &'static str {
    match surface {
        Surface::Plane => "plane",
        Surface::Sphere => "sphere",
        Surface::Cylinder => "cylinder",
    }
}

/// The word for where the rod is.
pub(super) fn side_word(side: Side) -> &'static str {
    match side {
        Side::Inside => "inside",
        Side::Outside => "outside",
    }
}

/// The word for what the tip does on the wall.
pub(super) fn tip_word(sticks: bool) -> &'static str {
    if sticks { "sticks" } else { "slides" }
}

/// The wall of a scene with these segments.
pub(super) fn wall(reader: &Reader, segments: &[Segment]) -> Result<Option<Wall>, InputError> {
    if !reader.has("wall") {
        return Ok(None);
    }
    if !reader.is_table("wall") && reader.tables("wall").is_ok_and(|walls| !walls.is_empty()) {
        let expected = "one wall at a time: `[wall]`, not `[[wall]]`".into();
        return Err(reader.error("wall", Problem::Range { value: "a list of walls".into(), expected }));
    }
    let Some(table) = reader.table("wall")? else { return Ok(None) };
    if let Some(index) = segments.iter().position(|segment| segment.name == "wall") {
        let expected = "another name: with `[wall]` in the scene, `wall` already starts the wall's parameters".into();
        let key = format!("segment[{index}].name");
        return Err(reader.error(&key, Problem::Range { value: "\"wall\"".into(), expected }));
    }
    read(&table).map(Some)
}

/// A coil array that has the name of the wall's parameters.
pub(super) fn check_names(reader: &Reader, scene: &Scene) -> Result<(), InputError> {
    let named = scene.sources.arrays.iter().position(|array| array.name == "wall");
    let Some(index) = named.filter(|_| scene.wall.is_some()) else { return Ok(()) };
    let expected = "another name: with `[wall]` in the scene, `wall` already starts the wall's parameters".into();
    let key = format!("coil_array[{index}].name");
    Err(reader.error(&key, Problem::Range { value: "\"wall\"".into(), expected }))
}

fn read(wall: &Reader) -> Result<Wall, InputError> {
    wall.check_keys(&KEYS)?;
    let surface = choice(wall, "kind", &SURFACES, surface_word)?;
    let surface = surface.ok_or_else(|| wall.missing("kind", "write kind = \"plane\", \"sphere\" or \"cylinder\""))?;
    refuse_other_kinds(wall, surface)?;
    let position = wall.vector("position", "m")?;
    let position = position.ok_or_else(|| wall.missing("position", of_position(surface)))?;
    Ok(Wall {
        shape: shape(wall, surface)?,
        position,
        rotation: wall.vector("rotation", "rad")?.unwrap_or_default(),
        tip_radius: wall.quantity("tip_radius", "m")?.unwrap_or(0.0),
        stiffness: wall.quantity("stiffness", "N/m")?,
        friction: wall.quantity("friction", "")?,
        tip: tip(wall)?,
    })
}

fn of_position(surface: Surface) -> &'static str {
    match surface {
        Surface::Plane => "give a point of the plane, such as position = [0, 0, \"80 mm\"]",
        Surface::Sphere => "give the centre of the sphere, such as position = [0, 0, \"80 mm\"]",
        Surface::Cylinder => "give a point of the cylinder's axis, such as position = [0, 0, \"80 mm\"]",
    }
}

fn refuse_other_kinds(wall: &Reader, surface: Surface) -> Result<(), InputError> {
    for (name, kinds) in OF_KINDS {
        if wall.has(name) && !kinds.contains(&surface) {
            let kinds = kinds.iter().map(|kind| format!("a {}", surface_word(*kind))).collect::<Vec<_>>().join(" or ");
            let with = format!("kind = \"{}\"", surface_word(surface));
            let remedy = format!("this key belongs to {kinds}: remove it, or change `kind`");
            return Err(wall.error(name, Problem::Conflict { with, remedy }));
        }
    }
    Ok(())
}

fn shape(wall: &Reader, surface: Surface) -> Result<WallShape, InputError> {
    let direction = |name: &str, remedy: &str| -> Result<Vector, InputError> {
        wall.vector(name, "")?.ok_or_else(|| wall.missing(name, remedy))
    };
    let radius = || wall.quantity("radius", "m")?.ok_or_else(|| wall.missing("radius", "give one such as \"35 mm\""));
    let side = || {
        let side = choice(wall, "side", &SIDES, side_word)?;
        side.ok_or_else(|| wall.missing("side", "say where the rod is: side = \"inside\" or \"outside\""))
    };
    Ok(match surface {
        Surface::Plane => WallShape::Plane {
            normal: direction("normal", "give the direction from the plane to the rod, such as normal = [0, 0, -1]")?,
        },
        Surface::Sphere => WallShape::Sphere { radius: radius()?, side: side()? },
        Surface::Cylinder => WallShape::Cylinder {
            axis: direction("axis", "give the direction of the cylinder, such as axis = [0, 0, 1]")?,
            radius: radius()?,
            side: side()?,
        },
    })
}

fn tip(wall: &Reader) -> Result<TipOnWall, InputError> {
    let sticks = choice(wall, "tip", &TIPS, tip_word)?.unwrap_or(false);
    match (sticks, wall.vector("anchor", "m")?) {
        (false, None) => Ok(TipOnWall::Slides),
        (true, Some(anchor)) => Ok(TipOnWall::Sticks(anchor)),
        (true, None) => {
            let remedy = "a held tip needs one: give where the tip is held, such as anchor = [\"25 mm\", 0, \"80 mm\"], \
                          or write tip = \"slides\"";
            Err(wall.missing("anchor", remedy))
        }
        (false, Some(_)) => {
            let remedy = "a sliding tip has no anchor: write tip = \"sticks\", or remove it".into();
            Err(wall.error("anchor", Problem::Conflict { with: "tip = \"slides\"".into(), remedy }))
        }
    }
}
