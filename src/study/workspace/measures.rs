//! Numbers of a whole workspace: size with its error, boundary, extents, components, the largest ball inside.

use super::growth::Grown;
use super::lattice::neighbours;
use super::search::End;
use crate::model::Vector;
use serde::Serialize;

/// Variance of counted volume over h⁴ and boundary area: 0.067 for smooth isotropic boundaries (Kendall and Moran 1963,
/// Matérn 1986), and up to this for bodies with edges and parallel sheets. P6 has 0.13 to 0.145 at 2 to 6 mm.
const LATTICE_VARIANCE: f64 = 0.145;
/// Area of a smooth boundary over that of the faces between voxels, on average over its directions.
const SMOOTH_SHARE: f64 = 2.0 / 3.0;
/// Of what one voxel at the rim of a surface adds, over its section.
const RIM_VARIANCE: f64 = 0.1;
/// Student's quantile for eight values.
const STUDENT_95: f64 = 2.364_624;
const NORMAL_95: f64 = 1.959_963_985;

/// A number with its interval of 95 %; bounds that are not known are NaN.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimate {
    /// A number of which the bounds are not known.
    pub fn without_bounds(value: f64) -> Estimate {
        Estimate { value, low: f64::NAN, high: f64::NAN }
    }

    /// The same in another unit.
    pub(crate) fn scaled(self, factor: f64) -> Estimate {
        Estimate { value: factor * self.value, low: factor * self.low, high: factor * self.high }
    }

    /// With the same error on either side.
    pub fn symmetric(value: f64, error: f64) -> Estimate {
        Estimate { value, low: value - error, high: value + error }
    }

    /// Half the width of the interval.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

/// Voxels by how the search for them ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Ends {
    /// Reached.
    pub reached: u64,
    /// Next to the workspace, held back by a limit.
    pub at_limit: u64,
    /// Next to the workspace, where the Jacobian loses a direction.
    pub singular: u64,
    /// Reached only by an equilibrium that does not count.
    pub off_branch: u64,
    /// Undecided.
    pub stuck: u64,
}

impl Ends {
    pub(super) fn of(grown: &Grown) -> Ends {
        let mut ends = Ends::default();
        for voxel in &grown.voxels {
            match voxel.end {
                Some(End::Reached) => ends.reached += 1,
                Some(End::AtLimit) => ends.at_limit += 1,
                Some(End::Singular) => ends.singular += 1,
                Some(End::OffBranch) => ends.off_branch += 1,
                Some(End::Stuck) | None => ends.stuck += 1,
                Some(End::Beside) => {}
            }
        }
        ends
    }

    /// Undecided voxels over all that are reached or undecided.
    pub fn undecided_share(&self) -> f64 {
        self.stuck as f64 / (self.reached + self.stuck).max(1) as f64
    }
}

/// Area of the boundary of a body (m²), by the faces between reached voxels and others.
pub(super) fn boundary_area(grown: &Grown) -> f64 {
    let is_reached = |cell| grown.voxel(cell).is_some_and(|voxel| voxel.is_reached());
    let open = |at: usize| neighbours(grown.voxels[at].cell).into_iter().filter(|cell| !is_reached(*cell)).count();
    let faces: usize = grown.reached().map(open).sum();
    SMOOTH_SHARE * faces as f64 * grown.lattice.spacing.powi(2)
}

/// Volume of a body by counted centres (m³): the error is that of a lattice; what is undecided may be part of it.
///
/// The variance is about 0.145 h⁴ S. That of a body with thin parts may be larger: it shows in how far the eight lattices of twice the spacing that make up this one differ, whose variance is sixteen times as large.
pub(super) fn volume(grown: &Grown, ends: &Ends) -> Estimate {
    let edge = grown.lattice.spacing;
    let cell = edge.powi(3);
    let value = cell * ends.reached as f64;
    let mut counts = [0.0f64; 8];
    for at in grown.reached() {
        let odd = grown.voxels[at].cell.map(|index| (index & 1) as usize);
        counts[odd[0] + 2 * odd[1] + 4 * odd[2]] += 1.0;
    }
    let mean = counts.iter().sum::<f64>() / 8.0;
    let variance = counts.iter().map(|count| (count - mean).powi(2)).sum::<f64>() / 7.0;
    let by_parts = STUDENT_95 * 8.0 * cell * variance.sqrt() / 4.0;
    let smooth = NORMAL_95 * (LATTICE_VARIANCE * edge.powi(4) * boundary_area(grown)).sqrt();
    let error = smooth.max(by_parts);
    // Where no centre is reached, all that was looked at may be.
    let unseen = if ends.reached == 0 { cell * grown.voxels.len() as f64 } else { cell * ends.stuck as f64 };
    Estimate { value, low: (value - error).max(0.0), high: value + error + unseen }
}

