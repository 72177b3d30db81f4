//! What all samples of a sweep share: terms, record layout, derivatives, resolution. And the batch that varies.

use super::anchors::PlanAnchors;
use super::dependence::{changes_chain, touched_entries};
use super::plan_parts::{free_part, is_forward, natural_units, segment_plans, terms_of};
use super::rest_shape::{REST_POSE, rest_pose};
use super::rod::Slot;
use super::sample::set_axes;
use super::starts::SEARCH_ENTRIES;
use super::tolerances::FIELD_BEND_NOISE;
use super::{
    Blocks, ContactColumn, MOST_ROWS, Parameter, ParameterError, PlanOptions, Quantity, Rod, RodWall, Scene,
    SceneError, SegmentKind, Units, WallParameter,
};
use std::collections::BTreeSet;

/// Share of the target error of derivatives.
const COLUMN_TARGET: f64 = 0.02;
/// So many steps over the rod ask for one rule along each rigid segment.
const STEPS_OF_A_RULE: usize = 8;

/// Which terms of the model the samples use. Kernels leave the others out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Terms {
    /// An internal force: tip force or distributed load.
    pub force: bool,
    /// A force per length, or a weight of rigid segments; implies `force`.
    pub load: bool,
    /// A magnetic moment per length of flexible segments.
    pub magnet: bool,
    /// Shear or stretch under an internal force.
    pub shear: bool,
    /// Stiffness that varies along a segment.
    pub taper: bool,
    /// Rest curvature that varies along a segment.
    pub curvature_rise: bool,
    /// Different stiffness about body x and y somewhere.
    pub anisotropic: bool,
    /// A load that may have no energy: a dead couple, or one that turns with the rod.
    pub load_without_energy: bool,
    /// A rigid segment with a dipole.
    pub dipole: bool,
    /// The field varies in space, or there is a wall: the force at the base is unknown.
    pub varying_field: bool,
    /// A wall that the tip may touch.
    pub wall: bool,
}

/// A number of the record or a chain-rule coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// The same for all samples, SI.
    Constant(f64),
    /// A column of the batch.
    Varying(usize),
}

/// A parameter to differentiate by: combination of slots.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivative {
    /// What solutions are differentiated by.
    pub parameter: Parameter,
    /// Its path in the scene, for names of columns.
    pub name: String,
    /// Slots and the entries that hold their rates (SI per unit of the parameter).
    pub terms: Vec<(Slot, usize)>,
}

/// One segment as the kernels see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentPlan {
    /// Whether it bends.
    pub is_flexible: bool,
    /// A rigid segment that may carry a dipole.
    pub has_dipole: bool,
    /// A rigid segment that may bear a couple.
    pub has_couple: bool,
    /// A rigid segment whose force and couple turn with it.
    pub follows: bool,
    /// A flexible segment that may carry a dipole per length.
    pub has_magnet: bool,
    /// A flexible segment that shears or stretches.
    pub shears: bool,
    /// Whose stiffness varies along it.
    pub tapers: bool,
    /// Whose rest curvature varies along it.
    pub curvature_rises: bool,
    /// First entry of its record.
    pub record: usize,
    /// Integration steps over a flexible segment.
    pub steps: usize,
    /// Eighths of an octave by which stiffness grows along it where that is much: its steps then change stiffness by the same
    /// factor each. Zero: they are equally long.
    pub grading: i16,
}

impl SegmentPlan {
    /// How many times as long as the one before each of `steps` steps over the segment is.
    pub fn step_ratio(&self, steps: usize) -> f64 {
        (f64::from(self.grading) / (8 * steps.max(1)) as f64).exp2()
    }
}

/// Where step `k` of `steps` starts and how long it is, as shares of the segment; each is `ratio` times as long as the one
/// before.
#[inline(always)]
pub fn step_at(ratio: f64, k: usize, steps: usize) -> (f64, f64) {
    let share = 1.0 / steps.max(1) as f64;
    if ratio == 1.0 {
        return (k as f64 * share, share);
    }
    let all = ratio.powi(steps as i32) - 1.0;
    let start = (ratio.powi(k as i32) - 1.0) / all;
    (start, (ratio.powi(k as i32 + 1) - 1.0) / all - start)
}

