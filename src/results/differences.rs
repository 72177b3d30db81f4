//! What differs between two sweeps, in the words of their files.

use crate::input::quantity_text;
use crate::model::{Parameter, Scene};
use crate::spec::{AxisSpec, Distribution, SweepSpec};

/// Differences that are told, at most.
const MOST: usize = 5;

/// What is otherwise in a sweep, a line each: `` `[[axis]] coil.current.x.to`: 0.3 A, was 0.2 A ``.
pub(super) fn differences(now: &SweepSpec, before: &SweepSpec) -> Vec<String> {
    let mut found = Vec::new();
    axes(&mut found, "axis", (now, &now.axes), (before, &before.axes));
    axes(&mut found, "uncertain", (now, &now.uncertain), (before, &before.uncertain));
    scenes(&mut found, &now.scene, &before.scene);
    match (&now.table, &before.table) {
        (Some(now), Some(before)) if now != before => found.push("`[sampling] file`: other values".into()),
        _ => {}
    }
    let lines = |spec: &SweepSpec| keyed_lines(&spec.to_toml());
    let (now, before) = (lines(now), lines(before));
    for (key, value) in &now {
        match before.iter().find(|(other, _)| other == key) {
            Some((_, was)) if was != value => found.push(change(key, &shown(key, value), &shown(key, was))),
            Some(_) => {}
            None => found.push(format!("{key}: {}, was not there", shown(key, value))),
        }
    }
    let gone = before.iter().filter(|(key, _)| now.iter().all(|(other, _)| other != key));
    found.extend(gone.map(|(key, was)| format!("{key}: is no longer there, was {}", shown(key, was))));
    if found.is_empty() {
        found.push("the scene is another one".into());
    }
    let more = found.len().saturating_sub(MOST);
    found.truncate(MOST);
    if more > 0 {
        found.push(format!("and {more} more"));
    }
    found
}

fn change(key: &str, now: &str, was: &str) -> String {
    format!("{key}: {now}, was {was}")
}

/// Axes by the names of what they drive.
fn axes(found: &mut Vec<String>, kind: &str, now: (&SweepSpec, &[AxisSpec]), before: (&SweepSpec, &[AxisSpec])) {
    let name = |spec: &SweepSpec, axis: &AxisSpec| axis.name(&spec.scene);
    for axis in now.1 {
        let parameter = name(now.0, axis);
        let Some(other) = before.1.iter().find(|other| name(before.0, other) == parameter) else {
            found.push(format!("`[[{kind}]] {parameter}`: is new"));
            continue;
        };
        let key = |number: &str| format!("`[[{kind}]] {parameter}.{number}`");
        let text = |value: f64| quantity_text(value, axis.unit());
        if axis.distribution.name() != other.distribution.name() {
            found.push(change(&key("distribution"), axis.distribution.name(), other.distribution.name()));
            continue;
        }
        for ((number, value), (_, was)) in axis.distribution.numbers().into_iter().zip(other.distribution.numbers()) {
            if value != was {
                found.push(change(&key(number), &text(value), &text(was)));
            }
        }
        if axis.points != other.points {
            found.push(change(&key("points"), &axis.points.to_string(), &other.points.to_string()));
        }
        if axis.scales != other.scales {
            found.push(change(&key("scale"), &axis.scales.to_string(), &other.scales.to_string()));
        }
        let values = |axis: &AxisSpec| match &axis.distribution {
            Distribution::Values(values) => Some(values.clone()),
            _ => None,
        };
        if values(axis) != values(other) {
            found.push(format!("{}: other values", key("values")));
        }
    }
    let is_gone = |other: &&AxisSpec| now.1.iter().all(|axis| name(now.0, axis) != name(before.0, other));
    found.extend(before.1.iter().filter(is_gone).map(|axis| format!("`[[{kind}]] {}`: is gone", name(before.0, axis))));
}

