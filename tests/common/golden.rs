//! Golden scenes: inputs as scenes, expected outputs. SI units; matrices by rows.

use super::scenes;
use rodsweep::model::{
    Axis, Base, Coil, CoilWinding, Flexible, Loads, Matrix, Node, Parameter, Profile, Rigid, RodSegment, Scene,
    Segment, SegmentKind, SegmentParameter, ShearAxis, Slot, Stiffness, StiffnessAxis, Vector,
};
use serde_json::Value;

/// A scene with one equilibrium and its derivatives.
pub struct GoldenCase {
    pub scene: Scene,
    /// Parameters of the columns of `J`.
    pub parameters: Vec<Parameter>,
    pub m0: Vector,
    pub u0: Vector,
    pub p_tip: Vector,
    pub R_tip: Matrix,
    pub u_tip: Vector,
    /// Six rows (tip position, tip rotation), a column for each parameter.
    pub J: Vec<Vec<f64>>,
    /// Six rows, a column for each world axis about which the base turns.
    pub J_R0: Vec<Vec<f64>>,
    pub index: usize,
}

/// A scene with rest curvature linear along its segments, or with shear and stretch.
pub struct ExtendedCase {
    pub scene: Scene,
    /// What each column of `J` is by: a combination of slots.
    pub columns: Vec<(String, Vec<(Slot, f64)>)>,
    pub m0: Vector,
    pub u0: Vector,
    pub p_tip: Vector,
    pub R_tip: Matrix,
    /// Six rows (tip position, tip rotation), a column for each of `columns`.
    pub J: Vec<Vec<f64>>,
}

/// A scene with every equilibrium found: base moment, base curvature, tip position, index.
pub struct StabilityCase {
    pub scene: Scene,
    pub equilibria: Vec<(Vector, Vector, Vector, usize)>,
}

/// One sample of the published code on prototype P6.
pub struct P6Sample {
    pub currents: Vector,
    pub insertion: f64,
    pub tip_force: Vector,
    pub p_tip: Vector,
    pub u0: Vector,
    /// Columns: three currents, insertion, tip force.
    pub J: Vec<Vec<f64>>,
}

/// The 60 scenes with derivatives.
pub fn dev() -> Vec<GoldenCase> {
    list(&parse(include_str!("../data/golden_dev.json"))["scenes"]).iter().map(golden_case).collect()
}

/// The 15 scenes with all equilibria.
pub fn stability() -> Vec<StabilityCase> {
    let case = |value: &Value| StabilityCase {
        scene: scene(&value["name"], &value["input"]),
        equilibria: list(&value["equilibria"])
            .iter()
            .map(|e| (vector(&e["m0"]), vector(&e["u0"]), vector(&e["p_tip"]), count(&e["morse_index"])))
            .collect(),
    };
    list(&parse(include_str!("../data/golden_stability.json"))["dev"]).iter().map(case).collect()
}

/// The 14 scenes with linear rest curvature or with shear and stretch.
pub fn extended() -> Vec<ExtendedCase> {
    list(&parse(include_str!("../data/golden_ext.json"))["scenes"]).iter().map(extended_case).collect()
}

/// The 50 samples of prototype P6.
pub fn p6_samples() -> Vec<P6Sample> {
    let sample = |value: &Value| P6Sample {
        currents: vector(&value["currents"]),
        insertion: number(&value["insertion"]),
        tip_force: vector(&value["tip_force"]),
        p_tip: vector(&value["ramp_tip"]),
        u0: vector(&value["ramp_u0"]),
        J: table(&value["ramp_J"]),
    };
    list(&parse(include_str!("../data/crm_p6_reference50.json"))["samples"]).iter().map(sample).collect()
}

/// Prototype P6 at full length, without the lever arm of its rigid segment.
pub fn p6_scene() -> Scene {
    let tube = Stiffness::Tube {
        inner_radius: 0.9906e-3,
        outer_radius: 1.5875e-3,
        youngs_modulus: 5.3948e6,
        shear: rodsweep::model::ShearElasticity::Modulus(2.3881e6),
    };
    let flexible = |name: &str, length: f64, rest_curvature: Vector| Segment {
        name: name.into(),
        length,
        kind: SegmentKind::Flexible(Flexible {
            density: Some(rodsweep::model::Density::Linear(2.8814e-4)),
            ..scenes::flexible(tube.clone(), rest_curvature)
        }),
    };
    let winding = CoilWinding::Axes { turns: [30.0, 30.0, 100.0], area: [46.665e-6, 46.665e-6, 11.251791e-6] };
    // The published code lays the coil's mass on top of the tube's.
    let mass = Some(5.7736e-5 + 2.8814e-4 * 0.0183);
    let coil = Rigid { mass, coil: Some(Coil { winding, current: [0.0; 3], alignment: [0.0; 3] }), ..Rigid::default() };
    Scene {
        name: "P6".into(),
        base: Base::default(),
        flux_density: [0.0, 3.0, 0.0],
        sources: Default::default(),
        loads: Loads { tip_force: Some([0.0; 3]), gravity: Some([0.0, 0.0, 9.81]), ..Loads::default() },
        segments: vec![
            flexible("proximal", 0.1008, [0.7399849479553774, -0.2292201697658481, 0.0]),
            Segment { name: "coil".into(), length: 0.0183, kind: SegmentKind::Rigid(coil) },
            flexible("distal", 0.0185, [0.0148626102272827, 0.094448815853795, 0.0]),
        ],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: false,
    }
}

