//! The rod that the baselines model: constant flexible segments, rigid segments with a dipole, weight and tip force.

use super::error::BaselineError;
use nalgebra::{Matrix3, Vector3};
use rodsweep::model::{self, Parameter, RodSegment, Scene, Slot};

/// A stretch that bends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flexible {
    /// In m
    pub length: f64,
    /// EIx, EIy, GJ (N·m²)
    pub K: Vector3<f64>,
    /// In 1/m
    pub u_star: Vector3<f64>,
    /// Force per length, world frame (N/m)
    pub load: Vector3<f64>,
}

/// A stretch that does not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    /// In m
    pub length: f64,
    /// Dipole, body frame (A·m²)
    pub mu: Vector3<f64>,
    /// Spread over the length, world frame (N)
    pub weight: Vector3<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Segment {
    Flexible(Flexible),
    Rigid(Rigid),
}

/// A rod within the scope of the baselines; SI.
#[derive(Clone, Debug)]
pub struct Rod {
    pub(super) p0: Vector3<f64>,
    pub(super) R0: Matrix3<f64>,
    pub(super) B: Vector3<f64>,
    pub(super) f_tip: Vector3<f64>,
    /// Base to tip.
    pub(super) segments: Vec<Segment>,
}

/// What Jacobians are taken by; all but the insertion add `per_unit` to three numbers of the rod.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// Of a rigid segment.
    Dipole {
        /// Its index.
        segment: usize,
        /// Body frame (A·m² per unit of the input)
        per_unit: model::Vector,
    },
    /// Force at the tip.
    TipForce {
        /// World frame (N per unit)
        per_unit: model::Vector,
    },
    /// Of a flexible segment.
    RestCurvature {
        /// Its index.
        segment: usize,
        /// Body frame (1/m per unit)
        per_unit: model::Vector,
    },
    /// Of a flexible segment.
    Stiffness {
        /// Its index.
        segment: usize,
        /// EIx, EIy, GJ (N·m² per unit)
        per_unit: model::Vector,
    },
    /// Length of the first segment (m).
    Insertion,
}

/// What a column differentiates by, in a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub column: usize,
    pub dn: Vector3<f64>,
    pub dK: Vector3<f64>,
    pub du_star: Vector3<f64>,
}

const REMEDY: &str =
    "differentiate by coil currents, `insertion`, `loads.tip_force`, rest curvature or stiffness of one segment";

fn unsupported(key: impl Into<String>, remedy: &'static str) -> BaselineError {
    BaselineError::Unsupported { key: key.into(), remedy }
}

impl Input {
    /// What it changes along a segment beside the state, in a column; nothing, for most inputs on most segments.
    pub(super) fn source(&self, column: usize, segment: usize) -> Option<Source> {
        let zero = Source { column, dn: Vector3::zeros(), dK: Vector3::zeros(), du_star: Vector3::zeros() };
        match self {
            Input::TipForce { per_unit } => Some(Source { dn: (*per_unit).into(), ..zero }),
            Input::RestCurvature { segment: of, per_unit } if *of == segment => {
                Some(Source { du_star: (*per_unit).into(), ..zero })
            }
            Input::Stiffness { segment: of, per_unit } if *of == segment => {
                Some(Source { dK: (*per_unit).into(), ..zero })
            }
            _ => None,
        }
    }

    /// The input that a parameter of the scene is.
    ///
    /// # Errors
    ///
    /// A parameter that the baselines do not differentiate by.
    pub fn new(parameter: Parameter, scene: &Scene) -> Result<Input, BaselineError> {
        let mut found: Option<Input> = None;
        for (slot, rate) in parameter.chain(scene) {
            let per_unit = [0.0; 3];
            let (part, axis) = match slot {
                Slot::Insertion => (Input::Insertion, None),
                Slot::Dipole(segment, axis) => (Input::Dipole { segment, per_unit }, Some(axis)),
                Slot::TipForce(axis) => (Input::TipForce { per_unit }, Some(axis)),
                Slot::RestCurvature(segment, axis) => (Input::RestCurvature { segment, per_unit }, Some(axis)),
                Slot::Stiffness(segment, axis) => (Input::Stiffness { segment, per_unit }, Some(axis)),
                _ => return Err(unsupported(parameter.name(scene), REMEDY)),
            };
            let whole = found.get_or_insert_with(|| part.clone());
            if whole.target() != part.target() {
                return Err(unsupported(parameter.name(scene), REMEDY));
            }
            if let (Some(per_unit), Some(axis)) = (whole.per_unit(), axis) {
                per_unit[axis.index()] += rate;
            }
        }
        found
            .ok_or_else(|| unsupported(parameter.name(scene), "it moves nothing; differentiate by something that does"))
    }