/// A distal part without loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreePart {
    /// Its first segment.
    pub segment: usize,
    /// First entry of the pose of its distal end in the frame of its proximal end: position, d1, t.
    pub entry: usize,
}

/// Everything about a sweep that does not change from sample to sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The scene with unswept values in place.
    pub scene: Scene,
    /// Parameters that each sample sets; an axis may drive several.
    pub axes: Vec<Vec<Parameter>>,
    /// Units in which the kernels compute.
    pub units: Units,
    /// Terms of the model that some sample uses.
    pub terms: Terms,
    /// Base to tip, one for each segment of the rod: nodes cut a segment of the scene into several.
    pub segments: Vec<SegmentPlan>,
    /// The distal part that nothing loads: it keeps its rest shape and is not integrated.
    pub free: Option<FreePart>,
    /// Whether derivatives come from forward columns; else from reciprocity.
    pub forward: bool,
    /// First entry of the base moments of a search; `None`: the path from rest is followed.
    pub start: Option<usize>,
    /// Whether samples start from loads at the base that were found on another grid.
    pub starts_near: bool,
    /// Equilibria from which samples may start instead of from rest.
    pub anchors: Option<PlanAnchors>,
    /// The rod's record, the rest pose of the free part, then the coefficients of the derivatives.
    pub entries: Vec<Entry>,
    /// Columns of a batch.
    pub input_count: usize,
    /// In the order they were asked for.
    pub derivatives: Vec<Derivative>,
    /// Choices it was made with.
    pub options: PlanOptions,
}

/// Why a sweep cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The scene describes no rod.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A swept parameter cannot be set in this scene.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Insertion is swept or differentiated by, but the first segment, whose name this is, is rigid.
    #[error("`insertion` needs a flexible first segment: `{0}` is rigid")]
    InsertionIntoRigid(String),
    /// Reciprocity was asked for, but the scene leaves out the force arm of rigid segments.
    #[error(
        "reciprocity does not hold without the force arm of rigid segments: leave the choice to the program, or `model.rigid_force_arm` out"
    )]
    NoReciprocity,
    /// A derivative by the coefficient of friction.
    #[error("no number has a derivative by `wall.friction`: friction judges a held tip and changes no equilibrium")]
    FrictionChangesNothing,
    /// The stiffness of a wall that the scene has rigid is swept.
    #[error(
        "the wall is rigid, and kernels leave out what a rigid wall has not: give the scene a stiffness, such as stiffness = \"100 N/m\" under [wall], to sweep it"
    )]
    RigidWall,
    /// A couple at the tip is swept beside a wall.
    #[error(
        "a tip moment has no energy, so stability with a wall is not known: do not sweep `loads.tip_moment`, or leave out `[wall]`"
    )]
    WallWithTipMoment,
}

/// Inputs of a batch: the varying entries of each sample, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// One row a sample, [`Plan::input_count`] columns.
    pub inputs: Blocks<f64>,
    /// Samples whose values make no rod; their inputs hold the plan's own scene.
    pub bad: Vec<bool>,
}

impl Batch {
    /// Some samples of it, in this order.
    pub fn gathered(&self, samples: &[usize]) -> Batch {
        let mut inputs = Blocks::new(self.inputs.column_count(), samples.len());
        for (to, from) in samples.iter().enumerate() {
            (0..inputs.column_count()).for_each(|column| inputs.set(to, column, self.inputs.get(*from, column)));
        }
        Batch { inputs, bad: samples.iter().map(|sample| self.bad[*sample]).collect() }
    }

    /// Rows of the inputs.
    pub fn sample_count(&self) -> usize {
        self.bad.len()
    }
}

impl Terms {
    /// Whether rarely used terms are among them, which the engines keep in kernels of their own.
    pub fn is_general(&self) -> bool {
        self.taper || self.curvature_rise || self.shear || self.magnet
    }
}

