//! Figures of a contact map: forces, friction and angle on the wall, with the outline of what holds.

use super::files::Drawn;
use super::workspace::outline::Outline;
use super::workspace::sheets::write_both;
use super::workspace::voxels::millimetres;
use crate::report::{Colour, ColourScale, ReportError, VoxelPanel, VoxelRows, VoxelSheet, count};
use crate::study::contact::{Answer, Cause, ContactMap, PointResult};
use std::path::Path;

/// Why the wall beyond an outline cannot be pressed on.
const OUTLINES: [(&str, Colour); Cause::ALL.len()] = [
    ("inside", Colour::WHITE),
    ("input limit", Colour::INK),
    ("friction", Colour::VERMILION),
    ("margin", Colour::PURPLE),
    ("end of the branch", Colour::BLUE),
    ("through the wall", Colour::GREY),
    ("out of reach", Colour::MUTED),
];
/// Coefficients above it are no use to tell apart.
const MOST_FRICTION: f64 = 2.0;

/// Draws a map into a folder, as PNG and SVG. What has nothing to draw is left out.
///
/// # Errors
///
/// A figure that cannot be written.
pub fn draw_contact(found: &ContactMap, folder: &Path) -> Result<Drawn, ReportError> {
    let mut drawn = Drawn::default();
    let most: &dyn Fn(&PointResult) -> Option<Answer> = &|point| point.most;
    let least: &dyn Fn(&PointResult) -> Option<Answer> = &|point| point.least;
    let degrees: &dyn Fn(&Answer) -> f64 = &|answer| answer.angle.to_degrees();
    let force: &dyn Fn(&Answer) -> f64 = &|answer| answer.force;
    let angle = match found.force {
        Some(_) => "angle between tip and normal",
        None => "angle between tip and normal, at the most force",
    };
    if found.force.is_some() {
        let ratio: &dyn Fn(&Answer) -> f64 = &|answer| answer.ratio.min(MOST_FRICTION);
        let panels = vec![panel(found, "least coefficient of friction", most, ratio)];
        let sheet = sheet(found, "coefficient of friction", "", panels);
        write_both(&mut drawn, ("friction", &sheet), folder, None)?;
    } else {
        let largest = found.reached().map(|(_, answer)| answer.force).fold(0.0, f64::max);
        let (unit, factor) = [("N", 1.0), ("mN", 1e3), ("µN", 1e6)]
            .into_iter()
            .find(|(_, factor)| largest * factor >= 1.0)
            .unwrap_or(("nN", 1e9));
        let scaled: &dyn Fn(&Answer) -> f64 = &|answer| factor * force(answer);
        let panels = vec![panel(found, "most force", most, scaled), panel(found, "least force", least, scaled)];
        let sheet = sheet(found, "normal force", unit, panels);
        write_both(&mut drawn, ("force", &sheet), folder, None)?;
    }
    let sheet = sheet(found, "angle", "°", vec![panel(found, angle, most, degrees)]);
    write_both(&mut drawn, ("angle", &sheet), folder, None)?;
    Ok(drawn)
}

fn sheet(found: &ContactMap, quantity: &str, unit: &str, panels: Vec<VoxelPanel>) -> VoxelSheet {
    let points = format!("{} points, {} apart", count(found.points.len() as u64), millimetres(found.lattice.spacing));
    let rows = VoxelRows {
        quantity: quantity.into(),
        unit: unit.into(),
        scale: ColourScale::Linear,
        range: None,
        rows: vec![panels],
    };
    VoxelSheet {
        title: found.scene.name.clone(),
        note: format!("{:.2} cm² · {points}", 1e4 * found.area()),
        groups: vec![rows],
        edges_title: "Beyond the outline:".into(),
        edges: OUTLINES.map(|(words, colour)| (words.to_owned(), colour)).into(),
        below: Vec::new(),
    }
}

/// The wall laid flat; beyond the lattice nothing is known.
fn panel(
    found: &ContactMap,
    title: &str,
    which: &dyn Fn(&PointResult) -> Option<Answer>,
    number: &dyn Fn(&Answer) -> f64,
) -> VoxelPanel {
    let (corner, columns, squares) = found.lattice.raster();
    let mut outline = Outline::new(columns, squares.len().checked_div(columns).unwrap_or(0));
    for (at, square) in squares.iter().enumerate() {
        if let Some(point) = square {
            let (column, row) = ((at % columns) as i64, (at / columns) as i64);
            let cause = found.points[*point].cause;
            let kind = Cause::ALL.iter().position(|other| *other == cause).unwrap_or(0);
            outline.set(column, row, cause == Cause::Reached, kind);
        }
    }
    let value = |point: &usize| which(&found.points[*point]).as_ref().map(number);
    VoxelPanel {
        title: title.into(),
        axes: found.lattice.axes.clone(),
        corner,
        spacing: found.lattice.spacing,
        columns,
        squares: squares.iter().map(|square| square.as_ref().and_then(value)).collect(),
        edges: outline.edges(),
    }
}