    /// Which three numbers it moves.
    fn target(&self) -> (u8, usize) {
        match self {
            Input::Insertion => (0, 0),
            Input::TipForce { .. } => (1, 0),
            Input::Dipole { segment, .. } => (2, *segment),
            Input::RestCurvature { segment, .. } => (3, *segment),
            Input::Stiffness { segment, .. } => (4, *segment),
        }
    }

    fn per_unit(&mut self) -> Option<&mut model::Vector> {
        match self {
            Input::Insertion => None,
            Input::TipForce { per_unit }
            | Input::Dipole { per_unit, .. }
            | Input::RestCurvature { per_unit, .. }
            | Input::Stiffness { per_unit, .. } => Some(per_unit),
        }
    }
}

impl Rod {
    /// The rod of a scene, if the baselines model all of it.
    ///
    /// # Errors
    ///
    /// A scene that makes no rod, or has what the baselines do not model.
    pub fn new(scene: &Scene) -> Result<Rod, BaselineError> {
        scene.validate()?;
        let rod = scene.rod();
        if !rod.is_valid() {
            return Err(unsupported("insertion", "it leaves the first segment no length; give more"));
        }
        if rod.tip_moment != [0.0; 3] {
            return Err(unsupported("loads.tip_moment", "leave it out"));
        }
        if !rod.rigid_force_arm {
            return Err(unsupported("model.rigid_force_arm = false", "leave it out"));
        }
        let mut segments = Vec::new();
        for (index, named) in scene.segments.iter().enumerate() {
            let key = |what: &str| format!("{}.{what}", named.name);
            let pieces = scene.piece_indices(index);
            if pieces.len() != 1 {
                return Err(unsupported(key("rest_curvature or stiffness"), "give one constant value, not nodes"));
            }
            segments.push(match rod.segments[pieces.start] {
                RodSegment::Flexible(flexible) => {
                    if flexible.stiffness_rise != [0.0; 3] {
                        return Err(unsupported(key("stiffness"), "give one constant value, not nodes"));
                    }
                    if flexible.rest_curvature_rise != [0.0; 3] {
                        return Err(unsupported(key("rest_curvature"), "give one constant value, not nodes"));
                    }
                    if flexible.dipole != [0.0; 3] {
                        return Err(unsupported(key("dipole_per_length"), "give rigid segments the dipoles"));
                    }
                    if flexible.shear_compliance != [0.0; 3] {
                        return Err(unsupported(
                            key("stiffness_shear and stiffness_axial"),
                            "leave them out: the rod neither shears nor stretches",
                        ));
                    }
                    Segment::Flexible(Flexible {
                        length: flexible.length,
                        K: flexible.stiffness.into(),
                        u_star: flexible.rest_curvature.into(),
                        load: flexible.load.into(),
                    })
                }
                RodSegment::Rigid(_) if index == 0 => {
                    return Err(unsupported(named.name.as_str(), "begin the rod with a flexible segment"));
                }
                RodSegment::Rigid(rigid) => {
                    Segment::Rigid(Rigid { length: rigid.length, mu: rigid.dipole.into(), weight: rigid.weight.into() })
                }
            });
        }
        let rod = Rod {
            p0: rod.base_position.into(),
            R0: Matrix3::from_fn(|row, col| rod.base_rotation[row][col]),
            B: rod.flux_density.into(),
            f_tip: rod.tip_force.into(),
            segments,
        };
        if rod.flexible().all(|flexible| flexible.length == 0.0) {
            return Err(unsupported("length", "give a flexible segment some length"));
        }
        Ok(rod)
    }

    /// The same rod under a share of its loads.
    pub fn loaded(&self, lambda: f64) -> Rod {
        let mut rod = self.clone();
        rod.f_tip *= lambda;
        for segment in &mut rod.segments {
            match segment {
                Segment::Flexible(flexible) => flexible.load *= lambda,
                Segment::Rigid(rigid) => {
                    rigid.mu *= lambda;
                    rigid.weight *= lambda;
                }
            }
        }
        rod
    }

    /// The rod with one input changed.
    pub fn moved(&self, input: &Input, by: f64) -> Rod {
        let mut rod = self.clone();
        let change = |per_unit: &model::Vector| Vector3::from(*per_unit) * by;
        if let Input::TipForce { per_unit } = input {
            rod.f_tip += change(per_unit);
        }
        match (input, &mut rod.segments[input.target().1]) {
            (Input::Dipole { per_unit, .. }, Segment::Rigid(rigid)) => rigid.mu += change(per_unit),
            (Input::RestCurvature { per_unit, .. }, Segment::Flexible(flexible)) => flexible.u_star += change(per_unit),
            (Input::Stiffness { per_unit, .. }, Segment::Flexible(flexible)) => flexible.K += change(per_unit),
            (Input::Insertion, Segment::Flexible(flexible)) => flexible.length += by,
            _ => {}
        }
        rod
    }

