//! Fields sampled on a grid: order of convergence, both engines, columns, the edge.
#![allow(non_snake_case)]

use super::common::check::{column_error, difference, norm};
use super::common::root;
use super::fields::{asymmetry, tip_columns};
use super::rods::{moved, rod_units};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::read_scene;
use rodsweep::model::{
    Axis, CoilLoad, FieldMap, FieldSources, MapGrid, Parameter, Plan, PlanOptions, Quantity, Rod, RodField, RodMap,
    Scene, Slot, Status, Stepper, Vector,
};
use rodsweep::reference::{energy_of, solve_rod};
use std::sync::Arc;

const ORIGIN: Vector = [-0.05, -0.045, -0.02];
const SIZE: Vector = [0.1, 0.09, 0.1];

fn arm() -> Scene {
    let mut scene = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("the scene");
    scene.sources.magnets[0].position = [0.14, 0.02, 0.05];
    scene
}

/// Values at the nodes of a grid with so many cells in each direction.
fn sampled(cells: usize, of: impl Fn(Vector) -> f64) -> (Vector, [usize; 3], Vec<f64>) {
    let n = cells + 1;
    let steps = SIZE.map(|size| size / cells as f64);
    let at = |k: usize| [k % n, k / n % n, k / (n * n)];
    let values = (0..n * n * n).map(|k| {
        let index = at(k);
        of(std::array::from_fn(|axis| ORIGIN[axis] + index[axis] as f64 * steps[axis]))
    });
    (steps, [n; 3], values.collect())
}

fn of_field(field: &RodField, cells: usize) -> MapGrid {
    let [x, y, z] = [0, 1, 2].map(|axis| sampled(cells, |at| field.flux_density(at)[axis]));
    MapGrid::from_flux_density(ORIGIN, x.0, x.1, [&x.2, &y.2, &z.2]).expect("a grid")
}

/// phi of a dipole: k0 M·r / r³
fn potential(field: &RodField, at: Vector) -> f64 {
    let of = |dipole: &rodsweep::model::FieldDipole| {
        let r: Vector = std::array::from_fn(|k| at[k] - dipole.position[k]);
        1e-7 * (0..3).map(|k| r[k] * dipole.moment[k]).sum::<f64>() / norm(&r).powi(3)
    };
    field.dipoles.iter().map(of).sum()
}

fn map_of(grid: MapGrid) -> FieldMap {
    FieldMap {
        name: "coil".into(),
        file: "coil.csv".into(),
        digest: String::new(),
        scale: 1.0,
        position: [0.0; 3],
        units: [None, None],
        grid: Arc::new(grid),
        remarks: Vec::new(),
    }
}

/// The arm's catheter in its magnet's field as a grid has it.
fn mapped(cells: usize) -> Scene {
    let mut scene = arm();
    let field = scene.rod().field.expect("a field that varies");
    scene.sources = FieldSources { maps: vec![map_of(of_field(&field, cells))], ..FieldSources::default() };
    scene
}

/// Worst B and worst gradient inside against the dipoles', which are of the size of 1.
fn errors(field: &RodField, grid: MapGrid) -> [f64; 2] {
    let map = RodMap { scale: 1.0, position: [0.0; 3], grid: Arc::new(grid) };
    let (mut worst, mut largest) = ([0.0_f64; 2], [0.0_f64; 2]);
    for k in 0..400 {
        let share = |by: f64| (0.5 + k as f64 * by).fract();
        let places = [share(0.618_034), share(0.754_878), share(0.569_840)];
        let at: Vector = std::array::from_fn(|axis| ORIGIN[axis] + SIZE[axis] * places[axis]);
        let (found, b) = (map.local(at), field.flux_density(at));
        let unit = |axis: usize| std::array::from_fn(|k| f64::from(u8::from(k == axis)));
        let off = (0..3).map(|axis| difference(&field.load(at, unit(axis)).0, &found.gradient[axis]));
        worst = [worst[0].max(difference(&found.flux_density, &b)), worst[1].max(off.fold(0.0, f64::max))];
        let gradient = (0..3).map(|axis| norm(&field.load(at, unit(axis)).0)).fold(0.0, f64::max);
        largest = [largest[0].max(norm(&b)), largest[1].max(gradient)];
    }
    [worst[0] / largest[0], worst[1] / largest[1]]
}

