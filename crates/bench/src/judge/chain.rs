//! A rod as elements between nodes. Only elements bend; rigid segments belong to the node that they follow.

use super::field::Field;
use super::wall::Wall;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use rodsweep::model::{FlexibleRod, Rod, RodSegment, SourceForm};

/// Elements of a stretch at least.
const LEAST_ELEMENTS: usize = 3;

/// An elastic element between two nodes.
pub struct Element {
    pub h: f64,
    /// Stiffness in its middle (N·m²)
    pub K: Vector3<f64>,
    /// h u* in its middle (rad)
    pub rest: Vector3<f64>,
    /// Compliance to shear and stretch (1/N)
    pub compliance: Vector3<f64>,
    /// Force through it under the full load, in a uniform field (N)
    pub n: Vector3<f64>,
}

impl Element {
    /// Whether it shears or stretches.
    pub fn yields(&self) -> bool {
        self.compliance != Vector3::zeros()
    }
}

/// A dipole on the tangent of a node, behind it by `offset`.
pub struct Point {
    pub offset: f64,
    /// Body frame (A·m²)
    pub mu: Vector3<f64>,
}

/// The end of an element, with what of its neighbours and of rigid segments beyond is taken there.
#[derive(Default)]
pub struct Node {
    /// Length of the rigid segments beyond it (m)
    pub jump: f64,
    /// The potential of dead loads is -f · p - c · t (N, N·m).
    pub f: Vector3<f64>,
    pub c: Vector3<f64>,
    /// Dipole in a uniform field, body frame (A·m²)
    pub mu: Vector3<f64>,
    /// Dipoles in a field that varies.
    pub points: Vec<Point>,
}

/// A rod cut into elements: element i lies between nodes i and i + 1; node 0 is the base.
pub struct Chain {
    pub elements: Vec<Element>,
    pub nodes: Vec<Node>,
    pub base: Vector3<f64>,
    pub turned: Quaternion<f64>,
    pub B: Vector3<f64>,
    /// `None`: the field is uniform, and the loads of each node hold all that acts beyond it. Beside a wall that is not known.
    pub field: Option<Field>,
    /// Once it comes, the loads are full and what grows is the share of its way.
    pub wall: Option<Wall>,
    pub tip_moment: Option<Vector3<f64>>,
    /// 1 where forces act on the lever arm of rigid segments, else 0.
    pub arm: f64,
}

/// Length of a rod (m).
pub fn length(rod: &Rod) -> f64 {
    let of = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => flexible.length,
        RodSegment::Rigid(rigid) => rigid.length,
    };
    rod.segments.iter().map(of).sum()
}

/// Whether all that acts on a rod is modelled here.
fn is_known(rod: &Rod) -> bool {
    let has_moment = rod.tip_moment != [0.0; 3];
    // Stability of a rod under a dead moment, without the arm of forces, in a field that varies is a matter of convention.
    let is_odd = has_moment && !rod.rigid_force_arm && rod.field.is_some();
    let is_odd_at_wall = rod.wall.is_some() && (has_moment || !rod.rigid_force_arm);
    let is_field_known = rod.field.as_ref().is_none_or(|field| {
        field.maps.is_empty() && field.dipoles.iter().all(|dipole| dipole.form == SourceForm::Point)
    });
    let has_no_energy =
        |segment: &RodSegment| matches!(segment, RodSegment::Rigid(of) if of.follows || of.couple != [0.0; 3]);
    !is_odd && !is_odd_at_wall && is_field_known && !rod.segments.iter().any(has_no_energy)
}

