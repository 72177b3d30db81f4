//! One call for a trajectory, or for many targets: which inputs within which limits, which options, which engines.

use super::run::{ControlRun, TargetResult, median_step};
use super::{ControlError, ControlOptions, Controller, TargetOptions};
use crate::backend::{BackendKind, Precision};
use crate::engines::{EngineRequest, F32_TOLERANCE, cpu_f64};
use crate::input::{LimitsError, parse_limits};
use crate::model::{Parameter, Plan, Scene, SegmentParameter, Stepper, TipOnWall};
use crate::spec::{ControlInput, Coordinates, Redundancy, Target, Trajectory};
use crate::study::witness::{CheckError, Claim, WitnessCheck};
use std::sync::Arc;

/// Currents may have either sign up to this, unless something is said about them (A).
pub const CURRENT_LIMIT: f64 = 0.3;
/// Points that are followed once more, one at a time, to tell what a lone step takes.
const LONE_STEPS: usize = 200;

/// What a job tells on its way.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ControlEvent {
    /// Nothing was said about inputs: every current is commanded, in either sign.
    EveryCurrent {
        /// In A
        limit: f64,
    },
    /// So many searches of a batch have ended; told about ten times.
    Ended {
        /// Targets whose search has ended.
        ended: usize,
        /// All targets.
        targets: usize,
    },
    /// A trajectory of an experiment has been followed and played.
    Played {
        /// Of the trajectory.
        name: String,
    },
}

type Listener = Arc<dyn Fn(&ControlEvent) + Send + Sync>;

/// Finds the inputs that bring a rod's tip to where it should be.
///
/// What is not said here is taken from the trajectory, and what that leaves open from [`ControlOptions::default`].
///
/// ```
/// use rodsweep::input::parse_scene;
/// use rodsweep::spec::{Target, Trajectory};
/// use rodsweep::study::ControlJob;
///
/// # let text = r#"
/// # name = "short"
/// # [field]
/// # flux_density = [0, 0, "3 T"]
/// # [[segment]]
/// # name = "tube"
/// # kind = "flexible"
/// # length = "90 mm"
/// # stiffness = { bending = "6e-5 N·m²", torsion = "5e-5 N·m²" }
/// # [[segment]]
/// # name = "coil"
/// # kind = "rigid"
/// # length = "5 mm"
/// # coil = { turns = [100, 100, 100], area = ["10 mm^2", "10 mm^2", "10 mm^2"] }
/// # "#;
/// let scene = parse_scene("scene.toml".as_ref(), text)?;
/// let targets = vec![Target::at([0.002, 0.0, 0.0]), Target::at([0.002, 0.001, 0.0])];
/// let mut trajectory = Trajectory::new("corner", targets);
/// trajectory.coordinates = [true, true, false];
/// let run = ControlJob::new(scene).input("coil.current=0.3 A")?.tolerance(1e-6).follow(&trajectory)?;
/// for result in run.results() {
///     println!("{:?} A, {:.1e} m off", result.inputs, run.tip_error(result));
/// }
/// assert_eq!(run.missed_count(), 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct ControlJob {
    scene: Scene,
    inputs: Vec<ControlInput>,
    coordinates: Option<Coordinates>,
    tolerance: Option<f64>,
    most_iterations: Option<usize>,
    tangent_weight: Option<f64>,
    redundancy: Option<Redundancy>,
    targets: TargetOptions,
    engine: EngineRequest,
    times_lone_steps: bool,
    listener: Option<Listener>,
}

impl ControlJob {
    /// Everything is left to the trajectory.
    pub fn new(scene: Scene) -> ControlJob {
        ControlJob {
            scene,
            inputs: Vec::new(),
            coordinates: None,
            tolerance: None,
            most_iterations: None,
            tangent_weight: None,
            redundancy: None,
            targets: TargetOptions::default(),
            engine: EngineRequest::any(),
            times_lone_steps: false,
            listener: None,
        }
    }

    /// Adds what is commanded, such as `coil.current=0.3` (either sign) or `insertion=85 mm..100 mm`.
    ///
    /// # Errors
    ///
    /// Text that says no such thing, or an input that is there already.
    pub fn input(mut self, text: &str) -> Result<ControlJob, LimitsError> {
        for input in parse_limits(&self.scene, text)? {
            if self.inputs.iter().any(|other| other.parameter == input.parameter) {
                return Err(LimitsError::Twice { name: input.name(&self.scene) });
            }
            self.inputs.push(input);
        }
        Ok(self)
    }

