//! A solution for a person.

use super::Solved;
use crate::model::{Quantity, SegmentKind, Vector};
use crate::report::{TextTable, engineering};
use std::fmt;

impl fmt::Display for Solved {
    /// Status, tip, base, stability, errors, stiffness and Jacobian, a line each; lengths in mm, moments in mN·m.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.scene().name.is_empty() { "rod" } else { &self.scene().name };
        writeln!(f, "{name}: {} ({})", self.status().name(), self.engine())?;
        if !self.is_equilibrium() {
            let percent = 100.0 * self.load_fraction();
            writeln!(f, "no equilibrium at the full load; followed from rest to {percent:.1} % of it")?;
            return write_fold(self, f);
        }
        if !self.is_converged() {
            let percent = 100.0 * self.load_fraction();
            writeln!(f, "the path from rest ends at {percent:.2} % of the load; an equilibrium beyond:")?;
        }
        write_numbers(self, f)?;
        write_stiffness(self, f)?;
        if !self.jacobian().is_empty() {
            write!(f, "{}", jacobian(self))?;
        }
        write_fold(self, f)
    }
}

fn write_numbers(solved: &Solved, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let numbers = |v: Vector, factor: f64| v.map(|x| format!("{:.6}", x * factor)).join(", ");
    let (solutions, options) = (solved.solutions(), &solved.plan().options);
    let stable = match solved.is_stable() {
        true => "stable",
        false if solved.stability_margin() > 0.0 => {
            "not diverged since rest; under a dead tip moment nothing more is proven of stability"
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
    write!(f, "the rod snaps at {:.6} of the load, which follows\n{table}", fold.load)
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
