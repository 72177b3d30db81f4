//! One call for a map of contacts: from a sweep with a wall to the forces that the tip can press with at each of its points.

use super::error::ContactError;
use super::lattice::{Region, WallLattice};
use super::map::{Answer, Cause, ContactMap, PointResult};
use super::rows::{HeldRod, Row, net};
use super::search::{Aim, Rules, Search};
use crate::engines::EngineRequest;
use crate::model::{Axis, Parameter, Plan, PlanOptions, Quantity, Scene, Status, Vector};
use crate::spec::SweepSpec;
use crate::study::workspace::{Inputs, MOST_INPUTS, WorkspaceInput, base_scene, workspace_inputs};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Points of one map, at most.
const MOST_POINTS: f64 = 1e6;
/// Normal forces below this share of EI/L² count as none.
const FLOOR: f64 = 1e-4;
/// A point without neighbours is tried at the middle of all limits and at a net.
const NET: u64 = 16;
const NET_SEED: u64 = 0xc027;
/// Neighbours whose inputs are tried at a point.
const STARTS: usize = 2;
/// First step of a search that begins from the inputs of a neighbour, over half the range.
const NEAR: f64 = 0.25;
/// How often neighbours start each other again, and by what share their force must be better.
const ROUNDS: usize = 6;
const BETTER: f64 = 0.02;
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

/// What a job is at: points that are done, and all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContactStage {
    /// Points looked at.
    pub done: usize,
    /// All points.
    pub all: usize,
}

/// Where a point stands.
#[derive(Clone, Debug, Default)]
struct Place {
    most: Option<Search>,
    least: Option<Search>,
    /// What became of inputs that gave no equilibrium that can be used.
    failures: Vec<Status>,
}

impl Place {
    fn is_reached(&self) -> bool {
        self.most.as_ref().is_some_and(|search| search.best.is_some())
    }

    fn best(&self, aim: Aim) -> Option<(Inputs, Row)> {
        let search = if aim == Aim::Least { &self.least } else { &self.most };
        search.as_ref().and_then(|search| search.best)
    }
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

