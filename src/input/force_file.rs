//! Forces and moments inside of the rod in scene files, and those at the tip that turn with it.

use super::error::{InputError, Problem};
use super::segment_file::check_name;
use super::toml::Reader;
use crate::model::{
    Frame, InnerLoad, LoadPlace, Scene, SceneError, Segment, SegmentKind, Vector, closest, short_number,
};

const KEYS: [&str; 7] = ["name", "segment", "at", "force", "force_per_length", "moment", "frame"];

/// A load at the tip as `[loads]` gives it: a vector is dead, `{ value, frame = "body" }` follows the tip.
pub(super) enum AtTip {
    Dead(Option<Vector>),
    Follows(InnerLoad),
}

/// `tip_force` or `tip_moment` of a rod of so many segments.
pub(super) fn at_tip(
    loads: &Reader,
    key: &'static str,
    unit: &'static str,
    segments: usize,
) -> Result<AtTip, InputError> {
    if !loads.is_table(key) {
        return Ok(AtTip::Dead(loads.vector(key, unit)?));
    }
    let Some(table) = loads.table(key)? else { return Ok(AtTip::Dead(None)) };
    table.check_keys(&["value", "frame"])?;
    let Some(value) = table.vector("value", unit)? else {
        return Err(table.missing("value", "give three components, such as value = [0, \"10 mN\", 0]"));
    };
    if frame(&table)? == Frame::World {
        return Ok(AtTip::Dead(Some(value)));
    }
    let is_force = key == "tip_force";
    Ok(AtTip::Follows(InnerLoad {
        name: key.into(),
        segment: segments.saturating_sub(1),
        place: LoadPlace::Tip,
        force: if is_force { value } else { [0.0; 3] },
        moment: (!is_force).then_some(value),
        frame: Frame::Body,
    }))
}

/// The loads of the `[[load]]` blocks of a scene with these segments.
pub(super) fn inner_loads(reader: &Reader, segments: &[Segment]) -> Result<Vec<InnerLoad>, InputError> {
    // Not an array, it is what `[loads]` is meant to be.
    if reader.is_table("load") {
        let problem = Problem::UnknownKey { suggestion: Some("loads".into()), known: vec!["loads", "[[load]]"] };
        return Err(reader.error("load", problem));
    }
    reader.tables("load")?.iter().map(|reader| inner_load(reader, segments)).collect()
}

fn inner_load(reader: &Reader, segments: &[Segment]) -> Result<InnerLoad, InputError> {
    reader.check_keys(&KEYS)?;
    let name = reader.string("name")?;
    let name = name.ok_or_else(|| {
        reader.missing("name", "parameters of a load start with `loads.` and its name, such as name = \"push\"")
    })?;
    check_name(reader, name)?;
    let (force, per_length) = (reader.vector("force", "N")?, reader.vector("force_per_length", "N/m")?);
    let (moment, frame) = (reader.vector("moment", "N·m")?, frame(reader)?);
    let (force, is_along) = match (force, per_length) {
        (Some(force), None) => (force, false),
        (None, Some(force)) => (force, true),
        (None, None) if moment.is_some() => ([0.0; 3], false),
        (None, None) => {
            let remedy = "give three components in N, or force_per_length in N/m, or a moment in N·m";
            return Err(reader.missing("force", remedy));
        }
        (Some(_), Some(_)) => {
            let remedy = "give each its own [[load]]".into();
            return Err(reader.error("force_per_length", Problem::Conflict { with: "force".into(), remedy }));
        }
    };
    if is_along && moment.is_some() {
        let remedy = "a moment acts at a point: give it its own [[load]]".into();
        return Err(reader.error("moment", Problem::Conflict { with: "force_per_length".into(), remedy }));
    }
    if is_along && frame == Frame::Body {
        let expected =
            "\"world\": a force per length that turns with the rod is not modelled; `force` and `moment` at points are";
        return Err(reader.error("frame", Problem::Range { value: "\"body\"".into(), expected: expected.into() }));
    }
    let named = segment(reader, segments)?;
    let at = reader.quantity("at", "m")?;
    let (segment, place) = match (is_along, named, at) {
        (true, Some(segment), None) => (segment, LoadPlace::Along),
        (true, _, Some(_)) => {
            let remedy = "it acts all along its segment: leave out `at`, or give `force`".into();
            return Err(reader.error("at", Problem::Conflict { with: "force_per_length".into(), remedy }));
        }
        (true, None, None) => {
            let remedy = "say along which; along the whole rod it is distributed_force under [loads]";
            return Err(reader.missing("segment", remedy));
        }
        (false, Some(segment), None) => match segments[segment].kind {
            SegmentKind::Rigid(_) => (segment, LoadPlace::Middle),
            SegmentKind::Flexible(_) => {
                let remedy = "say how far from the segment's proximal end the force acts, such as at = \"20 mm\"";
                return Err(reader.missing("at", remedy));
            }
        },
        (false, Some(segment), Some(at)) => (segment, LoadPlace::At(at)),
        (false, None, Some(at)) => station(reader, segments, at)?,
        (false, None, None) => {
            let remedy = "say how far from the base the force acts, such as at = \"20 mm\", or give a `segment`";
            return Err(reader.missing("at", remedy));
        }
    };
    Ok(InnerLoad { name: name.into(), segment, place, force, moment, frame })
}

