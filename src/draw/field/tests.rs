//! Lines of the field and marks at the edge, by their geometry.

use super::beyond::beyond;
use super::free_places::{Taken, extent, overlap};
use super::line::local;
use super::sources::{Surroundings, widened};
use super::spread::{Plane, SEPARATION, length};
use crate::draw::canvas::{Align, Rect, SMALL, Text};
use crate::draw::vectors::{cross, distance, dot, minus, norm};
use crate::draw::views::{FourViews, View};
use crate::model::{Base, CoilArray, FieldSources, Loads, Magnet, MagnetBody, MagnetShape, Scene, UnitDipole, Vector};

pub(super) fn scene(flux_density: Vector, sources: FieldSources) -> Scene {
    let (base, loads) = (Base::default(), Loads::default());
    Scene {
        name: String::new(),
        base,
        flux_density,
        sources,
        loads,
        segments: Vec::new(),
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

pub(super) fn dipole(name: &str, position: Vector, moment: Vector) -> Magnet {
    let (rotation, strength) = ([0.0; 3], 1.0);
    Magnet { name: name.into(), position, moment, rotation, strength, body: None, clearance: 0.01 }
}

pub(super) fn around(flux_density: Vector, magnets: Vec<Magnet>) -> Surroundings {
    let sources = FieldSources { magnets, ..FieldSources::default() };
    Surroundings::of(&scene(flux_density, sources)).expect("a field that varies")
}

/// The views of a rod of 60 mm along z.
fn views() -> FourViews {
    FourViews::new([[-0.03, 0.03], [-0.03, 0.03], [0.0, 0.06]], 500.0, 30.0, 14.0)
}

/// The largest angle between a line's chords and the field at their middles (rad).
fn largest_angle(line: &[Vector], field: impl Fn(Vector) -> Vector) -> f64 {
    let angle = |pair: &[Vector]| {
        let chord = minus(pair[1], pair[0]);
        let field = field(std::array::from_fn(|k| 0.5 * (pair[0][k] + pair[1][k])));
        norm(cross(chord, field)).atan2(dot(chord, field))
    };
    line.windows(2).map(angle).fold(0.0, f64::max)
}

#[test]
fn a_line_stays_along_the_field() {
    let magnets =
        vec![dipole("a", [0.1, 0.0, 0.05], [3.0, 0.0, 20.0]), dipole("b", [-0.1, 0.05, 0.0], [0.0, 9.0, 0.0])];
    let around = around([2e-3, 0.0, -1e-3], magnets);
    for through in [[0.0, 0.0, 0.03], [0.05, 0.02, 0.0], [-0.04, -0.03, 0.06]] {
        let line = around.line(through, 1e-3, 0.1);
        let long: f64 = line.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
        assert!(line.len() > 60 && long > 0.06, "{} points, {long} m", line.len());
        let angle = largest_angle(&line, |at| around.flux_density(at));
        assert!(angle < 2e-3, "{angle} rad off at {through:?}");
    }
}

/// r = R sin² of the angle from the axis, from pole to pole.
#[test]
fn the_line_of_a_dipole_comes_back_to_it() {
    let around = around([0.0; 3], vec![dipole("one", [0.0; 3], [0.0, 0.0, 1.0])]);
    let radius = 0.05;
    let line = around.line([radius, 0.0, 0.0], 1e-3, 1.0);
    let size = |at: &Vector| norm(*at);
    for at in &line {
        let sine = at[0].hypot(at[1]) / size(at);
        assert!((size(at) / (radius * sine * sine) - 1.0).abs() < 1e-3, "{at:?}");
    }
    let (first, last) = (line[0], line[line.len() - 1]);
    assert!(size(&first) < 0.004 && size(&last) < 0.004, "{first:?} {last:?}");
    // The field leaves at the north pole and comes in at the south pole.
    assert!(first[2] > 0.0 && last[2] < 0.0 && (first[2] + last[2]).abs() < 1e-4, "{first:?} {last:?}");
    assert!(line.iter().any(|at| at[0] > 0.999 * radius));
}

#[test]
fn the_line_of_a_uniform_field_is_straight() {
    let sources = FieldSources { gradient: Some([0.0; 5]), ..FieldSources::default() };
    let around = Surroundings::of(&scene([3e-3, 4e-3, 0.0], sources)).expect("a gradient");
    let line = around.line([0.01, 0.0, 0.02], 1e-3, 0.05);
    let (first, last) = (line[0], line[line.len() - 1]);
    assert!((distance(first, last) - 0.1).abs() < 2.1e-3, "{first:?} {last:?}");
    for at in line {
        let r = minus(at, [0.01, 0.0, 0.02]);
        assert!((4.0 * r[0] - 3.0 * r[1]).abs() < 1e-14 && r[2].abs() < 1e-15, "{at:?}");
    }
    assert!(Surroundings::of(&scene([0.0, 3.0, 0.0], FieldSources::default())).is_none());
}

/// Lines in a panel: along the field's part in the plane, neither crowded nor with holes between them.
#[test]
fn lines_are_spread_evenly() {
    let views = views();
    let around = around([4e-3, 0.0, 1e-3], vec![dipole("a", [0.1, 0.02, 0.05], [10.0, 0.0, 20.0])]);
    for view in views.views.iter().filter(|view| view.axes.is_some()) {
        let plane = Plane { surroundings: &around, view, through: [0.0, 0.0, 0.03] };
        let lines = plane.lines();
        assert!(lines.len() > 8, "{} lines", lines.len());
        let gap = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        for (k, line) in lines.iter().enumerate() {
            assert!(length(line) >= 20.0);
            let points: Vec<Vector> = line.iter().map(|spot| plane.point(spot.at)).collect();
            let in_plane = |at| local(&around, Some(view.toward), at).expect("a field").direction;
            let angle = largest_angle(&points, in_plane);
            assert!(angle < 0.01, "{angle} rad off");
            // A line's ends are where it came too near; before them it keeps its distance.
            for spot in &line[1..line.len() - 1] {
                let others = lines[..k].iter().flat_map(|other| &other[1..other.len() - 1]);
                let nearest = others.map(|other| gap(other.at, spot.at)).fold(f64::INFINITY, f64::min);
                assert!(nearest > 0.5 * SEPARATION, "{nearest} pt");
            }
        }
        let Rect { left, top, width, height } = view.rect;
        for k in 0..100 {
            let at = [left + width * (0.5 + f64::from(k % 10)) / 10.0, top + height * (0.5 + f64::from(k / 10)) / 10.0];
            let nearest = lines.iter().flatten().map(|spot| gap(spot.at, at)).fold(f64::INFINITY, f64::min);
            let is_along = plane.spot(at).is_some_and(|spot| spot.share > 0.2);
            assert!(nearest < 1.6 * SEPARATION || !is_along, "{nearest} pt from {at:?}");
        }
    }
}

#[test]
fn no_line_enters_a_magnet() {
    let axis = [0.6, 0.0, 0.8];
    let shape = MagnetShape::Cylinder { axis, length: 0.02, diameter: 0.01, bore: 0.0 };
    let body = MagnetBody { shape, is_exact: false };
    let magnet =
        Magnet { moment: shape.moment(1.2, axis), body: Some(body), ..dipole("rod", [0.02, 0.0, 0.03], [0.0; 3]) };
    let around = around([0.0; 3], vec![magnet]);
    let views = views();
    let plane = Plane { surroundings: &around, view: &views.views[0], through: [0.0, 0.0, 0.03] };
    let lines = plane.lines();
    let along = |at: Vector| dot(minus(at, [0.02, 0.0, 0.03]), axis);
    let mut nearest = f64::INFINITY;
    for spot in lines.iter().flatten() {
        let at = plane.point(spot.at);
        let r = minus(at, [0.02, 0.0, 0.03]);
        let outwards = norm(std::array::from_fn(|k| r[k] - along(at) * axis[k]));
        assert!(along(at).abs() > 0.01 || outwards > 0.005, "{at:?}");
        nearest = nearest.min(norm(r));
    }
    assert!(nearest < 0.0125, "lines end {nearest} m from the magnet");
}

#[test]
fn marks_at_the_edge_say_where_and_how_far() {
    let views = views();
    let view: &View = &views.views[0];
    let rod: Vec<Vector> = (0..=60).map(|k| [0.0, 0.0, 1e-3 * f64::from(k)]).collect();
    let far = [
        ("right", [0.5, 0.0, 0.03]),
        ("up", [0.0, 0.3, 0.46]),
        ("twin", [0.5, 0.05, 0.03]),
        ("behind", [0.0, 0.4, 0.03]),
    ];
    let around = around([0.0; 3], far.iter().map(|(name, at)| dipole(name, *at, [1.0, 0.0, 0.0])).collect());
    let sources: Vec<_> = around.sources.iter().collect();
    let marks = beyond(view, [0.0, 0.0, 0.03], &rod, &sources);
    // What is behind the panel has no mark there; 0.3 and 0.4 m away make half a metre.
    assert_eq!(
        marks.iter().map(|mark| mark.words.as_str()).collect::<Vec<_>>(),
        ["right, twin: 500 to 502 mm", "up: 500 mm"]
    );
    let middle = view.place([0.0, 0.0, 0.03]);
    let (right, up) = (&marks[0], &marks[1]);
    assert!(right.outwards[0] > 0.999 && (right.at[1] - middle[1]).abs() < 0.1, "{right:?}");
    assert!(view.rect.right() - right.at[0] < 4.0 && view.rect.contains(right.at), "{right:?}");
    assert!(up.outwards[1] < -0.999 && up.at[1] - view.rect.top < 4.0 && view.rect.contains(up.at), "{up:?}");
}

/// A view grows for what leaves the rod a third of it; an array of coils is shown whole or not.
#[test]
fn views_grow_for_near_sources() {
    let rod = [[0.0, 0.02], [0.0, 0.0], [0.0, 0.06]];
    let near = around([0.0; 3], vec![dipole("near", [0.14, 0.0, 0.06], [1.0, 0.0, 0.0])]);
    assert_eq!(widened(near.sources.iter(), rod), [[0.0, 0.14], [0.0, 0.0], [0.0, 0.06]]);
    let far = around([0.0; 3], vec![dipole("far", [0.19, 0.0, 0.06], [1.0, 0.0, 0.0])]);
    assert_eq!(widened(far.sources.iter(), rod), rod);
    let coil = |x: f64| vec![UnitDipole { position: [x, 0.0, 0.0], moment_per_ampere: [1.0, 0.0, 0.0] }];
    let array = |reach: f64| {
        let array = CoilArray {
            name: "a".into(),
            current: vec![1.0, -2.0],
            coils: vec![coil(reach), coil(-reach)],
            clearance: 0.01,
        };
        let sources = FieldSources { arrays: vec![array], ..FieldSources::default() };
        Surroundings::of(&scene([0.0; 3], sources)).expect("coils")
    };
    let limits = widened(array(0.07).sources.iter(), rod);
    assert!(limits[0][0] < -0.07 && limits[0][1] > 0.07, "{limits:?}");
    // One of them alone would fit.
    assert_eq!(widened(array(0.12).sources.iter(), rod), rod);
    assert!(widened(array(0.12).sources.iter().take(1), rod)[0][1] > 0.12);
    assert_eq!(array(0.07).sources[1].moment, [-2.0, 0.0, 0.0]);
}

#[test]
fn words_do_not_overlap() {
    let panel = Rect { left: 10.0, top: 10.0, width: 100.0, height: 60.0 };
    let data: Vec<[f64; 2]> = (0..50).map(|k| [10.0 + 2.0 * f64::from(k), 40.0]).collect();
    let mut taken = Taken::new(panel, data.clone());
    let text = Text::new("array 1 (+)", [0.0; 2], SMALL);
    let places: Vec<_> = [40.0, 20.0, 22.0, 30.0, 60.0, 5.0].map(|y| ([60.0, y], Align::Middle)).into();
    let found: Vec<Text> = std::iter::from_fn(|| taken.settle(&text, &places)).collect();
    let heights: Vec<f64> = found.iter().map(|text| text.at[1]).collect();
    // Near places first, the data last, never on other words nor beyond the panel.
    assert_eq!(heights, [20.0, 30.0, 60.0, 40.0]);
    for (k, a) in found.iter().enumerate() {
        assert!(found[..k].iter().all(|b| !overlap(&extent(a), &extent(b))));
        assert!(extent(a).corners().into_iter().all(|corner| panel.contains(corner)));
    }
}
