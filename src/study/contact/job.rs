//! One call for a map of contacts: from a sweep with a wall to the forces that the tip can press with at each of its points.

use super::error::ContactError;
use super::lattice::{Region, WallLattice};
use super::map::{Answer, Cause, ContactMap, PointResult};
use super::robust::{ContactDesign, RobustContact};
use super::rows::{Ask, HeldRod, Row, net};
use super::search::{Aim, Forecast, INSIDE, Learned, Rules, Search, WELL_INSIDE};
use crate::draw::count;
use crate::engines::EngineRequest;
use crate::model::{Axis, Parameter, Plan, PlanOptions, Quantity, Scene, Status, Vector};
use crate::spec::SweepSpec;
use crate::study::witness::{CheckError, Press, WitnessCheck, is_raised};
use crate::study::workspace::{Inputs, MOST_INPUTS, WorkspaceInput, base_scene, draw_designs, workspace_inputs};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Points of one map, at most: searches keep some 30 kB for each.
const MOST_POINTS: f64 = 1e5;
/// Normal forces below this share of EI/L² count as none.
const FLOOR: f64 = 1e-4;
/// Coarse lattices up to so many points, and points without neighbours, are tried at the middle of all limits and at a net.
const SCATTERED: usize = 32;
const NET: u64 = 64;
const NET_SEED: u64 = 0xc027;
/// Searches from the best of the net, so far from each other, and answers of a point that are kept.
const RUNS: usize = 8;
const SCATTER: f64 = 0.3;
/// Answers of neighbours from which a coarse point begins.
const COARSE: usize = 2;
const MODES: usize = 4;
/// Answers of a neighbour, the best first, that are looked at as starts.
const PROMISING: usize = 2;
/// Inputs so far from each other are of different answers.
const APART: f64 = 0.2;
/// How far from a neighbour's inputs those of a point are looked for.
const FORECAST: f64 = 0.3;
/// Weight of violations that choose among starts.
const WEIGHT: f64 = 10.0;
/// First step of a search from a net and from the inputs of a neighbour, over half the range.
const FIRST: f64 = 0.5;
const NEAR: f64 = 0.25;
/// How often neighbours start each other again, and by what share their force must be better.
const ROUNDS: usize = 6;
const BETTER: f64 = 1e-3;
/// Neighbours whose own inputs are tried beside the best forecast, and how far apart these are.
const OWN_INPUTS: usize = 2;
const SIMILAR: f64 = 0.03;
/// How much worse than the middle of its neighbours an answer is odd, over the larger of that and the unit of force, and how often such
/// begin again.
const ODD: f64 = 0.02;
const MENDS: usize = 2;
/// Inputs so near a limit are at it.
const AT_LIMIT: f64 = 1.0 - 1e-6;

/// Finds which force the tip can press where.
///
/// ```no_run
/// use rodsweep::spec::SweepSpec;
/// use rodsweep::study::contact::ContactJob;
///
/// let spec = SweepSpec::read("sweep.toml".as_ref())?;
/// let map = ContactJob::of_sweep(&spec).extent(Some(30e-3)).run()?;
/// println!("{:.1} cm² of the wall", 1e4 * map.area());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct ContactJob<'a> {
    spec: &'a SweepSpec,
    request: EngineRequest,
    spacing: f64,
    extent: Option<f64>,
    minimum_margin: f64,
    force: Option<f64>,
    interrupt: Option<&'a AtomicBool>,
    progress: Option<&'a dyn Fn(ContactStage)>,
}

/// What a job is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactStage {
    /// Points looked at, and all points.
    Points(usize, usize),
    /// Designs looked at, and all designs.
    Designs(usize, usize),
}

impl ContactStage {
    /// A line of progress.
    pub fn words(&self) -> String {
        let (done, all, what) = match self {
            ContactStage::Points(done, all) => (done, all, "points"),
            ContactStage::Designs(done, all) => (done, all, "designs"),
        };
        format!("{} of {} {what}", count(*done as u64), count(*all as u64))
    }
}

/// Where a point stands: searches for its most (or its least friction) and for its least force, the best first.
#[derive(Clone, Debug, Default)]
struct Place {
    most: Vec<Search>,
    least: Vec<Search>,
    /// What became of inputs that gave no equilibrium that can be used.
    failures: Vec<Status>,
}

