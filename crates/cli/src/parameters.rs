//! `rodsweep parameters`: every number of a scene by name, with its value, its unit and what it is.

use super::{CommandError, Exit, print};
use clap::Args;
use rodsweep::draw::TextTable;
use rodsweep::input::{FileKind, parameter_groups, parameter_rows, parse_scene, read_text};
use rodsweep::model::Scene;
use rodsweep::results::{Results, is_place};
use rodsweep::spec::SweepSpec;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct ParametersArguments {
    /// Scene file, sweep file (TOML) or result directory
    #[arg(value_name = "SCENE|SWEEP|DIR")]
    pub source: PathBuf,
    /// Print JSON: values in SI units
    #[arg(long)]
    pub json: bool,
}

pub fn parameters(arguments: &ParametersArguments) -> Result<Exit, CommandError> {
    let scene = scene_of(&arguments.source)?;
    print(&if arguments.json { as_json(&scene) } else { as_text(&scene) })?;
    Ok(Exit::Done)
}

/// The scene of a scene file, a sweep file or a result directory.
fn scene_of(source: &Path) -> Result<Scene, CommandError> {
    if is_place(source) {
        return Ok(Results::open(source)?.spec().scene.clone());
    }
    let text = read_text(source)?;
    Ok(match FileKind::of(source, &text) {
        FileKind::Sweep => SweepSpec::parse(source, &text)?.scene,
        _ => parse_scene(source, &text)?,
    })
}

fn as_text(scene: &Scene) -> String {
    let mut table = TextTable::new(["name", "value", "SI unit", "meaning"]);
    let mut is_any_bound = false;
    for row in parameter_rows(scene) {
        is_any_bound |= !row.is_free;
        let mark = if row.is_free { "" } else { " *" };
        table.row([row.name.clone(), row.value_text() + mark, row.unit.to_owned(), row.meaning]);
    }
    let mut groups = TextTable::new(["group", "stands for"]);
    for group in parameter_groups(scene) {
        groups.row([group.name, group.members.join(", ")]);
    }
    let mut text = table.to_string();
    if is_any_bound {
        text += "* follows from other numbers: it can be differentiated by, not set or swept\n";
    }
    if !groups.is_empty() {
        text += &format!("\n{groups}");
    }
    text + "\nUse a name in `[[axis]] parameter`, `--set NAME=VALUE`, `--wrt NAME` and `[output] derivatives`.\n"
}

fn as_json(scene: &Scene) -> String {
    let rows = parameter_rows(scene).into_iter().map(|row| {
        let value = row.value.is_finite().then_some(row.value);
        json!({ "name": row.name, "value": value, "unit": row.unit, "meaning": row.meaning, "can_be_set": row.is_free })
    });
    let groups =
        parameter_groups(scene).into_iter().map(|group| json!({ "name": group.name, "members": group.members }));
    let value = json!({ "parameters": rows.collect::<Vec<_>>(), "groups": groups.collect::<Vec<_>>() });
    format!("{value:#}\n")
}
