//! The reference against golden results of independent computations.

use crate::common::check::{SMALL_COLUMN, Tolerance, check_golden, column_error, difference, natural_size, norm};
use crate::common::golden;
use rodsweep::backend::Backend;
use rodsweep::model::{
    Axis, Density, Flexible, Parameter, Plan, PlanOptions, Quantity, SegmentKind, SegmentParameter, Slot, Status,
};
use rodsweep::reference::{Reference, base_curvature, solve_rod, stability_at};

/// The golden Jacobians are good to 2.4e-11, poses to 1e-14; the worst scenes amplify errors a hundredfold.
const GOLDEN: Tolerance = Tolerance { pose: 1e-11, moment: 1e-11, jacobian: 1e-9, small_column: SMALL_COLUMN };
/// The golden poses of the extended scenes agree to 2e-14 of the length between two forms.
const EXTENDED_POSE: f64 = 1e-12;
/// Stated accuracy of the published code's tips [m].
const PUBLISHED_TIP: f64 = 1e-7;
/// The published Jacobians differentiate with its coarser weights: relative to each column.
const PUBLISHED_JACOBIAN: f64 = 1e-4;
/// The published code tabulates weight every 0.01 mm and counts two nodes too many in the distal segment [m].
const PUBLISHED_EXTRA_WEIGHT: f64 = 2e-5;

#[test]
fn all_scenes() {
    let cases = golden::dev();
    let make = |plan: &Plan| Box::new(Reference::new(plan)) as Box<_>;
    let errors = check_golden(&cases, PlanOptions::default(), make, GOLDEN);
    assert_eq!(errors.len(), 60);
    for error in errors.iter().take(5) {
        println!("{error:?}");
    }
    let worst = |of: fn(&crate::common::check::Errors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    println!("worst: pose {:.1e}, moment {:.1e}", worst(|e| e.pose), worst(|e| e.moment));
    for error in &errors {
        assert_eq!(error.index, 0.0, "{}", error.name);
    }
}

/// Rest curvature linear along segments, with the columns of its nodes and of insertion; shear and stretch.
#[test]
fn extended_scenes() {
    let cases = golden::extended();
    assert_eq!(cases.len(), 14);
    let (mut pose, mut moment) = ((0.0, String::new()), (0.0, String::new()));
    let mut column = (0.0, String::new(), String::new());
    for case in &cases {
        let (rod, name) = (case.scene.rod(), &case.scene.name);
        let slots: Vec<Slot> = case.columns.iter().flat_map(|(_, chain)| chain.iter().map(|(slot, _)| *slot)).collect();
        let found = solve_rod(&rod, &slots);
        assert!(found.status.is_success(), "{name}: {:?}", found.status);
        let plan = Plan::single(&case.scene, &[], PlanOptions::default()).expect("a valid plan");
        let units = plan.units;
        let turn = norm(&std::array::from_fn::<f64, 9, _>(|k| found.R_tip[k / 3][k % 3] - case.R_tip[k / 3][k % 3]));
        let error = (difference(&found.p_tip, &case.p_tip) / units.length).max(turn);
        if error.is_nan() || error > pose.0 {
            pose = (error, name.clone());
        }
        let error = (difference(&found.m0, &case.m0) / norm(&case.m0).max(units.moment()))
            .max(difference(&found.u0, &case.u0) / norm(&case.u0).max(units.curvature()));
        if error.is_nan() || error > moment.0 {
            moment = (error, name.clone());
        }
        let mut derivatives = found.derivatives.iter();
        for (k, (label, chain)) in case.columns.iter().enumerate() {
            let mut by = [0.0; 6];
            for ((_, rate), d) in chain.iter().zip(derivatives.by_ref()) {
                by.iter_mut().zip(d.dp.iter().chain(&d.w)).for_each(|(x, d)| *x += rate * d);
            }
            let expected: [f64; 6] = std::array::from_fn(|row| case.J[row][k]);
            let size = chain.iter().map(|(slot, rate)| (rate / slot.unit(&units)).powi(2)).sum::<f64>().sqrt();
            let error = column_error(&by, &expected, SMALL_COLUMN * size, units.length);
            if error.is_nan() || error > column.0 {
                column = (error, name.clone(), label.clone());
            }
        }
    }
    println!("worst: pose {pose:?}, moment and curvature {moment:?}, column {column:?}");
    assert!(pose.0 <= EXTENDED_POSE, "{pose:?}");
    assert!(moment.0 <= GOLDEN.moment, "{moment:?}");
    assert!(column.0 <= GOLDEN.jacobian, "{column:?}");
}

#[test]
fn curvature_at_both_ends() {
    let mut worst = (0.0, String::new());
    for case in golden::dev() {
        let rod = case.scene.rod();
        let equilibrium = solve_rod(&rod, &[]);
        let length = rod.total_length();
        let error = (difference(&equilibrium.u0, &case.u0) / norm(&case.u0).max(1.0 / length))
            .max(difference(&equilibrium.u_tip, &case.u_tip) / norm(&case.u_tip).max(1.0 / length));
        if error.is_nan() || error > worst.0 {
            worst = (error, case.scene.name.clone());
        }
        let u0 = base_curvature(&rod, case.m0).expect("integrable");
        assert!(difference(&u0, &case.u0) <= 1e-11 * norm(&case.u0).max(1.0 / length), "{}", case.scene.name);
    }
    println!("worst curvature {worst:?}");
    assert!(worst.0 <= GOLDEN.moment, "{worst:?}");
}

#[test]
fn index_of_every_equilibrium() {
    let mut count = 0;
    for case in golden::stability() {
        let rod = case.scene.rod();
        for (k, (m0, _, _, index)) in case.equilibria.iter().enumerate() {
            let found = stability_at(&rod, *m0).expect("integrable");
            assert_eq!(found.index, *index, "{} equilibrium {k}: {found:?}", case.scene.name);
            assert_eq!(found.margin < 0.0, *index > 0);
            count += 1;
        }
    }
    assert_eq!(count, 83);
}

#[test]
fn published_code_on_p6() {
    let mut wrt = Axis::ALL.map(|axis| Parameter::Segment(1, SegmentParameter::Current(axis))).to_vec();
    wrt.push(Parameter::Insertion);
    wrt.extend(Axis::ALL.map(Parameter::TipForce));
    let mut scene = golden::p6_scene();
    let distal_length = scene.segments[2].length;
    if let SegmentKind::Flexible(Flexible { density: Some(Density::Linear(density)), .. }) = &mut scene.segments[2].kind
    {
        *density *= 1.0 + PUBLISHED_EXTRA_WEIGHT / distal_length;
    }
    let axes: Vec<Vec<Parameter>> = wrt.iter().map(|parameter| vec![*parameter]).collect();
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).expect("a valid plan");
    let samples = golden::p6_samples();
    let batch = plan.batch(samples.len(), |i, row| {
        if let Some(sample) = samples.get(i) {
            row[..3].copy_from_slice(&sample.currents);
            row[3] = sample.insertion;
            row[4..].copy_from_slice(&sample.tip_force);
        }
    });
    let solutions = Reference::new(&plan).solve(&batch).expect("solved");
    let (mut tip, mut jacobian) = ((0.0, 0), (0.0, 0, String::new()));
    let mut report = Vec::new();
    for (i, sample) in samples.iter().enumerate() {
        let error = difference(&solutions.vector(i, Quantity::TipPosition), &sample.p_tip);
        if error > tip.0 {
            tip = (error, i);
        }
        if error > PUBLISHED_TIP || !solutions.status(i).is_success() {
            report.push(format!("sample {i}: {error:.2e} m, {:?}", solutions.status(i)));
        }
        for (k, parameter) in wrt.iter().enumerate() {
            let found: [f64; 6] = std::array::from_fn(|row| solutions.derivative(i, k, row));
            let expected: [f64; 6] = std::array::from_fn(|row| sample.J[row][k]);
            let size = SMALL_COLUMN * natural_size(&scene, *parameter, &plan.units);
            let error = column_error(&found, &expected, size, plan.units.length);
            if error > jacobian.0 {
                jacobian = (error, i, parameter.name(&scene));
            }
        }
    }
    println!("worst tip {tip:?}, worst column {jacobian:?}");
    assert!(report.is_empty(), "{}", report.join("\n"));
    assert!(jacobian.0 <= PUBLISHED_JACOBIAN, "{jacobian:?}");
}