impl Place {
    fn is_reached(&self) -> bool {
        self.most.first().is_some_and(|search| search.best.is_some())
    }

    fn of(&self, aim: Aim) -> impl Iterator<Item = &Search> {
        if aim == Aim::Least { self.least.iter() } else { self.most.iter() }
    }

    fn best(&self, aim: Aim) -> Option<(Inputs, Row)> {
        self.of(aim).next().and_then(|search| search.best)
    }

    /// The best answer to an aim; where no search for the least force has one, the answer with the most force holds for the least, too.
    fn answer(&self, aim: Aim) -> Option<(Inputs, Row)> {
        self.best(aim).or_else(|| self.most.first().filter(|_| aim == Aim::Least)?.best)
    }

    fn searches_for(&mut self, aim: Aim) -> &mut Vec<Search> {
        if aim == Aim::Least { &mut self.least } else { &mut self.most }
    }

    /// The answer to an aim is this row, solved with care.
    fn confirm(&mut self, rules: &Rules, row: Row) {
        if let Some(Search { best: Some((_, best)), .. }) = self.searches_for(rules.aim).first_mut() {
            *best = row;
        }
    }

    /// Keeps a search if it is better than those that ended at about the same inputs.
    fn offer(&mut self, rules: &Rules, search: Search) {
        let all = self.searches_for(rules.aim);
        all.push(search);
        all.sort_by(|a, b| rules.compare(a, b));
        let mut kept: Vec<Search> = Vec::new();
        for search in all.drain(..) {
            if kept.len() < MODES && kept.iter().all(|other| far(&other.end(), &search.end()) > APART) {
                kept.push(search);
            }
        }
        *all = kept;
    }
}

/// Largest difference of two inputs.
fn far(a: &Inputs, b: &Inputs) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

