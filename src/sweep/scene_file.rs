//! Scene files: TOML with units to a `Scene`. Every mistake names file, line, key and remedy.

use super::error::{InputError, Problem};
use super::toml::{Reader, Source};
use crate::model::{
    Base, Coil, CoilWinding, Density, Flexible, Loads, Parameter, Rigid, Scene, SceneError, Segment, SegmentKind,
    ShearElasticity, Stiffness, closest,
};
use std::path::Path;

const SCENE_KEYS: [&str; 7] = ["name", "base", "field", "loads", "segment", "model", "insertion"];
const LOAD_KEYS: [&str; 5] = ["tip_force", "tip_moment", "gravity", "distributed_force", "fluid_density"];
const FLEXIBLE_KEYS: [&str; 11] = [
    "name",
    "kind",
    "length",
    "tube",
    "youngs_modulus",
    "shear_modulus",
    "poisson_ratio",
    "stiffness",
    "density",
    "linear_density",
    "rest_curvature",
];
const RIGID_KEYS: [&str; 5] = ["name", "kind", "length", "mass", "coil"];
const COIL_KEYS: [&str; 5] = ["turns", "area", "turns_area", "current", "alignment"];
/// First words of parameter names that are not segments.
const RESERVED: [&str; 6] = ["base", "field", "loads", "insertion", "model", "scene"];

/// Reads a scene file.
pub fn read_scene(file: &Path) -> Result<Scene, InputError> {
    parse_scene(file, &read_text(file)?)
}

/// Parses the text of a scene file; `file` names it in messages.
pub fn parse_scene(file: &Path, text: &str) -> Result<Scene, InputError> {
    let source = Source::parse(file, text)?;
    scene(&source.root())
}

/// What is unusual about a scene without being wrong.
pub fn scene_notes(scene: &Scene) -> Vec<String> {
    let mut notes = Vec::new();
    for segment in &scene.segments {
        if let SegmentKind::Flexible(Flexible {
            stiffness: Stiffness::Tube { youngs_modulus, shear: ShearElasticity::Modulus(shear_modulus), .. },
            ..
        }) = &segment.kind
        {
            let ratio = youngs_modulus / (2.0 * shear_modulus) - 1.0;
            if !(0.0..=0.5).contains(&ratio) {
                notes.push(format!(
                    "`{}`: Young's and shear modulus imply a Poisson ratio of {ratio:.2}, outside 0 to 0.5; both are used as given",
                    segment.name
                ));
            }
        }
    }
    notes
}

pub(super) fn read_text(file: &Path) -> Result<String, InputError> {
    let unreadable = |reason: String| InputError {
        file: file.into(),
        line: None,
        key: String::new(),
        problem: Problem::Unreadable(reason).into(),
    };
    let bytes = std::fs::read(file).map_err(|error| unreadable(error.to_string()))?;
    String::from_utf8(bytes).map_err(|_| unreadable("it is not UTF-8 text".into()))
}

/// Reads a scene from a table: a whole file, or `[scene]` of a sweep.
pub(super) fn scene(reader: &Reader) -> Result<Scene, InputError> {
    reader.check_keys(&SCENE_KEYS)?;
    let mut segments = Vec::new();
    for segment_reader in reader.tables("segment")? {
        let segment = segment(&segment_reader)?;
        if segments.iter().any(|other: &Segment| other.name == segment.name) {
            let problem = Problem::Scene(SceneError::DuplicateName(segment.name));
            return Err(segment_reader.error("name", problem));
        }
        segments.push(segment);
    }
    if segments.is_empty() {
        return Err(reader.missing("segment", "add a [[segment]] block with a name, a kind and a length"));
    }
    let mut scene = Scene {
        name: reader.string("name")?.unwrap_or_default().to_owned(),
        base: base(reader)?,
        flux_density: field(reader)?,
        loads: loads(reader)?,
        segments,
        rigid_force_arm: rigid_force_arm(reader)?,
    };
    if let Some(insertion) = reader.quantity("insertion", "m")? {
        insert(reader, &mut scene, insertion)?;
    }
    scene.validate().map_err(|error| located(reader, &scene, error))?;
    Ok(scene)
}

