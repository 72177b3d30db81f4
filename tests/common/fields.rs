//! Golden scenes in fields that vary in space: both ways in which the field may act on a rigid segment.

use super::check::{column_error, difference, norm, pose_error};
use super::golden::{self, list, matrix, number, table, vector};
use rodsweep::backend::Backend;
use rodsweep::model::{
    Axis, Coil, CoilArray, CoilLoad, CoilWinding, Derivative, Entry, FieldSources, GradientEntry, Magnet, Matrix,
    Parameter, Plan, PlanOptions, Quantity, Rigid, Scene, SegmentKind, Slot, UnitDipole, Vector,
};
use serde_json::Value;

/// A scene with one equilibrium and its derivatives.
#[derive(Clone)]
pub struct FieldCase {
    pub scene: Scene,
    /// Kind of each column and what it is by: a combination of slots.
    pub columns: Vec<(String, Vec<(Slot, f64)>)>,
    pub n0: Vector,
    pub m0: Vector,
    pub p_tip: Vector,
    pub R_tip: Matrix,
    /// Six rows (tip position, tip rotation), a column for each of `columns`.
    pub J: Vec<Vec<f64>>,
    /// Six rows (force and moment at the base).
    pub J_base: Vec<Vec<f64>>,
    pub energy: f64,
    pub index: u64,
}

/// The 24 scenes, those in which it matters under both loads.
pub fn cases() -> Vec<FieldCase> {
    let golden = golden::parse(include_str!("../data/golden_fields.json"));
    let variants = |value: &Value| {
        let load = |(name, load): (&str, CoilLoad)| {
            let output = &value["output"][name];
            (!output.is_null()).then(|| case(value, output, load))
        };
        [("middle", CoilLoad::Middle), ("distributed", CoilLoad::Distributed)].into_iter().filter_map(load).collect()
    };
    list(&golden["scenes"]).iter().flat_map(|value| -> Vec<FieldCase> { variants(value) }).collect()
}

fn case(value: &Value, output: &Value, load: CoilLoad) -> FieldCase {
    let input = &value["input"];
    let mut scene = golden::scene(&value["name"], input);
    scene.name = format!("{} {}", scene.name, load.name());
    scene.sources = FieldSources { coil_load: load, ..sources(&input["field"]) };
    for (segment, value) in scene.segments.iter_mut().zip(list(&input["segments"])) {
        let length = segment.length;
        match &mut segment.kind {
            SegmentKind::Flexible(flexible) => {
                flexible.dipole_per_length = some(&value["dipole_per_length"]);
            }
            SegmentKind::Rigid(rigid) => *rigid = of_rigid(value, length),
        }
    }
    let columns = list(&output["params"]).iter().map(|of| (kind(of).to_owned(), column(&scene, input, of))).collect();
    FieldCase {
        columns,
        n0: vector(&output["n0"]),
        m0: vector(&output["m0"]),
        p_tip: vector(&output["p_tip"]),
        R_tip: matrix(&output["R_tip"]),
        J: table(&output["J"]),
        J_base: table(&output["J_base"]),
        energy: number(&output["energy"]),
        index: output["morse_index"].as_u64().expect("an index"),
        scene,
    }
}

fn some(value: &Value) -> Option<Vector> {
    (!value.is_null()).then(|| vector(value))
}

fn of_rigid(value: &Value, length: f64) -> Rigid {
    let coil = &value["coil"];
    let coil = (!coil.is_null()).then(|| Coil {
        winding: CoilWinding::Axes { turns: [1.0; 3], area: vector(&coil["turns_area"]) },
        current: vector(&coil["current"]),
        alignment: [0.0; 3],
    });
    Rigid { coil, dipole_per_length: some(&value["dipole"]).map(|mu| mu.map(|x| x / length)), ..Rigid::default() }
}

