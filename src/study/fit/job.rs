//! What is to be fitted to what, in one call.

use super::model::Problem;
use super::solve::fit;
use super::{Fit, FitError};
use crate::engines::cpu_f64;
use crate::model::{Axis, Parameter, Scene, SegmentParameter};
use crate::spec::ObservedShapes;
use crate::study::MakeEngine;

/// Fits numbers of a scene to observed shapes: rest curvature about x and y, unless [`FitJob::free`] says otherwise.
///
/// ```no_run
/// use rodsweep::input::{read_scene, read_shapes};
/// use rodsweep::study::FitJob;
///
/// let scene = read_scene("p6.toml".as_ref())?;
/// let observed = read_shapes("markers.csv".as_ref(), &scene)?;
/// let names = ["proximal.rest_curvature", "proximal.youngs_modulus+distal.youngs_modulus"];
/// let fit = FitJob::new(scene, observed).free(&names)?.noise(2e-4).run()?;
/// for fitted in &fit.parameters {
///     println!("{} = {} ± {} {}", fitted.name, fitted.value, fitted.deviation, fitted.unit);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FitJob {
    problem: Problem,
}

impl FitJob {
    /// Starts from a scene's own values.
    pub fn new(scene: Scene, observed: ObservedShapes) -> FitJob {
        let about_x_or_y = |parameter: &Parameter| {
            use SegmentParameter::{RestCurvature, RestCurvatureNode};
            matches!(parameter, Parameter::Segment(_, RestCurvature(axis) | RestCurvatureNode(_, axis)) if *axis != Axis::Z)
        };
        let free = Parameter::all(&scene).into_iter().filter(about_x_or_y).map(|parameter| vec![parameter]).collect();
        FitJob { problem: Problem { scene, free, observed, noise: None, force_noise: None } }
    }

    /// What is fitted, by name. A group such as `tube.rest_curvature` gives each of its components; names joined by `+`
    /// keep their ratio.
    ///
    /// # Errors
    ///
    /// A name that the scene has not, or that stands twice.
    pub fn free(self, names: &[impl AsRef<str>]) -> Result<FitJob, FitError> {
        let scene = &self.problem.scene;
        let mut free: Vec<Vec<Parameter>> = Vec::new();
        for text in names.iter().map(AsRef::as_ref).filter(|name| !name.trim().is_empty()) {
            let parse = |name: &str| Parameter::parse(scene, name.trim());
            let parts: Vec<Vec<Parameter>> = text.split('+').map(parse).collect::<Result<_, _>>()?;
            match &parts[..] {
                [group] => free.extend(group.iter().map(|parameter| vec![*parameter])),
                _ => free.push(parts.concat()),
            }
        }
        let all: Vec<&Parameter> = free.iter().flatten().collect();
        if let Some((_, twice)) = all.iter().enumerate().find(|(k, parameter)| all[..*k].contains(parameter)) {
            return Err(FitError::NamedTwice(twice.name(scene)));
        }
        Ok(self.free_parameters(free))
    }

    /// What is fitted; parameters that stand together keep their ratios.
    pub fn free_parameters(self, free: Vec<Vec<Parameter>>) -> FitJob {
        FitJob { problem: Problem { free, ..self.problem } }
    }

    /// The standard deviation of a coordinate (m); estimated from the residuals if not given.
    pub fn noise(self, noise: f64) -> FitJob {
        FitJob { problem: Problem { noise: Some(noise), ..self.problem } }
    }

    /// The standard deviation of a measured force (N). Without it a force counts by how far it pushes the rod aside.
    pub fn force_noise(self, force_noise: f64) -> FitJob {
        FitJob { problem: Problem { force_noise: Some(force_noise), ..self.problem } }
    }

    /// The scene where the fit starts.
    pub fn scene(&self) -> &Scene {
        &self.problem.scene
    }

    /// What was seen.
    pub fn observed(&self) -> &ObservedShapes {
        &self.problem.observed
    }

    /// The standard deviation of a coordinate as it was given (m).
    pub fn given_noise(&self) -> Option<f64> {
        self.problem.noise
    }

    /// Refuses what is to be fitted and known at once, as [`FitJob::run`] does.
    ///
    /// # Errors
    ///
    /// [`FitError::FreeAndKnown`].
    pub fn check(&self) -> Result<(), FitError> {
        let Problem { scene, free, observed, .. } = &self.problem;
        match observed.known.iter().find(|known| free.iter().flatten().any(|free| free == *known)) {
            Some(known) => Err(FitError::FreeAndKnown(known.name(scene))),
            None => Ok(()),
        }
    }

    /// Fits; equilibria on the CPU in f64.
    ///
    /// # Errors
    ///
    /// Too little observed, no equilibrium to begin from, or a method that ends in vain.
    pub fn run(&self) -> Result<Fit, FitError> {
        self.run_on(&mut |plan| cpu_f64(plan))
    }

    /// Fits; equilibria by another engine.
    ///
    /// # Errors
    ///
    /// As [`FitJob::run`], or an engine that cannot be used.
    pub fn run_on(&self, make: &mut MakeEngine) -> Result<Fit, FitError> {
        self.check()?;
        fit(&self.problem, make)
    }
}
