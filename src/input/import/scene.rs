//! Writes an imported catheter as a scene file: the source's digits with their units, base to tip, and a comment
//! wherever the source is silent or a number was computed.

use super::super::toml::quoted;
use super::catheter::{Actuator, Catheter, Flexible, Kind, Segment};
use super::spatial::Spatial;
use super::{Import, ImportKind, name_of, printable};
use std::fmt::Write;
use std::path::Path;

/// Column at which comments begin, as in the scenes of `sweeps/`.
const COMMENT: usize = 38;

pub(crate) fn import(file: &Path, catheter: &Catheter, spatial: Option<&Spatial>) -> Import {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_scene(&mut text, file, catheter, spatial);
    let coils = catheter.segments.iter().filter(|segment| matches!(segment.kind, Kind::Actuator(_))).count();
    let names: Vec<&str> = catheter.segments.iter().map(|segment| segment.name.as_str()).collect();
    let plural = if coils == 1 { "" } else { "s" };
    let summary = format!("{} mm, {coils} coil set{plural}; base to tip: {}", total_length(catheter), names.join(", "));
    Import { kind: ImportKind::Scene, text, summary, notes: notes(catheter, spatial) }
}

fn notes(catheter: &Catheter, spatial: Option<&Spatial>) -> Vec<String> {
    let mut notes = Vec::new();
    if spatial.is_none() {
        let silent = "the file states neither field, gravity nor base pose";
        notes.push(format!("{silent}: the laboratory's usual ones were written; `--spatial FILE` reads others"));
    }
    if !catheter.unused.is_empty() {
        let names: Vec<&str> = catheter.unused.iter().map(|(keyword, _)| *keyword).collect();
        notes.push(format!("not used, kept as comments: {}", names.join(", ")));
    }
    for segment in &catheter.segments {
        let Kind::Flexible(flexible) = &segment.kind else { continue };
        let ratio = flexible.youngs_modulus.value / (2.0 * flexible.shear_modulus.value) - 1.0;
        if !(0.0..=0.5).contains(&ratio) {
            notes.push(format!(
                "`{}`: YoungModlist and ShearModlist imply a Poisson ratio of {ratio:.2}, outside 0 to 0.5; both are kept",
                segment.name
            ));
        }
    }
    notes
}

/// In mm
fn total_length(catheter: &Catheter) -> f64 {
    rounded(catheter.segments.iter().map(|segment| segment.length.value).sum())
}

/// To 15 digits, so that sums and products of short decimals are short again.
fn rounded(value: f64) -> f64 {
    // A formatted double always reads back; adding zero turns -0 into 0.
    format!("{value:.14e}").parse().unwrap_or(value) + 0.0
}

fn write_scene(text: &mut String, file: &Path, catheter: &Catheter, spatial: Option<&Spatial>) -> std::fmt::Result {
    writeln!(text, "# Imported from {}; base to tip, where the file goes tip to base.", name_of(file))?;
    writeln!(text, "# Lengths, moduli, densities and rest curvatures have the file's digits and units.")?;
    for comment in &catheter.comments {
        writeln!(text, "# The file says: {}", printable(comment))?;
    }
    writeln!(text, "name = {}", quoted(&printable(&file.file_stem().unwrap_or_default().to_string_lossy())))?;
    if matches!(catheter.segments[0].kind, Kind::Flexible(_)) {
        let example = format!("# insertion = \"{} mm\"", total_length(catheter));
        commented(text, &example, "not stated: the whole length; less shortens the first segment")?;
    }
    match spatial {
        Some(spatial) => write_spatial(text, spatial)?,
        None => write_usual(text)?,
    }
    writeln!(text, "# No fluid_density: rho is taken as it stands, in the published sets net of displaced blood.")?;
    for segment in &catheter.segments {
        write_segment(text, segment)?;
    }
    writeln!(text, "\n[model]")?;
    let arm = "false reproduces the published code: no lever arm of force over rigid segments";
    commented(text, "rigid_force_arm = true", arm)?;
    if !catheter.unused.is_empty() {
        writeln!(text, "\n# In the file, without meaning for a static rod:")?;
    }
    for (keyword, values) in &catheter.unused {
        writeln!(text, "# {keyword} {}", printable(values))?;
    }
    Ok(())
}

fn commented(text: &mut String, line: &str, comment: &str) -> std::fmt::Result {
    writeln!(text, "{line:<width$}# {comment}", width = COMMENT.max(line.len() + 1))
}