impl Chain {
    /// A rod in about so many elements; `None` for what the judge does not model.
    pub fn new(rod: &Rod, elements: usize) -> Option<Chain> {
        let flexible = |segment: &RodSegment| match segment {
            RodSegment::Flexible(flexible) => Some(*flexible),
            RodSegment::Rigid(_) => None,
        };
        let all: Vec<FlexibleRod> = rod.segments.iter().filter_map(flexible).collect();
        let total: f64 = all.iter().map(|of| of.length).sum();
        let field = rod.field.as_ref();
        if !is_known(rod) || total <= 0.0 {
            return None;
        }
        let R = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|row, col| rod.base_rotation[row][col]));
        let mut chain = Chain {
            elements: Vec::new(),
            nodes: vec![Node::default()],
            base: rod.base_position.into(),
            turned: UnitQuaternion::from_rotation_matrix(&R).into_inner(),
            B: rod.flux_density.into(),
            field: field.map(Field::new).or(rod.wall.map(|_| Field::none())),
            wall: None,
            tip_moment: (rod.tip_moment != [0.0; 3]).then(|| rod.tip_moment.into()),
            arm: if rod.rigid_force_arm { 1.0 } else { 0.0 },
        };
        let arm = chain.arm;
        for segment in &rod.segments {
            match segment {
                // Nodes and forces at an end leave a piece of no length.
                RodSegment::Flexible(of) if of.length <= 0.0 => {}
                RodSegment::Flexible(of) => {
                    let count = (elements as f64 * of.length / total).ceil() as usize;
                    chain.add_flexible(of, count.max(LEAST_ELEMENTS * elements.div_ceil(32)));
                }
                RodSegment::Rigid(of) => {
                    let node = chain.nodes.last_mut()?;
                    let weight = Vector3::from(of.weight);
                    node.f += weight;
                    node.c += weight * (node.jump + 0.5 * of.length) * arm;
                    let mu = Vector3::from(of.dipole);
                    match field {
                        Some(field) => {
                            let points = field.coil_load.points().iter();
                            node.points.extend(points.map(|(place, share)| Point {
                                offset: node.jump + place * of.length,
                                mu: mu * *share,
                            }));
                            node.mu += mu;
                        }
                        None => node.mu += mu,
                    }
                    node.jump += of.length;
                }
            }
        }
        let node = chain.nodes.last_mut()?;
        node.f += Vector3::from(rod.tip_force);
        node.c += Vector3::from(rod.tip_force) * node.jump * arm;
        if chain.field.is_none() {
            chain.sum_forces();
        }
        let stiffest = chain.elements.iter().fold(0.0, |most: f64, element| most.max(element.K.x).max(element.K.y));
        chain.wall = rod.wall.as_ref().map(|wall| Wall::new(wall, stiffest / length(rod).powi(3)));
        Some(chain)
    }

    fn add_flexible(&mut self, of: &FlexibleRod, count: usize) {
        let h = of.length / count as f64;
        let [stiffness, rise] = [Vector3::from(of.stiffness), Vector3::from(of.stiffness_rise)];
        let [rest, rest_rise] = [Vector3::from(of.rest_curvature), Vector3::from(of.rest_curvature_rise)];
        let (load, mu) = (Vector3::from(of.load), Vector3::from(of.dipole));
        let compliance = Vector3::from(of.shear_compliance);
        for k in 0..count {
            let share = (k as f64 + 0.5) / count as f64;
            self.elements.push(Element {
                h,
                K: stiffness + share * rise,
                rest: h * (rest + share * rest_rise),
                compliance,
                n: Vector3::zeros(),
            });
            // Half of what an element bears goes to either end.
            let at_start = self.nodes.len() - 1;
            self.nodes.push(Node::default());
            for at in [at_start, at_start + 1] {
                let node = &mut self.nodes[at];
                node.f += 0.5 * h * load;
                node.c += 0.5 * h * load * node.jump * self.arm;
                node.mu += 0.5 * h * mu;
                if self.field.is_some() && mu != Vector3::zeros() {
                    node.points.push(Point { offset: node.jump, mu: 0.5 * h * mu });
                }
            }
        }
    }

    /// In a uniform field the force on every element is known: tangents bear it, and positions play no part.
    fn sum_forces(&mut self) {
        let mut beyond = Vector3::zeros();
        for i in (1..self.nodes.len()).rev() {
            beyond += self.nodes[i].f;
            let element = &mut self.elements[i - 1];
            let h = element.h;
            element.n = beyond;
            self.nodes[i].c += 0.5 * h * beyond;
            let before = &mut self.nodes[i - 1];
            before.c += (before.jump * self.arm + 0.5 * h) * beyond;
        }
    }

    /// Rotations at rest: every element is bent as it is without loads.
    pub fn rest(&self) -> Vec<Quaternion<f64>> {
        let mut turned = vec![self.turned];
        for element in &self.elements {
            let v = 0.5 * element.rest;
            let bend = Quaternion::new((1.0 - v.norm_squared()).max(0.0).sqrt(), v.x, v.y, v.z);
            turned.push(turned[turned.len() - 1] * bend);
        }
        turned
    }
}