impl Plan {
    /// Plans a sweep of `scene` along `axes`, differentiated by `wrt`.
    ///
    /// # Errors
    ///
    /// The scene, a parameter or an option does not allow it; see [`PlanError`].
    pub fn new(
        scene: &Scene,
        axes: &[Vec<Parameter>],
        wrt: &[Parameter],
        options: PlanOptions,
    ) -> Result<Plan, PlanError> {
        scene.validate()?;
        let swept: Vec<Parameter> = axes.iter().flatten().copied().collect();
        let mut probe = scene.clone();
        for parameter in &swept {
            parameter.set(&mut probe, parameter.get(scene))?;
        }
        let inserts = swept.iter().chain(wrt).any(|parameter| *parameter == Parameter::Insertion);
        if inserts && matches!(scene.segments[0].kind, SegmentKind::Rigid(_)) {
            return Err(PlanError::InsertionIntoRigid(scene.segments[0].name.clone()));
        }
        if wrt.contains(&Parameter::Wall(WallParameter::Friction)) {
            return Err(PlanError::FrictionChangesNothing);
        }
        let is_rigid = scene.wall.is_some_and(|wall| wall.stiffness.is_none());
        if is_rigid && swept.contains(&Parameter::Wall(WallParameter::Stiffness)) {
            return Err(PlanError::RigidWall);
        }
        let is_moment = |parameter: &Parameter| matches!(parameter, Parameter::TipMoment(_));
        if scene.wall.is_some() && swept.iter().chain(wrt).any(is_moment) {
            return Err(PlanError::WallWithTipMoment);
        }
        let rod = scene.rod();
        let segments = segment_plans(scene, &rod, &options, &swept);
        let terms = terms_of(scene, &segments, &rod, &swept, !wrt.is_empty());
        let chains: Vec<Vec<(Slot, f64)>> = wrt.iter().map(|parameter| parameter.chain(scene)).collect();
        let forward = is_forward(scene, &terms, chains.iter().map(Vec::as_slice), options.sensitivity)?;
        let mut record = Vec::new();
        rod.write_record(&mut record);
        let mut varying: BTreeSet<usize> =
            swept.iter().flat_map(|parameter| touched_entries(*parameter, scene, &rod, &swept)).collect();
        let free = free_part(&terms, &segments, &chains).map(|segment| FreePart { segment, entry: record.len() });
        if let Some(FreePart { segment, entry }) = free {
            if varying.range(segments[segment].record..).next().is_some() {
                varying.extend(entry..entry + REST_POSE);
            }
            record.extend(rest_pose(&rod.segments[segment..]));
        }
        let mut entries: Vec<Entry> = record.into_iter().map(Entry::Constant).collect();
        for (column, entry) in varying.iter().enumerate() {
            entries[*entry] = Entry::Varying(column);
        }
        let mut input_count = varying.len();
        let mut derivatives = Vec::new();
        for (parameter, chain) in wrt.iter().zip(chains) {
            let varies = swept.iter().any(|other| changes_chain(scene, *parameter, *other));
            let mut terms = Vec::new();
            for (slot, rate) in chain {
                if rate == 0.0 && !varies {
                    continue;
                }
                terms.push((slot, entries.len()));
                entries.push(if varies { Entry::Varying(input_count) } else { Entry::Constant(rate) });
                input_count += usize::from(varies);
            }
            derivatives.push(Derivative { parameter: *parameter, name: parameter.name(scene), terms });
        }
        Ok(Plan {
            scene: scene.clone(),
            axes: axes.to_vec(),
            units: natural_units(&rod),
            terms,
            segments,
            free,
            forward,
            start: None,
            starts_near: false,
            anchors: None,
            entries,
            input_count,
            derivatives,
            options,
        })
    }

    /// A plan for one scene, nothing swept.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`].
    pub fn single(scene: &Scene, wrt: &[Parameter], options: PlanOptions) -> Result<Plan, PlanError> {
        Self::new(scene, &[], wrt, options)
    }

    /// Steps of a pass over the rod.
    pub fn step_count(&self) -> usize {
        self.segments.iter().map(|segment| segment.steps).sum()
    }

    /// Error target of Newton's method and of rules along rigid segments: that of poses, and a small part of that of derivatives,
    /// which are not led to equilibrium to first order as a pose is.
    pub fn target(&self) -> f64 {
        let PlanOptions { tolerance, derivative_tolerance, .. } = self.options;
        if self.derivatives.is_empty() { tolerance } else { tolerance.min(COLUMN_TARGET * derivative_tolerance) }
    }

    /// The target error of derivatives, where there are any.
    pub fn column_tolerance(&self) -> Option<f64> {
        (!self.derivatives.is_empty()).then_some(self.options.derivative_tolerance)
    }

