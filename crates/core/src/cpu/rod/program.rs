//! A plan made ready for the kernel: entries in the plan's units, steps, and what to collect for the derivatives.

use super::terms::{ProgramTerms, Terms};
use crate::cpu::algebra::Vec3;
use crate::cpu::contact::program_wall::ProgramWall;
use crate::cpu::rod::field::program_field::ProgramField;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::record::{BASE_POSITION_AT, LOAD_AT};
use crate::model::tolerances::{
    CAREFUL_STEPPER, PATH_STEPPER, chord_tolerance, first_order_tolerance, newton_tolerance, rounded, turn_tolerance,
};
use crate::model::{Anchors, Derivative, DerivativeScale, Entry, Plan, PlanAnchors, SegmentPlan, Slot, Tableau};
use std::sync::Arc;

/// Where a number of the record comes from, in the plan's units.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    Constant(f64),
    Input(usize),
}

impl Source {
    /// The number that all samples share.
    pub fn constant(self) -> Option<f64> {
        if let Source::Constant(value) = self { Some(value) } else { None }
    }
}

/// What a segment must collect while the columns pass over it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collect {
    pub rest_curvature: bool,
    pub stiffness: bool,
    /// Either of them times s / length as well.
    pub rise: bool,
    pub shear_compliance: bool,
    pub load: bool,
    pub dipole: bool,
    pub field: bool,
    pub length: bool,
}

impl Collect {
    /// Whether anything is integrated along the segment.
    pub fn integrals(&self) -> bool {
        self.rest_curvature || self.stiffness || self.shear_compliance || self.load || self.dipole || self.field
    }

    pub fn any(&self) -> bool {
        self.integrals() || self.length
    }
}

/// The steps of one integration.
#[derive(Clone, Debug)]
pub struct Resolution {
    pub tableau: &'static Tableau,
    /// Steps over each segment; zero for rigid ones.
    pub steps: Vec<usize>,
    /// How many times as long as the one before each of them is.
    pub ratios: Vec<f64>,
}

impl Resolution {
    /// The ratio of the steps over a segment. It is 1 where the terms of the program are not `general`.
    #[inline(always)]
    pub fn ratio(&self, terms: impl Terms, index: usize) -> f64 {
        if terms.general() { self.ratios[index] } else { 1.0 }
    }
}

/// The kernel's view of a plan.
#[derive(Clone, Debug)]
pub struct Program {
    pub terms: ProgramTerms,
    /// A load that may have no energy: a dead couple, or one that turns with the rod.
    pub load_without_energy: bool,
    pub rigid_force_arm: bool,
    pub sources: Vec<Source>,
    /// So many columns of inputs tell all of a rod but its derivatives.
    pub rod_columns: usize,
    /// `None`: the field is uniform.
    pub field: Option<ProgramField>,
    /// Wall that the tip may touch; `None`: the tip is free.
    pub wall: Option<ProgramWall>,
    /// Those that are integrated.
    pub segments: Vec<SegmentPlan>,
    /// First entry of the rest pose of what lies beyond them.
    pub free: Option<usize>,
    /// Those, too.
    pub all_segments: usize,
    /// First entry of the base moments of a search.
    pub start: Option<usize>,
    /// Whether samples are searches.
    pub searches: bool,
    /// Whether samples start from loads at the base that were found on another grid.
    pub starts_near: bool,
    /// Whether paths without care are all, and trust narrow passes.
    pub bold: bool,
    /// First column of the force at the base, where a search tells it.
    pub base_force: Option<usize>,
    /// First column of how the load of a fold follows each parameter, where that is asked for.
    pub fold: Option<usize>,
    /// First column of the contact with a wall.
    pub contact: Option<usize>,
    /// Where samples may start instead of from rest, and the column of their first coordinate there.
    pub anchors: Option<(Arc<Anchors>, usize)>,
    /// Of each segment, in a field that varies: whether force is the same all along it, for derivatives, too.
    pub steady: Vec<bool>,
    /// Of each three derivatives, there: the first segment that any of them acts on.
    pub acts_from: Vec<usize>,
    /// Whether derivatives come from forward columns.
    pub forward: bool,
    pub collect: Vec<Collect>,
    pub derivatives: Vec<Vec<(Slot, usize)>>,
    /// Whether they include those of the base moment.
    pub base_moment_rows: bool,
    /// Of each.
    pub rows: usize,
    /// The segment whose curvature at its start is an output of its own.
    pub first_beyond_rigid: Option<usize>,
    /// Length of the first step of a path, and of the corrections that it trusts, over the usual ones.
    pub pace: f64,
    /// For following the path from rest.
    pub coarse: Resolution,
    /// The same with care.
    pub careful: Resolution,
    /// Along the curve of equilibria.
    pub curve: Resolution,
    /// For the columns.
    pub fine: Resolution,
    /// For the answer: twice the steps of `fine`.
    pub check: Resolution,
    /// Newton's last step must be below this, in the plan's units of moment.
    pub newton_tolerance: f64,
    /// Chord steps end below this times the stability margin.
    pub chord_tolerance: f64,
    /// A step below this times the stability margin does to first order.
    pub first_order_tolerance: f64,
    /// Newton's last step moves the tip by less than this.
    pub turn_tolerance: f64,
    /// Error of the answer over its difference to the fine steps.
    pub error_share: f64,
    /// Differences below so many times what round-off can do are round-off alone.
    pub rounded: f64,
    /// See [`Plan::stage_noise`].
    pub stage_noise: f64,
    /// See [`Plan::bend_noise`].
    pub bend_noise: f64,
    /// What error estimates of derivatives are made of.
    pub derivative_scale: DerivativeScale,
}