fn golden_case(value: &Value) -> GoldenCase {
    let output = &value["output"];
    GoldenCase {
        scene: scene(&value["name"], &value["input"]),
        parameters: list(&output["params"]).iter().map(parameter).collect(),
        m0: vector(&output["m0"]),
        u0: vector(&output["u0"]),
        p_tip: vector(&output["p_tip"]),
        R_tip: matrix(&output["R_tip"]),
        u_tip: vector(&output["u_tip"]),
        J: table(&output["J"]),
        J_R0: table(&output["J_R0"]),
        index: count(&output["morse_index"]),
    }
}

fn extended_case(value: &Value) -> ExtendedCase {
    let mut scene = scene(&value["name"], &value["input"]);
    if let Some(shear) = value["Kse"].as_array() {
        let [x, y, axial] = [0, 1, 2].map(|k| number(&shear[k]));
        for segment in &mut scene.segments {
            if let SegmentKind::Flexible(flexible) = &mut segment.kind {
                (flexible.stiffness_shear, flexible.stiffness_axial) = (Some([x, y]), Some(axial));
            }
        }
    }
    let output = &value["output"];
    let mut columns: Vec<_> =
        list(&output["params"]).iter().map(|of| (of.to_string(), extended_column(&scene, of))).collect();
    let mut J = table(&output["J"]);
    if !output["J_insertion"].is_null() {
        columns.push(("insertion".into(), Parameter::Insertion.chain(&scene)));
        J.iter_mut().zip(list(&output["J_insertion"])).for_each(|(row, x)| row.push(number(x)));
    }
    ExtendedCase {
        columns,
        m0: vector(&output["m0"]),
        u0: vector(&output["u0"]),
        p_tip: vector(&output["p_tip"]),
        R_tip: matrix(&output["R_tip"]),
        J,
        scene,
    }
}

/// Slots and rates of a column: those of one parameter, or of the same one on every flexible segment.
fn extended_column(scene: &Scene, value: &Value) -> Vec<(Slot, f64)> {
    let axis = || Axis::ALL[count(&value[2])];
    let of = |parameter| Parameter::Segment(count(&value[1]), parameter).chain(scene);
    match value[0].as_str().expect("a kind") {
        "rlength" => of(SegmentParameter::Length),
        "length" => stretched(scene, count(&value[1])),
        "ustar_start" => of(SegmentParameter::RestCurvatureNode(0, axis())),
        "ustar_end" => of(SegmentParameter::RestCurvatureNode(1, axis())),
        "p0" => Parameter::BasePosition(axis()).chain(scene),
        "R0" => vec![(Slot::BaseRotation(axis()), 1.0)],
        "Kse" => {
            let shear = [
                SegmentParameter::StiffnessShear(ShearAxis::X),
                SegmentParameter::StiffnessShear(ShearAxis::Y),
                SegmentParameter::StiffnessAxial,
            ];
            let flexible = (0..scene.segments.len())
                .filter(|j| matches!(scene.segments[*j].kind, SegmentKind::Flexible(_)))
                .map(|j| Parameter::Segment(j, shear[count(&value[2])]));
            flexible.flat_map(|parameter| parameter.chain(scene)).collect()
        }
        _ => parameter(value).chain(scene),
    }
}

/// The golden lengths stretch the rest curvature with the segment: its rise is kept, not its slope, which is what
/// [`Slot::Length`] keeps. Taken as the latter, columns would be off by up to 89 %.
fn stretched(scene: &Scene, index: usize) -> Vec<(Slot, f64)> {
    let rod = scene.rod();
    let mut chain = Parameter::Segment(index, SegmentParameter::Length).chain(scene);
    for j in scene.piece_indices(index) {
        if let RodSegment::Flexible(piece) = rod.segments[j]
            && piece.length > 0.0
        {
            let fall = |axis: Axis| -piece.rest_curvature_rise[axis.index()] / piece.length;
            chain.extend(Axis::ALL.map(|axis| (Slot::RestCurvatureRise(j, axis), fall(axis))));
        }
    }
    chain
}