    /// Everything that is commanded; none leaves it to the trajectory.
    pub fn inputs(self, inputs: Vec<ControlInput>) -> ControlJob {
        ControlJob { inputs, ..self }
    }

    /// Which coordinates are controlled: `[true, true, false]` for x and y of the tip, or [`Coordinates`] with the normal force.
    pub fn coordinates(self, coordinates: impl Into<Coordinates>) -> ControlJob {
        ControlJob { coordinates: Some(coordinates.into()), ..self }
    }

    /// A target is reached where so much is left of it (m).
    pub fn tolerance(self, tolerance: f64) -> ControlJob {
        ControlJob { tolerance: Some(tolerance), ..self }
    }

    /// Equilibria for one target, at most.
    pub fn most_iterations(self, most_iterations: usize) -> ControlJob {
        ControlJob { most_iterations: Some(most_iterations), ..self }
    }

    /// Length by which a tangent's error counts (m).
    pub fn tangent_weight(self, tangent_weight: f64) -> ControlJob {
        ControlJob { tangent_weight: Some(tangent_weight), ..self }
    }

    /// What becomes of inputs that the tip does not need.
    pub fn redundancy(self, redundancy: Redundancy) -> ControlJob {
        ControlJob { redundancy: Some(redundancy), ..self }
    }

    /// Where the searches for many targets begin.
    pub fn target_options(self, targets: TargetOptions) -> ControlJob {
        ControlJob { targets, ..self }
    }

    /// What solves. A trajectory is followed on the CPU in f64 unless another engine is asked for.
    pub fn engine(self, engine: EngineRequest) -> ControlJob {
        ControlJob { engine, ..self }
    }

    /// Whether a trajectory's first points are followed once more, one at a time, to tell what a lone step takes.
    pub fn time_lone_steps(self, times_lone_steps: bool) -> ControlJob {
        ControlJob { times_lone_steps, ..self }
    }

    /// Who hears what the job tells on its way.
    pub fn on_event(self, listener: impl Fn(&ControlEvent) + Send + Sync + 'static) -> ControlJob {
        ControlJob { listener: Some(Arc::new(listener)), ..self }
    }

    /// The scene that is controlled.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Inputs for each target, one after another: the first from rest, each other from where the last one ended.
    ///
    /// # Errors
    ///
    /// A scene without anything to command, limits that make no sense, no equilibrium to begin from, or an engine that
    /// cannot be used.
    pub fn follow(&self, trajectory: &Trajectory) -> Result<ControlRun, ControlError> {
        let trajectory = &self.chosen(trajectory)?;
        let (inputs, options) = (self.inputs_for(trajectory)?, self.options_for(trajectory));
        let targets = &trajectory.targets;
        let engine = self.engine.choose_for_one(&self.scene, options.tolerance)?;
        let mut many = |plan: &Plan| engine.make(plan);
        let mut controller = Controller::new(&self.scene, &inputs, options, engine.steppers()[0], &mut many)?;
        if engine.kind() == BackendKind::Cpu {
            controller = controller.for_trajectories(&mut many, &mut |plan| engine.make_for_one(plan))?;
        }
        let results = controller.follow(targets)?;
        let mut seconds_of_a_lone_step = None;
        if self.times_lone_steps {
            let lone = controller.follow_singly(&targets[..targets.len().min(LONE_STEPS)])?;
            seconds_of_a_lone_step = median_step(&lone);
        }
        let (options, engine) = (*controller.options(), controller.engine());
        let run = self.run(trajectory, inputs, options, results, engine)?;
        Ok(ControlRun { in_order: true, seconds_of_a_lone_step, ..run })
    }

    /// Inputs for each target, whatever their order, all at once. What f32 cannot reach is finished in f64.
    ///
    /// # Errors
    ///
    /// As [`ControlJob::follow`].
    pub fn reach(&self, trajectory: &Trajectory) -> Result<ControlRun, ControlError> {
        let trajectory = &self.chosen(trajectory)?;
        let (inputs, options) = (self.inputs_for(trajectory)?, self.options_for(trajectory));
        // f32 on a GPU, finished in f64.
        let engine = self.engine.choose_for(&self.scene, F32_TOLERANCE)?;
        let mut make = |plan: &Plan| engine.make(plan);
        let mut controller = Controller::new(&self.scene, &inputs, options, engine.steppers()[0], &mut make)?;
        if engine.kind() == BackendKind::Cpu {
            controller = controller.for_targets(&mut make)?;
        }
        let mut results = self.reach_all(&mut controller, &trajectory.targets)?;
        let mut words = controller.engine();
        if controller.options().tolerance > options.tolerance && engine.precision() == Precision::F32 {
            let mut fine = Controller::new(&self.scene, &inputs, options, Stepper::Dop853, &mut |plan| cpu_f64(plan))?;
            fine.finish(&mut results)?;
            words += &format!(", finished on {}", fine.engine());
        }
        self.run(trajectory, inputs, options, results, words)
    }