#[test]
fn rows_do_not_depend_on_the_batch() {
    let mut scene = golden::p6_scene();
    scene.rigid_force_arm = true;
    let current = |axis| Parameter::Segment(1, SegmentParameter::Current(axis));
    let axes = [vec![current(Axis::X)], vec![current(Axis::Y)], vec![Parameter::Insertion]];
    let wrt = [current(Axis::X), Parameter::Gravity(Axis::Z), Parameter::Segment(0, SegmentParameter::YoungsModulus)];
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).expect("a valid plan");
    let values = |i: usize| [0.05 * i as f64 - 0.1, 0.1, if i == 3 { 0.01 } else { 0.12 }];
    let mut reference = Reference::new(&plan);
    let batch = plan.batch(6, |i, row| row.copy_from_slice(&values(i)));
    let all = reference.solve(&batch).expect("solved");
    for i in 0..6 {
        let alone = reference.solve(&plan.batch(1, |_, row| row.copy_from_slice(&values(i)))).expect("solved");
        // Insertion by 10 mm leaves the first segment a negative length.
        let status = if i == 3 { Status::BadParameter } else { all.status(i) };
        assert_eq!((all.status(i), alone.status(0)), (status, status));
        for column in 0..all.values.column_count() {
            assert_eq!(all.values.get(i, column), alone.values.get(0, column), "sample {i} column {column}");
        }
    }
}
