//! What is known of every voxel beside its inputs: dexterity, compliance, reserve, solutions, orientations, density.

use super::engine_map::EngineMap;
use super::error::WorkspaceError;
use super::growth::Grown;
use super::inputs::reserve;
use super::lattice::{Cell, CellMap, neighbours};
use super::search::End;
use super::step::Singular;
use super::tip_map::{Inputs, MOST_INPUTS, Tip, TipMap, padded};
use crate::model::Vector;
use crate::table::Lattice;
use nalgebra::{Matrix3, SymmetricEigen};
use serde::Serialize;

/// Two solutions of one voxel differ by so much in some input over half its range, or by such an angle of the tangent.
const APART: f64 = 0.25;
const ANGLE: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Solutions of one voxel that are told apart, at most.
const MOST_SOLUTIONS: usize = 8;
/// A margin below this at the boundary: the workspace ends where the equilibrium does.
const SMALL_MARGIN: f64 = 0.1;
/// Equal areas of the sphere of directions: bands by height, each cut into as many.
const BANDS: usize = 12;
const IN_A_BAND: usize = 16;

/// Why a voxel is where the workspace ends; `Inside` where it does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// All neighbours are reached.
    Inside,
    /// An input is at its limit.
    InputLimit,
    /// The Jacobian loses a direction.
    Singular,
    /// The equilibrium from rest ends or changes.
    Branch,
    /// A neighbour is undecided.
    Stuck,
}

impl Cause {
    /// Every cause.
    pub const ALL: [Cause; 5] = [Cause::Inside, Cause::InputLimit, Cause::Singular, Cause::Branch, Cause::Stuck];

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Inside => "inside",
            Cause::InputLimit => "input-limit",
            Cause::Singular => "singular",
            Cause::Branch => "branch",
            Cause::Stuck => "stuck",
        }
    }

    /// Of a voxel, by its neighbours; that of the reason which concerns the rod most counts.
    pub(super) fn of(grown: &Grown, at: usize) -> Cause {
        let voxel = &grown.voxels[at];
        let of_end = |end: Option<End>| match end {
            Some(End::Reached | End::Beside) => Cause::Inside,
            Some(End::AtLimit) => Cause::InputLimit,
            Some(End::Singular) => Cause::Singular,
            Some(End::OffBranch) => Cause::Branch,
            Some(End::Stuck) | None => Cause::Stuck,
        };
        if !voxel.is_reached() {
            return of_end(voxel.end);
        }
        let around = neighbours(voxel.cell).map(|cell| grown.voxel(cell).map_or(Cause::Inside, |v| of_end(v.end)));
        let has = |cause: Cause| around.contains(&cause);
        let is_open = around.iter().any(|cause| *cause != Cause::Inside);
        if has(Cause::Branch) || (is_open && voxel.margin < SMALL_MARGIN) {
            Cause::Branch
        } else {
            [Cause::Singular, Cause::InputLimit, Cause::Stuck].into_iter().find(|c| has(*c)).unwrap_or(Cause::Inside)
        }
    }
}

/// What many tips say about the voxels that they fall into.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    cells: CellMap<SeenVoxel>,
}

#[derive(Clone, Debug, Default)]
struct SeenVoxel {
    least_margin: f32,
    solutions: Vec<([f32; MOST_INPUTS], [f32; 3])>,
    directions: [u64; 3],
}

impl Seen {
    pub(super) fn add(&mut self, lattice: &Lattice, at: &Inputs, tip: &Tip) {
        let seen = self
            .cells
            .entry(lattice.cell(tip.position))
            .or_insert_with(|| SeenVoxel { least_margin: f32::INFINITY, ..SeenVoxel::default() });
        seen.least_margin = seen.least_margin.min(tip.margin as f32);
        let direction = direction_of(tip.tangent);
        seen.directions[direction / 64] |= 1 << (direction % 64);
        let (at, tangent) = (at.map(|x| x as f32), tip.tangent.map(|x| x as f32));
        let is_like = |(other, direction): &([f32; MOST_INPUTS], [f32; 3])| {
            let apart = other.iter().zip(at).fold(0.0f32, |largest, (a, b)| largest.max((a - b).abs()));
            let along: f32 = (0..3).map(|k| direction[k] * tangent[k]).sum();
            f64::from(apart) <= APART && f64::from(along) >= ANGLE.cos()
        };
        if seen.solutions.len() < MOST_SOLUTIONS && !seen.solutions.iter().any(is_like) {
            seen.solutions.push((at, tangent));
        }
    }

    fn get(&self, cell: Cell) -> Option<&SeenVoxel> {
        self.cells.get(&cell)
    }
}

fn direction_of(tangent: Vector) -> usize {
    let height = ((0.5 * (tangent[2] + 1.0)) * BANDS as f64).clamp(0.0, BANDS as f64 - 1.0) as usize;
    let turn = (tangent[1].atan2(tangent[0]) / std::f64::consts::TAU).rem_euclid(1.0);
    height * IN_A_BAND + ((turn * IN_A_BAND as f64) as usize).min(IN_A_BAND - 1)
}

