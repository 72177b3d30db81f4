//! The size of a column of derivatives, and what rounding does to a small one.

use super::tolerances::{SMALL_COLUMN_NOISE, STIFFNESS_NOISE};
use super::{BLOCK, Parameter, Plan, Quantity, Rod, RodSegment, Scene, Slot, Units};

/// A column smaller than this share of its natural size does next to nothing: errors are measured against that share.
pub const SMALL_COLUMN: f64 = 1e-3;

/// Size that a column (dp/L, w) has when a unit change of a rod-sized number turns the tip by one radian.
pub fn natural_size(scene: &Scene, parameter: Parameter, units: &Units) -> f64 {
    parameter.chain(scene).iter().map(|(slot, rate)| (rate / slot.unit(units)).powi(2)).sum::<f64>().sqrt()
}

/// Round-off of columns, and what the residual does to them, over their own size. Kernels tell both over the natural size; a small
/// column is the difference of large numbers and is off by as much. Only f32 needs it.
pub struct ColumnNoise {
    /// Round-off of a pass, relative to the size of the numbers that are rounded.
    noise: f64,
    units: Units,
    rows: usize,
    columns: Vec<ColumnSize>,
}

struct ColumnSize {
    natural: f64,
    /// Size of what is rounded.
    rounded: f64,
}

impl ColumnNoise {
    /// The round-off of a plan's rows, computed with this machine epsilon; `None` in f64 and without derivatives.
    pub fn new(plan: &Plan, epsilon: f64) -> Option<ColumnNoise> {
        let is_single = epsilon > f64::from(f32::EPSILON) / 2.0;
        if !is_single || plan.derivatives.is_empty() {
            return None;
        }
        let rod = plan.scene.rod();
        let uneven = unevenness(&rod).min(STIFFNESS_NOISE);
        let size = |parameter| ColumnSize {
            natural: natural_size(&plan.scene, parameter, &plan.units),
            rounded: rounded_size(&plan.scene, (&rod, uneven), parameter, &plan.units),
        };
        let columns = plan.derivatives.iter().map(|derivative| size(derivative.parameter)).collect();
        let noise = SMALL_COLUMN_NOISE * epsilon * plan.options.stepper.uniform_stage_noise(epsilon);
        Some(ColumnNoise { noise, units: plan.units, rows: plan.rows(), columns })
    }

    /// Adds it to the `derivative_error` of a block of rows, column by column, in SI.
    pub fn add(&self, block: &mut [f64]) {
        let mut largest = [0.0f64; BLOCK];
        let (columns, _) = block.as_chunks_mut::<BLOCK>();
        for (index, ColumnSize { natural, rounded }) in self.columns.iter().enumerate() {
            let first = Quantity::COUNT + self.rows * index;
            let mut squares = [0.0; BLOCK];
            for (row, column) in columns[first..first + 6].iter().enumerate() {
                let unit = if row < 3 { self.units.length } else { 1.0 };
                squares.iter_mut().zip(column).for_each(|(square, x)| *square += (x / unit).powi(2));
            }
            for (largest, square) in largest.iter_mut().zip(squares) {
                *largest = largest.max(rounded / square.sqrt().max(SMALL_COLUMN * natural));
            }
        }
        for (lane, larger) in largest.into_iter().enumerate() {
            let of = |quantity: Quantity, axis: usize| columns[quantity.column() + axis][lane];
            let moment = [0, 1, 2].map(|axis| of(Quantity::BaseMoment, axis) / self.units.moment());
            let moment = moment.iter().map(|x| x * x).sum::<f64>().sqrt();
            // Next to a fold a column grows as its round-off does. What is left of the residual moves the base moment, more so there.
            let margin = of(Quantity::StabilityMargin, 0).abs().clamp(SMALL_COLUMN, 1.0);
            let left = of(Quantity::Residual, 0) / margin;
            columns[Quantity::DerivativeError.column()][lane] += (self.noise * (1.0 + moment) + left) * larger;
        }
    }
}

/// Size of the numbers that a column is made of. A stretch that is softer than most of the rod turns further by the same moment,
/// and a derivative by its stiffness has two powers of that, times how uneven the rod is.
fn rounded_size(scene: &Scene, (rod, uneven): (&Rod, f64), parameter: Parameter, units: &Units) -> f64 {
    let of_slot = |slot: &Slot| match *slot {
        Slot::Stiffness(segment, axis) | Slot::StiffnessRise(segment, axis) => match rod.segments.get(segment) {
            Some(RodSegment::Flexible(piece)) => {
                let (first, axis) = (piece.stiffness, axis.index());
                let softest = first[axis].min(first[axis] + piece.stiffness_rise[axis]);
                uneven * units.moment() * piece.length / softest.powi(2)
            }
            _ => 0.0,
        },
        slot => 1.0 / slot.unit(units),
    };
    parameter.chain(scene).iter().map(|(slot, rate)| (rate * of_slot(slot)).powi(2)).sum::<f64>().sqrt()
}

/// The largest stiffness of a rod, of bending or torsion, over the smallest.
fn unevenness(rod: &Rod) -> f64 {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for segment in &rod.segments {
        if let RodSegment::Flexible(piece) = segment {
            for stiffness in (0..3).flat_map(|k| [piece.stiffness[k], piece.stiffness[k] + piece.stiffness_rise[k]]) {
                (least, most) = (least.min(stiffness), most.max(stiffness));
            }
        }
    }
    most / least
}