/// A golden input as a scene with segments seg0, seg1, ...
pub fn scene(name: &Value, input: &Value) -> Scene {
    let some = |v: Vector| v.iter().any(|x| *x != 0.0).then_some(v);
    let loads = Loads {
        tip_force: some(vector(&input["f_tip"])),
        tip_moment: some(vector(&input["l_tip"])),
        distributed_force: (!input["weight"].is_null()).then(|| vector(&input["weight"])),
        ..Loads::default()
    };
    let segment = |(index, value): (usize, &Value)| Segment {
        name: format!("seg{index}"),
        length: number(&value["length"]),
        kind: if value["type"] == "flexible" { flexible(value) } else { rigid(value) },
    };
    Scene {
        name: name.as_str().expect("a name").into(),
        base: Base { position: vector(&input["p0"]), rotation: rotation_vector(&matrix(&input["R0"])) },
        flux_density: vector(&input["B"]),
        sources: Default::default(),
        loads,
        segments: list(&input["segments"]).iter().enumerate().map(segment).collect(),
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

fn flexible(value: &Value) -> SegmentKind {
    let [bending_x, bending_y, torsion] = ["EIx", "EIy", "GJ"].map(|name| number(&value[name]));
    let stiffness = Stiffness::Direct { bending_x, bending_y, torsion };
    let mut flexible = scenes::flexible(stiffness, vector(&value["ustar"]));
    if !value["ustar_end"].is_null() {
        let node = |at: f64, value: &Value| Node { at, value: vector(value) };
        let nodes = vec![node(0.0, &value["ustar"]), node(number(&value["length"]), &value["ustar_end"])];
        flexible.rest_curvature = Profile::Nodes(nodes);
    }
    SegmentKind::Flexible(flexible)
}

fn rigid(value: &Value) -> SegmentKind {
    let coil = &value["coil"];
    let coil = (!coil.is_null()).then(|| Coil {
        winding: CoilWinding::Axes { turns: [1.0; 3], area: vector(&coil["turns_area"]) },
        current: vector(&coil["current"]),
        alignment: [0.0; 3],
    });
    SegmentKind::Rigid(Rigid { coil, ..Rigid::default() })
}

pub(super) fn parameter(value: &Value) -> Parameter {
    let segment = || count(&value[1]);
    let axis = || Axis::ALL[count(&value[2])];
    let of_segment = |parameter| Parameter::Segment(segment(), parameter);
    match value[0].as_str().expect("a kind") {
        "current" => of_segment(SegmentParameter::Current(axis())),
        "f_tip" => Parameter::TipForce(axis()),
        "l_tip" => Parameter::TipMoment(axis()),
        "weight" => Parameter::DistributedForce(axis()),
        "B" => Parameter::FluxDensity(axis()),
        "length" => of_segment(SegmentParameter::Length),
        "EIx" => of_segment(SegmentParameter::Stiffness(StiffnessAxis::BendingX)),
        "EIy" => of_segment(SegmentParameter::Stiffness(StiffnessAxis::BendingY)),
        "GJ" => of_segment(SegmentParameter::Stiffness(StiffnessAxis::Torsion)),
        "ustar" => of_segment(SegmentParameter::RestCurvature(axis())),
        other => panic!("unknown golden parameter {other}"),
    }
}

/// Logarithm of a rotation by way of its quaternion; sound at every angle up to pi.
pub fn rotation_vector(R: &Matrix) -> Vector {
    let trace = R[0][0] + R[1][1] + R[2][2];
    // Four times the square of each quaternion component; the largest one is computed first.
    let squares = [1.0 + trace, 1.0 + 2.0 * R[0][0] - trace, 1.0 + 2.0 * R[1][1] - trace, 1.0 + 2.0 * R[2][2] - trace];
    let largest = (0..4).max_by(|a, b| squares[*a].total_cmp(&squares[*b])).expect("four components");
    let antisymmetric = [R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]];
    let mut q = [0.0; 4];
    q[largest] = squares[largest];
    for k in (0..4).filter(|k| *k != largest) {
        q[k] = match (largest, k) {
            (0, k) => antisymmetric[k - 1],
            (k, 0) => antisymmetric[k - 1],
            (j, k) => R[j - 1][k - 1] + R[k - 1][j - 1],
        };
    }
    let sine = (q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    if sine == 0.0 {
        return [0.0; 3];
    }
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    let angle = 2.0 * sine.atan2(q[0].abs());
    [q[1], q[2], q[3]].map(|x| sign * angle * x / sine)
}

pub(super) fn parse(text: &str) -> Value {
    serde_json::from_str(text).expect("valid JSON")
}

pub(super) fn list(value: &Value) -> &Vec<Value> {
    value.as_array().expect("a list")
}

pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn count(value: &Value) -> usize {
    value.as_u64().expect("a count") as usize
}

pub(super) fn vector(value: &Value) -> Vector {
    std::array::from_fn(|k| number(&value[k]))
}

pub(super) fn matrix(value: &Value) -> Matrix {
    std::array::from_fn(|row| vector(&value[row]))
}

pub(super) fn table(value: &Value) -> Vec<Vec<f64>> {
    list(value).iter().map(|row| list(row).iter().map(number).collect()).collect()
}