impl<'a> ContactJob<'a> {
    /// Of the inputs and the wall of a sweep; nothing of it needs to have been run.
    pub fn of_sweep(spec: &'a SweepSpec) -> ContactJob<'a> {
        ContactJob {
            spec,
            request: EngineRequest::any(),
            spacing: spec.workspace.voxel,
            extent: None,
            minimum_margin: spec.workspace.minimum_margin,
            force: None,
            interrupt: None,
            progress: None,
        }
    }

    /// What is asked of the engine.
    pub fn engine(self, request: EngineRequest) -> Self {
        ContactJob { request, ..self }
    }

    /// Distance of neighbouring points (m).
    pub fn spacing(self, spacing: f64) -> Self {
        ContactJob { spacing, ..self }
    }

    /// How far points are from the middle along the wall, at most (m); `None`: as far as the rod is long.
    pub fn extent(self, extent: Option<f64>) -> Self {
        ContactJob { extent, ..self }
    }

    /// Least stability margin of an equilibrium that counts.
    pub fn minimum_margin(self, margin: f64) -> Self {
        ContactJob { minimum_margin: margin, ..self }
    }

    /// The least coefficient of friction at this normal force (N), in place of the range of forces.
    pub fn force(self, force: Option<f64>) -> Self {
        ContactJob { force, ..self }
    }

    /// A flag that ends the job, within a batch as well.
    pub fn interrupt(self, flag: &'a AtomicBool) -> Self {
        ContactJob { interrupt: Some(flag), ..self }
    }

    /// Who hears what the job is at.
    pub fn progress(self, progress: Option<&'a dyn Fn(ContactStage)>) -> Self {
        ContactJob { progress, ..self }
    }

    /// Finds the forces.
    ///
    /// # Errors
    ///
    /// A scene without a wall, options that make no sense, inputs that none can command, an engine that fails, or the caller's
    /// interruption.
    pub fn run(&self) -> Result<ContactMap, ContactError> {
        let start = Instant::now();
        self.check_options()?;
        let (inputs, notes) = workspace_inputs(self.spec)?;
        let scene = base_scene(self.spec);
        let Some(wall) = scene.wall else { return Err(ContactError::NoWall { file: self.spec.file.clone() }) };
        if self.force.is_none() && wall.friction.is_none() {
            return Err(ContactError::NoFriction { file: self.spec.file.clone() });
        }
        let engine = self.request.choose_for(&scene, self.spec.tolerance)?;
        let surface = wall.rod_wall();
        let region = self.region(&scene, &inputs)?;
        let count = WallLattice::expected(&surface, self.spacing, &region);
        if count > MOST_POINTS {
            let (spacing, fits) = (self.spacing, self.spacing * (count / MOST_POINTS).sqrt());
            return Err(ContactError::TooManyPoints { spacing, count, most: MOST_POINTS, fits });
        }
        let lattice = WallLattice::new(&surface, self.spacing, &region);
        if lattice.is_empty() {
            return Err(ContactError::OutOfReach { reach: region.reach });
        }
        let mut rod = HeldRod::new(&scene, &inputs, (&engine, self.spec.tolerance, self.spec.steps), self.interrupt)?;
        let rules = Rules {
            aim: self.force.map_or(Aim::Most, Aim::Ratio),
            count: inputs.len(),
            friction: wall.friction.unwrap_or(0.0),
            minimum_margin: self.minimum_margin,
            floor: FLOOR * rod.unit(),
            unit: self.force.unwrap_or(rod.unit()),
            inside: INSIDE,
            is_any_enough: false,
        };
        let mut work = Work { job: self, lattice: &lattice, rod: &mut rod, rules, places: Vec::new(), design: None };
        work.places.resize_with(lattice.len(), Place::default);
        work.run()?;
        let points: Vec<PointResult> = work.places.iter().map(|place| result(place, &rules)).collect();
        let check = self.check(&mut rod, &lattice, &points)?;
        Ok(ContactMap {
            check,
            points,
            extent: self.extent,
            minimum_margin: self.minimum_margin,
            force: self.force,
            friction: wall.friction,
            solves: rod.solves(),
            engine: rod.engine(),
            method: rod.method(),
            seconds: start.elapsed().as_secs_f64(),
            lattice,
            scene,
            inputs,
            notes,
        })
    }

    /// At which points of a map so many uncertain designs hold, each with inputs of its own.
    ///
    /// # Errors
    ///
    /// A sweep that calls nothing uncertain, designs that make no rod, a map at a given force, or as [`ContactJob::run`].
    pub fn robust(&self, map: &ContactMap, designs: usize) -> Result<RobustContact, ContactError> {
        if map.force.is_some() {
            return Err(ContactError::RobustForce);
        }
        let drawn = draw_designs(self.spec, &map.scene, designs, self.spec.workspace.seed)?;
        let engine = self.request.choose_for(&map.scene, self.spec.tolerance)?;
        let names = self.spec.uncertain.iter().map(|axis| axis.name(&map.scene)).collect();
        let mut robust = RobustContact { names, designs: Vec::new(), counts: vec![0; map.points.len()], solves: 0 };
        for (number, (values, scene)) in drawn.into_iter().enumerate() {
            let method = (&engine, self.spec.tolerance, Some(map.method.steps));
            let mut rod = HeldRod::new(&scene, &map.inputs, method, self.interrupt)?;
            let rules = Rules {
                aim: Aim::Most,
                count: map.inputs.len(),
                friction: scene.wall.and_then(|wall| wall.friction).unwrap_or(0.0),
                minimum_margin: self.minimum_margin,
                floor: FLOOR * rod.unit(),
                unit: rod.unit(),
                inside: WELL_INSIDE,
                is_any_enough: true,
            };
            let (lattice, design) = (&map.lattice, Some((number, designs)));
            let mut work = Work { job: self, lattice, rod: &mut rod, rules, places: Vec::new(), design };
            work.places.resize_with(map.points.len(), Place::default);
            // Between both answers of the nominal rod friction has something left; where that does not do, from each of them.
            let start = |(at, point): (usize, &PointResult)| {
                let (most, least) = (point.most?.inputs, point.least?.inputs);
                let between = std::array::from_fn(|k| 0.5 * (most[k] + least[k]));
                Some(Trial::new(at, [least, most, between].map(|inputs| (inputs, Learned::default())).into()))
            };
            let trials = map.points.iter().enumerate().filter_map(start).collect();
            work.pursue(rules, trials)?;
            work.help_each_other(rules)?;
            work.confirm(rules)?;
            let mut area = 0.0;
            for at in (0..work.places.len()).filter(|at| work.places[*at].is_reached()) {
                robust.counts[at] += 1;
                area += map.lattice.areas[at];
            }
            robust.designs.push(ContactDesign { values, area });
            robust.solves += rod.solves();
        }
        Ok(robust)
    }

    /// Solves a share of the answers again by the reference and compares tips and normal forces.
    fn check(
        &self,
        rod: &mut HeldRod<'_>,
        lattice: &WallLattice,
        points: &[PointResult],
    ) -> Result<WitnessCheck, ContactError> {
        // An even choice takes from both.
        let most = points.iter().enumerate().filter_map(|(at, point)| Some((at, point.most?)));
        let least = points.iter().enumerate().filter_map(|(at, point)| Some((at, point.least?)));
        let answers: Vec<(usize, Answer)> =
            most.chain(least.filter(|(at, answer)| points[*at].most != Some(*answer))).collect();
        let (scene, driven) = rod.held();
        let (scene, driven) = (scene.clone(), driven.to_vec());
        let mut failed = None;
        let mut claim = |number: usize| {
            if is_raised(self.interrupt) {
                return None;
            }
            let (at, answer) = answers[number];
            match rod.claim(lattice.points[at], answer.inputs) {
                Ok(claim) => claim.map(|(claim, press)| (claim, Some(Press { force: answer.force, ..press }))),
                Err(error) => {
                    failed = Some(error);
                    None
                }
            }
        };
        let check = WitnessCheck::of_presses(&scene, &driven, answers.len(), &mut claim, self.interrupt);
        match failed {
            Some(error) => return Err(error),
            None if is_raised(self.interrupt) => return Err(ContactError::Interrupted),
            None => {}
        }
        check
            .map_err(|error| match error {
                CheckError::Plan(error) => ContactError::from(error),
                CheckError::Backend(error) => error.into(),
            })?
            .ok_or(ContactError::Interrupted)
    }

    fn check_options(&self) -> Result<(), ContactError> {
        let is_length = |x: f64| (1e-12..=1e60).contains(&x);
        match (self.extent, self.force) {
            _ if !is_length(self.spacing) => Err(ContactError::Spacing(self.spacing)),
            _ if !(0.0..1.0).contains(&self.minimum_margin) => Err(ContactError::Margin(self.minimum_margin)),
            (Some(extent), _) if !is_length(extent) => Err(ContactError::Extent(extent)),
            (_, Some(force)) if !(force > 0.0 && force < 1e60) => Err(ContactError::Force(force)),
            _ => Ok(()),
        }
    }

    /// Where points are wanted: about the foot of the free tip at the middle of all limits, within reach of the rod.
    fn region(&self, scene: &Scene, inputs: &[WorkspaceInput]) -> Result<Region, ContactError> {
        use Parameter::{BasePosition, Insertion};
        let inserted = inputs.iter().filter(|input| input.parameters.contains(&Insertion)).map(|input| input.high);
        let length = inserted.fold(scene.total_length(), f64::max);
        let moves = |axis: Axis| {
            let own = inputs.iter().filter(move |input| input.parameters.contains(&BasePosition(axis)));
            own.map(WorkspaceInput::half_range).sum::<f64>()
        };
        let travel = Axis::ALL.map(moves).iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut free = Scene { wall: None, ..scene.clone() };
        let middle = inputs.iter().flat_map(|input| {
            input.parameters.iter().zip(&input.rates).map(|(parameter, rate)| (*parameter, rate * input.value(0.0)))
        });
        // Limits that make no scene are refused with the plan.
        let _ = Parameter::set_all(&mut free, middle);
        let base = free.base.position;
        let plan = Plan::new(&free, &[], &[], PlanOptions::default())?;
        let solutions = crate::engines::cpu_f64(&plan)?.solve(&plan.batch(1, |_, _| {}))?;
        let tip = solutions.vector(0, Quantity::TipPosition);
        let middle = self.middle(scene, tip, base);
        Ok(Region { middle, base, reach: length + travel, extent: self.extent })
    }

    /// The foot of the tip, or where that has none, of the base, or of a point beside the wall's own.
    fn middle(&self, scene: &Scene, tip: Vector, base: Vector) -> Vector {
        let Some(wall) = scene.wall else { return tip };
        let surface = wall.rod_wall();
        let beside = std::array::from_fn(|k| wall.position[k] + [0.3, 0.5, 0.7][k]);
        let feet = [tip, base, beside].map(|point| surface.foot(point));
        feet.into_iter().find(|foot| foot.iter().all(|x| x.is_finite())).unwrap_or(beside)
    }
}

/// A map in the making.
struct Work<'a, 'b> {
    job: &'a ContactJob<'a>,
    lattice: &'b WallLattice,
    rod: &'b mut HeldRod<'a>,
    rules: Rules,
    places: Vec<Place>,
    /// Number of the uncertain design, and of all of them.
    design: Option<(usize, usize)>,
}

/// Inputs, and what is known of the response there.
type Start = (Inputs, Learned);

/// Inputs to be tried at a point, the last first, and the search that begins where one of them gives an equilibrium.
struct Trial {
    at: usize,
    queue: Vec<Start>,
    search: Option<Search>,
    failures: Vec<Status>,
    /// Whether every row is solved with care, and whether the next one is.
    is_careful: bool,
    needs_care: bool,
}

impl Trial {
    fn new(at: usize, queue: Vec<Start>) -> Trial {
        Trial { at, queue, search: None, failures: Vec::new(), is_careful: false, needs_care: false }
    }

