//! Scene files: TOML with units to a `Scene`. Every mistake names file, line, key and remedy.

use super::error::{InputError, Problem};
use super::force_file::AtTip;
use super::magnet_note::magnet_note;
use super::segment_file::segment;
use super::toml::{Reader, Source};
use super::{field_file, force_file, wall_file};
use crate::files;
use crate::model::{
    Base, CoilLoad, FieldMap, FieldSources, Flexible, InnerLoad, LOAD_KEYS, Loads, Parameter, Scene, SceneError,
    SegmentKind, ShearElasticity, Stiffness, closest,
};
use std::collections::HashSet;
use std::path::Path;

const SCENE_KEYS: [&str; 12] = [
    "name",
    "base",
    "field",
    "magnet",
    "coil_array",
    "field_map",
    "loads",
    "load",
    "wall",
    "segment",
    "model",
    "insertion",
];

/// Reads a scene file.
///
/// # Errors
///
/// A file that cannot be read, or any mistake in it.
pub fn read_scene(file: &Path) -> Result<Scene, InputError> {
    parse_scene(file, &read_text(file)?)
}

/// Parses the text of a scene file; `file` names it in messages.
///
/// # Errors
///
/// Any mistake in the text: syntax, unknown keys, units, values that make no scene.
pub fn parse_scene(file: &Path, text: &str) -> Result<Scene, InputError> {
    let source = Source::parse(file, text)?;
    scene(&source.root())
}

/// What is unusual about a scene without being wrong, and how well sampled fields obey Maxwell's equations.
pub fn scene_notes(scene: &Scene) -> Vec<String> {
    let mut notes: Vec<String> = scene.sources.maps.iter().map(FieldMap::summary).collect();
    notes.extend(scene.sources.magnets.iter().filter_map(magnet_note));
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

/// The text of a file of settings, at most 16 MiB.
///
/// # Errors
///
/// A file that cannot be read, is larger, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String, InputError> {
    files::read_settings(file).map_err(|error| InputError {
        file: file.into(),
        line: None,
        key: String::new(),
        problem: Problem::Unreadable(error.to_string()).into(),
    })
}

/// Reads a scene from a table: a whole file, or `[scene]` of a sweep.
pub(crate) fn scene(reader: &Reader) -> Result<Scene, InputError> {
    let scene = unjudged_scene(reader)?;
    scene.validate().map_err(|error| located(reader, &scene, error))?;
    Ok(scene)
}

