//! Figures of a contact map: forces, friction and angle on the wall, with the outline of what holds.

use super::files::Drawn;
use super::workspace::outline::Outline;
use super::workspace::sheets::write_both;
use super::workspace::voxels::millimetres;
use crate::draw::{Colour, ColourScale, ReportError, VoxelPanel, VoxelRows, VoxelSheet, count};
use crate::study::contact::{Answer, Cause, ContactMap, PointResult, RobustContact};
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
pub fn draw_contact(found: &ContactMap, robust: Option<&RobustContact>, folder: &Path) -> Result<Drawn, ReportError> {
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
        let panels = vec![panel(found, "least coefficient of friction", &number(found, most, ratio))];
        let sheet = sheet(found, vec![rows("coefficient of friction", "", panels)]);
        write_both(&mut drawn, ("friction", &sheet), folder, found.mark())?;
    } else {
        let largest = found.reached().map(|(_, answer)| answer.force).fold(0.0, f64::max);
        let (unit, factor) = [("N", 1.0), ("mN", 1e3), ("µN", 1e6)]
            .into_iter()
            .find(|(_, factor)| largest * factor >= 1.0)
            .unwrap_or(("nN", 1e9));
        let scaled: &dyn Fn(&Answer) -> f64 = &|answer| factor * force(answer);
        let panels = [("most force", most), ("least force", least)];
        let panels = panels.map(|(title, which)| panel(found, title, &number(found, which, scaled)));
        let mut groups = vec![rows("normal force", unit, panels.into())];
        if let Some(robust) = robust {
            let shares: Vec<f64> = robust.shares().collect();
            // Beyond what any design holds there is nothing to tell.
            let share = |point: usize| Some(shares[point]).filter(|share| *share > 0.0);
            let panels = vec![panel(found, "designs that hold", &share)];
            groups.push(VoxelRows { range: Some([0.0, 1.0]), ..rows("share of designs", "", panels) });
        }
        let sheet = sheet(found, groups);
        write_both(&mut drawn, ("force", &sheet), folder, found.mark())?;
    }
    let sheet = sheet(found, vec![rows("angle", "°", vec![panel(found, angle, &number(found, most, degrees))])]);
    write_both(&mut drawn, ("angle", &sheet), folder, found.mark())?;
    Ok(drawn)
}

/// A number of the answer that a point has.
fn number<'a>(
    found: &'a ContactMap,
    which: &'a dyn Fn(&PointResult) -> Option<Answer>,
    number: &'a dyn Fn(&Answer) -> f64,
) -> impl Fn(usize) -> Option<f64> + 'a {
    move |point| which(&found.points[point]).as_ref().map(number)
}

fn rows(quantity: &str, unit: &str, panels: Vec<VoxelPanel>) -> VoxelRows {
    VoxelRows {
        quantity: quantity.into(),
        unit: unit.into(),
        scale: ColourScale::Linear,
        range: None,
        rows: vec![panels],
    }
}

fn sheet(found: &ContactMap, groups: Vec<VoxelRows>) -> VoxelSheet {
    let points = format!("{} points, {} apart", count(found.points.len() as u64), millimetres(found.lattice.spacing));
    VoxelSheet {
        title: found.scene.name.clone(),
        note: format!("{:.2} cm² · {points}", 1e4 * found.area()),
        groups,
        edges_title: "Beyond the outline:".into(),
        edges: OUTLINES.map(|(words, colour)| (words.to_owned(), colour)).into(),
        wall: None,
        below: Vec::new(),
    }
}

/// The wall laid flat; beyond the lattice nothing is known.
fn panel(found: &ContactMap, title: &str, number: &dyn Fn(usize) -> Option<f64>) -> VoxelPanel {
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
    VoxelPanel {
        title: title.into(),
        axes: found.lattice.axes.clone(),
        corner,
        spacing: found.lattice.spacing,
        columns,
        squares: squares.iter().map(|square| square.and_then(number)).collect(),
        edges: outline.edges(),
        plane: None,
    }
}