    fn next(&self) -> Option<Inputs> {
        match &self.search {
            Some(search) => search.next,
            None => self.queue.last().map(|(inputs, _)| *inputs),
        }
    }

    /// Takes in the row of what was to be solved next, at a point that may have an answer.
    fn judge(&mut self, rules: &Rules, row: Row, answer: Option<Row>) {
        // A given force may be had next to a fold alone.
        let seeks_force = |search: &Search| matches!(rules.aim, Aim::Ratio(_)) && search.best.is_none();
        let is_open = !row.has_care && row.status == Status::Pending;
        self.needs_care = is_open && self.search.as_ref().is_none_or(seeks_force);
        if self.needs_care {
            return;
        }
        if let Some(search) = &mut self.search {
            search.judge(rules, row);
        } else if let Some((inputs, learned)) = self.queue.pop() {
            if !row.status.is_success() {
                self.failures.push(row.status);
                return;
            }
            self.queue.clear();
            let search = Search::new(rules, (inputs, row), (NEAR, learned));
            if answer.is_none_or(|answer| search.may_improve(rules, &answer, BETTER)) {
                self.search = Some(search);
            }
        }
    }
}

impl Work<'_, '_> {
    fn run(&mut self) -> Result<(), ContactError> {
        self.spread(self.rules)?;
        self.help_each_other(self.rules)?;
        self.mend(self.rules)?;
        self.confirm(self.rules)?;
        if self.job.force.is_none() {
            let rules = Rules { aim: Aim::Least, ..self.rules };
            self.spread(rules)?;
            self.help_each_other(rules)?;
            self.mend(rules)?;
            self.confirm(rules)?;
        }
        Ok(())
    }