fn sources(field: &Value) -> FieldSources {
    let entry = |entry: GradientEntry| number(&field["gradient"][entry.name()]);
    let magnet = |(k, magnet): (usize, &Value)| Magnet {
        name: format!("m{k}"),
        position: vector(&magnet["position"]),
        moment: vector(&magnet["moment"]),
        rotation: [0.0; 3],
        strength: 1.0,
        body: None,
        clearance: 0.01,
    };
    let coil = |coil: &Value| {
        vec![UnitDipole { position: vector(&coil["position"]), moment_per_ampere: vector(&coil["unit_moment"]) }]
    };
    let coils = list(&field["coils"]);
    let array = CoilArray {
        name: "array".into(),
        current: coils.iter().map(|coil| number(&coil["current"])).collect(),
        coils: coils.iter().map(coil).collect(),
        clearance: rodsweep::model::DEFAULT_CLEARANCE,
    };
    FieldSources {
        gradient: (!field["gradient"].is_null()).then(|| GradientEntry::ALL.map(entry)),
        origin: vector(&field["origin"]),
        magnets: list(&field["magnets"]).iter().enumerate().map(magnet).collect(),
        arrays: if coils.is_empty() { Vec::new() } else { vec![array] },
        maps: Vec::new(),
        coil_load: CoilLoad::default(),
    }
}

fn kind(value: &Value) -> &str {
    value[0].as_str().expect("a kind")
}

/// Slots and rates of a golden column.
fn column(scene: &Scene, input: &Value, of: &Value) -> Vec<(Slot, f64)> {
    let index = || of[1].as_u64().expect("an index") as usize;
    let axis = || Axis::ALL[of[2].as_u64().expect("an axis") as usize];
    let magnets = scene.sources.magnets.len();
    let coil = |name: &str| &list(&input["field"]["coils"])[index()][name];
    match kind(of) {
        "gradient" => {
            let name = of[2].as_str().expect("an entry");
            let entry = GradientEntry::ALL.into_iter().find(|entry| entry.name() == name).expect("an entry");
            vec![(Slot::FieldGradient(entry), 1.0)]
        }
        "origin" => vec![(Slot::FieldOrigin(axis()), 1.0)],
        "p0" => vec![(Slot::BasePosition(axis()), 1.0)],
        "R0" => vec![(Slot::BaseRotation(axis()), 1.0)],
        "magnet.position" => vec![(Slot::SourcePosition(index(), axis()), 1.0)],
        "magnet.moment" => vec![(Slot::SourceMoment(index(), axis()), 1.0)],
        "array.position" => vec![(Slot::SourcePosition(magnets + index(), axis()), 1.0)],
        "array.unit_moment" => vec![(Slot::SourceMoment(magnets + index(), axis()), number(coil("current")))],
        "array.current" => {
            let moment = vector(coil("unit_moment"));
            Axis::ALL.map(|axis| (Slot::SourceMoment(magnets + index(), axis), moment[axis.index()])).to_vec()
        }
        "dipole" => vec![(Slot::Dipole(index(), axis()), 1.0)],
        "dipole_per_length" => vec![(Slot::DipolePerLength(index(), axis()), 1.0)],
        "turns_area" => {
            let current = vector(&list(&input["segments"])[index()]["coil"]["current"]);
            vec![(Slot::Dipole(index(), axis()), current[axis().index()])]
        }
        "length" => {
            // The dipole of a rigid segment stays the same; the force per length acts on more of it.
            let is_flexible = matches!(scene.segments[index()].kind, SegmentKind::Flexible(_));
            let mut slots = vec![(Slot::Length(index()), 1.0)];
            if let (false, Some(load)) = (is_flexible, scene.loads.distributed_force) {
                slots.extend(Axis::ALL.map(|axis| (Slot::Weight(index(), axis), load[axis.index()])));
            }
            slots
        }
        _ => golden::parameter(of).chain(scene),
    }
}

/// A column smaller than this share of the largest of its kind is measured against that.
pub const SMALL: f64 = 1e-3;

pub fn slots(case: &FieldCase) -> Vec<Slot> {
    let mut slots: Vec<Slot> = Vec::new();
    for (slot, _) in case.columns.iter().flat_map(|(_, slots)| slots) {
        if !slots.contains(slot) {
            slots.push(*slot);
        }
    }
    slots
}