/// Numbers of the scene, without those that follow from others.
fn scenes(found: &mut Vec<String>, now: &Scene, before: &Scene) {
    let names = |scene: &Scene| scene.segments.iter().map(|segment| segment.name.clone()).collect::<Vec<_>>();
    if names(now) != names(before) {
        return found.push(change("`[[segment]]`", &names(now).join(", "), &names(before).join(", ")));
    }
    let is_free = |scene: &Scene, parameter: &Parameter| {
        *parameter != Parameter::Insertion && parameter.set(&mut scene.clone(), parameter.get(scene)).is_ok()
    };
    let others = Parameter::all(before);
    for parameter in Parameter::all(now) {
        let name = parameter.name(now);
        let is_joint = name.ends_with(".stiffness.bending") || name.ends_with(".diameter");
        let Some(other) = others.iter().find(|other| other.name(before) == name) else {
            found.push(format!("`{name}`: is new"));
            continue;
        };
        let (value, was) = (parameter.get(now), other.get(before));
        if value != was && !(value.is_nan() && was.is_nan()) && !is_joint && is_free(now, &parameter) {
            let text = |value: f64| quantity_text(value, parameter.unit());
            found.push(change(&format!("`{name}`"), &text(value), &text(was)));
        }
    }
}

/// The keys of a resolved sweep that belong to no axis and no scene, as `` `[solver] tolerance` ``, and their values.
fn keyed_lines(text: &str) -> Vec<(String, String)> {
    let mut table = "";
    let mut found = Vec::new();
    for line in text.lines() {
        if line.starts_with('[') {
            table = line.trim();
            continue;
        }
        let is_told = ["[sampling]", "[solver]", "[output]", "[workspace]"].contains(&table);
        if let Some((key, value)) = line.split_once(" = ").filter(|_| is_told) {
            found.push((format!("`{table} {key}`"), value.to_owned()));
        }
    }
    found
}

/// A value as it is told: lengths with a unit.
fn shown(key: &str, value: &str) -> String {
    match value.parse() {
        Ok(number) if key.contains("[workspace] voxel") || key.contains("[workspace] length") => {
            quantity_text(number, "m")
        }
        _ => value.trim_matches('"').to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const P6: &str = include_str!("../../sweeps/scenes/p6.toml");
    const WORKSPACE: &str = include_str!("../../sweeps/workspace.toml");

    fn spec(change: &dyn Fn(&str, &str) -> (String, String)) -> SweepSpec {
        let (sweep, scene) = change(WORKSPACE, P6);
        SweepSpec::parse_with(Path::new("workspace.toml"), &sweep, &[("scenes/p6.toml", &scene)]).expect("a sweep")
    }

    #[test]
    fn changes_are_told_in_the_words_of_the_file() {
        let before = spec(&|sweep, scene| (sweep.into(), scene.into()));
        for (from, to, told) in [
            ("to = \"0.3 A\"", "to = \"0.2 A\"", "`[[axis]] coil.current.x.to`: 0.2 A, was 0.3 A"),
            ("points = 61", "points = 31", "`[[axis]] coil.current.x.points`: 31, was 61"),
            ("tolerance = 1e-6", "tolerance = 1e-5", "`[solver] tolerance`: 1e-5, was 1e-6"),
            ("voxel = \"1 mm\"", "voxel = \"2 mm\"", "`[workspace] voxel`: 2 mm, was 1 mm"),
            ("\"parquet\"", "\"csv\"", "`[output] format`: csv, was parquet"),
        ] {
            let now = spec(&|sweep, scene| (sweep.replacen(from, to, 1), scene.into()));
            assert_eq!(differences(&now, &before), [told], "{to}");
        }
        let now = spec(&|sweep, scene| (sweep.into(), scene.replacen("5.3948 MPa", "6 MPa", 1)));
        assert_eq!(differences(&now, &before), ["`proximal.youngs_modulus`: 6 MPa, was 5.3948 MPa"]);
    }
}