impl Program {
    pub fn new(plan: &Plan, epsilon: f64) -> Self {
        let mut sources: Vec<Source> = plan
            .entries
            .iter()
            .zip(plan.entry_units())
            .map(|(entry, unit)| match *entry {
                Entry::Constant(value) => Source::Constant(value / unit),
                Entry::Varying(column) => Source::Input(column),
            })
            .collect();
        // A base position only moves the result; the engine adds it at the end.
        if !plan.terms.varying_field {
            sources[BASE_POSITION_AT..][..3].fill(Source::Constant(0.0));
        }
        let integrated = plan.free.map_or(plan.segments.len(), |free| free.segment);
        let slots = || plan.derivatives.iter().flat_map(|derivative| &derivative.terms).map(|(slot, _)| slot);
        let mut terms = plan.terms;
        // Kernels integrate M where anything but coils changes it.
        terms.load |= terms.magnet;
        terms.load |= plan.forward && slots().any(|slot| matches!(slot, Slot::Load(..) | Slot::DipolePerLength(..)));
        // In a field that varies each column asks for its own sources.
        let is_general = terms.is_general() || plan.forward && !plan.terms.varying_field;
        let terms = ProgramTerms::new(terms, is_general);
        let collect = if plan.forward { vec![Collect::default(); integrated] } else { collect(plan, integrated) };
        let grid = |tableau, scale: &dyn Fn(usize) -> usize| {
            let segments = &plan.segments[..integrated];
            let steps: Vec<usize> = segments.iter().map(|segment| scale(segment.steps)).collect();
            let ratios = segments.iter().zip(&steps).map(|(segment, steps)| segment.step_ratio(*steps)).collect();
            Resolution { tableau, steps, ratios }
        };
        let stepper = plan.options.stepper;
        let tableau = stepper.tableau();
        let careful = if plan.terms.varying_field { PATH_STEPPER } else { CAREFUL_STEPPER };
        // A rod that a wall bends asks for finer steps than a free one: next to where it buckles a coarse one bends the other way.
        let beside = if plan.terms.wall { 2 } else { 1 };
        let on_path = if plan.options.pace < 1.0 { 2 } else { 1 } * beside;
        let steady = (0..integrated).map(|index| is_steady(plan, &sources, index)).collect();
        let newton_tolerance = newton_tolerance(plan.target(), epsilon);
        Self {
            terms,
            load_without_energy: plan.terms.load_without_energy,
            rigid_force_arm: plan.scene.rigid_force_arm,
            field: ProgramField::new(plan, |record| sources[record].constant()),
            wall: plan.contact_column().map(|_| ProgramWall::new(plan)),
            contact: plan.contact_column(),
            rod_columns: rod_columns(plan, &sources),
            sources,
            steady,
            acts_from: acts_from(plan),
            segments: plan.segments[..integrated].to_vec(),
            free: plan.free.map(|free| free.entry),
            all_segments: plan.segments.len(),
            start: plan.start,
            searches: plan.searches(),
            starts_near: plan.starts_near,
            bold: plan.options.bold,
            base_force: plan.base_force_column(),
            fold: plan.fold_column(),
            anchors: plan.anchors.as_ref().filter(|_| plan.start.is_none()).and_then(anchor_columns(plan)),
            forward: plan.forward,
            collect,
            base_moment_rows: plan.options.base_moment_rows,
            rows: plan.rows(),
            first_beyond_rigid: plan.first_beyond_rigid(),
            derivatives: plan.derivatives.iter().map(|derivative| derivative.terms.clone()).collect(),
            pace: plan.options.pace,
            coarse: grid(PATH_STEPPER.tableau(), &|n| on_path * stepper.path_steps(n)),
            careful: grid(careful.tableau(), &|n| beside * stepper.careful_steps(n, careful)),
            curve: grid(CAREFUL_STEPPER.tableau(), &|n| beside * stepper.careful_steps(n, CAREFUL_STEPPER)),
            fine: grid(tableau, &|n| n),
            check: grid(tableau, &|n| 2 * n),
            newton_tolerance,
            chord_tolerance: chord_tolerance(newton_tolerance),
            first_order_tolerance: first_order_tolerance(newton_tolerance),
            turn_tolerance: turn_tolerance(newton_tolerance, plan.column_tolerance()),
            error_share: plan.options.error_share,
            rounded: rounded(epsilon, plan.step_count()),
            stage_noise: plan.stage_noise(epsilon),
            bend_noise: plan.bend_noise(),
            derivative_scale: plan.options.derivative_scale,
        }
    }