    /// Round-off of a pass over [`ROUND_OFF`](super::tolerances::ROUND_OFF), in numbers of this machine epsilon.
    pub fn stage_noise(&self, epsilon: f64) -> f64 {
        let stepper = self.options.stepper;
        if self.terms.varying_field { stepper.stage_noise() } else { stepper.uniform_stage_noise(epsilon) }
    }

    /// Round-off of a pass, over [`ROUND_OFF`](super::tolerances::ROUND_OFF), for each radian that a rod bends beyond
    /// [`LITTLE_TURN`](super::tolerances::LITTLE_TURN).
    pub fn bend_noise(&self) -> f64 {
        let more = if self.terms.varying_field { FIELD_BEND_NOISE } else { 1.0 };
        more * self.options.stepper.bend_noise()
    }

    /// Into how many parts rules along rigid segments cut each: one, where steps are as long as usual.
    pub fn rigid_parts(&self) -> usize {
        let PlanOptions { steps, refinement, .. } = self.options;
        (steps / STEPS_OF_A_RULE).max(1) * refinement.max(1)
    }

    /// The same plan at another resolution.
    pub fn with_options(&self, options: PlanOptions) -> Plan {
        let swept: Vec<Parameter> = self.axes.iter().flatten().copied().collect();
        let segments = segment_plans(&self.scene, &self.scene.rod(), &options, &swept);
        let chains: Vec<_> =
            self.derivatives.iter().map(|derivative| derivative.parameter.chain(&self.scene)).collect();
        let chains = chains.iter().map(Vec::as_slice);
        let forward = is_forward(&self.scene, &self.terms, chains, options.sensitivity);
        Plan { segments, options, forward: forward.unwrap_or(self.forward), ..self.clone() }
    }

    /// A plan of the same rods without the wall; `None` where the force at the base stays unknown without it. It takes the batches of this
    /// plan and fills the same columns, so its scene keeps the wall.
    pub fn without_wall(&self) -> Option<Plan> {
        let scene = Scene { wall: None, ..self.scene.clone() };
        if !self.terms.wall || scene.has_unknown_force() || self.start.is_some() || self.first_beyond_rigid().is_some()
        {
            return None;
        }
        let swept: Vec<Parameter> = self.axes.iter().flatten().copied().collect();
        let terms = terms_of(&scene, &self.segments, &scene.rod(), &swept, !self.derivatives.is_empty());
        let chains: Vec<_> =
            self.derivatives.iter().map(|derivative| derivative.parameter.chain(&self.scene)).collect();
        let chains = chains.iter().map(Vec::as_slice);
        let forward = is_forward(&scene, &terms, chains, self.options.sensitivity).ok()?;
        let options = PlanOptions { bold: false, ..self.options };
        Some(Plan { terms, forward, options, ..self.clone() })
    }

    /// The scene with a sample's axis values in place. Insertion is applied after the other lengths.
    pub fn sample_scene(&self, row: &[f64]) -> Scene {
        let mut scene = self.scene.clone();
        set_axes(self, row, &mut scene);
        scene
    }

    /// Of the values of all entries, those that vary, with their columns of a batch.
    pub(super) fn varying(&self, values: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        self.entries.iter().zip(values).filter_map(|(entry, value)| match entry {
            Entry::Varying(column) => Some((*column, *value)),
            Entry::Constant(_) => None,
        })
    }

    /// Slots that some derivative uses, each once.
    pub fn slots(&self) -> Vec<Slot> {
        let mut slots = Vec::new();
        for (slot, _) in self.derivatives.iter().flat_map(|derivative| &derivative.terms) {
            if !slots.contains(slot) {
                slots.push(*slot);
            }
        }
        slots
    }

    /// Value of an entry for one sample of a batch, SI.
    pub fn entry(&self, batch: &Batch, sample: usize, entry: usize) -> f64 {
        match self.entries[entry] {
            Entry::Constant(value) => value,
            Entry::Varying(column) => batch.inputs.get(sample, column),
        }
    }

    /// The rod of one sample of a batch.
    pub fn sample_rod(&self, batch: &Batch, sample: usize) -> Rod {
        let mut rod = self.scene.rod();
        self.read_sample_rod(batch, sample, &mut rod);
        rod
    }