fn base(reader: &Reader) -> Result<Base, InputError> {
    let Some(base) = reader.table("base")? else { return Ok(Base::default()) };
    base.check_keys(&["position", "rotation"])?;
    Ok(Base {
        position: base.vector("position", "m")?.unwrap_or_default(),
        rotation: base.vector("rotation", "rad")?.unwrap_or_default(),
    })
}

fn field(reader: &Reader) -> Result<[f64; 3], InputError> {
    let Some(field) = reader.table("field")? else { return Ok([0.0; 3]) };
    field.check_keys(&["flux_density"])?;
    Ok(field.vector("flux_density", "T")?.unwrap_or_default())
}

fn loads(reader: &Reader) -> Result<Loads, InputError> {
    let Some(loads) = reader.table("loads")? else { return Ok(Loads::default()) };
    loads.check_keys(&LOAD_KEYS)?;
    Ok(Loads {
        tip_force: loads.vector("tip_force", "N")?,
        tip_moment: loads.vector("tip_moment", "N·m")?,
        gravity: loads.vector("gravity", "m/s²")?,
        distributed_force: loads.vector("distributed_force", "N/m")?,
        fluid_density: loads.quantity("fluid_density", "kg/m³")?,
    })
}

fn rigid_force_arm(reader: &Reader) -> Result<bool, InputError> {
    let Some(model) = reader.table("model")? else { return Ok(true) };
    model.check_keys(&["rigid_force_arm"])?;
    Ok(model.boolean("rigid_force_arm")?.unwrap_or(true))
}

/// The first segment gets what the others leave of the insertion.
fn insert(reader: &Reader, scene: &mut Scene, insertion: f64) -> Result<(), InputError> {
    if let SegmentKind::Rigid(_) = scene.segments[0].kind {
        let name = scene.segments[0].name.clone();
        return Err(reader.error("insertion", Problem::Plan(crate::model::PlanError::InsertionIntoRigid(name))));
    }
    let others: f64 = scene.segments[1..].iter().map(|segment| segment.length).sum();
    if insertion <= others {
        return Err(reader.error("insertion", Problem::InsertionTooShort { others }));
    }
    // A length is no derived stiffness: setting it cannot fail.
    let _ = Parameter::Insertion.set(scene, insertion);
    Ok(())
}