    /// Whether rows by reciprocity take integrals along the rod.
    pub fn collects(&self) -> bool {
        self.collect.iter().any(|collect| collect.any())
    }

    /// Threes of forward columns.
    pub fn forward_threes(&self) -> usize {
        if self.forward { self.derivatives.len().div_ceil(3) } else { 0 }
    }

    /// Loads one entry for a group of samples: `inputs[column * stride + offset ..]`.
    #[inline(always)]
    pub fn entry<L: Lane>(&self, token: L::Token, inputs: &Inputs<'_, L::Scalar>, entry: usize) -> L {
        match self.sources[entry] {
            Source::Constant(value) => L::splat(token, value),
            Source::Input(column) => L::load(token, &inputs.data[column * inputs.stride + inputs.offset..]),
        }
    }

    /// Three entries in a row.
    #[inline(always)]
    pub fn vector<L: Lane>(&self, token: L::Token, inputs: &Inputs<'_, L::Scalar>, entry: usize) -> Vec3<L> {
        Vec3 {
            x: self.entry(token, inputs, entry),
            y: self.entry(token, inputs, entry + 1),
            z: self.entry(token, inputs, entry + 2),
        }
    }
}

/// Columns of inputs before those that derivatives alone are made of.
fn rod_columns(plan: &Plan, sources: &[Source]) -> usize {
    let mut of_rod = vec![true; sources.len()];
    let entries = plan.derivatives.iter().flat_map(|derivative| &derivative.terms).map(|(_, entry)| *entry);
    entries.for_each(|entry| of_rod[entry] = false);
    let columns = sources.iter().zip(of_rod).filter_map(|(source, of_rod)| match source {
        Source::Input(column) if of_rod => Some(*column + 1),
        _ => None,
    });
    columns.max().unwrap_or(0)
}

/// Whether no force acts along a segment, nor that of any derivative.
fn is_steady(plan: &Plan, sources: &[Source], index: usize) -> bool {
    let segment = &plan.segments[index];
    if !(plan.terms.varying_field && segment.is_flexible) {
        return false;
    }
    let load = &sources[segment.record + LOAD_AT..][..3];
    let by = |slot: &Slot| matches!(slot, Slot::Load(at, _) | Slot::DipolePerLength(at, _) if *at == index);
    let mut slots = plan.derivatives.iter().flat_map(|derivative| &derivative.terms).map(|(slot, _)| slot);
    !segment.has_magnet && load.iter().all(|w| matches!(w, Source::Constant(0.0))) && !slots.any(by)
}

