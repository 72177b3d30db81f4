//! Scenes for Python.

use super::failure::Failure;
use pyo3::prelude::*;
use rodsweep::draw::{ImageFormat, encode};
use rodsweep::input::{assign, parse_scene, read_scene, write_scene};
use rodsweep::model::{Parameter, Scene};
use rodsweep::study::{Solve, evenly_spaced};
use std::path::PathBuf;
use std::sync::OnceLock;

/// A scene, as the library has it.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeScene {
    /// What it holds.
    pub scene: Scene,
    /// Every parameter by name.
    names: OnceLock<Vec<(String, Parameter)>>,
}

impl NativeScene {
    /// Of a scene.
    pub fn new(scene: Scene) -> NativeScene {
        NativeScene { scene, names: OnceLock::new() }
    }

    fn names(&self) -> &[(String, Parameter)] {
        self.names.get_or_init(|| Parameter::all(&self.scene).into_iter().map(|p| (p.name(&self.scene), p)).collect())
    }

    /// The parameters that a name stands for.
    pub fn parse(&self, name: &str) -> Result<Vec<Parameter>, Failure> {
        match self.names().iter().find(|(known, _)| known == name) {
            Some((_, parameter)) => Ok(vec![*parameter]),
            None => Ok(Parameter::parse(&self.scene, name)?),
        }
    }

    /// The parameters of several names, each once.
    pub fn parse_all(&self, names: &[String]) -> Result<Vec<Parameter>, Failure> {
        let mut all: Vec<Parameter> = Vec::new();
        for name in names {
            for parameter in self.parse(name)? {
                if !all.contains(&parameter) {
                    all.push(parameter);
                }
            }
        }
        Ok(all)
    }
}

#[pymethods]
impl NativeScene {
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<NativeScene> {
        Ok(NativeScene::new(read_scene(&path).map_err(Failure::from)?))
    }

    #[staticmethod]
    fn parse_text(text: &str) -> PyResult<NativeScene> {
        Ok(NativeScene::new(parse_scene("<scene>".as_ref(), text).map_err(Failure::from)?))
    }

    fn to_toml(&self) -> String {
        write_scene(&self.scene)
    }

    /// Name, unit and value of every parameter.
    fn parameters(&self) -> Vec<(String, &'static str, f64)> {
        self.names().iter().map(|(name, p)| (name.clone(), p.unit(), p.get(&self.scene))).collect()
    }

    /// Names of the parameters that a name stands for.
    fn components(&self, name: &str) -> PyResult<Vec<String>> {
        let parameters = self.parse(name)?;
        if let [_] = parameters[..] {
            return Ok(vec![name.to_owned()]);
        }
        Ok(parameters.iter().map(|parameter| parameter.name(&self.scene)).collect())
    }

    /// With other values, such as `coil.current.x=0.2`.
    fn assigned(&self, assignments: Vec<String>) -> PyResult<NativeScene> {
        let mut scene = self.scene.clone();
        assign(&mut scene, &assignments).map_err(Failure::from)?;
        Ok(NativeScene::new(scene))
    }

    fn name(&self) -> &str {
        &self.scene.name
    }

    fn total_length(&self) -> f64 {
        self.scene.total_length()
    }

    /// Name, kind and length of every segment.
    fn segments(&self) -> Vec<(String, &'static str, f64)> {
        let kind = |segment: &rodsweep::model::Segment| match segment.kind {
            rodsweep::model::SegmentKind::Flexible(_) => "flexible",
            rodsweep::model::SegmentKind::Rigid(_) => "rigid",
        };
        let segments = self.scene.segments.iter().enumerate();
        segments.map(|(at, segment)| (segment.name.clone(), kind(segment), self.scene.segment_length(at))).collect()
    }

    /// Points of the centre line at equilibrium; none where there is no equilibrium.
    fn centreline(&self, py: Python<'_>, count: usize) -> Vec<[f64; 3]> {
        py.detach(|| {
            let solved = Solve::new(self.scene.clone()).without_derivatives().run().ok()?;
            let at = evenly_spaced(self.scene.total_length(), count).ok()?;
            Some(solved.shape(&at).ok()?.positions())
        })
        .unwrap_or_default()
    }

    /// The rod's figure as a PNG or SVG, as `rodsweep solve --plot` draws it.
    fn figure(&self, py: Python<'_>, format: &str) -> PyResult<Vec<u8>> {
        let scene = self.scene.clone();
        let format = ImageFormat::of(format!("x.{format}").as_ref()).map_err(Failure::from)?;
        let draw = move || -> Result<Vec<u8>, Failure> {
            let solved = Solve::new(scene).without_derivatives().run()?;
            let figure = rodsweep::figures::rod_shape(&solved).map_err(Failure::input)?;
            Ok(encode(&figure, format)?)
        };
        Ok(py.detach(draw)?)
    }
}
