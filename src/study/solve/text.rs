//! A solution for a person.

use super::Solved;
use crate::draw::{TextTable, engineering};
use crate::model::{Quantity, SegmentKind, Status, TipOnWall, Vector};
use std::fmt;

impl fmt::Display for Solved {
    /// Status, tip, base, stability, errors, stiffness and Jacobian, a line each; lengths in mm, moments in mN·m.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.scene().name.is_empty() { "rod" } else { &self.scene().name };
        writeln!(f, "{name}: {} ({})", self.status().name(), self.engine())?;
        if !self.is_equilibrium() {
            write_end(self, f)?;
            return write_fold(self, f);
        }
        if !self.is_converged() {
            match way_of_wall(self) {
                Some(percent) => writeln!(
                    f,
                    "the path ends where the wall has come {percent:.2} % of its way; an equilibrium beyond:"
                )?,
                None => {
                    let percent = 100.0 * self.load_fraction();
                    writeln!(f, "the path from rest ends at {percent:.2} % of the load; an equilibrium beyond:")?;
                }
            }
        }
        if self.status() == Status::ThroughWall {
            writeln!(f, "another part of the rod than its tip is in the wall: its force there is not modelled")?;
        }
        write_numbers(self, f)?;
        write_contact(self, f)?;
        write_stiffness(self, f)?;
        if !self.jacobian().is_empty() {
            write!(f, "{}", jacobian(self))?;
            write_force_jacobian(self, f)?;
        }
        write_fold(self, f)
    }
}

/// How far a path came that leads to no equilibrium.
fn write_end(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if solved.status() == Status::OutOfReach {
        return writeln!(f, "the anchor is farther from the base than the rod is long; nothing was tried");
    }
    if let Some(percent) = way_of_wall(solved) {
        return writeln!(
            f,
            "no equilibrium with the wall in place; followed until it has come {percent:.1} % of its way"
        );
    }
    let percent = 100.0 * solved.load_fraction();
    writeln!(f, "no equilibrium at the full load; followed from rest to {percent:.1} % of it")
}

/// Share of its way that the wall had come where the path ended, in percent; `None` where it had not begun.
fn way_of_wall(solved: &Solved) -> Option<f64> {
    let percent = 100.0 * (solved.load_fraction() - 1.0);
    (solved.scene().wall.is_some() && percent > 0.0).then_some(percent)
}

fn write_contact(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Some(contact) = solved.contact() else { return Ok(()) };
    if !contact.touching {
        writeln!(f, "wall                        not touched; {:.6} mm away", contact.gap * 1e3)?;
        return write_body_gap(contact.body_gap, f);
    }
    let force = contact.force.map(|x| format!("{:.6}", x * 1e3)).join(", ");
    let error = engineering(contact.force_error);
    writeln!(
        f,
        "force of the wall  [mN]     {force}; along its normal {:.6}, error {error} N",
        contact.normal_force * 1e3
    )?;
    let angle = contact.angle.to_degrees();
    writeln!(f, "tip at the wall             {angle:.3} deg from a right angle; gap {:.6} mm", contact.gap * 1e3)?;
    let friction = contact.friction_ratio.map(|ratio| format!("needs a coefficient of {ratio:.4}"));
    let friction = friction.unwrap_or_else(|| "cannot hold the tip: the wall would have to pull".into());
    match contact.holds {
        Some(true) => writeln!(f, "friction                    {friction}; the tip holds")?,
        Some(false) => writeln!(f, "friction                    {friction}; the tip does not hold")?,
        None if solved.scene().wall.is_some_and(|wall| matches!(wall.tip, TipOnWall::Sticks(_))) => {
            writeln!(f, "friction                    {friction}")?;
        }
        None => {}
    }
    write_body_gap(contact.body_gap, f)
}

/// Says where the rest of the rod comes nearest; nothing where the tip is nearest.
fn write_body_gap(gap: f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if gap < 0.0 { writeln!(f, "rest of the rod             {:.6} mm in the wall", -gap * 1e3) } else { Ok(()) }
}