    /// The same into a rod of this plan.
    pub fn read_sample_rod(&self, batch: &Batch, sample: usize, rod: &mut Rod) {
        rod.read_record(|entry| self.entry(batch, sample, entry));
    }

    /// The segment of the rod whose curvature at its start is an output of its own: the first flexible one, where rigid
    /// ones come before it and the field varies. Otherwise the base moment tells it.
    pub fn first_beyond_rigid(&self) -> Option<usize> {
        let first = self.segments.iter().position(|segment| segment.is_flexible)?;
        (self.terms.varying_field && first > 0).then_some(first)
    }

    /// Rows of one derivative: tip position, tip rotation and, where they are wanted, base moment and what goes with it: curvature beyond
    /// rigid segments, force at the base.
    pub fn rows(&self) -> usize {
        let further = usize::from(self.first_beyond_rigid().is_some()) + usize::from(self.tells_base_force());
        match self.options.base_moment_rows {
            false => MOST_ROWS - 3,
            true => MOST_ROWS + 3 * further,
        }
    }

    /// First row of a derivative that is of the force at the base; `None` where that is not asked for.
    pub fn base_force_row(&self) -> Option<usize> {
        (self.options.base_moment_rows && self.tells_base_force()).then(|| self.rows() - 3)
    }

    /// Whether the force at the base is asked for and is not that of the loads alone.
    fn tells_base_force(&self) -> bool {
        self.terms.varying_field && self.options.base_force
    }

    /// First column of the solutions after the derivatives, where that of [`Plan::first_beyond_rigid`] has its curvature.
    pub fn own_curvature_column(&self) -> usize {
        Quantity::COUNT + self.rows() * self.derivatives.len()
    }

    /// First column of the force at the base, where the field varies. Searches always hold it: the moment alone is no start.
    pub fn base_force_column(&self) -> Option<usize> {
        let own_curvature = if self.first_beyond_rigid().is_some() { 3 } else { 0 };
        (self.tells_base_force() || self.terms.varying_field && self.searches())
            .then(|| self.own_curvature_column() + own_curvature)
    }

    /// First of the columns that tell how the load of a fold follows each parameter, and how far that may be off; `None` where
    /// that is not asked for.
    pub fn fold_column(&self) -> Option<usize> {
        (self.options.fold_rows && !self.derivatives.is_empty()).then(|| self.column_count_without_folds())
    }

    /// First of the columns of the contact with a wall ([`ContactColumn`]), then four for each derivative: of the normal force, and of
    /// the force.
    pub fn contact_column(&self) -> Option<usize> {
        self.terms.wall.then(|| self.column_count_without_contact())
    }

    /// Columns of the solutions.
    pub fn output_count(&self) -> usize {
        let all = |first| first + ContactColumn::COUNT + 4 * self.derivatives.len();
        self.contact_column().map_or(self.column_count_without_contact(), all)
    }

    fn column_count_without_contact(&self) -> usize {
        self.fold_column().map_or(self.column_count_without_folds(), |first| first + 2 * self.derivatives.len())
    }

    fn column_count_without_folds(&self) -> usize {
        let own_curvature = if self.first_beyond_rigid().is_some() { 3 } else { 0 };
        self.base_force_column().map_or(self.own_curvature_column() + own_curvature, |first| first + 3)
    }

    /// Unit of each entry in the plan's units: divide an SI value by it.
    pub fn entry_units(&self) -> Vec<f64> {
        let units = &self.units;
        let mut scale = Rod::record_units(self.segments.iter().map(|segment| segment.is_flexible), units);
        if let Some(field) = self.scene.rod_field() {
            scale.extend(field.record_units(units));
        }
        if self.scene.wall.is_some() {
            scale.extend(RodWall::record_units(units));
        }
        if self.free.is_some() {
            scale.extend([units.length; 3]);
            scale.extend([1.0; 6]);
        }
        for derivative in &self.derivatives {
            scale.extend(derivative.terms.iter().map(|(slot, _)| slot.unit(units)));
        }
        if let Some(PlanAnchors { grid, .. }) = &self.anchors {
            scale.extend(grid.axes().iter().map(|_| 1.0));
        }
        if self.start.is_some() {
            scale.extend([units.moment(); SEARCH_ENTRIES]);
            scale.resize(scale.len() + self.search_entries() - SEARCH_ENTRIES, units.force);
        }
        scale
    }
}