    /// A flag that ends the job between batches.
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
        let mut rod = HeldRod::new(&scene, &inputs, (&engine, self.spec.tolerance, self.spec.steps))?;
        let rules = Rules {
            aim: self.force.map_or(Aim::Most, Aim::Ratio),
            count: inputs.len(),
            friction: wall.friction.unwrap_or(0.0),
            minimum_margin: self.minimum_margin,
            floor: FLOOR * rod.unit(),
            unit: self.force.unwrap_or(rod.unit()),
        };
        let mut work = Work { job: self, lattice: &lattice, rod: &mut rod, rules, places: Vec::new() };
        work.places.resize_with(lattice.len(), Place::default);
        work.run()?;
        let points = work.places.iter().map(|place| result(place, &rules)).collect();
        Ok(ContactMap {
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
    rod: &'b mut HeldRod,
    rules: Rules,
    places: Vec<Place>,
}

impl Work<'_, '_> {
    fn run(&mut self) -> Result<(), ContactError> {
        let mut done: Vec<usize> = Vec::new();
        for group in self.lattice.groups() {
            let spacing = (self.lattice.len() as f64 / done.len().max(1) as f64).sqrt() * self.lattice.spacing;
            let near = self.lattice.among(&done, 1.6 * spacing);
            let starts: Vec<(usize, Vec<Inputs>)> = group.iter().map(|at| (*at, self.starts(&near.of(*at)))).collect();
            self.search(self.rules, starts)?;
            done.extend(group);
        }
        self.help_each_other(self.rules)?;
        if self.job.force.is_none() {
            self.least()?;
        }
        Ok(())
    }

    fn starts(&self, near: &[usize]) -> Vec<Inputs> {
        let best = |at: &usize| self.places[*at].best(self.rules.aim).map(|(at, _)| at);
        let mut starts: Vec<Inputs> = near.iter().filter_map(best).take(STARTS).collect();
        if starts.is_empty() {
            starts.push([0.0; MOST_INPUTS]);
            // Where neighbours found nothing with it, it is not tried again.
            if near.is_empty() {
                starts.extend(net(self.rules.count, NET, NET_SEED));
            }
            let ends = near.iter().filter_map(|at| self.places[*at].most.as_ref()).map(|search| search.at);
            starts.extend(ends.take(STARTS));
        }
        starts
    }

    /// Tries inputs at points and searches from the best of each, all at once. An answer that is there gives way to a better one.
    fn search(&mut self, rules: Rules, starts: Vec<(usize, Vec<Inputs>)>) -> Result<(), ContactError> {
        let asked =
            starts.iter().flat_map(|(at, inputs)| inputs.iter().map(|inputs| (self.lattice.points[*at], *inputs)));
        let asked: Vec<(Vector, Inputs)> = asked.collect();
        let rows = self.rod.solve(&asked)?;
        let mut first = 0;
        let mut begun: Vec<(usize, Inputs, Row, Option<f64>)> = Vec::new();
        for (at, inputs) in &starts {
            let own = &rows[first..first + inputs.len()];
            let radius = (inputs.len() <= STARTS).then_some(NEAR);
            let answer = self.places[*at].best(rules.aim).map(|(_, row)| row);
            match (rules.first(own), answer) {
                // What is there already is as good.
                (Some(k), Some(answer)) if !rules.is_clearly_better(&own[k], &answer, BETTER) => {}
                (Some(k), _) => begun.push((*at, asked[first + k].1, own[k], radius)),
                (None, Some(_)) => {}
                (None, None) => self.places[*at].failures = own.iter().map(|row| row.status).collect(),
            }
            first += inputs.len();
        }
        let points = &self.lattice.points;
        let mut searches: Vec<(usize, Search)> = begun
            .into_par_iter()
            .map(|(at, inputs, row, radius)| (at, Search::new(&rules, points[at], (inputs, row), radius)))
            .collect();
        loop {
            let mut open: Vec<&mut Search> =
                searches.iter_mut().map(|(_, search)| search).filter(|search| search.next.is_some()).collect();
            if open.is_empty() {
                break;
            }
            let asked: Vec<(Vector, Inputs)> =
                open.iter().filter_map(|search| search.next.map(|next| (search.place, next))).collect();
            let rows = self.rod.solve(&asked)?;
            open.par_iter_mut().zip(rows).for_each(|(search, row)| search.judge(&rules, row));
            self.goes_on()?;
        }
        for (at, search) in searches {
            let place = &mut self.places[at];
            let old = if rules.aim == Aim::Least { &mut place.least } else { &mut place.most };
            let is_better = match (old.as_ref().and_then(|old| old.best), search.best) {
                (Some((_, old)), Some((_, new))) => rules.is_better(&new, &old),
                (Some(_), None) => false,
                _ => true,
            };
            if is_better {
                *old = Some(search);
            }
        }
        Ok(())
    }

    /// Points begin again from neighbours: where they are not reached themselves, or where a neighbour is clearly better.
    fn help_each_other(&mut self, rules: Rules) -> Result<(), ContactError> {
        let near = self.lattice.neighbours();
        let mut changed: Vec<bool> = vec![true; self.places.len()];
        for _ in 0..ROUNDS {
            let start = |at: usize| {
                let own = self.places[at].best(rules.aim);
                if rules.aim == Aim::Least && own.is_none() {
                    return None;
                }
                let helps = |other: &usize| {
                    let (inputs, row) = self.places[*other].best(rules.aim).filter(|_| changed[*other])?;
                    let is_better = own.as_ref().is_none_or(|(_, own)| rules.is_clearly_better(&row, own, BETTER));
                    is_better.then_some((inputs, row))
                };
                let mut helping: Vec<(Inputs, Row)> = near.of(at).iter().filter_map(helps).collect();
                if own.is_some() {
                    helping.sort_by(|(_, a), (_, b)| rules.goal(a).total_cmp(&rules.goal(b)));
                    helping.truncate(1);
                }
                let inputs: Vec<Inputs> = helping.into_iter().map(|(inputs, _)| inputs).take(STARTS).collect();
                (!inputs.is_empty()).then_some((at, inputs))
            };
            let starts: Vec<(usize, Vec<Inputs>)> = (0..self.places.len()).into_par_iter().filter_map(start).collect();
            if starts.is_empty() {
                break;
            }
            let value = |work: &Self, at: usize| work.places[at].best(rules.aim).map(|(_, row)| row.normal_force);
            let before: Vec<Option<f64>> = starts.iter().map(|(at, _)| value(self, *at)).collect();
            let tried: Vec<usize> = starts.iter().map(|(at, _)| *at).collect();
            self.search(rules, starts)?;
            changed.fill(false);
            tried.into_iter().zip(before).for_each(|(at, before)| changed[at] = value(self, at) != before);
        }
        Ok(())
    }

    /// The least force of points that are reached, in groups as the most.
    fn least(&mut self) -> Result<(), ContactError> {
        let rules = Rules { aim: Aim::Least, ..self.rules };
        let mut done: Vec<usize> = Vec::new();
        for group in self.lattice.groups() {
            let spacing = (self.lattice.len() as f64 / done.len().max(1) as f64).sqrt() * self.lattice.spacing;
            let near = self.lattice.among(&done, 1.6 * spacing);
            let reached: Vec<usize> = group.into_iter().filter(|at| self.places[*at].is_reached()).collect();
            let starts = reached.iter().map(|at| {
                let mut starts: Vec<Inputs> = Vec::new();
                let least = |other: &usize| self.places[*other].least.as_ref()?.best.map(|(inputs, _)| inputs);
                starts.extend(near.of(*at).iter().filter_map(least).take(STARTS - 1));
                starts.extend(self.places[*at].best(Aim::Most).map(|(inputs, _)| inputs));
                (*at, starts)
            });
            let starts = starts.collect();
            self.search(rules, starts)?;
            done.extend(reached);
        }
        self.help_each_other(rules)
    }

    fn goes_on(&self) -> Result<(), ContactError> {
        if let Some(progress) = self.job.progress {
            let done = self.places.iter().filter(|place| place.most.is_some() || !place.failures.is_empty()).count();
            progress(ContactStage { done, all: self.places.len() });
        }
        match self.job.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            true => Err(ContactError::Interrupted),
            false => Ok(()),
        }
    }
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
    // The most holds, too, where no lesser force was found.
    let least = match rules.aim {
        Aim::Ratio(_) => None,
        _ => answer(place.best(Aim::Least)).or(most),
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
    let Some(search) = &place.most else { return of_failures() };
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