    /// In m
    pub fn length(&self) -> f64 {
        let length = |segment: &Segment| match segment {
            Segment::Flexible(flexible) => flexible.length,
            Segment::Rigid(rigid) => rigid.length,
        };
        self.segments.iter().map(length).sum()
    }

    fn flexible(&self) -> impl Iterator<Item = &Flexible> {
        self.segments.iter().filter_map(|segment| match segment {
            Segment::Flexible(flexible) => Some(flexible),
            Segment::Rigid(_) => None,
        })
    }

    /// Moment that bends the flexible part by about one radian (N·m).
    pub(super) fn moment_unit(&self) -> f64 {
        let length: f64 = self.flexible().map(|flexible| flexible.length).sum();
        let compliance: f64 = self.flexible().map(|flexible| flexible.length / flexible.K.x.min(flexible.K.y)).sum();
        if compliance > 0.0 { 1.0 / compliance } else { length.max(1.0) }
    }

    /// Change of an input that bends the rod by about one radian, or doubles its length or its stiffness.
    pub fn scale(&self, input: &Input) -> f64 {
        let scale = match input {
            Input::Dipole { per_unit, .. } => self.moment_unit() / (self.B.norm() * Vector3::from(*per_unit).norm()),
            Input::TipForce { per_unit } => self.moment_unit() / (self.length() * Vector3::from(*per_unit).norm()),
            Input::RestCurvature { per_unit, .. } => 1.0 / (self.length() * Vector3::from(*per_unit).norm()),
            Input::Stiffness { per_unit, .. } => self.moment_unit() * self.length() / Vector3::from(*per_unit).norm(),
            Input::Insertion => self.length(),
        };
        if scale.is_finite() { scale } else { 1.0 }
    }

    /// The rod in its own units: of length, and of the moment that bends it by about one radian.
    pub(super) fn without_units(&self) -> Rod {
        let (length, moment) = (self.length(), self.moment_unit());
        let force = moment / length;
        let mut rod = Rod { p0: self.p0 / length, f_tip: self.f_tip / force, ..self.clone() };
        for segment in &mut rod.segments {
            match segment {
                Segment::Flexible(flexible) => {
                    flexible.length /= length;
                    flexible.K /= moment * length;
                    flexible.u_star *= length;
                    flexible.load *= length / force;
                }
                Segment::Rigid(rigid) => {
                    rigid.length /= length;
                    rigid.mu /= moment;
                    rigid.weight /= force;
                }
            }
        }
        rod
    }

    /// An input of [`Rod::without_units`], per [`Rod::scale`] of it.
    pub(super) fn input_without_units(&self, input: &Input) -> Input {
        let (length, moment) = (self.length(), self.moment_unit());
        let unit = match input {
            Input::Insertion => length,
            Input::Dipole { .. } => moment,
            Input::TipForce { .. } => moment / length,
            Input::RestCurvature { .. } => 1.0 / length,
            Input::Stiffness { .. } => moment * length,
        };
        let factor = self.scale(input) / unit;
        let mut input = input.clone();
        input.per_unit().into_iter().flatten().for_each(|x| *x *= factor);
        input
    }

    /// n at the distal end of each segment: tip force and the loads beyond it. R1
    pub(super) fn forces(&self) -> Vec<Vector3<f64>> {
        let mut n = self.f_tip;
        let mut forces = vec![n; self.segments.len()];
        for (force, segment) in forces.iter_mut().zip(&self.segments).rev() {
            *force = n;
            n += match segment {
                Segment::Flexible(flexible) => flexible.load * flexible.length,
                Segment::Rigid(rigid) => rigid.weight,
            };
        }
        forces
    }

    /// `total` pieces shared out among the flexible segments by length, at least one each that has a length.
    pub(super) fn shares(&self, total: usize) -> Vec<usize> {
        let length: f64 = self.flexible().map(|flexible| flexible.length).sum();
        let share = |segment: &Segment| match segment {
            Segment::Flexible(flexible) if flexible.length > 0.0 => {
                ((total as f64 * flexible.length / length).round() as usize).max(1)
            }
            _ => 0,
        };
        self.segments.iter().map(share).collect()
    }
}
