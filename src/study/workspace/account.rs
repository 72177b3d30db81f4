//! The account of a workspace: what is printed and what goes into `workspace.json`.

use super::measures::{Ends, Estimate, boundary_area, centroid, components, extents, quantiles};
use super::pose::PoseRank;
use super::workspace::Workspace;
use crate::model::Vector;
use crate::study::witness::{WitnessCheck, with_mark};
use serde::Serialize;

/// Margins whose share of the size is told.
const MARGINS: [f64; 3] = [0.1, 0.3, 0.5];
/// Shares of the size at which compliance and margin are told.
const SHARES: [f64; 5] = [0.01, 0.05, 0.5, 0.95, 0.99];

/// All that is known of a workspace as a whole; numbers in SI units.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct WorkspaceAccount {
    /// 0 point, 1 curve, 2 surface, 3 body.
    pub dimension: usize,
    /// Of a body (m³), with its interval of 95 %.
    pub volume: Option<Estimate>,
    /// Of a surface, or of the middle of a thin body (m²).
    pub area: Option<Estimate>,
    /// The independent value.
    pub check: Option<CheckAccount>,
    /// Of a curve (m).
    pub length: Option<Estimate>,
    /// Point, curve, surface, thin body or body.
    pub kind: &'static str,
    /// How the size was found.
    pub by: &'static str,
    /// Voxels by how the search for them ended.
    pub voxels: Ends,
    /// Undecided voxels over reached and undecided ones.
    pub undecided_share: f64,
    /// Share of the samples whose voxel was known before growth (Good 1953).
    pub coverage: f64,
    /// How often the family of the check reaches a point, on average.
    pub multiplicity: Option<f64>,
    /// 90 %-quantiles of the singular values (m per half range).
    pub sigma: [f64; 3],
    /// Rank of the whole pose.
    pub pose: Option<PoseRank>,
    /// Of a body: area of its boundary (m²), good to a few per cent.
    pub boundary_area: Option<f64>,
    /// Boundary voxels by cause, as shares.
    pub boundary_causes: Vec<(&'static str, f64)>,
    /// Box around it (m).
    pub extents: Option<[Vector; 2]>,
    /// Its centre (m).
    pub centroid: Option<Vector>,
    /// Middle (m) and radius (m) of the largest ball of reached voxels.
    pub largest_ball: Option<(Vector, f64)>,
    /// Sizes of its pieces, as shares, the largest first; at most eight.
    pub components: Vec<f64>,
    /// Mean isotropy over its size (Gosselin and Angeles 1991).
    pub global_conditioning_index: Option<f64>,
    /// Largest compliance (m/N) at shares of the size.
    pub compliance: Vec<(f64, f64)>,
    /// Stability margin at shares of the size.
    pub margin: Vec<(f64, f64)>,
    /// Share of the size with at least this margin; empty where nothing is reached.
    pub share_with_margin: Vec<(f64, f64)>,
    /// What is commanded.
    pub inputs: Vec<InputAccount>,
    /// Edge of a voxel (m) and corner of voxel (0, 0, 0) (m).
    pub voxel: f64,
    /// A corner of voxel (0, 0, 0) (m).
    pub origin: Vector,
    /// Of lattice and nets.
    pub seed: u64,
    /// Least margin that counts.
    pub minimum_margin: f64,
    /// Whether every stable equilibrium counts, or those from rest.
    pub any_stable: bool,
    /// Equilibria that growth began from.
    pub seeds: usize,
    /// Equilibria computed.
    pub solves: u64,
    /// What computed them.
    pub engine: String,
    /// Precision, steps and tolerance.
    pub method: String,
    /// Of the rod.
    pub scene: String,
    /// Remarks for the user.
    pub notes: Vec<String>,
    /// What the reference says of a share of the voxels.
    pub check_by_reference: WitnessCheck,
    /// What speaks against the rows that it began from, or against it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distrusted: Option<String>,
    /// Of the program.
    pub version: &'static str,
}

/// The independent value as it is told.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CheckAccount {
    /// By change of variables: m³, m² or m.
    pub value: f64,
    /// Of the value.
    pub standard_error: f64,
    /// Whether both values agree within three of their errors; false where nothing is reached, so that there is one value alone.
    pub agrees: bool,
    /// Difference over the error of the difference.
    pub deviation: f64,
    /// Points counted as often as they are reached.
    pub with_multiplicity: f64,
    /// Equilibria computed for it.
    pub samples: u64,
    /// Its largest term over the sum; above 0.01 the error is itself uncertain.
    pub largest_share: f64,
}

/// An input as it is told.
#[derive(Clone, Debug, Serialize)]
pub struct InputAccount {
    /// Name of its first parameter.
    pub name: String,
    /// SI.
    pub unit: &'static str,
    /// Least value, SI.
    pub low: f64,
    /// Largest value, SI.
    pub high: f64,
}