    /// From coarse points to fine ones: each begins with the inputs that its neighbours promise most of.
    fn spread(&mut self, rules: Rules) -> Result<(), ContactError> {
        let mut done: Vec<usize> = Vec::new();
        let groups = self.lattice.groups();
        let count = groups.len();
        for (number, group) in groups.into_iter().enumerate() {
            let spacing = (self.lattice.len() as f64 / done.len().max(1) as f64).sqrt() * self.lattice.spacing;
            let near = self.lattice.among(&done, 1.6 * spacing);
            let is_wanted = |at: &usize| rules.aim != Aim::Least || self.places[*at].is_reached();
            let group: Vec<usize> = group.into_iter().filter(is_wanted).collect();
            let (lattice, places) = (self.lattice, &self.places);
            let interrupt = self.job.interrupt;
            let rate = |at: &usize| {
                let near = if is_raised(interrupt) { Vec::new() } else { near.of(*at) };
                (*at, near.is_empty(), forecasts(lattice, places, &rules, *at, &near))
            };
            let rated: Vec<(usize, bool, Vec<Forecast>)> = group.par_iter().map(rate).collect();
            self.goes_on()?;
            let are_few = done.len() < SCATTERED;
            let mut scattered: Vec<usize> = if are_few { group.clone() } else { Vec::new() };
            let mut trials = Vec::new();
            for (at, is_alone, forecasts) in rated {
                let mut starts: Vec<Start> = Vec::new();
                for forecast in forecasts {
                    if starts.iter().all(|(other, _)| far(other, &forecast.inputs) > APART) {
                        starts.push((forecast.inputs, *forecast.learned));
                    }
                }
                if number + 1 == count {
                    // On the finest lattice the others stand in where the first is no equilibrium.
                    starts.truncate(2);
                    starts.reverse();
                    trials.push(Trial::new(at, starts));
                } else {
                    trials.extend(starts.into_iter().take(COARSE).map(|start| Trial::new(at, vec![start])));
                }
                if is_alone && !are_few {
                    scattered.push(at);
                }
            }
            self.pursue(rules, trials)?;
            if rules.aim != Aim::Least {
                self.scatter(rules, &scattered)?;
            }
            done.extend(group);
        }
        Ok(())
    }

