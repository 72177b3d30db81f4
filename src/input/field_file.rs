//! `[field]`, `[[magnet]]` and `[[coil_array]]` of a scene file.

use super::error::{InputError, Problem};
use super::map::field_maps;
use super::segment_file::{check_name, exclusive};
use super::toml::Reader;
use crate::model::{
    CoilArray, DEFAULT_CLEARANCE, FieldSources, GradientEntry, Magnet, MagnetBody, MagnetShape, UnitDipole, Vector,
    closest, mri_gradient,
};

const FIELD_KEYS: [&str; 4] = ["flux_density", "gradient", "mri_gradient", "origin"];
const MAGNET_KEYS: [&str; 13] = [
    "name",
    "position",
    "moment",
    "remanence",
    "diameter",
    "inner_diameter",
    "length",
    "size",
    "axis",
    "field",
    "rotation",
    "strength",
    "clearance",
];
/// Clearance of a magnet whose field is exact, over its radius, or over half of a cuboid's longest edge.
const EXACT_CLEARANCE: f64 = 0.035;
/// A gradient given as a matrix may miss symmetry and trace by this share of its largest entry.
const MATRIX_TOLERANCE: f64 = 1e-6;

/// The uniform field.
pub(super) fn flux_density(reader: &Reader) -> Result<Vector, InputError> {
    let Some(field) = reader.table("field")? else { return Ok([0.0; 3]) };
    field.check_keys(&FIELD_KEYS)?;
    Ok(field.vector("flux_density", "T")?.unwrap_or_default())
}

/// What is added to it and varies in space.
pub(super) fn sources(reader: &Reader) -> Result<FieldSources, InputError> {
    let mut sources = FieldSources::default();
    if let Some(field) = reader.table("field")? {
        sources.gradient = gradient(&field)?;
        sources.origin = field.vector("origin", "m")?.unwrap_or_default();
        if field.has("origin") && sources.gradient.is_none() {
            return Err(
                field.missing("gradient", "`origin` is where the gradient adds nothing: give one, or leave it out")
            );
        }
    }
    sources.magnets = reader.tables("magnet")?.iter().map(magnet).collect::<Result<_, _>>()?;
    sources.arrays = reader.tables("coil_array")?.iter().map(coil_array).collect::<Result<_, _>>()?;
    sources.maps = field_maps(reader)?;
    Ok(sources)
}

fn gradient(field: &Reader) -> Result<Option<[f64; 5]>, InputError> {
    exclusive(field, "gradient", "mri_gradient")?;
    if let Some(gradient) = field.vector("mri_gradient", "T/m")? {
        return Ok(Some(mri_gradient(gradient)));
    }
    if field.is_list("gradient") {
        return field.matrix("gradient", "T/m")?.map(|rows| from_matrix(field, rows)).transpose();
    }
    let Some(table) = field.table("gradient")? else { return Ok(None) };
    table.check_keys(&["xx", "xy", "xz", "yy", "yz", "zz"])?;
    let mut entries = [0.0; 5];
    for entry in GradientEntry::ALL {
        entries[entry.index()] = table.quantity(entry.name(), "T/m")?.unwrap_or(0.0);
    }
    if let Some(zz) = table.quantity("zz", "T/m")? {
        let [xx, .., yy, _] = entries;
        let largest = entries.iter().fold(zz.abs(), |largest: f64, x| largest.max(x.abs()));
        if (xx + yy + zz).abs() > MATRIX_TOLERANCE * largest {
            let expected = format!("-(xx + yy) = {} T/m, or leave it out: div B = 0", -(xx + yy));
            return Err(table.error("zz", Problem::Range { value: format!("{zz} T/m"), expected }));
        }
    }
    Ok(Some(entries))
}