fn segment(reader: &Reader) -> Result<Segment, InputError> {
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
            not_modelled(reader)?;
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

fn check_name(reader: &Reader, name: &str) -> Result<(), InputError> {
    let plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    let expected = if !plain {
        "a name of letters, digits, _ and -".to_owned()
    } else if RESERVED.contains(&name) {
        format!("another name: `{name}` already starts other parameters")
    } else {
        return Ok(());
    };
    Err(reader.error("name", Problem::Range { value: format!("\"{name}\""), expected }))
}

/// Terms of a later version: refused with what to do instead.
fn not_modelled(reader: &Reader) -> Result<(), InputError> {
    let split = "split the segment into several, each with its own constant value";
    for name in ["rest_curvature", "stiffness"] {
        if reader.is_node_list(name) {
            return Err(reader.error(name, Problem::NotModelled { remedy: split }));
        }
    }
    for name in ["stiffness_axial", "stiffness_shear"] {
        if reader.has(name) {
            let remedy = "remove it: the rod neither stretches nor shears";
            return Err(reader.error(name, Problem::NotModelled { remedy }));
        }
    }
    Ok(())
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
fn exclusive(reader: &Reader, one: &str, other: &str) -> Result<(), InputError> {
    if reader.has(one) && reader.has(other) {
        let remedy = "keep one of the two".into();
        return Err(reader.error(one, Problem::Conflict { with: other.into(), remedy }));
    }
    Ok(())
}

fn flexible(reader: &Reader) -> Result<Flexible, InputError> {
    for modulus in ["tube", "youngs_modulus", "shear_modulus", "poisson_ratio"] {
        exclusive(reader, "stiffness", modulus)?;
    }
    exclusive(reader, "shear_modulus", "poisson_ratio")?;
    exclusive(reader, "density", "linear_density")?;
    let density = match (reader.quantity("density", "kg/m³")?, reader.quantity("linear_density", "kg/m")?) {
        (Some(density), _) => Some(Density::Volume(density)),
        (None, density) => density.map(Density::Linear),
    };
    let rest_curvature = reader.vector("rest_curvature", "1/m")?.unwrap_or_default();
    Ok(Flexible { stiffness: stiffness(reader)?, rest_curvature, density })
}

fn stiffness(reader: &Reader) -> Result<Stiffness, InputError> {
    if let Some(stiffness) = reader.table("stiffness")? {
        stiffness.check_keys(&["bending", "bending_x", "bending_y", "torsion"])?;
        exclusive(&stiffness, "bending", "bending_x")?;
        exclusive(&stiffness, "bending", "bending_y")?;
        let get = |name: &str| -> Result<f64, InputError> {
            let value = match stiffness.quantity("bending", "N·m²")? {
                Some(bending) if name != "torsion" => Some(bending),
                _ => stiffness.quantity(name, "N·m²")?,
            };
            value.ok_or_else(|| stiffness.missing(name, "give it in N·m², such as \"2e-5 N·m²\""))
        };
        return Ok(Stiffness::Direct {
            bending_x: get("bending_x")?,
            bending_y: get("bending_y")?,
            torsion: get("torsion")?,
        });
    }
    let Some(tube) = reader.table("tube")? else {
        return Err(reader.missing(
            "tube",
            "give tube = { inner_radius, outer_radius } with moduli, or stiffness = { bending_x, bending_y, torsion }",
        ));
    };
    tube.check_keys(&["inner_radius", "outer_radius"])?;
    let radius = |name: &str| -> Result<f64, InputError> {
        tube.quantity(name, "m")?.ok_or_else(|| tube.missing(name, "give a radius such as \"1.3 mm\""))
    };
    let (inner_radius, outer_radius) = (radius("inner_radius")?, radius("outer_radius")?);
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
    let Some(coil) = reader.table("coil")? else { return Ok(Rigid { mass, coil: None }) };
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
    Ok(Rigid { mass, coil: Some(Coil { winding, current, alignment }) })
}

/// Finds the key of the file that a model error is about.
fn located(reader: &Reader, scene: &Scene, error: SceneError) -> InputError {
    let key = match &error {
        SceneError::OutOfRange { name, .. } => file_key(reader, scene, name),
        SceneError::DensityWithoutTube { segment } => file_key(reader, scene, &format!("{segment}.density")),
        SceneError::DuplicateName(name) => file_key(reader, scene, &format!("{name}.name")),
        SceneError::GravityWithoutMass => "loads.gravity".into(),
        SceneError::NoSegment | SceneError::NoFlexible => "segment".into(),
    };
    reader.error(&key, Problem::Scene(error))
}

/// `coil.coil.area.x` becomes `segment[1].coil.area[0]`, or the nearest key around it that the file has.
fn file_key(reader: &Reader, scene: &Scene, name: &str) -> String {
    let mut key = match name.split_once('.') {
        Some((first, rest)) => match scene.segments.iter().position(|segment| segment.name == first) {
            Some(index) => format!("segment[{index}].{rest}"),
            None => name.to_owned(),
        },
        None => "segment".to_owned(),
    };
    for (component, index) in [(".x", "[0]"), (".y", "[1]"), (".z", "[2]")] {
        if let Some(vector) = key.strip_suffix(component) {
            key = format!("{vector}{index}");
        }
    }
    while !reader.source().contains(&reader.key(&key)) {
        match key.rfind(['.', '[']) {
            Some(at) => key.truncate(at),
            None => break,
        }
    }
    key
}