/// Worst error of columns against golden ones, each measured against itself or, if small, against the largest of its
/// kind; `scale` makes the first three rows of one kind with the last.
pub fn worst_column(
    case: &FieldCase,
    golden: &[Vec<f64>],
    scale: f64,
    small: impl Fn(&[(Slot, f64)]) -> f64,
    found: impl Fn(usize) -> [f64; 6],
) -> (f64, String) {
    let expected = |k: usize| -> [f64; 6] { std::array::from_fn(|row| golden[row][k]) };
    let size =
        |column: [f64; 6]| norm(&std::array::from_fn::<f64, 6, _>(|r| column[r] / if r < 3 { scale } else { 1.0 }));
    let mut worst = (0.0, String::new());
    for (k, (kind, slots)) in case.columns.iter().enumerate() {
        let of_kind = case.columns.iter().enumerate().filter(|(_, (other, _))| other == kind);
        let largest = of_kind.map(|(j, _)| size(expected(j))).fold(0.0, f64::max);
        let error = column_error(&found(k), &expected(k), (SMALL * largest).max(small(slots)), scale);
        if error.is_nan() || error > worst.0 {
            worst = (error, format!("{}: {kind} {slots:?}", case.scene.name));
        }
    }
    worst
}

/// A plan of a scene, differentiated by each of some slots.
pub fn plan_by_slots(scene: &Scene, slots: &[Slot], options: PlanOptions) -> Plan {
    let mut plan = Plan::single(scene, &[], options).expect("a valid plan");
    for slot in slots {
        let terms = vec![(*slot, plan.entries.len())];
        plan.entries.push(Entry::Constant(1.0));
        plan.derivatives.push(Derivative { parameter: Parameter::Insertion, name: format!("{slot:?}"), terms });
    }
    plan.forward = true;
    plan
}

/// Worst pose, base moment and column of an engine over all golden scenes; columns are measured against at least so much
/// of their natural size.
pub fn engine_errors(
    cases: Vec<FieldCase>,
    options: PlanOptions,
    small: f64,
    make: impl Fn(&Plan) -> Box<dyn Backend>,
) -> (f64, f64, (f64, String)) {
    let (mut pose, mut moment, mut columns) = (0.0_f64, 0.0_f64, (0.0, String::new()));
    for case in cases {
        let slots = slots(&case);
        let plan = plan_by_slots(&case.scene, &slots, options);
        let batch = plan.batch(1, |_, _| {});
        let solutions = make(&plan).solve(&batch).expect("a solved batch");
        let (name, units) = (&case.scene.name, plan.units);
        assert!(solutions.status(0).is_success(), "{name}: {:?}", solutions.status(0));
        assert_eq!(solutions.get(0, Quantity::StabilityIndex) as u64, case.index, "{name}");
        let error = pose_error(&solutions, 0, &case.p_tip, &case.R_tip, units.length);
        let estimate = solutions.get(0, Quantity::ErrorEstimate);
        // Five points stand for the line along which the field acts.
        assert!(error <= estimate + 1e-11, "{name}: error {error:e}, estimate {estimate:e}");
        pose = pose.max(error);
        let m0 = solutions.vector(0, Quantity::BaseMoment);
        moment = moment.max(difference(&m0, &case.m0) / norm(&case.m0).max(units.moment()));
        let column = |k: usize| -> [f64; 6] {
            let of = |(slot, rate): &(Slot, f64), row: usize| {
                let at = slots.iter().position(|other| other == slot).expect("a slot asked for");
                rate * solutions.derivative(0, at, row)
            };
            std::array::from_fn(|row| case.columns[k].1.iter().map(|term| of(term, row)).sum())
        };
        let natural = |slots: &[(Slot, f64)]| {
            small * slots.iter().map(|(slot, rate)| (rate / slot.unit(&units)).powi(2)).sum::<f64>().sqrt()
        };
        let worst = worst_column(&case, &case.J, units.length, natural, column);
        columns = if worst.0 > columns.0 || worst.0.is_nan() { worst } else { columns };
    }
    println!("pose {pose:.1e}, base moment {moment:.1e}, columns {columns:?}");
    (pose, moment, columns)
}