    /// Searches from the best inputs of a net over all limits.
    fn scatter(&mut self, rules: Rules, group: &[usize]) -> Result<(), ContactError> {
        let mut inputs = vec![[0.0; MOST_INPUTS]];
        inputs.extend(net(rules.count, NET, NET_SEED));
        let ask =
            |at: &usize, inputs: &Inputs| Ask { place: self.lattice.points[*at], inputs: *inputs, has_care: false };
        let each = |at: &usize| inputs.iter().map(|inputs| ask(at, inputs)).collect::<Vec<_>>();
        let asked: Vec<Ask> = group.iter().flat_map(each).collect();
        let rows = self.rod.solve(&asked)?;
        let least = (rules.aim == Aim::Most).then_some(Rules { aim: Aim::Least, ..rules });
        for rules in [Some(rules), least].into_iter().flatten() {
            let mut trials = Vec::new();
            for (at, rows) in group.iter().zip(rows.chunks(inputs.len())) {
                let mut order: Vec<usize> = (0..rows.len()).filter(|k| rows[*k].status.is_success()).collect();
                order.sort_by(|a, b| rules.merit(&rows[*a], WEIGHT).total_cmp(&rules.merit(&rows[*b], WEIGHT)));
                let mut chosen: Vec<usize> = Vec::new();
                for k in order {
                    if chosen.iter().all(|other| far(&inputs[*other], &inputs[k]) > SCATTER) {
                        chosen.push(k);
                    }
                }
                if chosen.is_empty() {
                    self.places[*at].failures.extend(rows.iter().map(|row| row.status));
                }
                trials.extend(chosen.into_iter().take(RUNS).map(|k| {
                    let start = (inputs[k], Learned::default());
                    let search = Search::new(&rules, (inputs[k], rows[k]), (FIRST, start.1));
                    Trial { search: Some(search), ..Trial::new(*at, vec![start]) }
                }));
            }
            self.pursue(rules, trials)?;
        }
        Ok(())
    }

    /// Tries inputs at points and searches from there, all at once. An answer that is there gives way to a better one.
    fn pursue(&mut self, rules: Rules, mut trials: Vec<Trial>) -> Result<(), ContactError> {
        loop {
            let mut open: Vec<(&mut Trial, Inputs)> =
                trials.iter_mut().filter_map(|trial| trial.next().map(|next| (trial, next))).collect();
            if open.is_empty() {
                break;
            }
            let points = &self.lattice.points;
            let ask = |(trial, next): &(&mut Trial, Inputs)| Ask {
                place: points[trial.at],
                inputs: *next,
                has_care: trial.is_careful || trial.needs_care,
            };
            let asked: Vec<Ask> = open.iter().map(ask).collect();
            let rows = self.rod.solve(&asked)?;
            let (places, interrupt) = (&self.places, self.job.interrupt);
            open.par_iter_mut().zip(rows).for_each(|((trial, _), row)| {
                if !is_raised(interrupt) {
                    let answer = places[trial.at].best(rules.aim).map(|(_, row)| row);
                    trial.judge(&rules, row, answer);
                }
            });
            self.tell();
            self.goes_on()?;
        }
        for Trial { at, search, failures, .. } in trials {
            match search {
                Some(search) => self.places[at].offer(&rules, search),
                None => self.places[at].failures.extend(failures),
            }
        }
        Ok(())
    }