/// Area of a surface (m²) or length of a curve (m), by sections of voxels.
pub(super) fn sections(grown: &Grown) -> f64 {
    // The sum of nothing is -0.
    0.0 + grown.voxels.iter().filter(|voxel| voxel.is_reached()).map(|voxel| voxel.measure).sum::<f64>()
}

/// Size of a surface or curve by voxels of edge h; its error by those of 2 h and by what a rim adds by chance.
pub(super) fn extrapolated(grown: &Grown, fine: f64, coarse: f64) -> Estimate {
    let edge = grown.lattice.spacing;
    let is_rim = |at: &usize| {
        let ends = neighbours(grown.voxels[*at].cell).map(|cell| grown.voxel(cell).and_then(|voxel| voxel.end));
        ends.iter().any(|end| matches!(end, Some(End::AtLimit | End::OffBranch | End::Stuck)))
    };
    let rim = grown.reached().filter(is_rim).count() as f64;
    let unit = edge.powi(grown.dimension as i32);
    // Each voxel at the rim counts whole or not at all.
    let by_chance = NORMAL_95 * unit * (RIM_VARIANCE * rim).sqrt();
    let undecided = unit * grown.voxels.iter().filter(|voxel| voxel.end == Some(End::Stuck)).count() as f64;
    let error = (fine - coarse).abs().hypot(by_chance);
    Estimate { value: fine, low: (fine - error).max(0.0), high: fine + error + undecided }
}

/// Box around the tips that were found (m).
pub(super) fn extents(grown: &Grown) -> Option<[Vector; 2]> {
    let mut around: Option<[Vector; 2]> = None;
    for at in grown.reached() {
        let voxel = &grown.voxels[at];
        let centre = grown.lattice.centre(voxel.cell);
        let p: Vector = std::array::from_fn(|axis| match grown.dimension {
            3 => centre[axis],
            _ => centre[axis] + f64::from(voxel.offset[axis]),
        });
        let [low, high] = around.get_or_insert([p, p]);
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    around
}

/// Centre of volume, area or length (m).
pub(super) fn centroid(grown: &Grown) -> Option<Vector> {
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for at in grown.reached() {
        let voxel = &grown.voxels[at];
        let centre = grown.lattice.centre(voxel.cell);
        (0..3).for_each(|axis| sum[axis] += voxel.measure * centre[axis]);
        weight += voxel.measure;
    }
    (weight > 0.0).then(|| sum.map(|x| x / weight))
}

/// Sizes of the pieces that hang together by faces (of surfaces and curves by corners, too), as voxels; the largest
/// first.
pub(super) fn components(grown: &Grown) -> Vec<u64> {
    let mut seen = vec![false; grown.voxels.len()];
    let mut sizes = Vec::new();
    for start in grown.reached() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let (mut stack, mut size) = (vec![start], 0);
        while let Some(at) = stack.pop() {
            size += 1;
            let cell = grown.voxels[at].cell;
            let mut visit = |other| {
                if let Some(other) = grown.place(other).filter(|other| grown.voxels[*other].is_reached())
                    && !std::mem::replace(&mut seen[other], true)
                {
                    stack.push(other);
                }
            };
            match grown.dimension {
                3 => neighbours(cell).into_iter().for_each(&mut visit),
                _ => (0..27).for_each(|k| visit([cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1])),
            }
        }
        sizes.push(size);
    }
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

/// Least and largest value of a share of all, each weighted.
pub(super) fn quantiles(values: &[f64], weights: &[f64], shares: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).filter(|at| values[*at].is_finite()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let all: f64 = order.iter().map(|at| weights[*at]).sum();
    let quantile = |share: &f64| {
        let mut sum = 0.0;
        let found = order.iter().find(|at| {
            sum += weights[**at];
            sum >= share * all
        });
        found.or(order.last()).map_or(f64::NAN, |at| values[*at])
    };
    shares.iter().map(quantile).collect()
}