fn write_numbers(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let numbers = |v: Vector, factor: f64| v.map(|x| format!("{:.6}", x * factor)).join(", ");
    let (solutions, options) = (solved.solutions(), &solved.plan().options);
    let stable = match solved.is_stable() {
        true => "stable",
        false if solved.stability_margin() > 0.0 => {
            "not diverged since rest; under loads without energy nothing more is proven of stability"
        }
        false => "unstable",
    };
    writeln!(f, "tip position       [mm]     {}", numbers(solved.tip_position(), 1e3))?;
    writeln!(f, "tip tangent                 {}", numbers(solved.tip_tangent(), 1.0))?;
    writeln!(f, "base curvature     [1/m]    {}", numbers(solved.base_curvature(), 1.0))?;
    writeln!(f, "base moment        [mN·m]   {}", numbers(solved.base_moment(), 1e3))?;
    writeln!(f, "stability margin            {:.4} ({stable})", solved.stability_margin())?;
    writeln!(
        f,
        "error estimate              {} of the length; residual {}, {} passes, {} steps of {}",
        engineering(solved.error_estimate()),
        // Over the moment that bends the rod by a radian, like the tolerance.
        engineering(solutions.get(0, Quantity::Residual)),
        solutions.get(0, Quantity::Iterations),
        options.steps,
        options.stepper.name()
    )?;
    if solved.derivative_error().is_finite() {
        writeln!(f, "error of derivatives        {} of their size", engineering(solved.derivative_error()))?;
    }
    Ok(())
}

fn write_stiffness(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for segment in &solved.scene().segments {
        if let SegmentKind::Flexible(flexible) = &segment.kind {
            let [x, y, z] = flexible.stiffness.principal().map(engineering);
            writeln!(f, "stiffness of {:<15}bending {x}, {y}, torsion {z} N·m²", segment.name)?;
        }
    }
    Ok(())
}

/// How the load of a fold follows the parameters, where that is known.
fn write_fold(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Some(fold) = solved.fold().filter(|fold| !fold.derivatives.is_empty()) else { return Ok(()) };
    let mut table = TextTable::new(["d/d", "load of the fold [1/unit]", "error", "unit"]);
    let jacobian = solved.jacobian();
    for ((name, unit), (slope, error)) in jacobian.names().into_iter().zip(jacobian.units()).zip(&fold.derivatives) {
        table.row([name, format!("{slope:.6e}"), engineering(*error), unit.into()]);
    }
    match way_of_wall(solved) {
        Some(_) => {
            write!(f, "the rod snaps where the wall has come {:.6} of its way, which follows\n{table}", fold.load - 1.0)
        }
        None => write!(f, "the rod snaps at {:.6} of the load, which follows\n{table}", fold.load),
    }
}

fn jacobian(solved: &Solved) -> TextTable {
    let jacobian = solved.jacobian();
    let (position, rotation) = (jacobian.position(), jacobian.rotation());
    let mut table = TextTable::new(["d/d", "x [m/unit]", "y", "z", "w.x [rad/unit]", "w.y", "w.z", "unit"]);
    for (k, (name, unit)) in jacobian.names().into_iter().zip(jacobian.units()).enumerate() {
        let mut cells = vec![name];
        cells.extend(position.iter().chain(&rotation).map(|row| format!("{:.6e}", row[k])));
        cells.push(unit.into());
        table.row(cells);
    }
    table
}

/// How the force of the wall follows the parameters.
fn write_force_jacobian(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let jacobian = solved.jacobian();
    let (Some(normal), Some(force)) = (jacobian.normal_force(), jacobian.force()) else { return Ok(()) };
    let mut table = TextTable::new(["d/d", "normal force [N/unit]", "force.x", "force.y", "force.z", "unit"]);
    for (k, (name, unit)) in jacobian.names().into_iter().zip(jacobian.units()).enumerate() {
        let mut cells = vec![name, format!("{:.6e}", normal[k])];
        cells.extend(force.iter().map(|row| format!("{:.6e}", row[k])));
        cells.push(unit.into());
        table.row(cells);
    }
    write!(f, "{table}")
}
