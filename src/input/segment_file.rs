//! `[[segment]]` blocks of a scene file.

use super::error::{InputError, Problem};
use super::toml::Reader;
use crate::model::{
    Body, Coil, CoilWinding, Density, Flexible, MagnetMaterial, MagnetQuantity, Node, Profile, Rigid, Segment,
    SegmentKind, ShearElasticity, Stiffness, Vector, closest, short_name,
};

const FLEXIBLE_KEYS: [&str; 18] = [
    "name",
    "kind",
    "length",
    "tube",
    "diameter",
    "youngs_modulus",
    "shear_modulus",
    "poisson_ratio",
    "stiffness",
    "stiffness_shear",
    "stiffness_axial",
    "density",
    "linear_density",
    "rest_curvature",
    "dipole_per_length",
    "remanence",
    "magnetization",
    "volume_fraction",
];
const RIGID_KEYS: [&str; 12] = [
    "name",
    "kind",
    "length",
    "mass",
    "coil",
    "dipole_per_length",
    "tube",
    "diameter",
    "density",
    "remanence",
    "magnetization",
    "volume_fraction",
];
const COIL_KEYS: [&str; 5] = ["turns", "area", "turns_area", "current", "alignment"];
/// First words of parameter names that are not segments.
const RESERVED: [&str; 8] = ["base", "field", "loads", "insertion", "model", "scene", "magnets", "maps"];

/// Characters of a name: it stands in columns, messages and figures.
const MOST_CHARACTERS: usize = 100;

/// Reads a `[[segment]]` block.
pub(crate) fn segment(reader: &Reader) -> Result<Segment, InputError> {
    let kind =
        reader.string("kind")?.ok_or_else(|| reader.missing("kind", "write kind = \"flexible\" or \"rigid\""))?;
    let name = reader.string("name")?.ok_or_else(|| {
        reader.missing("name", "parameters of a segment start with its name, such as name = \"proximal\"")
    })?;
    check_name(reader, name)?;
    let length = |reader: &Reader| -> Result<f64, InputError> {
        let length = reader.quantity("length", "m")?;
        length.ok_or_else(|| reader.missing("length", "give the segment's length, such as \"13 mm\""))
    };
    let (length, kind) = match kind {
        "flexible" => {
            check_segment_keys(reader, &FLEXIBLE_KEYS, &RIGID_KEYS, "a rigid")?;
            (length(reader)?, SegmentKind::Flexible(flexible(reader)?))
        }
        "rigid" => {
            check_segment_keys(reader, &RIGID_KEYS, &FLEXIBLE_KEYS, "a flexible")?;
            (length(reader)?, SegmentKind::Rigid(rigid(reader)?))
        }
        other => {
            let suggestion = closest(other, ["flexible", "rigid"].into_iter());
            let allowed = "flexible, rigid".into();
            return Err(reader.error("kind", Problem::Choice { found: other.into(), suggestion, allowed }));
        }
    };
    Ok(Segment { name: name.into(), length, kind })
}

pub(super) fn check_name(reader: &Reader, name: &str) -> Result<(), InputError> {
    let plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    let expected = if !plain {
        "a name of letters, digits, _ and -".to_owned()
    } else if name.chars().nth(MOST_CHARACTERS).is_some() {
        format!("a name of at most {MOST_CHARACTERS} characters")
    } else if RESERVED.contains(&name) {
        format!("another name: `{name}` already starts other parameters")
    } else {
        return Ok(());
    };
    Err(reader.error("name", Problem::Range { value: format!("\"{}\"", short_name(name)), expected }))
}

