//! Lines of the field in a box of space, by formulas of their own.

use super::sources::Surroundings;
use super::space::{FieldLine, SEEDS, SEPARATION};
use super::tests::{around, dipole, scene};
use crate::draw::vectors::{distance, dot, minus, norm};
use crate::model::{FieldMap, FieldSources, MapFit, MapGrid, Vector};
use std::sync::Arc;

const BOX: [[f64; 2]; 3] = [[-0.06, 0.06], [-0.05, 0.05], [-0.04, 0.06]];

fn with_sources(sources: FieldSources) -> Surroundings {
    Surroundings::of(&scene([0.0; 3], sources)).expect("a field that varies")
}

/// Of a cube as large as the box (m).
fn side() -> f64 {
    BOX.iter().map(|[low, high]| high - low).product::<f64>().cbrt()
}

/// How far a place is inside of limits (m).
fn inside(at: Vector, limits: [[f64; 2]; 3]) -> f64 {
    (0..3).map(|k| (at[k] - limits[k][0]).min(limits[k][1] - at[k])).fold(f64::INFINITY, f64::min)
}

/// Both ends, with how well they are seen.
fn ends(lines: &[FieldLine]) -> impl Iterator<Item = (Vector, f64)> + '_ {
    let places = lines.iter().flat_map(|line| [line.places[0], line.places[line.places.len() - 1]]);
    places.map(|place| (place.at, place.weight))
}

/// Lines run with the field, and each keeps a number that the formula of the field's lines says is constant.
fn check_kept(around: &Surroundings, lines: &[FieldLine], tolerance: f64, kept: impl Fn(Vector) -> f64) {
    assert!(lines.len() > 12, "{} lines", lines.len());
    for line in lines {
        let known = kept(line.places[line.places.len() / 2].at);
        for pair in line.places.windows(2) {
            let middle = std::array::from_fn(|k| 0.5 * (pair[0].at[k] + pair[1].at[k]));
            assert!(dot(minus(pair[1].at, pair[0].at), around.flux_density(middle)) > 0.0, "{pair:?}");
        }
        for place in &line.places {
            let found = kept(place.at);
            // Where a side cuts a step, the end lies on its chord.
            let tolerance = if inside(place.at, BOX) < 1e-12 { 10.0 * tolerance } else { tolerance };
            assert!((found - known).abs() < tolerance, "{found}, not {known}, at {place:?}");
            let size = norm(around.flux_density(place.at));
            assert!((place.flux_density - size).abs() < 1e-9 * size && (0.0..=1.0).contains(&place.weight));
            assert!(inside(place.at, BOX) > -1e-12, "{place:?}");
        }
    }
}

/// r = R sin² of the angle from the axis: sin² / r is the same along a line, and 0 on the axis.
#[test]
fn lines_of_a_dipole_are_those_of_the_formula() {
    let around = around([0.0; 3], vec![dipole("one", [0.0; 3], [0.0, 0.0, 1.0])]);
    let lines = around.lines_within(BOX);
    // 1e-3 of that of R = 50 mm.
    check_kept(&around, &lines, 0.02, |at| (at[0] * at[0] + at[1] * at[1]) / norm(at).powi(3));
    // They end at a side, at a quarter of the clearance of 10 mm, or unseen.
    for (at, weight) in ends(&lines) {
        let is_at_source = norm(at) < 0.0027 && norm(at) > 0.0025;
        assert!(inside(at, BOX) < 1e-12 || is_at_source || weight < 0.02, "{at:?} {weight}");
    }
    assert!(ends(&lines).any(|(at, weight)| norm(at) < 0.0027 && weight > 0.9), "one is whole");
}

/// B = g (x, y, -2 z): (x² + y²) z is the same along a line.
#[test]
fn lines_of_a_gradient_are_those_of_the_formula() {
    let around = with_sources(FieldSources { gradient: Some([0.3, 0.0, 0.0, 0.3, 0.0]), ..FieldSources::default() });
    let lines = around.lines_within(BOX);
    check_kept(&around, &lines, 3e-4 * 0.06f64.powi(3), |at| (at[0] * at[0] + at[1] * at[1]) * at[2]);
    for (at, weight) in ends(&lines) {
        // There is no field at the origin.
        assert!(inside(at, BOX) < 1e-12 || norm(at) < 1e-5 || weight < 0.02, "{at:?} {weight}");
    }
}