/// Values of the reached voxels, in their order; empty where nobody asked.
#[derive(Clone, Debug, Default)]
pub struct VoxelValues {
    /// Singular values of the Jacobian (m per half range), the largest first.
    pub sigma: Vec<[f64; 3]>,
    /// Least and largest displacement by a force (m/N), and the direction of the largest.
    pub compliance: Vec<(f64, f64, Vector)>,
    /// Normal force of the wall on the tip (N); NaN without a wall.
    pub normal_force: Vec<f64>,
    /// Least distance of an input to a limit over half its range.
    pub reserve: Vec<f64>,
    /// Least margin seen in the voxel.
    pub least_margin: Vec<f64>,
    /// Solutions that differ.
    pub solutions: Vec<u32>,
    /// Share of all directions that the tip's tangent was seen to take.
    pub orientations: Vec<f64>,
    /// Expected tips in the voxel for one sample spread evenly over the inputs.
    pub density: Vec<f64>,
}

impl VoxelValues {
    /// Finds the equilibrium of every reached voxel again, for its Jacobian and its compliance.
    pub(super) fn of(
        grown: &Grown,
        map: &mut EngineMap,
        seen: &Seen,
        counts: &CellMap<u32>,
    ) -> Result<VoxelValues, WorkspaceError> {
        let places: Vec<usize> = grown.reached().collect();
        let inputs: Vec<Inputs> = places.iter().map(|at| padded(grown.inputs_of(*at))).collect();
        let mut values = VoxelValues::default();
        let count = grown.input_count;
        let all: u64 = counts.values().map(|count| u64::from(*count)).sum();
        for (places, inputs) in places.chunks(TOGETHER).zip(inputs.chunks(TOGETHER)) {
            let known = places.iter().zip(inputs).map(|(at, inputs)| grown.known(*at, *inputs)).collect::<Vec<_>>();
            let solved = map.with_compliance_again(&known)?;
            values.compliance.extend(solved.iter().map(|(_, rates)| principal_compliance(rates)));
            let mut tips: Vec<Tip> = solved.into_iter().map(|(tip, _)| tip).collect();
            if grown.branch == super::Branch::Neighbour {
                let starts: Vec<_> = inputs.iter().zip(&tips).map(|(at, tip)| (*at, tip.base)).collect();
                tips = map.near(&starts)?;
            }
            for ((at, inputs), tip) in places.iter().zip(inputs).zip(&tips) {
                let voxel = &grown.voxels[*at];
                let sigma = Singular::new(&tip.jacobian[..count]).values;
                values.sigma.push(sigma);
                values.normal_force.push(tip.normal_force);
                values.reserve.push(reserve(inputs, count));
                let seen = seen.get(voxel.cell);
                let own = 1 << (direction_of(tip.tangent) % 64);
                let mut directions = seen.map_or([0; 3], |seen| seen.directions);
                directions[direction_of(tip.tangent) / 64] |= own;
                let known: u32 = directions.iter().map(|bits| bits.count_ones()).sum();
                values.orientations.push(f64::from(known) / (BANDS * IN_A_BAND) as f64);
                values.solutions.push(seen.map_or(1, |seen| seen.solutions.len().max(1) as u32));
                let least = seen.map_or(f64::INFINITY, |seen| f64::from(seen.least_margin));
                values.least_margin.push(least.min(voxel.margin));
                values.density.push(if grown.dimension == count {
                    let stretch: f64 = sigma[..count].iter().product();
                    voxel.measure.max(0.0) * unit_of(grown) / (2f64.powi(count as i32) * stretch)
                } else {
                    f64::from(counts.get(&voxel.cell).copied().unwrap_or(0)) / all.max(1) as f64
                });
            }
        }
        Ok(values)
    }
}

/// Voxels that are solved together: bounds the memory for their Jacobians.
const TOGETHER: usize = 65_536;

/// Of a body, the volume that a measure of 1 stands for.
fn unit_of(grown: &Grown) -> f64 {
    if grown.dimension == 3 { grown.lattice.spacing.powi(3) } else { 1.0 }
}

/// Eigenvalues of the symmetric part of dp/df, and the direction of the largest.
fn principal_compliance(rates: &[Vector; 3]) -> (f64, f64, Vector) {
    if rates.iter().flatten().any(|x| !x.is_finite()) {
        return (f64::NAN, f64::NAN, [f64::NAN; 3]);
    }
    let matrix = Matrix3::from_fn(|row, column| 0.5 * (rates[column][row] + rates[row][column]));
    let eigen = SymmetricEigen::new(matrix);
    let order = |a: &usize, b: &usize| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]);
    let (least, most) = (0..3).min_by(order).zip((0..3).max_by(order)).unwrap_or((0, 2));
    (eigen.eigenvalues[least], eigen.eigenvalues[most], eigen.eigenvectors.column(most).into_owned().into())
}