/// B is of third order, its gradient of second, be they of samples of B or of the potential; so is the residual of
/// Laplace's equation.
#[test]
fn splines_converge_by_their_order() {
    let field = arm().rod().field.expect("a field that varies");
    let of_potential = |cells: usize| {
        let (steps, counts, values) = sampled(cells, |at| potential(&field, at));
        MapGrid::from_potential(ORIGIN, steps, counts, &values).expect("a grid")
    };
    for of in [&of_potential as &dyn Fn(usize) -> MapGrid, &|cells| of_field(&field, cells)] {
        let grids = [of(10), of(20), of(40)];
        let divergences = grids.each_ref().map(|grid| grid.fit.divergence);
        let rotations = grids.each_ref().map(|grid| grid.fit.rotation);
        let [coarse, middle, fine] = grids.map(|grid| errors(&field, grid));
        println!("{coarse:?} {middle:?} {fine:?} {divergences:?} {rotations:?}");
        for (k, least) in [2.6, 1.7].into_iter().enumerate() {
            let order = (middle[k] / fine[k]).log2();
            assert!(
                order > least && (coarse[k] / middle[k]).log2() > least - 0.4,
                "{k}: {coarse:?} {middle:?} {fine:?}"
            );
        }
        assert!(fine[0] < 2e-4, "{fine:?}");
        assert!((divergences[1] / divergences[2]).log2() > 1.7, "{divergences:?}");
        assert!(rotations[2].is_none_or(|rotation| rotation < 1e-3), "{rotations:?}");
    }
}

/// A linear field is a spline itself.
#[test]
fn linear_fields_are_exact() {
    let mut scene = arm();
    scene.sources = FieldSources { gradient: Some([0.3, -0.1, 0.2, 0.5, 0.4]), ..FieldSources::default() };
    scene.sources.origin = [0.01, -0.02, 0.03];
    let grid = of_field(&scene.rod().field.expect("a gradient"), 5);
    assert!(
        grid.fit.divergence < 1e-12 && grid.fit.rotation.is_some_and(|rotation| rotation < 1e-13),
        "{:?}",
        grid.fit
    );
    let exact = solve_rod(&scene.rod(), &[]);
    scene.sources = FieldSources { maps: vec![map_of(grid)], ..FieldSources::default() };
    let found = solve_rod(&scene.rod(), &[]);
    assert!(exact.status.is_success() && found.status.is_success(), "{:?} {:?}", exact.status, found.status);
    assert!(difference(&exact.p_tip, &found.p_tip) <= 1e-11 * scene.total_length());
    assert!((exact.margin - found.margin).abs() < 1e-9);
}

/// Noise and fields that no magnet makes show in the residuals.
#[test]
fn residuals_tell_what_is_no_field() {
    let swirl = [0, 1, 2].map(|axis| sampled(8, |at| [-at[1], at[0], 0.0][axis]));
    let [x, y, z] = &swirl;
    let grid = MapGrid::from_flux_density(ORIGIN, x.0, x.1, [&x.2, &y.2, &z.2]).expect("a grid");
    assert!(grid.fit.rotation.is_some_and(|rotation| rotation > 0.3), "{:?}", grid.fit);
    let (steps, counts, values) = sampled(8, |at| at[0] * at[0]);
    let grid = MapGrid::from_potential(ORIGIN, steps, counts, &values).expect("a grid");
    assert!(grid.fit.divergence > 0.9, "{:?}", grid.fit);
}

/// The rod in the map of a magnet's field goes where the magnet brings it.
#[test]
fn a_map_stands_for_its_magnet() {
    let exact = solve_rod(&arm().rod(), &[]);
    let mut last = f64::INFINITY;
    for cells in [10, 20, 40] {
        let scene = mapped(cells);
        let found = solve_rod(&scene.rod(), &[]);
        assert!(found.status.is_success(), "{:?}", found.status);
        let off = difference(&exact.p_tip, &found.p_tip) / scene.total_length();
        println!("{cells} cells: tip {off:.1e} of the length off");
        assert!(off < last / 2.0, "{cells}: {off:e} after {last:e}");
        last = off;
    }
    assert!(last < 1e-4, "{last:e}");
}