/// In which frame a load keeps its direction.
fn frame(reader: &Reader) -> Result<Frame, InputError> {
    let Some(found) = reader.string("frame")? else { return Ok(Frame::World) };
    Frame::ALL.into_iter().find(|frame| frame.name() == found).ok_or_else(|| {
        let suggestion = closest(found, Frame::ALL.iter().map(|frame| frame.name()));
        reader.error("frame", Problem::Choice { found: found.into(), suggestion, allowed: "world, body".into() })
    })
}

/// Index of the segment that is named.
fn segment(reader: &Reader, segments: &[Segment]) -> Result<Option<usize>, InputError> {
    let Some(found) = reader.string("segment")? else { return Ok(None) };
    let names = || segments.iter().map(|segment| segment.name.as_str());
    match names().position(|name| name == found) {
        Some(index) => Ok(Some(index)),
        None => {
            let (suggestion, allowed) = (closest(found, names()), names().collect::<Vec<_>>().join(", "));
            Err(reader.error("segment", Problem::Choice { found: found.into(), suggestion, allowed }))
        }
    }
}

/// The flexible segment at a distance from the base, and the place on it.
fn station(reader: &Reader, segments: &[Segment], at: f64) -> Result<(usize, LoadPlace), InputError> {
    let refused = |expected: String| {
        Err(reader.error("at", Problem::Range { value: format!("{} m", short_number(at)), expected }))
    };
    let mut start = 0.0;
    // An end that is a sum of lengths may miss the place by rounding.
    let slack = 1e-12 * segments.iter().map(|segment| segment.length).sum::<f64>();
    for (index, segment) in segments.iter().enumerate() {
        let end = start + segment.length;
        let on = (at - start).min(segment.length);
        let holds = at >= start - slack && at <= end + slack;
        match segment.kind {
            SegmentKind::Flexible(_) if holds => return Ok((index, LoadPlace::At(on.max(0.0)))),
            SegmentKind::Rigid(_) if holds && at < end - slack => {
                return refused(format!(
                    "a place on a flexible segment: here is `{0}`, which is rigid; with segment = \"{0}\" in place of `at` the force acts at its middle",
                    segment.name
                ));
            }
            _ => start = end,
        }
    }
    refused(format!("a distance from the base, 0 to {} m", short_number(start)))
}

/// The key of the file that an error about a force is at.
pub(super) fn key(scene: &Scene, error: &SceneError) -> Option<String> {
    let (name, key) = match error {
        SceneError::DuplicateForce(name) => (name, "name"),
        SceneError::MisplacedForce { name } => (name, "segment"),
        _ => return None,
    };
    key_of(scene, name, key)
}

/// The key of the first load without energy.
pub(super) fn key_without_energy(scene: &Scene) -> String {
    match scene.inner_loads.iter().position(|load| !load.is_dead_force()) {
        Some(at) if scene.inner_loads[at].place != LoadPlace::Tip => format!("load[{at}]"),
        Some(at) => format!("loads.{}", scene.inner_loads[at].name),
        None => "load".into(),
    }
}

/// A key of the last force of a name.
pub(super) fn key_of(scene: &Scene, name: &str, rest: &str) -> Option<String> {
    let at = scene.inner_loads.iter().rposition(|force| force.name == name)?;
    Some(format!("load[{at}].{rest}"))
}