/// What the laboratory uses, where no file says more.
fn write_usual(text: &mut String) -> std::fmt::Result {
    writeln!(text, "\n[base]")?;
    commented(text, "position = [0, 0, 0]", "not stated by the file")?;
    commented(text, "rotation = [0, 0, 0]", "not stated by the file: rod along world +z")?;
    writeln!(text, "\n[field]")?;
    commented(
        text,
        "flux_density = [\"0 T\", \"3 T\", \"0 T\"]",
        "not stated by the file: the laboratory's usual field",
    )?;
    writeln!(text, "\n[loads]")?;
    commented(text, "gravity = [0, 0, \"9.81 m/s^2\"]", "not stated by the file: as usual, towards the tip")
}

fn write_spatial(text: &mut String, spatial: &Spatial) -> std::fmt::Result {
    let Spatial { file, flux_density, gravity, position, rotation } = spatial;
    writeln!(text, "\n# [base], [field] and [loads]: from {file}.")?;
    writeln!(text, "[base]\nposition = [{}]", position.join(", "))?;
    commented(text, &format!("rotation = {rotation:?}"), "rotation vector of R0")?;
    writeln!(text, "\n[field]\nflux_density = [{}]", flux_density.join(", "))?;
    writeln!(text, "\n[loads]\ngravity = [{}]", gravity.join(", "))
}

fn write_segment(text: &mut String, segment: &Segment) -> std::fmt::Result {
    let kind = if matches!(segment.kind, Kind::Flexible(_)) { "flexible" } else { "rigid" };
    let (length, density) = (segment.length, segment.linear_density);
    writeln!(text, "\n[[segment]]\nname = {}\nkind = \"{kind}\"", quoted(&segment.name))?;
    writeln!(text, "length = \"{} mm\"", length.text)?;
    let tube = format!("rho {} kg/mm x {} mm of tube", density.text, length.text);
    match &segment.kind {
        Kind::Flexible(flexible) => {
            write_flexible(text, flexible)?;
            writeln!(text, "linear_density = \"{} kg/mm\"", density.text)
        }
        Kind::Rigid => write_mass(text, density.value * length.value, &tube),
        Kind::Actuator(actuator) => {
            let mass = actuator.mass.value + density.value * length.value;
            write_mass(text, mass, &format!("ActMass {} kg + {tube}, as the published code adds", actuator.mass.text))?;
            write_coil(text, actuator)
        }
    }
}

fn write_mass(text: &mut String, kilograms: f64, comment: &str) -> std::fmt::Result {
    commented(text, &format!("mass = \"{:?} mg\"", rounded(1e6 * kilograms)), comment)
}

fn write_flexible(text: &mut String, flexible: &Flexible) -> std::fmt::Result {
    let Flexible { outer_radius, inner_radius, youngs_modulus, shear_modulus, rest_curvature } = flexible;
    writeln!(
        text,
        "tube = {{ inner_radius = \"{} mm\", outer_radius = \"{} mm\" }}",
        inner_radius.text, outer_radius.text
    )?;
    writeln!(text, "youngs_modulus = \"{} MPa\"", youngs_modulus.text)?;
    writeln!(text, "shear_modulus = \"{} MPa\"", shear_modulus.text)?;
    let [x, y, z] = rest_curvature.map(|number| format!("\"{} 1/mm\"", number.text));
    writeln!(text, "rest_curvature = [{x}, {y}, {z}]")
}

/// Alignment turns the dipoles of the two side coils, each by its own angle: no rotation in general, so it is
/// multiplied into the turns-area matrix.
fn write_coil(text: &mut String, actuator: &Actuator) -> std::fmt::Result {
    let [first, second] = actuator.angles;
    let source = actuator.turns_area;
    let aligned = |row: usize, col: usize| {
        let (x, y) = (source[col].value, source[3 + col].value);
        match row {
            0 => first.value.cos() * x - second.value.sin() * y,
            1 => first.value.sin() * x + second.value.cos() * y,
            _ => source[6 + col].value,
        }
    };
    if [first, second].iter().any(|angle| angle.value != 0.0) {
        let matrix = source.map(|number| number.text).join(" ");
        writeln!(text, "# turns_area: [[cos a, -sin b, 0], [sin a, cos b, 0], [0, 0, 1]] x CoilTurnAreaMat with")?;
        writeln!(text, "# a, b = {}, {} rad (CoilAlignmentAngles) and {matrix} [1000 mm^2].", first.text, second.text)?;
    }
    writeln!(text, "coil = {{ current = [0, 0, 0], turns_area = [")?;
    for row in 0..3 {
        let entries: Vec<String> = (0..3).map(|col| format!("{:?}", rounded(1e-3 * aligned(row, col)))).collect();
        writeln!(text, "    [{}],", entries.join(", "))?;
    }
    writeln!(text, "] }}")
}