/// Scaled and moved.
fn placed(mut scene: Scene) -> Scene {
    scene.sources.maps[0].scale = 0.8;
    scene.sources.maps[0].position = [0.001, -0.002, 0.003];
    scene
}

fn wrt(scene: &Scene) -> Vec<Parameter> {
    let names = ["maps.coil.scale", "maps.coil.position", "base.position", "base.rotation", "field.flux_density"];
    let names = names.iter().chain(&["tube.length", "tip.dipole_per_length", "loads.tip_force"]);
    names.flat_map(|name| Parameter::parse(scene, name).expect("parameters")).collect()
}

#[test]
fn engines_agree_in_a_map() {
    let mut scene = placed(mapped(16));
    for load in CoilLoad::ALL {
        scene.sources.coil_load = load;
        let wrt = wrt(&scene);
        let (pose, columns): (f64, f64) = (1e-9, 3e-8);
        let cases = [(Precision::F64, pose, columns), (Precision::F32, pose.max(2e-5), columns.max(2e-4))];
        for (precision, pose, columns) in cases {
            let tolerance = if precision == Precision::F64 { 1e-11 } else { 1e-5 };
            let options = PlanOptions { tolerance, stepper: Stepper::Dop853, steps: 24, ..PlanOptions::default() };
            let plan = Plan::single(&scene, &wrt, options).expect("a plan");
            let batch = plan.batch(1, |_, _| {});
            let solutions = Cpu::new(&plan, precision).expect("an engine").solve(&batch).expect("solutions");
            let slots = plan.slots();
            let found = solve_rod(&scene.rod(), &slots);
            assert!(solutions.status(0).is_success() && found.status.is_success(), "{:?}", solutions.status(0));
            assert_eq!(solutions.get(0, Quantity::StabilityIndex), found.index as f64);
            let length = plan.units.length;
            let off = difference(&solutions.vector(0, Quantity::TipPosition), &found.p_tip) / length;
            assert!(off <= pose, "{precision}: {off:e}");
            for (k, derivative) in plan.derivatives.iter().enumerate() {
                let mut expected = [0.0; 6];
                let mut natural = 0.0_f64;
                for (slot, entry) in &derivative.terms {
                    let rate = plan.entry(&batch, 0, *entry);
                    let d = &found.derivatives[slots.iter().position(|other| other == slot).expect("a slot")];
                    expected.iter_mut().zip(d.dp.iter().chain(&d.w)).for_each(|(sum, x)| *sum += rate * x);
                    natural = natural.max(rate.abs() / slot.unit(&plan.units));
                }
                let column: [f64; 6] = std::array::from_fn(|row| solutions.derivative(0, k, row));
                let error = column_error(&column, &expected, natural, length);
                assert!(error <= columns, "{precision} {}: {error:e}", derivative.name);
            }
        }
    }
}

/// A magnet that lies across many cells is what its pieces are, each within one or two: no rule of points knows where faces are.
#[test]
fn a_long_magnet_in_a_map_is_its_pieces() {
    const PIECES: u32 = 8;
    let mut whole = mapped(24);
    whole.segments[0].length = 0.03;
    whole.segments[1].length = 0.03;
    let mut pieces = whole.clone();
    let piece = pieces.segments.pop().expect("the magnet");
    for k in 0..PIECES {
        let mut one = piece.clone();
        one.name = format!("piece{k}");
        one.length = piece.length / f64::from(PIECES);
        pieces.segments.push(one);
    }
    let options = PlanOptions { tolerance: 1e-11, stepper: Stepper::Dop853, steps: 24, ..PlanOptions::default() };
    let wrt = [Axis::X, Axis::Y].map(|axis| Parameter::MapPosition(0, axis));
    let solve = |scene: &Scene| {
        let plan = Plan::single(scene, &wrt, options).expect("a plan");
        let batch = plan.batch(1, |_, _| {});
        let solutions = Cpu::new(&plan, Precision::F64).expect("an engine").solve(&batch).expect("solutions");
        assert!(solutions.status(0).is_success());
        let column = |k: usize| -> [f64; 6] { std::array::from_fn(|row| solutions.derivative(0, k, row)) };
        (solutions.vector(0, Quantity::TipPosition), [0, 1].map(column), plan.units.length)
    };
    let (p, columns, length) = solve(&whole);
    let (q, of_pieces, _) = solve(&pieces);
    assert!(difference(&p, &q) <= 1e-9 * length, "{:e}", difference(&p, &q) / length);
    for (a, b) in columns.iter().zip(&of_pieces) {
        let error = column_error(a, b, 0.0, length);
        assert!(error <= 1e-7, "{error:e}");
    }
    for scene in [whole, pieces] {
        let found = solve_rod(&scene.rod(), &[]);
        assert!(difference(&p, &found.p_tip) <= 1e-9 * length, "{:e}", difference(&p, &found.p_tip) / length);
    }
}