    /// Points begin again from neighbours: where they are not reached themselves, or where a neighbour promises a better answer.
    fn help_each_other(&mut self, rules: Rules) -> Result<(), ContactError> {
        let near = self.lattice.neighbours();
        let mut changed: Vec<bool> = vec![true; self.places.len()];
        for _ in 0..ROUNDS {
            let (lattice, places, interrupt) = (self.lattice, &self.places, self.job.interrupt);
            let start = |at: usize| {
                if is_raised(interrupt) {
                    return None;
                }
                let own = places[at].best(rules.aim);
                if rules.aim == Aim::Least && own.is_none() || rules.is_any_enough && own.is_some() {
                    return None;
                }
                let others: Vec<usize> = near.of(at).into_iter().filter(|other| changed[*other]).collect();
                let forecasts = forecasts(lattice, places, &rules, at, &others);
                let promises = |forecast: &Forecast| match &own {
                    Some((_, row)) => forecast.is_better(&rules, row, BETTER),
                    None => forecast.may_hold(),
                };
                let first = forecasts.iter().find(|forecast| promises(forecast))?;
                // A forecast may lead to another equilibrium than its neighbour's; the neighbours' own inputs rarely do.
                let mut starts: Vec<Start> = vec![(first.inputs, *first.learned)];
                let mut best: Vec<&Search> =
                    others.iter().filter_map(|other| places[*other].of(rules.aim).next()).collect();
                best.sort_by(|a, b| rules.compare(a, b));
                for start in best.into_iter().filter_map(Search::start) {
                    if starts.len() <= OWN_INPUTS && starts.iter().all(|(inputs, _)| far(inputs, &start.0) > SIMILAR) {
                        starts.push(start);
                    }
                }
                Some(starts.into_iter().map(move |start| Trial::new(at, vec![start])).collect::<Vec<_>>())
            };
            let trials: Vec<Trial> = (0..self.places.len()).into_par_iter().filter_map(start).flatten_iter().collect();
            self.goes_on()?;
            if trials.is_empty() {
                break;
            }
            let value = |work: &Self, at: usize| work.places[at].best(rules.aim).map(|(_, row)| row.normal_force);
            let tried: Vec<usize> = trials.iter().map(|trial| trial.at).collect();
            let before: Vec<Option<f64>> = tried.iter().map(|at| value(self, *at)).collect();
            self.pursue(rules, trials)?;
            changed.fill(false);
            tried.iter().zip(before).for_each(|(at, before)| changed[*at] = value(self, *at) != before);
        }
        Ok(())
    }

    /// Points whose answer is worse than those around it, as if it stayed on another equilibrium, and points without one among such that
    /// have one, begin from the inputs of all neighbours.
    fn mend(&mut self, rules: Rules) -> Result<(), ContactError> {
        let near = self.lattice.neighbours();
        for _ in 0..MENDS {
            let goal = |at: usize| self.places[at].answer(rules.aim).map(|(_, row)| rules.goal(&row));
            let is_odd = |own: f64, others: &[usize]| {
                let mut goals: Vec<f64> = others.iter().filter_map(|other| goal(*other)).collect();
                goals.sort_by(f64::total_cmp);
                goals.get(goals.len() / 2).is_some_and(|middle| own - middle > ODD * middle.abs().max(1.0))
            };
            let is_hole = |others: &[usize]| {
                let reached = others.iter().filter(|other| goal(**other).is_some()).count();
                rules.aim != Aim::Least && reached > 0 && 2 * reached >= others.len()
            };
            let start = |at: usize| {
                let others: Vec<usize> = near.of(at);
                let is_odd = match goal(at) {
                    Some(own) => is_odd(own, &others),
                    None => is_hole(&others),
                };
                is_odd.then(|| {
                    let starts = self.answers_of(&others, rules.aim);
                    starts.map(|start| Trial::new(at, vec![start])).collect::<Vec<_>>()
                })
            };
            let trials = (0..self.places.len()).filter_map(start).flatten().collect();
            self.pursue(rules, trials)?;
        }
        Ok(())
    }