fn from_matrix(field: &Reader, rows: [Vector; 3]) -> Result<[f64; 5], InputError> {
    let largest = rows.as_flattened().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let wrong = |value: String, expected: &str| {
        Err(field.error("gradient", Problem::Range { value, expected: expected.into() }))
    };
    let trace = rows[0][0] + rows[1][1] + rows[2][2];
    if trace.abs() > MATRIX_TOLERANCE * largest {
        return wrong(format!("a matrix of trace {trace} T/m"), "one of trace zero: div B = 0");
    }
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        if (rows[i][j] - rows[j][i]).abs() > MATRIX_TOLERANCE * largest {
            let value = format!("a matrix with {} at [{i}][{j}] and {} at [{j}][{i}]", rows[i][j], rows[j][i]);
            return wrong(value, "a symmetric one: curl B = 0 where no current flows");
        }
    }
    let mean = |i: usize, j: usize| 0.5 * (rows[i][j] + rows[j][i]);
    Ok([rows[0][0], mean(0, 1), mean(0, 2), rows[1][1], mean(1, 2)])
}

fn magnet(reader: &Reader) -> Result<Magnet, InputError> {
    reader.check_keys(&MAGNET_KEYS)?;
    let name = reader.string("name")?;
    let name = name.ok_or_else(|| {
        reader.missing("name", "parameters of a magnet start with `magnets.` and its name, such as name = \"em1\"")
    })?;
    check_name(reader, name)?;
    let position = reader.vector("position", "m")?;
    let position = position.ok_or_else(|| reader.missing("position", "give the magnet's centre in the world frame"))?;
    exclusive(reader, "moment", "remanence")?;
    let body = body(reader)?;
    let moment = match (reader.vector("moment", "A·m²")?, reader.quantity("remanence", "T")?, &body) {
        (Some(moment), ..) => moment,
        (None, Some(remanence), Some(body)) => body.shape.moment(remanence, direction(reader, body)?),
        (None, Some(_), None) => {
            return Err(reader.missing(
                "axis",
                "with `remanence` give axis, diameter and length, or axis and size: Br V / mu0 is the moment",
            ));
        }
        (None, None, _) => {
            return Err(reader.missing(
                "moment",
                "give moment in A·m², or remanence with axis, diameter and length (of a cuboid axis and size)",
            ));
        }
    };
    let clearance = match (reader.quantity("clearance", "m")?, &body) {
        (Some(clearance), _) => clearance,
        (None, Some(MagnetBody { shape: MagnetShape::Cylinder { diameter, .. }, is_exact: true })) => {
            EXACT_CLEARANCE * 0.5 * diameter
        }
        (None, Some(body)) if body.is_exact => EXACT_CLEARANCE * 0.5 * body.shape.extent(),
        (None, Some(body)) => 0.5 * body.shape.extent(),
        (None, None) => reader.quantity("diameter", "m")?.map_or(DEFAULT_CLEARANCE, |diameter| 0.5 * diameter),
    };
    Ok(Magnet {
        name: name.into(),
        position,
        moment,
        rotation: reader.vector("rotation", "rad")?.unwrap_or_default(),
        strength: reader.quantity("strength", "")?.unwrap_or(1.0),
        body,
        clearance,
    })
}

/// The direction in which a magnet with a size is magnetised.
fn direction(reader: &Reader, body: &MagnetBody) -> Result<Vector, InputError> {
    match body.shape {
        MagnetShape::Cylinder { axis, .. } => Ok(axis),
        MagnetShape::Cuboid(_) => {
            let axis = reader.vector("axis", "")?;
            let axis = axis.ok_or_else(|| {
                reader.missing(
                    "axis",
                    "with `remanence` and `size` give the direction of magnetisation, such as axis = [0, 0, 1]",
                )
            })?;
            unit(reader, axis)
        }
    }
}

/// A cuboid, by `size`.
fn cuboid(reader: &Reader, size: Vector) -> Result<MagnetBody, InputError> {
    for key in ["diameter", "length", "inner_diameter"] {
        exclusive(reader, "size", key)?;
    }
    // A moment has its direction.
    exclusive(reader, "axis", "moment")?;
    Ok(MagnetBody { shape: MagnetShape::Cuboid(size), is_exact: is_exact(reader)? })
}