#[test]
fn columns_of_a_map_are_differences() {
    let rod = placed(mapped(16)).rod();
    let mut slots = vec![Slot::MapScale(0)];
    slots.extend(Axis::ALL.map(|axis| Slot::MapPosition(0, axis)));
    slots.extend(Axis::ALL.map(Slot::BasePosition));
    let found = solve_rod(&rod, &slots);
    for (slot, d) in slots.iter().zip(&found.derivatives) {
        let h = 1e-3 * slot.unit(&rod_units(&rod));
        let at = |steps: f64| solve_rod(&moved(&rod, *slot, steps * h), &[]).p_tip;
        let (up, down) = (at(1.0), at(-1.0));
        let by: Vector = std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * h));
        let size = norm(&d.dp).max(0.1 * rod.total_length() / slot.unit(&rod_units(&rod)));
        assert!(difference(&by, &d.dp) <= 2e-4 * size, "{slot:?}: {by:?} {:?}", d.dp);
    }
    // Nothing is left where base and map move together.
    for axis in 0..3 {
        let (map, base) = (&found.derivatives[1 + axis], &found.derivatives[4 + axis]);
        let sum: Vector = std::array::from_fn(|k| map.dp[k] + base.dp[k] - f64::from(u8::from(k == axis)));
        assert!(norm(&sum) <= 1e-9, "{axis}: {sum:?}");
    }
}

/// Response to loads is symmetric and force is the slope of the energy: the interpolated field has a potential.
#[test]
fn a_map_conserves_energy() {
    let rod = placed(mapped(16)).rod();
    let loads: Vec<Slot> = Axis::ALL.map(Slot::TipForce).into_iter().chain(Axis::ALL.map(Slot::TipMoment)).collect();
    let found = solve_rod(&rod, &loads);
    let (error, place) = asymmetry(&tip_columns(&found), rod.total_length());
    assert!(error <= 1e-9, "{place:?}: {error:e}");
    // dE/d(base position) is minus the force there.
    let h = 1e-5;
    for axis in Axis::ALL {
        let at = |by: f64| {
            let there = moved(&rod, Slot::BasePosition(axis), by);
            energy_of(&there, &solve_rod(&there, &[])).expect("an energy")
        };
        let slope = (at(h) - at(-h)) / (2.0 * h);
        let n0 = found.n0[axis.index()];
        assert!((slope + n0).abs() <= 1e-5 * norm(&found.n0), "{axis:?}: {slope} {n0}");
    }
}

/// A magnetic part outside of the grid has no field; a part that is not magnetic may be there.
#[test]
fn outside_of_a_map_there_is_no_answer() {
    let solve = |scene: &Scene| {
        let plan = Plan::single(scene, &[], PlanOptions { steps: 12, ..PlanOptions::default() }).expect("a plan");
        let mut lanes = Cpu::new(&plan, Precision::F64).expect("an engine");
        let by_lanes = lanes.solve(&plan.batch(1, |_, _| {})).expect("a solved batch").status(0);
        (solve_rod(&scene.rod(), &[]).status, by_lanes)
    };
    // The base lies outside, and the whole tube.
    let mut scene = mapped(20);
    scene.sources.maps[0].position = [0.0, 0.0, 0.075];
    let (by_reference, by_lanes) = solve(&scene);
    assert!(by_reference.is_success() && by_lanes.is_success(), "{by_reference:?} {by_lanes:?}");
    scene.sources.maps[0].position = [0.0, 0.0, 0.095];
    assert_eq!(solve(&scene), (Status::OutsideMap, Status::OutsideMap));
    let rod: Rod = scene.rod();
    assert!(rod.field.expect("a field").maps[0].inside([0.0, 0.0, 0.07]) < 0.0);
}