    fn reach_all(&self, controller: &mut Controller, targets: &[Target]) -> Result<Vec<TargetResult>, ControlError> {
        let mut last = 0;
        controller.reach(targets, &self.targets, &mut |ended| {
            if ended >= last + targets.len().div_ceil(10) {
                self.tell(ControlEvent::Ended { ended, targets: targets.len() });
                last = ended;
            }
        })
    }

    fn run(
        &self,
        trajectory: &Trajectory,
        inputs: Vec<ControlInput>,
        options: ControlOptions,
        results: Vec<TargetResult>,
        engine: String,
    ) -> Result<ControlRun, ControlError> {
        let (scene, trajectory) = (self.scene.clone(), trajectory.clone());
        let driven: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
        let mut claim = |at: usize| {
            let result = &results[at];
            let is_one = result.from_rest && result.margin > 0.0;
            let claim =
                || Claim { inputs: result.inputs.clone(), tip: result.tip, error_estimate: result.error_estimate };
            is_one.then(claim)
        };
        let check = WitnessCheck::of(&scene, &driven, results.len(), &mut claim).map_err(|error| match error {
            CheckError::Plan(error) => ControlError::from(error),
            CheckError::Backend(error) => error.into(),
        })?;
        Ok(ControlRun {
            scene,
            trajectory,
            inputs,
            options,
            results,
            engine,
            in_order: false,
            seconds_of_a_lone_step: None,
            check,
        })
    }

    pub(in crate::study) fn tell(&self, event: ControlEvent) {
        if let Some(listener) = &self.listener {
            listener(&event);
        }
    }

    /// The trajectory with forces where they are controlled.
    fn chosen(&self, trajectory: &Trajectory) -> Result<Trajectory, ControlError> {
        let mut trajectory = trajectory.clone();
        match self.coordinates {
            Some(coordinates) if coordinates.normal_force => {
                if let Some(at) = trajectory.targets.iter().position(|target| target.normal_force.is_none()) {
                    return Err(ControlError::NoForce { target: at });
                }
            }
            Some(_) => trajectory.targets.iter_mut().for_each(|target| target.normal_force = None),
            None => {}
        }
        let slides = self.scene.wall.is_some_and(|wall| wall.tip == TipOnWall::Slides);
        for (target, force) in trajectory.targets.iter().enumerate().filter_map(|(k, at)| Some((k, at.normal_force?))) {
            if slides && force < 0.0 {
                return Err(ControlError::Pulls { target, force });
            }
        }
        match self.scene.wall.is_none() && trajectory.targets.iter().any(|target| target.normal_force.is_some()) {
            true => Err(ControlError::NoWall),
            false => Ok(trajectory),
        }
    }

    /// Inputs and limits: those given here, else those of the trajectory, else every current.
    fn inputs_for(&self, trajectory: &Trajectory) -> Result<Vec<ControlInput>, ControlError> {
        if let Some(inputs) = [&self.inputs, &trajectory.inputs].into_iter().find(|inputs| !inputs.is_empty()) {
            return Ok(inputs.clone());
        }
        let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
        let currents: Vec<Parameter> = Parameter::all(&self.scene).into_iter().filter(is_current).collect();
        if currents.is_empty() {
            return Err(ControlError::NoInputs);
        }
        self.tell(ControlEvent::EveryCurrent { limit: CURRENT_LIMIT });
        Ok(currents.into_iter().map(|parameter| ControlInput::within(parameter, CURRENT_LIMIT)).collect())
    }

    fn options_for(&self, trajectory: &Trajectory) -> ControlOptions {
        let of_trajectory = ControlOptions::of(trajectory);
        ControlOptions {
            coordinates: self.coordinates.map_or(of_trajectory.coordinates, |coordinates| coordinates.position),
            free_direction: of_trajectory.free_direction,
            tangent_weight: self.tangent_weight.unwrap_or(of_trajectory.tangent_weight),
            tolerance: self.tolerance.unwrap_or(of_trajectory.tolerance),
            most_iterations: self.most_iterations.unwrap_or(of_trajectory.most_iterations),
            redundancy: self.redundancy.unwrap_or(of_trajectory.redundancy),
        }
    }
}