/// A cuboid, a cylinder or a ring; a diameter alone is that of a sphere, which is a dipole.
fn body(reader: &Reader) -> Result<Option<MagnetBody>, InputError> {
    if let Some(size) = reader.vector("size", "m")? {
        return cuboid(reader, size).map(Some);
    }
    let (axis, length) = (reader.vector("axis", "")?, reader.quantity("length", "m")?);
    let diameter = reader.quantity("diameter", "m")?;
    let bore = reader.quantity("inner_diameter", "m")?;
    let is_exact = is_exact(reader)?;
    let (Some(axis), Some(length), Some(diameter)) = (axis, length, diameter) else {
        let given = [("axis", axis.is_some()), ("length", length.is_some()), ("inner_diameter", bore.is_some())];
        if let Some((name, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
            let remedy = format!("a cylinder has axis, diameter and length, and `{name}` is given");
            let missing = [("axis", axis.is_none()), ("length", length.is_none()), ("diameter", diameter.is_none())];
            let lacking = missing.into_iter().find(|(_, lacks)| *lacks).map_or("diameter", |(name, _)| name);
            return Err(reader.missing(lacking, remedy));
        }
        if is_exact {
            let remedy = "field = \"exact\" is that of a cylinder or a cuboid: give axis, diameter and length, or size";
            return Err(reader.missing("axis", remedy));
        }
        return Ok(None);
    };
    let shape = MagnetShape::Cylinder { axis: unit(reader, axis)?, length, diameter, bore: bore.unwrap_or(0.0) };
    Ok(Some(MagnetBody { shape, is_exact }))
}

/// `axis`, of length one.
fn unit(reader: &Reader, axis: Vector) -> Result<Vector, InputError> {
    let size = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_direction = size.is_finite() && size > 0.0;
    if !is_direction {
        let expected = "a direction other than zero".into();
        return Err(reader.error("axis", Problem::Range { value: format!("{axis:?}"), expected }));
    }
    // What already has length one stays as it is, so that a scene written and read again is the same.
    Ok(if (size - 1.0).abs() < 4.0 * f64::EPSILON { axis } else { axis.map(|x| x / size) })
}

/// Whether the field of the magnet's shape is asked for, in place of that of a few dipoles.
fn is_exact(reader: &Reader) -> Result<bool, InputError> {
    const WORDS: [&str; 2] = ["dipoles", "exact"];
    let Some(found) = reader.string("field")? else { return Ok(false) };
    if !WORDS.contains(&found) {
        let suggestion = closest(found, WORDS.into_iter());
        let problem = Problem::Choice { found: found.into(), suggestion, allowed: WORDS.join(", ") };
        return Err(reader.error("field", problem));
    }
    Ok(found == WORDS[1])
}

fn coil_array(reader: &Reader) -> Result<CoilArray, InputError> {
    reader.check_keys(&["name", "current", "clearance", "coil"])?;
    let name = reader.string("name")?;
    let name =
        name.ok_or_else(|| reader.missing("name", "parameters of an array start with its name, such as \"array\""))?;
    check_name(reader, name)?;
    let coils: Vec<Vec<UnitDipole>> = reader.tables("coil")?.iter().map(coil).collect::<Result<_, _>>()?;
    if coils.is_empty() {
        return Err(reader.missing("coil", "add a [[coil_array.coil]] block with its dipoles"));
    }
    let current = reader.quantities("current", "A")?.unwrap_or_else(|| vec![0.0; coils.len()]);
    let clearance = reader.quantity("clearance", "m")?.unwrap_or(DEFAULT_CLEARANCE);
    Ok(CoilArray { name: name.into(), current, coils, clearance })
}

fn coil(reader: &Reader) -> Result<Vec<UnitDipole>, InputError> {
    reader.check_keys(&["dipoles"])?;
    let dipole = |reader: &Reader| {
        reader.check_keys(&["position", "moment_per_ampere"])?;
        let position = reader.vector("position", "m")?;
        let moment = reader.vector("moment_per_ampere", "m²")?;
        Ok(UnitDipole {
            position: position
                .ok_or_else(|| reader.missing("position", "give the dipole's place in the world frame"))?,
            moment_per_ampere: moment
                .ok_or_else(|| reader.missing("moment_per_ampere", "give the dipole per ampere, in A·m²/A = m²"))?,
        })
    };
    let dipoles: Vec<UnitDipole> = reader.tables("dipoles")?.iter().map(dipole).collect::<Result<_, _>>()?;
    if dipoles.is_empty() {
        return Err(reader.missing("dipoles", "give at least one { position, moment_per_ampere }"));
    }
    Ok(dipoles)
}