/// The first segment on which any of each three derivatives acts, in a field that varies.
fn acts_from(plan: &Plan) -> Vec<usize> {
    let magnetic = plan.segments.iter().position(|segment| segment.has_dipole || segment.has_magnet);
    let never = plan.segments.len();
    let of = |slot: &Slot| match slot {
        Slot::TipForce(_) | Slot::TipMoment(_) => never,
        slot if slot.is_of_wall() => never,
        slot if slot.is_of_sources() || matches!(slot, Slot::FluxDensity(_)) => magnetic.unwrap_or(never),
        slot => slot.segment().unwrap_or(0),
    };
    let slots =
        |three: &[Derivative]| three.iter().flat_map(|derivative| &derivative.terms).map(|(slot, _)| of(slot)).min();
    plan.derivatives.chunks(3).map(|three| slots(three).unwrap_or(never)).collect()
}

/// The grid of a plan and the column of the first coordinate.
fn anchor_columns(plan: &Plan) -> impl Fn(&PlanAnchors) -> Option<(Arc<Anchors>, usize)> + '_ {
    |anchors| match plan.entries.get(anchors.entry) {
        Some(Entry::Varying(column)) => Some((anchors.grid.clone(), *column)),
        _ => None,
    }
}

/// What the slots of a plan need along its segments.
fn collect(plan: &Plan, segments: usize) -> Vec<Collect> {
    let mut collect = vec![Collect::default(); segments];
    for (slot, _) in plan.derivatives.iter().flat_map(|derivative| &derivative.terms) {
        if let Slot::FluxDensity(_) = slot {
            collect.iter_mut().for_each(|collect| collect.field = true);
        }
        let Some(collect) = slot.segment().and_then(|segment| collect.get_mut(segment)) else { continue };
        match slot {
            Slot::RestCurvature(..) => collect.rest_curvature = true,
            Slot::Stiffness(..) => collect.stiffness = true,
            Slot::RestCurvatureRise(..) => (collect.rest_curvature, collect.rise) = (true, true),
            Slot::StiffnessRise(..) => (collect.stiffness, collect.rise) = (true, true),
            Slot::ShearCompliance(..) => collect.shear_compliance = true,
            Slot::Load(..) | Slot::Weight(..) => collect.load = true,
            Slot::Dipole(..) | Slot::DipolePerLength(..) => collect.dipole = true,
            Slot::Length(_) => collect.length = true,
            _ => {}
        }
    }
    collect
}

/// Where a group's results go, in the plan's units, column by column.
pub struct Outputs<'a, S: Scalar> {
    pub data: &'a mut [S],
    pub stride: usize,
    pub offset: usize,
}

impl<S: Scalar> Outputs<'_, S> {
    #[inline(always)]
    pub fn store<L: Lane<Scalar = S>>(&mut self, column: usize, value: L) {
        value.store(&mut self.data[column * self.stride + self.offset..]);
    }

    #[inline(always)]
    pub fn store_vector<L: Lane<Scalar = S>>(&mut self, column: usize, value: Vec3<L>) {
        self.store(column, value.x);
        self.store(column + 1, value.y);
        self.store(column + 2, value.z);
    }
}

/// The varying entries of a group, in the plan's units, column by column.
#[derive(Clone, Copy)]
pub struct Inputs<'a, S: Scalar> {
    pub data: &'a [S],
    pub stride: usize,
    pub offset: usize,
}

impl<S: Scalar> Inputs<'_, S> {
    #[inline(always)]
    pub fn column<L: Lane<Scalar = S>>(&self, token: L::Token, column: usize) -> L {
        L::load(token, &self.data[column * self.stride + self.offset..])
    }

    /// Three columns in a row.
    #[inline(always)]
    pub fn vector<L: Lane<Scalar = S>>(&self, token: L::Token, column: usize) -> Vec3<L> {
        Vec3 { x: self.column(token, column), y: self.column(token, column + 1), z: self.column(token, column + 2) }
    }
}