#[test]
fn lines_end_at_the_edges_of_a_grid() {
    let (counts, step) = ([5, 6, 7], 0.01);
    let origin: Vector = [-0.03, -0.02, -0.03];
    // Of the potential -(B x): its coefficients are its values at the nodes.
    let b: Vector = [3e-3, 1e-3, 2e-3];
    let padded = counts.map(|count| count + 2);
    let node = |index: usize| -> Vector {
        let at = [index % padded[0], index / padded[0] % padded[1], index / (padded[0] * padded[1])];
        std::array::from_fn(|k| origin[k] + (at[k] as f64 - 1.0) * step)
    };
    let coefficients = (0..padded.iter().product()).map(|index| -dot(b, node(index))).collect();
    let fit = MapFit { divergence: 0.0, rotation: None };
    let grid = Arc::new(MapGrid { origin, steps: [step; 3], counts, coefficients, fit, gaps: Vec::new() });
    let [name, file, digest] = ["map", "map.csv", ""].map(String::from);
    let map =
        FieldMap { name, file, digest, scale: 1.0, position: [0.0; 3], units: [None, None], grid, remarks: Vec::new() };
    let around = with_sources(FieldSources { maps: vec![map], ..FieldSources::default() });
    let limits = around.grids[0].limits;
    assert!((norm(around.flux_density([0.0; 3])) - norm(b)).abs() < 1e-12);
    let lines = around.lines_within(BOX);
    assert!(lines.len() > 4, "{} lines", lines.len());
    for (at, weight) in ends(&lines) {
        assert!(inside(at, limits).abs() < 1e-5 || inside(at, BOX) < 1e-12 || weight < 0.02, "{at:?} {weight}");
    }
    assert!(ends(&lines).any(|(at, _)| inside(at, limits).abs() < 1e-5));
    assert!(lines.iter().flat_map(|line| &line.places).all(|place| inside(place.at, limits) > -1e-5));
}

/// A few magnets in the box and beside it.
fn crowd(shift: f64) -> Surroundings {
    let magnets = (0..6).map(|k| {
        let [sin, cos] = [f64::from(k).sin(), f64::from(k).cos()];
        dipole("m", [0.05 * cos + shift, 0.05 * sin, 0.015 * f64::from(k) - 0.03], [sin, cos, 0.3])
    });
    around([1e-3, 0.0, 2e-3], magnets.collect())
}

#[test]
fn lines_in_space_are_the_same_each_time_and_bounded() {
    let lines = crowd(0.0).lines_within(BOX);
    assert_eq!(lines, crowd(0.0).lines_within(BOX));
    let points: usize = lines.iter().map(|line| line.places.len()).sum();
    assert!(lines.len() > 20 && lines.len() <= SEEDS && points <= 8000, "{} lines, {points} points", lines.len());
    for line in &lines {
        let long: f64 = line.places.windows(2).map(|pair| distance(pair[0].at, pair[1].at)).sum();
        assert!(long < 4.1 * 0.12 && line.places.len() <= 401, "{long} m");
    }
    // Nowhere a field, or no box.
    let mut still = dipole("one", [0.0; 3], [0.0, 0.0, 1.0]);
    still.strength = 0.0;
    assert_eq!(around([0.0; 3], vec![still]).lines_within(BOX), []);
    for side in [[0.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY], [1.0, 0.0]] {
        assert_eq!(crowd(0.0).lines_within([side; 3]), []);
    }
}

/// Of two lines that come together one fades; everywhere one is seen nearby.
#[test]
fn lines_in_space_are_spread_evenly() {
    let separation = SEPARATION * side();
    for around in [crowd(0.0), around([0.0; 3], vec![dipole("far", [0.2, 0.0, 0.0], [0.0, 5.0, 9.0])])] {
        let lines = around.lines_within(BOX);
        let places = |of: &[FieldLine]| of.iter().flat_map(|line| line.places.clone()).collect::<Vec<_>>();
        for (k, line) in lines.iter().enumerate() {
            let before = places(&lines[..k]);
            for place in &line.places {
                let near = before.iter().filter(|other| distance(other.at, place.at) < 0.5 * separation);
                let seen = near.map(|other| other.weight).fold(0.0, f64::max);
                assert!(seen + place.weight < 1.0 + 1e-9, "{seen} beside {place:?}");
            }
        }
        let all = places(&lines);
        for k in 0..1000 {
            let share = |axis: u32| (0.5 + f64::from(k / 10i32.pow(axis) % 10)) / 10.0;
            let at: Vector =
                std::array::from_fn(|axis| BOX[axis][0] + share(axis as u32) * (BOX[axis][1] - BOX[axis][0]));
            let seen = all.iter().filter(|place| place.weight > 0.25).map(|place| distance(place.at, at));
            let nearest = seen.fold(f64::INFINITY, f64::min);
            assert!(nearest < 1.7 * separation, "{nearest} m from {at:?}");
        }
    }
}

/// Where a source moves a little, so does every line.
#[test]
fn no_line_in_space_jumps() {
    let seen = |shift: f64| -> f64 {
        let of = |line: &FieldLine| -> f64 {
            line.places.windows(2).map(|pair| pair[1].weight * distance(pair[0].at, pair[1].at)).sum()
        };
        crowd(shift).lines_within(BOX).iter().map(of).sum()
    };
    for k in 0..40 {
        let at = 2.5e-4 * f64::from(k);
        let (one, other) = (seen(at), seen(at + 1e-7));
        // A tenth of the shortest line that is seen in full.
        assert!((one - other).abs() < 0.1 * SEPARATION * side(), "{one} and {other} m at {at}");
    }
}

/// What makes the same field is told apart from what does not.
#[test]
fn the_same_field_is_known() {
    assert!(crowd(0.0).is_as(&crowd(0.0)));
    assert!(!crowd(0.0).is_as(&crowd(1e-12)));
    let gradient =
        |xx: f64| with_sources(FieldSources { gradient: Some([xx, 0.0, 0.0, 0.0, 0.0]), ..FieldSources::default() });
    assert!(gradient(0.1).is_as(&gradient(0.1)) && !gradient(0.1).is_as(&gradient(0.2)));
}