fn check_segment_keys(
    reader: &Reader,
    own: &[&'static str],
    other: &[&'static str],
    other_kind: &str,
) -> Result<(), InputError> {
    for name in reader.names() {
        if other.contains(&name.as_str()) && !own.contains(&name.as_str()) {
            let with = "kind".to_owned();
            let remedy = format!("only {other_kind} segment has it: change `kind`, or remove it");
            return Err(reader.error(&name, Problem::Conflict { with, remedy }));
        }
    }
    reader.check_keys(own)
}

/// At most one of two keys.
pub(super) fn exclusive(reader: &Reader, one: &str, other: &str) -> Result<(), InputError> {
    if reader.has(one) && reader.has(other) {
        let remedy = "keep one of the two".into();
        return Err(reader.error(one, Problem::Conflict { with: other.into(), remedy }));
    }
    Ok(())
}

fn flexible(reader: &Reader) -> Result<Flexible, InputError> {
    for modulus in ["tube", "diameter", "youngs_modulus", "shear_modulus", "poisson_ratio"] {
        exclusive(reader, "stiffness", modulus)?;
    }
    exclusive(reader, "shear_modulus", "poisson_ratio")?;
    exclusive(reader, "density", "linear_density")?;
    let density = match (reader.quantity("density", "kg/m³")?, reader.quantity("linear_density", "kg/m")?) {
        (Some(density), _) => Some(Density::Volume(density)),
        (None, density) => density.map(Density::Linear),
    };
    let magnet = magnet(reader, !reader.has("stiffness"))?;
    Ok(Flexible {
        stiffness: stiffness(reader)?,
        rest_curvature: rest_curvature(reader)?,
        stiffness_shear: stiffness_shear(reader)?,
        stiffness_axial: reader.quantity("stiffness_axial", "N")?,
        density,
        dipole_per_length: reader.vector("dipole_per_length", "A·m")?,
        magnet,
    })
}

/// The magnetic material of a data sheet; `has_volume`: whether a cross-section is given.
fn magnet(reader: &Reader, has_volume: bool) -> Result<Option<MagnetMaterial>, InputError> {
    exclusive(reader, "remanence", "magnetization")?;
    let quantities = [MagnetQuantity::Remanence, MagnetQuantity::Magnetization];
    let Some(quantity) = quantities.into_iter().find(|quantity| reader.has(quantity.name())) else {
        if reader.has("volume_fraction") {
            return Err(reader.missing("remanence", "`volume_fraction` is its share: give remanence or magnetization"));
        }
        return Ok(None);
    };
    let name = quantity.name();
    if reader.has("dipole_per_length") {
        let remedy = format!("keep one of the two: `{name}` times the cross-section is the dipole per length");
        return Err(reader.error(name, Problem::Conflict { with: "dipole_per_length".into(), remedy }));
    }
    if !has_volume {
        let remedy = format!("`{name}` times a volume is the dipole: give tube, or diameter of a solid cylinder");
        return Err(reader.missing("tube", remedy));
    }
    let is_along = !reader.is_list(name);
    let value = match is_along {
        true => [0.0, 0.0, reader.quantity(name, quantity.unit())?.unwrap_or_default()],
        false => reader.vector(name, quantity.unit())?.unwrap_or_default(),
    };
    Ok(Some(MagnetMaterial { quantity, value, is_along, volume_fraction: reader.quantity("volume_fraction", "")? }))
}

/// Inner and outer radius of a tube, or of a solid cylinder by its diameter (m)
fn radii(reader: &Reader) -> Result<Option<[f64; 2]>, InputError> {
    exclusive(reader, "diameter", "tube")?;
    if let Some(diameter) = reader.quantity("diameter", "m")? {
        return Ok(Some([0.0, 0.5 * diameter]));
    }
    let Some(tube) = reader.table("tube")? else { return Ok(None) };
    tube.check_keys(&["inner_radius", "outer_radius"])?;
    let radius = |name: &str| -> Result<f64, InputError> {
        tube.quantity(name, "m")?.ok_or_else(|| tube.missing(name, "give a radius such as \"1.3 mm\""))
    };
    Ok(Some([radius("inner_radius")?, radius("outer_radius")?]))
}

fn rest_curvature(reader: &Reader) -> Result<Profile, InputError> {
    if !reader.is_node_list("rest_curvature") {
        return Ok(Profile::Constant(reader.vector("rest_curvature", "1/m")?.unwrap_or_default()));
    }
    let node = |node: Reader| {
        node.check_keys(&["at", "value"])?;
        let value = node.vector("value", "1/m")?;
        let value = value.ok_or_else(|| node.missing("value", "give the rest curvature there, such as [2.0, 0, 0]"))?;
        Ok(Node { at: node_position(&node)?, value })
    };
    let nodes = reader.nodes("rest_curvature", "{ at = \"10 mm\", value = [2.0, 0, 0] }")?;
    nodes.into_iter().map(node).collect::<Result<_, _>>().map(Profile::Nodes)
}

fn node_position(node: &Reader) -> Result<f64, InputError> {
    let remedy = "give the distance from the segment's proximal end, such as \"10 mm\"";
    node.quantity("at", "m")?.ok_or_else(|| node.missing("at", remedy))
}

/// One number for both axes, or `[x, y]`.
fn stiffness_shear(reader: &Reader) -> Result<Option<[f64; 2]>, InputError> {
    if reader.is_list("stiffness_shear") {
        return reader.pair("stiffness_shear", "N");
    }
    Ok(reader.quantity("stiffness_shear", "N")?.map(|shear| [shear; 2]))
}

/// EIx, EIy, GJ.
fn principal(reader: &Reader) -> Result<Vector, InputError> {
    exclusive(reader, "bending", "bending_x")?;
    exclusive(reader, "bending", "bending_y")?;
    let get = |name: &str| -> Result<f64, InputError> {
        let value = match reader.quantity("bending", "N·m²")? {
            Some(bending) if name != "torsion" => Some(bending),
            _ => reader.quantity(name, "N·m²")?,
        };
        value.ok_or_else(|| reader.missing(name, "give it in N·m², such as \"2e-5 N·m²\""))
    };
    Ok([get("bending_x")?, get("bending_y")?, get("torsion")?])
}

fn stiffness(reader: &Reader) -> Result<Stiffness, InputError> {
    if reader.is_node_list("stiffness") {
        let node = |node: Reader| {
            node.check_keys(&["at", "bending", "bending_x", "bending_y", "torsion"])?;
            Ok(Node { at: node_position(&node)?, value: principal(&node)? })
        };
        let nodes = reader.nodes("stiffness", "{ at = \"10 mm\", bending = 2e-5, torsion = 2e-5 }")?;
        return nodes.into_iter().map(node).collect::<Result<_, _>>().map(Stiffness::Nodes);
    }
    if let Some(stiffness) = reader.table("stiffness")? {
        stiffness.check_keys(&["bending", "bending_x", "bending_y", "torsion"])?;
        let [bending_x, bending_y, torsion] = principal(&stiffness)?;
        return Ok(Stiffness::Direct { bending_x, bending_y, torsion });
    }
    let Some([inner_radius, outer_radius]) = radii(reader)? else {
        return Err(reader.missing(
            "tube",
            "give tube = { inner_radius, outer_radius } with moduli, or stiffness = { bending_x, bending_y, torsion }",
        ));
    };
    let youngs_modulus = reader.quantity("youngs_modulus", "Pa")?;
    let youngs_modulus =
        youngs_modulus.ok_or_else(|| reader.missing("youngs_modulus", "give a modulus such as \"31.03 MPa\""))?;
    let shear = match (reader.quantity("shear_modulus", "Pa")?, reader.quantity("poisson_ratio", "")?) {
        (Some(modulus), _) => ShearElasticity::Modulus(modulus),
        (None, Some(ratio)) => ShearElasticity::PoissonRatio(ratio),
        (None, None) => return Err(reader.missing("shear_modulus", "give shear_modulus, or poisson_ratio instead")),
    };
    Ok(Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear })
}

fn rigid(reader: &Reader) -> Result<Rigid, InputError> {
    let mass = reader.quantity("mass", "kg")?;
    let dipole_per_length = reader.vector("dipole_per_length", "A·m")?;
    if reader.has("mass") && reader.has("density") {
        let remedy = "keep one of the two: `density` times the volume is the mass".into();
        return Err(reader.error("density", Problem::Conflict { with: "mass".into(), remedy }));
    }
    let radii = radii(reader)?;
    let magnet = magnet(reader, radii.is_some())?;
    let density = reader.quantity("density", "kg/m³")?;
    if density.is_some() && radii.is_none() {
        return Err(
            reader.missing("tube", "`density` times a volume is the mass: give tube, or diameter of a solid cylinder")
        );
    }
    let body = radii.map(|[inner_radius, outer_radius]| Body { inner_radius, outer_radius, density });
    let rigid = Rigid { mass, coil: None, dipole_per_length, body, magnet };
    let Some(coil) = reader.table("coil")? else { return Ok(rigid) };
    coil.check_keys(&COIL_KEYS)?;
    exclusive(&coil, "turns_area", "turns")?;
    exclusive(&coil, "turns_area", "area")?;
    let winding = match coil.matrix("turns_area", "m²")? {
        Some(matrix) => CoilWinding::Matrix(matrix),
        None => {
            let turns = coil.vector("turns", "")?;
            let turns = turns.ok_or_else(|| coil.missing("turns", "give turns and area, or turns_area instead"))?;
            let area = coil.vector("area", "m²")?;
            let area = area.ok_or_else(|| coil.missing("area", "give the area of one turn of each coil"))?;
            CoilWinding::Axes { turns, area }
        }
    };
    let current = coil.vector("current", "A")?.unwrap_or_default();
    let alignment = coil.vector("alignment", "rad")?.unwrap_or_default();
    Ok(Rigid { coil: Some(Coil { winding, current, alignment }), ..rigid })
}