/// The scene of a table, whose numbers may describe no rod.
pub(super) fn unjudged_scene(reader: &Reader) -> Result<Scene, InputError> {
    reader.check_keys(&SCENE_KEYS)?;
    let mut segments = Vec::new();
    let mut names = HashSet::new();
    for segment_reader in reader.tables("segment")? {
        let segment = segment(&segment_reader)?;
        if !names.insert(segment.name.clone()) {
            let problem = Problem::Scene(SceneError::DuplicateName(segment.name));
            return Err(segment_reader.error("name", problem));
        }
        segments.push(segment);
    }
    if segments.is_empty() {
        return Err(reader.missing("segment", "add a [[segment]] block with a name, a kind and a length"));
    }
    let (base, flux_density) = (base(reader)?, field_file::flux_density(reader)?);
    let sources = FieldSources { coil_load: coil_load(reader)?, ..field_file::sources(reader)? };
    let (loads, at_tip) = loads(reader, segments.len())?;
    let mut inner_loads = force_file::inner_loads(reader, &segments)?;
    inner_loads.extend(at_tip);
    let mut scene = Scene {
        name: reader.string("name")?.unwrap_or_default().to_owned(),
        base,
        flux_density,
        sources,
        loads,
        inner_loads,
        wall: wall_file::wall(reader, &segments)?,
        segments,
        inserted: 0.0,
        rigid_force_arm: rigid_force_arm(reader)?,
    };
    wall_file::check_names(reader, &scene)?;
    if let Some(insertion) = reader.quantity("insertion", "m")? {
        insert(reader, &mut scene, insertion)?;
    }
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

/// The loads of the whole rod and its tip, and those at the tip that turn with it.
fn loads(reader: &Reader, segments: usize) -> Result<(Loads, Vec<InnerLoad>), InputError> {
    let Some(loads) = reader.table("loads")? else { return Ok((Loads::default(), Vec::new())) };
    loads.check_keys(&LOAD_KEYS)?;
    let mut follow = Vec::new();
    let mut at_tip = |key, unit| {
        Ok(match force_file::at_tip(&loads, key, unit, segments)? {
            AtTip::Dead(vector) => vector,
            AtTip::Follows(load) => {
                follow.push(load);
                None
            }
        })
    };
    let (tip_force, tip_moment) = (at_tip("tip_force", "N")?, at_tip("tip_moment", "N·m")?);
    let loads = Loads {
        tip_force,
        tip_moment,
        gravity: loads.vector("gravity", "m/s²")?,
        distributed_force: loads.vector("distributed_force", "N/m")?,
        fluid_density: loads.quantity("fluid_density", "kg/m³")?,
    };
    Ok((loads, follow))
}

fn rigid_force_arm(reader: &Reader) -> Result<bool, InputError> {
    let Some(model) = reader.table("model")? else { return Ok(true) };
    model.check_keys(&["rigid_force_arm", "coil_load"])?;
    Ok(model.boolean("rigid_force_arm")?.unwrap_or(true))
}

fn coil_load(reader: &Reader) -> Result<CoilLoad, InputError> {
    let Some(model) = reader.table("model")? else { return Ok(CoilLoad::default()) };
    let Some(found) = model.string("coil_load")? else { return Ok(CoilLoad::default()) };
    CoilLoad::ALL.into_iter().find(|load| load.name() == found).ok_or_else(|| {
        let suggestion = closest(found, CoilLoad::ALL.iter().map(|load| load.name()));
        model.error(
            "coil_load",
            Problem::Choice { found: found.into(), suggestion, allowed: "distributed, middle".into() },
        )
    })
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
    // Insertion is no derived stiffness: setting it cannot fail.
    let _ = Parameter::Insertion.set(scene, insertion);
    scene.absorb_insertion();
    Ok(())
}

/// Finds the key of the file that a model error is about.
pub(super) fn located(reader: &Reader, scene: &Scene, error: SceneError) -> InputError {
    let key = match &error {
        SceneError::OutOfRange { name, .. } => file_key(reader, scene, name),
        SceneError::DensityWithoutTube { segment } => file_key(reader, scene, &format!("{segment}.density")),
        SceneError::DuplicateName(name) => file_key(reader, scene, &format!("{name}.name")),
        SceneError::GravityWithoutMass => "loads.gravity".into(),
        SceneError::NoSegment | SceneError::NoFlexible => "segment".into(),
        SceneError::MagnetisedInMap { segment } => {
            let keys = ["dipole_per_length", "remanence", "magnetization"];
            let of = |key: &&str| file_key(reader, scene, &format!("{segment}.{key}"));
            keys.iter().map(of).find(|key| keys.iter().any(|end| key.ends_with(end))).unwrap_or("segment".into())
        }
        SceneError::DuplicateSource(name) => source_key(scene, name, "name"),
        SceneError::CurrentsOfCoils { name, .. } => source_key(scene, name, "current"),
        SceneError::NoEnergyBesideWall if scene.loads.tip_moment.is_some() => "loads.tip_moment".into(),
        SceneError::NoEnergyBesideWall => force_file::key_without_energy(scene),
        SceneError::WallWithoutForceArm => "model.rigid_force_arm".into(),
        SceneError::DuplicateForce(_) | SceneError::MisplacedForce { .. } => {
            force_file::key(scene, &error).unwrap_or_else(|| "load".into())
        }
    };
    reader.error(&key, Problem::Scene(error))
}

/// A key of the last magnet, array of coils or map of a name.
fn source_key(scene: &Scene, name: &str, rest: &str) -> String {
    let sources = &scene.sources;
    let magnet = sources.magnets.iter().rposition(|magnet| magnet.name == name).map(|at| format!("magnet[{at}]"));
    let array = || sources.arrays.iter().rposition(|array| array.name == name).map(|at| format!("coil_array[{at}]"));
    let map = || sources.maps.iter().rposition(|map| map.name == name).map(|at| format!("field_map[{at}]"));
    format!("{}.{rest}", magnet.or_else(array).or_else(map).unwrap_or_else(|| "magnet".into()))
}

/// `coil.coil.area.x` becomes `segment[1].coil.area[0]`, or the nearest key around it that the file has.
fn file_key(reader: &Reader, scene: &Scene, name: &str) -> String {
    let mut key = match name.split_once('.') {
        Some(("magnets" | "maps", rest)) => match rest.split_once('.') {
            Some((magnet, rest)) => source_key(scene, magnet, rest),
            None => name.to_owned(),
        },
        Some(("loads", rest)) => {
            let of_force = rest.split_once('.').and_then(|(force, rest)| force_file::key_of(scene, force, rest));
            of_force.unwrap_or_else(|| name.to_owned())
        }
        Some((first, rest)) if scene.sources.arrays.iter().any(|array| array.name == first) => {
            source_key(scene, first, rest)
        }
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
    let has = |key: &str| reader.source().contains(&reader.key(key));
    while !has(&key) {
        // `bending` stands for both axes.
        match key.strip_suffix("_x").or(key.strip_suffix("_y")) {
            Some(both) if has(both) => return both.to_owned(),
            _ => {}
        }
        match key.rfind(['.', '[']) {
            Some(at) => key.truncate(at),
            None => break,
        }
    }
    key
}