    /// Solves all answers again with care. Where that finds another equilibrium, or none, the point begins again from those inputs and from
    /// its neighbours', each row with care.
    fn confirm(&mut self, rules: Rules) -> Result<(), ContactError> {
        let open: Vec<(usize, Inputs, Row)> = (0..self.places.len())
            .filter_map(|at| self.places[at].best(rules.aim).map(|(inputs, row)| (at, inputs, row)))
            .filter(|(_, _, row)| !row.has_care)
            .collect();
        let points = &self.lattice.points;
        let ask = |(at, inputs, _): &(usize, Inputs, Row)| Ask { place: points[*at], inputs: *inputs, has_care: true };
        let rows = self.rod.solve(&open.iter().map(ask).collect::<Vec<_>>())?;
        let mut others = Vec::new();
        for ((at, inputs, bold), row) in open.into_iter().zip(rows) {
            if row.is_same(&bold, rules.unit) && rules.holds(&row) {
                self.places[at].confirm(&rules, row);
            } else {
                self.places[at].searches_for(rules.aim).clear();
                others.push((at, inputs));
            }
        }
        let near = self.lattice.neighbours();
        let starts = |(at, inputs): (usize, Inputs)| {
            let neighbours = near.of(at);
            let starts = self.answers_of(&neighbours, rules.aim).chain([(inputs, Learned::default())]);
            let careful = |start: Start| Trial { is_careful: true, ..Trial::new(at, vec![start]) };
            starts.map(careful).collect::<Vec<_>>()
        };
        let trials = others.into_iter().flat_map(starts).collect();
        self.pursue(rules, trials)
    }

    /// The answers of points, as starts of others.
    fn answers_of(&self, points: &[usize], aim: Aim) -> impl Iterator<Item = Start> {
        points.iter().filter_map(move |point| self.places[*point].of(aim).next().and_then(Search::start))
    }

    /// Tells how many points are done.
    fn tell(&self) {
        if let Some(progress) = self.job.progress {
            let done = self.places.iter().filter(|place| !place.most.is_empty() || !place.failures.is_empty()).count();
            let points = ContactStage::Points(done, self.places.len());
            progress(self.design.map_or(points, |(number, all)| ContactStage::Designs(number, all)));
        }
    }

    /// An error where the caller wants the job ended.
    fn goes_on(&self) -> Result<(), ContactError> {
        if is_raised(self.job.interrupt) { Err(ContactError::Interrupted) } else { Ok(()) }
    }
}

/// What neighbours and the point's own other answers promise, the best first.
fn forecasts<'a>(
    lattice: &WallLattice,
    places: &'a [Place],
    rules: &Rules,
    at: usize,
    near: &[usize],
) -> Vec<Forecast<'a>> {
    let by = |other: usize| {
        let between = |of: &[Vector]| std::array::from_fn(|k| of[at][k] - of[other][k]);
        (between(&lattice.points), between(&lattice.normals))
    };
    let of_neighbours =
        near.iter().flat_map(|other| places[*other].of(rules.aim).take(PROMISING).map(|search| (*other, search)));
    // The least force begins from the most, too.
    let own = places[at].most.iter().filter(|_| rules.aim == Aim::Least).map(|search| (at, search));
    let found = of_neighbours.chain(own).filter_map(|(other, search)| search.forecast(rules, by(other), FORECAST));
    let mut found: Vec<Forecast> = found.collect();
    found.sort_by(|a, b| a.merit(WEIGHT).total_cmp(&b.merit(WEIGHT)));
    found
}

/// What is told of a point.
fn result(place: &Place, rules: &Rules) -> PointResult {
    let answer = |found: Option<(Inputs, Row)>| {
        found.map(|(inputs, row)| Answer {
            inputs,
            force: row.normal_force,
            ratio: row.friction() / row.normal_force,
            angle: row.angle,
            margin: row.margin,
        })
    };
    let most = answer(place.best(rules.aim));
    let least = match rules.aim {
        Aim::Ratio(_) => None,
        _ => answer(place.answer(Aim::Least)),
    };
    let cause = if most.is_some() { Cause::Reached } else { cause(place, rules) };
    PointResult { most, least, cause }
}

fn cause(place: &Place, rules: &Rules) -> Cause {
    let of_failures = || match &place.failures {
        all if !all.is_empty() && all.iter().all(|status| *status == Status::OutOfReach) => Cause::OutOfReach,
        all if all.contains(&Status::ThroughWall) => Cause::ThroughWall,
        _ => Cause::Branch,
    };
    let Some(search) = place.most.first() else { return of_failures() };
    match search.blocked {
        Some(Status::ThroughWall) => return Cause::ThroughWall,
        Some(_) => return Cause::Branch,
        None => {}
    }
    let is_at_limit = search.at[..rules.count].iter().any(|t| t.abs() > AT_LIMIT);
    if search.row.margin < rules.minimum_margin {
        Cause::Margin
    } else if is_at_limit {
        Cause::InputLimit
    } else {
        Cause::Friction
    }
}
