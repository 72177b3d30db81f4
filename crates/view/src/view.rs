//! What is viewed: a scene, alone or with the results of a sweep.

use crate::drag::{Beginning, Drag};
use crate::error::{Refusal, ViewError};
use crate::lines::Lines;
use crate::map::ResultMap;
use crate::region::region;
use crate::rod;
use crate::sliders::{Slider, sliders};
use crate::sources::sources;
use crate::stills::Stills;
use crate::style::style;
use crate::wall::wall;
use rodsweep::draw::{LengthUnit, Surroundings};
use rodsweep::input::{read_scene, read_text};
use rodsweep::model::{Parameter, Scene, SegmentParameter, Vector};
use rodsweep::results::Results;
use rodsweep::spec::{AxisSpec, ControlInput, SweepSpec};
use rodsweep::study::MOST_INPUTS;
use serde_json::{Map, Value, json};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// A scene or a result directory, ready to be shown.
pub struct View {
    title: String,
    file: String,
    scene: Scene,
    sliders: Vec<Slider>,
    map: Option<ResultMap>,
    stills: Stills,
    drag: Mutex<Option<Drag>>,
    lines: Lines,
}

impl View {
    /// Opens a result directory, a sweep file (its scene, with its limits) or a scene file.
    ///
    /// # Errors
    ///
    /// What cannot be read, or results without tips.
    pub fn open(path: &Path) -> Result<View, ViewError> {
        let file = path.display().to_string();
        if path.is_dir() {
            let map = ResultMap::open(Results::open(path)?)?;
            let spec = map.results().spec();
            let (scene, axes) = (spec.scene.clone(), spec.axes.clone());
            return Ok(View::new(scene, &axes, file, Some(map), Stills::of_directory(path)));
        }
        let is_sweep = read_text(path)?.lines().any(|line| line.trim() == "[sampling]");
        let (scene, axes) = match is_sweep {
            true => {
                let spec = SweepSpec::read(path)?;
                (spec.scene, spec.axes)
            }
            false => (read_scene(path)?, Vec::new()),
        };
        Ok(View::new(scene, &axes, file, None, Stills::of_scene()))
    }

    fn new(mut scene: Scene, axes: &[AxisSpec], file: String, map: Option<ResultMap>, stills: Stills) -> View {
        scene.absorb_insertion();
        let title = if scene.name.is_empty() { "rod".into() } else { scene.name.clone() };
        let (sliders, lines) = (sliders(&scene, axes), Lines::within(region(&scene)));
        View { title, file, sliders, scene, map, stills, drag: Mutex::default(), lines }
    }

    /// The scene as it stands in the file.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The results, if any.
    pub(crate) fn map(&self) -> Option<&ResultMap> {
        self.map.as_ref()
    }

    pub(crate) fn stills(&self) -> &Stills {
        &self.stills
    }

    pub(crate) fn lines(&self) -> &Lines {
        &self.lines
    }

    /// Everything that the page must know at first; `engine` tells whether there is one to ask.
    ///
    /// # Errors
    ///
    /// Results that cannot be read any more.
    pub(crate) fn describe(&self, engine: bool) -> Result<Value, Refusal> {
        let length = self.scene.total_length();
        let unit = LengthUnit::for_extent(length);
        let map = self.map.as_ref().map(ResultMap::describe).transpose()?;
        let (distrusted, distrust) = self.map.as_ref().and_then(ResultMap::distrust).unzip();
        // Where it lies is nobody's business but the user's.
        let name = Path::new(&self.file).file_name().map(|name| name.to_string_lossy().into_owned());
        let file = if engine { self.file.clone() } else { name.unwrap_or_default() };
        Ok(json!({
            "kind": if map.is_some() { "map" } else { "scene" },
            "title": self.title,
            "file": file,
            "version": rodsweep::VERSION,
            "engine": engine,
            "style": style(),
            "length": length,
            "length_unit": { "name": unit.name, "metres": unit.metres },
            "region": self.lines.region(),
            "field_varies": self.scene.sources.varies(),
            "sources": sources(Surroundings::of(&self.scene).as_ref()),
            "wall": wall(&self.scene),
            "sliders": self.sliders,
            "can_drag": !self.inputs().is_empty(),
            "map": map,
            "distrusted": distrusted,
            "distrust": distrust,
            "stills": self.stills.names(),
        }))
    }

    /// The scene with other values.
    ///
    /// # Errors
    ///
    /// A name or a value that the scene cannot take.
    pub(crate) fn scene_at(&self, values: &Map<String, Value>) -> Result<Scene, Refusal> {
        rod::with_values(&self.scene, values)
    }

    /// Goes on with dragging the tip to a place (m); where one begins anew, the search so far is forgotten.
    ///
    /// # Errors
    ///
    /// A rod that nothing drives, or that has no equilibrium to begin from.
    pub(crate) fn drag(
        &self,
        values: &Map<String, Value>,
        target: Vector,
        beginning: Option<Beginning>,
    ) -> Result<Value, Refusal> {
        let inputs = self.inputs();
        let mut drag = self.drag.lock().unwrap_or_else(PoisonError::into_inner);
        if beginning.is_some() || drag.is_none() {
            *drag = Some(Drag::new(self.scene_at(values)?, inputs, beginning.unwrap_or_default())?);
        }
        match drag.as_mut() {
            Some(drag) => drag.follow(target),
            None => Err(Refusal::failed("no search has begun")),
        }
    }

    /// Every current within the limits of its slider.
    fn inputs(&self) -> Vec<ControlInput> {
        let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
        let currents = Parameter::all(&self.scene).into_iter().filter(is_current);
        let input = |parameter: Parameter| {
            let name = parameter.name(&self.scene);
            let slider = self.sliders.iter().find(|slider| slider.name == name)?;
            (slider.low < slider.high).then(|| ControlInput::new(parameter, slider.low, slider.high))
        };
        currents.filter_map(input).take(MOST_INPUTS).collect()
    }
}