impl Workspace {
    /// Its account.
    pub fn account(&self) -> WorkspaceAccount {
        let grown = &self.grown;
        let places: Vec<usize> = grown.reached().collect();
        let weights: Vec<f64> = places.iter().map(|at| grown.voxels[*at].measure).collect();
        let all: f64 = weights.iter().sum();
        let margins: Vec<f64> = places.iter().map(|at| grown.voxels[*at].margin).collect();
        let share = |least: f64| {
            let pairs = margins.iter().zip(&weights).filter(|(margin, _)| **margin >= least);
            pairs.map(|(_, weight)| weight).sum::<f64>() / all
        };
        let at_shares = |values: &[f64]| match values.is_empty() {
            true => Vec::new(),
            false => SHARES.into_iter().zip(quantiles(values, &weights, &SHARES)).collect(),
        };
        let compliance: Vec<f64> = self.values.compliance.iter().map(|(_, most, _)| *most).collect();
        let rank = self.dimension.rank.max(1);
        // A voxel that is painted may have no singular values.
        let ratios = self.values.sigma.iter().map(|sigma| sigma[rank - 1] / sigma[0]).zip(&weights);
        let (sum, weight) = ratios
            .filter(|(ratio, _)| ratio.is_finite())
            .fold((0.0, 0.0), |(sum, all), (ratio, weight)| (sum + weight * ratio, all + weight));
        let pieces = components(grown);
        let whole = pieces.iter().sum::<u64>().max(1) as f64;
        WorkspaceAccount {
            dimension: self.dimension.rank,
            volume: self.volume,
            area: self.area,
            check: self.check.map(|check| {
                let integral = check.by_change_of_variables;
                CheckAccount {
                    value: integral.value,
                    standard_error: integral.standard_error,
                    agrees: check.agrees && !places.is_empty(),
                    deviation: check.deviation,
                    with_multiplicity: integral.with_multiplicity,
                    samples: integral.samples,
                    largest_share: integral.largest_share,
                }
            }),
            length: self.length,
            kind: self.dimension.name(),
            by: match (self.is_painted, self.dimension.rank) {
                (true, _) => "painted",
                (false, 3) => "centres reached",
                _ => "sections of voxels",
            },
            voxels: self.ends,
            undecided_share: self.ends.undecided_share(),
            coverage: self.coverage,
            multiplicity: self.multiplicity(),
            sigma: self.dimension.quantiles,
            pose: self.pose.clone(),
            boundary_area: (self.dimension.rank == 3).then(|| boundary_area(grown)),
            boundary_causes: self.boundary_causes(),
            extents: extents(grown),
            centroid: centroid(grown),
            largest_ball: self.largest_ball(),
            components: pieces.iter().take(8).map(|size| *size as f64 / whole).collect(),
            global_conditioning_index: (weight > 0.0).then(|| sum / weight),
            compliance: at_shares(&compliance),
            margin: at_shares(&margins),
            share_with_margin: MARGINS
                .into_iter()
                .filter(|_| !places.is_empty())
                .map(|least| (least, share(least)))
                .collect(),
            inputs: self
                .inputs
                .iter()
                .map(|input| InputAccount {
                    name: input.name(&self.scene),
                    unit: input.unit(),
                    low: input.low,
                    high: input.high,
                })
                .collect(),
            voxel: grown.lattice.spacing,
            origin: grown.lattice.origin,
            seed: self.seed,
            minimum_margin: self.minimum_margin,
            any_stable: self.any_stable,
            seeds: self.seed_count,
            solves: self.solves,
            engine: self.engine.clone(),
            method: self.method.to_string(),
            scene: self.scene.name.clone(),
            notes: self.notes.clone(),
            check_by_reference: self.check_by_reference.clone(),
            distrusted: self.mark.clone(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    fn boundary_causes(&self) -> Vec<(&'static str, f64)> {
        use super::voxel_values::Cause;
        let count = |cause: Cause| self.grown.reached().filter(|at| self.causes[*at] == cause).count() as f64;
        let outer = [Cause::InputLimit, Cause::Singular, Cause::Branch, Cause::Stuck];
        let all: f64 = outer.into_iter().map(count).sum();
        outer.into_iter().filter(|_| all > 0.0).map(|cause| (cause.name(), count(cause) / all)).collect()
    }

    fn largest_ball(&self) -> Option<(Vector, f64)> {
        let known = self.grown.reached().filter(|at| self.distances.get(*at).is_some_and(|d| d.is_finite()));
        let deepest = known.max_by(|a, b| self.distances[*a].total_cmp(&self.distances[*b]))?;
        Some((self.grown.lattice.centre(self.grown.voxels[deepest].cell), self.distances[deepest]))
    }
}

impl WorkspaceAccount {
    /// As JSON; what does not apply is null.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// The answer: the size with its interval. It begins with what speaks against it; else it is a line of
    /// [`WorkspaceAccount::text`].
    pub fn headline(&self) -> String {
        with_mark(self.distrusted.as_deref(), self.answer())
    }

    fn answer(&self) -> String {
        let is_size = |line: &&str| ["volume = ", "area = ", "length = "].iter().any(|word| line.starts_with(word));
        self.text().lines().find(is_size).map_or_else(|| self.kind_text(), str::to_owned)
    }

    /// Point, curve, surface or body, and whether there is a size to tell.
    fn kind_text(&self) -> String {
        let unknown = match self.is_unseen() {
            true => "; no voxel's centre is reached, so there is no size, margin or pose to tell",
            false => "",
        };
        format!("the tip's workspace is a {}{unknown}", self.kind)
    }

    /// Whether no voxel's centre is reached.
    fn is_unseen(&self) -> bool {
        self.voxels.reached == 0
    }

    /// A size with its interval, and the independent value.
    fn size_lines(&self, name: &str, size: Estimate, factor: f64, unit: &str) -> Vec<String> {
        let Estimate { value, low, high } = size;
        let mut lines = Vec::new();
        if !self.is_unseen() {
            lines.push(match low.is_finite() {
                true => {
                    format!("{name} = {:.2} {unit}, 95 %: {:.2} to {:.2}", factor * value, factor * low, factor * high)
                }
                false => {
                    format!("{name} = {:.2} {unit}, painted: no centre is proven, no error is known", factor * value)
                }
            });
        }
        let check = self.check.filter(|_| !(name == "area" && self.dimension == 3));
        if let Some(check) = check {
            let (value, error) = (factor * check.value, factor * check.standard_error);
            let alone = format!("by change of variables {value:.2} ± {error:.2} {unit}");
            lines.push(match self.multiplicity.filter(|_| !self.is_unseen()) {
                Some(times) => {
                    let agrees = if check.agrees { "agrees" } else { "DISAGREES" };
                    format!("  {alone} ({agrees}), each point reached {times:.3} times")
                }
                None => format!("{name} {alone}, with nothing to compare it with"),
            });
        }
        lines
    }

    /// For a person: a few lines.
    pub fn text(&self) -> String {
        let mut lines: Vec<String> = self.distrusted.iter().cloned().collect();
        lines.push(self.kind_text());
        let sizes =
            [("volume", self.volume, 1e6, "cm³"), ("area", self.area, 1e4, "cm²"), ("length", self.length, 1e3, "mm")];
        for (name, size, factor, unit) in sizes {
            lines.extend(size.into_iter().flat_map(|size| self.size_lines(name, size, factor, unit)));
        }
        let per_cent = |share: f64| format!("{:.1} %", 100.0 * share);
        lines.push(format!(
            "voxels of {:.3} mm: {} reached, {} undecided ({}); {} of the samples fell into known voxels",
            1e3 * self.voxel,
            self.voxels.reached,
            self.voxels.stuck,
            per_cent(self.undecided_share),
            per_cent(self.coverage)
        ));
        if !self.boundary_causes.is_empty() {
            let causes = self.boundary_causes.iter().filter(|(_, share)| *share > 0.0);
            let words: Vec<String> = causes.map(|(name, share)| format!("{name} {}", per_cent(*share))).collect();
            lines.push(format!("boundary: {}", words.join(", ")));
        }
        if let Some([low, high]) = self.extents {
            let range = |axis: usize| format!("{:.1} to {:.1}", 1e3 * low[axis], 1e3 * high[axis]);
            lines.push(format!("extents: x {}, y {}, z {} mm", range(0), range(1), range(2)));
        }
        if let Some((middle, radius)) = self.largest_ball {
            let [x, y, z] = middle.map(|x| 1e3 * x);
            lines.push(format!("largest ball inside: {:.1} mm about {x:.1} {y:.1} {z:.1} mm", 1e3 * radius));
        }
        let shares: Vec<String> =
            self.share_with_margin.iter().map(|(least, share)| format!("{} ≥ {least}", per_cent(*share))).collect();
        if !shares.is_empty() {
            lines.push(format!("margin: {}", shares.join(", ")));
        }
        if let Some(pose) = self.pose.as_ref().filter(|_| !self.is_unseen()) {
            let rank = pose.rank;
            lines.push(format!("pose: rank {rank} with rotations times {:.1} mm", 1e3 * pose.length));
        }
        if let Some(index) = self.global_conditioning_index {
            lines.push(format!("isotropy, mean over the workspace: {index:.3}"));
        }
        if let Some((_, median)) = self.compliance.iter().find(|(share, _)| *share == 0.5) {
            lines.push(format!("largest compliance, median: {median:.2} mm/mN"));
        }
        lines.push(self.check_by_reference.sentence());
        lines.push(format!("{} equilibria on {}", crate::draw::count(self.solves), self.engine));
        lines.join("\n")
    }
}
