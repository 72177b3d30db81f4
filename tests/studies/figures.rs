//! Figures are written whole, in both formats, from ordinary and from degenerate input.
//!
//! `RODSWEEP_FIGURES=folder` keeps the figures drawn here for a look at them.

use rodsweep::draw::{
    AxisLabel, Cloud, Counts, Curves, FailureMap, Figure, ForceAt, FourViews, Histogram, Marker, PlaneCurves,
    ReportError, RodMotion, RodShape, Series, Sheet, Stretch, StretchKind, SweptAxis, TextTable, count, engineering,
    write,
};
use rodsweep::model::Status;
use std::f64::consts::PI;
use std::path::PathBuf;

/// A folder for this run's files, kept where the user asked for them.
fn folder() -> (PathBuf, Option<tempfile::TempDir>) {
    match std::env::var_os("RODSWEEP_FIGURES") {
        Some(kept) => {
            std::fs::create_dir_all(&kept).expect("a folder for figures");
            (kept.into(), None)
        }
        None => {
            let temporary = tempfile::tempdir().expect("a temporary folder");
            (temporary.path().to_owned(), Some(temporary))
        }
    }
}

/// Width, height and pixels (RGB) of a PNG, and how many differ from white.
fn read_png(path: &std::path::Path) -> (u32, u32, usize) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).expect("a file")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("a picture");
    (info.width, info.height, pixels.chunks_exact(3).filter(|pixel| pixel.iter().any(|x| *x < 250)).count())
}

/// Text of an SVG without markup; checks that tags are balanced.
fn read_svg(path: &std::path::Path) -> String {
    let svg = std::fs::read_to_string(path).expect("an SVG");
    let (mut open, mut text, mut rest) = (Vec::new(), String::new(), svg.as_str());
    while let Some(start) = rest.find('<') {
        text += &rest[..start];
        let end = start + rest[start..].find('>').expect("every tag ends");
        let tag = &rest[start + 1..end];
        let name = tag.split_whitespace().next().expect("every tag has a name");
        match tag.strip_prefix('/') {
            Some(closed) => assert_eq!(open.pop().as_deref(), Some(closed), "tags are nested"),
            None if tag.ends_with('/') || tag.starts_with('?') => {}
            None => open.push(name.to_owned()),
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "tags left open: {open:?}");
    let drawn: Vec<&str> = svg.lines().filter(|line| !line.starts_with("<image")).collect();
    assert!(drawn.iter().all(|line| !line.contains("NaN") && !line.contains("\"inf")), "a number is not finite");
    text
}

/// Writes a figure in both formats and checks what can be checked without eyes.
fn check(figure: &dyn Figure, name: &str, width_mm: f64, labels: &[&str]) {
    let (folder, _kept) = folder();
    let (png, svg) = (folder.join(format!("{name}.png")), folder.join(format!("{name}.svg")));
    write(figure, &png).expect("a PNG");
    write(figure, &svg).expect("an SVG");
    let (width, height, marked) = read_png(&png);
    assert_eq!(width, (width_mm / 25.4 * 300.0).round() as u32, "{name}: width at 300 dpi");
    assert!(height > width / 8 && height < 2 * width, "{name}: {width} x {height}");
    assert!(marked > 2000, "{name} is blank: {marked} pixels are not white");
    let text = read_svg(&svg);
    for label in labels {
        assert!(text.contains(label), "{name}: `{label}` is missing from\n{text}");
    }
    let size = std::fs::metadata(&svg).expect("an SVG").len();
    assert!(size < 6_000_000, "{name}: the SVG takes {size} bytes");
}

/// Tips of rods of constant curvature bent in all directions, `count` of them, over two loads.
fn workspace(count: usize, length: f64) -> Cloud {
    let golden = PI * (3.0 - 5f64.sqrt());
    let tips = (0..count).map(|k| {
        let share = (k as f64 + 0.5) / count as f64;
        let layer = 0.75 + 0.25 * (k as f64 * 0.618_034).fract();
        let (bend, turn) = (2.6 * share.sqrt(), golden * k as f64);
        let (l, radius) = (length * layer, length * layer * (1.0 - bend.cos()) / bend);
        let p = [radius * turn.cos(), radius * turn.sin(), l * bend.sin() / bend];
        (p, 1.0 - 0.3 * bend - 0.25 * layer * (3.0 * turn).sin() * share + if k % 911 == 0 { 4.0 } else { 0.0 })
    });
    let (points, values) = tips.unzip();
    Cloud {
        points,
        values,
        quantity: "stability margin".into(),
        title: "Reachable tip positions".into(),
        rod: Some((0..50).map(|k| [0.0, 0.0, length * k as f64 / 49.0]).collect()),
        ..Cloud::default()
    }
}

/// A flexible, a coil, a rigid and a flexible segment of a rod bent in space.
fn rod(length: f64) -> RodShape {
    let at = |s: f64| {
        let angle = 1.9 * s * s;
        [
            length * 0.45 * (1.0 - (angle).cos()),
            length * 0.3 * s * s * (1.0 - s * 0.4),
            length * s * (1.0 - 0.25 * s * s),
        ]
    };
    let stretch = |name: &str, kind, from: f64, to: f64, dipole| Stretch {
        name: name.into(),
        kind,
        points: (0..=20).map(|k| at(from + (to - from) * f64::from(k) / 20.0)).collect(),
        dipole,
    };
    RodShape {
        title: "Catheter with two coil sets in 3 T".into(),
        stretches: vec![
            stretch("proximal", StretchKind::Flexible, 0.0, 0.45, None),
            stretch("coil", StretchKind::Coil, 0.45, 0.56, Some([2e-3, 1e-3, 3.1e-3])),
            stretch("middle", StretchKind::Flexible, 0.56, 0.8, None),
            stretch("sleeve", StretchKind::Rigid, 0.8, 0.86, None),
            stretch("distal", StretchKind::Flexible, 0.86, 0.93, None),
            stretch("tip coil", StretchKind::Coil, 0.93, 1.0, Some([-1.5e-3, 2e-3, 0.4e-3])),
        ],
        tip_rotation: Some([[0.36, -0.48, 0.8], [0.8, 0.6, 0.0], [-0.48, 0.64, 0.6]]),
        flux_density: Some([0.0, 3.0, 0.0]),
        surroundings: None,
        wall: None,
        tip_force: Some([2e-3, 0.0, -4e-3]),
        inner_loads: vec![ForceAt { name: "push".into(), point: at(0.7), force: [0.0, -2e-3, 0.0] }],
        rest: Some((0..30).map(|k| [0.0, 0.0, length * f64::from(k) / 29.0]).collect()),
    }
}

fn speed_against_error() -> Curves {
    let series = |name: &str, rate: f64, floor: f64| {
        let points = (0..9).map(|k| {
            let tolerance = 10f64.powi(-2 - k);
            [rate * tolerance.powf(0.125), 0.3 * tolerance + floor]
        });
        Series::line(name, points.collect())
    };
    Curves {
        title: "Speed against error".into(),
        x: AxisLabel::logarithmic("samples per second", "1/s"),
        y: AxisLabel::logarithmic("largest tip error / rod length", ""),
        series: vec![
            series("GPU, f32", 4e7, 2e-6).marker(Marker::Circle),
            series("CPU, 16 threads, f64", 2e6, 1e-13).marker(Marker::Square),
            series("scalar reference", 4e3, 1e-14).marker(Marker::Triangle).dashed(),
        ],
    }
}

fn currents() -> Curves {
    let times: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.05).collect();
    let wave = |phase: f64| times.iter().map(|t| [*t, 0.22 * (0.9 * t + phase).sin() * (-0.05 * t).exp()]).collect();
    let line: Vec<[f64; 2]> = wave(0.0);
    let band = line.iter().map(|[_, y]| [y - 0.03, y + 0.03]).collect();
    Curves {
        title: "Coil currents".into(),
        x: AxisLabel::linear("time", "s"),
        y: AxisLabel::linear("current", "A"),
        series: vec![
            Series::line("x", line).band(band),
            Series::line("y", wave(2.0 * PI / 3.0)),
            Series::line("z", wave(4.0 * PI / 3.0)).dashed(),
        ],
    }
}

fn failures(points: usize) -> FailureMap {
    let axis = |k: usize| -0.3 + 0.6 * k as f64 / (points - 1) as f64;
    let samples = (0..points * points).map(|k| (axis(k % points), axis(k / points)));
    let status = samples.clone().map(|(x, y)| match x.hypot(1.3 * y + 0.4 * x * x) {
        r if r > 0.34 => Status::NotConverged,
        r if r > 0.30 => Status::Fold,
        r if r > 0.25 && x > 0.0 => Status::Unstable,
        _ => Status::Ok,
    });
    let status = status.collect();
    let (x, y) = samples.unzip();
    FailureMap {
        title: "Where samples fail".into(),
        x: SweptAxis { label: "coil.current.x".into(), unit: "A".into(), values: x },
        y: SweptAxis { label: "coil.current.y".into(), unit: "A".into(), values: y },
        status,
    }
}

fn counts() -> Counts {
    let counts = vec![(Status::Ok, 211_004), (Status::Ramped, 9_120), (Status::Fold, 6_730), (Status::NonFinite, 127)];
    Counts { title: "Samples by status".into(), counts }
}

fn distribution() -> Histogram {
    let values =
        (1..20_000).map(|k| 1e-9 * (2.0 * (f64::from(k) * 0.618_034).fract() + (f64::from(k) * 0.414).sin()).exp());
    Histogram {
        title: "Error estimates".into(),
        x: AxisLabel::logarithmic("error estimate", ""),
        values: values.chain([f64::NAN]).collect(),
        bins: None,
    }
}

#[test]
fn large_tip_cloud() {
    let cloud = workspace(226_981, 0.094);
    check(&cloud, "tip_cloud", 183.0, &["x (mm)", "z (mm)", "stability margin", "226,981 tip positions", "−50"]);
}

#[test]
fn small_signed_tip_cloud() {
    let mut cloud = workspace(700, 0.094);
    cloud.values = cloud.points.iter().map(|p| 3e-4 * p[0] / 0.09 * p[2]).collect();
    (cloud.quantity, cloud.unit, cloud.rod) = ("base moment".into(), "N·m".into(), None);
    check(&cloud, "tip_cloud_signed", 183.0, &["y (mm)", "base moment", "700 tip positions"]);
}

#[test]
fn rod_shape() {
    let labels = ["x (mm)", "flexible", "coil (rigid)", "field B, 3 T", "A·m", "tip force F, 4.47 mN"];
    check(&rod(0.12), "rod_shape", 183.0, &labels);
}

#[test]
fn panels_and_sheet() {
    check(&speed_against_error(), "curves_log", 89.0, &["Speed against error", "GPU, f32", "10"]);
    check(&currents(), "curves_linear", 89.0, &["time (s)", "current (A)", "−0.2"]);
    check(&failures(61), "failure_map", 89.0, &["coil.current.x (A)", "not-converged: "]);
    check(&counts(), "counts", 89.0, &["211,004  (93.0 %)", "non-finite"]);
    check(&distribution(), "histogram", 89.0, &["error estimate", "1 left out"]);
    let (a, b, c, d, e) = (speed_against_error(), currents(), failures(200), distribution(), counts());
    let sheet = Sheet { panels: vec![&a, &b, &c, &d, &e], columns: 2 };
    check(&sheet, "sheet", 183.0, &["Samples by status", "Where samples fail"]);
}

#[test]
fn unknown_extension_is_an_error() {
    for name in ["figure.pdf", "figure", "figure.png.gz"] {
        let error = write(&counts(), std::path::Path::new(name)).expect_err("no such format");
        let message = error.to_string();
        assert!(message.contains(name) && message.contains(".png or .svg"), "{message}");
    }
    let error = write(&counts(), std::path::Path::new("/nonexistent/figure.svg")).expect_err("no such folder");
    assert!(error.to_string().contains("/nonexistent/figure.svg"), "{error}");
}

#[test]
fn every_panel_has_equal_axes() {
    for bounds in [
        [[-0.09, 0.09], [-0.09, 0.09], [-0.02, 0.094]],
        [[0.0, 0.0], [0.0, 0.0], [0.0, 3.0]],
        [[1e-4, 2e-4], [0.0, 5e-5], [-1e-4, 0.0]],
        [[7.0, 7.0], [1.0, 1.0], [0.0, 0.0]],
    ] {
        let four = FourViews::new(bounds, 519.0, 30.0, 60.0);
        for view in &four.views {
            let step = (four.limits[2][1] - four.limits[2][0]) / 10.0;
            let square = |k: usize| {
                let mut direction = [0.0; 3];
                direction[k] = step;
                let [x, y] = view.along(direction);
                x * x + y * y
            };
            // An orthographic image of three equal perpendicular steps: the squares add up to twice the step's.
            let sum: f64 = (0..3).map(square).sum();
            assert!((sum / (2.0 * (view.scale * step).powi(2)) - 1.0).abs() < 1e-12);
            for corner in 0..8 {
                let corner = std::array::from_fn(|k| four.limits[k][corner >> k & 1]);
                let [x, y] = view.place(corner);
                let slack = 1e-6;
                let inside = x > view.rect.left - slack && x < view.rect.right() + slack;
                assert!(inside && y > view.rect.top - slack && y < view.rect.bottom() + slack, "{bounds:?} {view:?}");
            }
        }
        for view in &four.views[..3] {
            let [horizontal, vertical] = view.axes.expect("a projection");
            let range = |axis: usize| four.limits[axis][1] - four.limits[axis][0];
            assert_eq!(view.scale, four.views[0].scale);
            assert!((view.rect.height / range(vertical) / view.scale - 1.0).abs() < 1e-9);
            assert!(
                view.rect.width / range(horizontal) / view.scale > 1.0 - 1e-9,
                "a panel may be wider than its limits"
            );
        }
    }
}

#[test]
fn degenerate_clouds() {
    let single = |point: [f64; 3]| Cloud {
        points: vec![point],
        values: vec![0.7],
        quantity: "margin".into(),
        ..Cloud::default()
    };
    check(&single([0.01, -0.02, 0.09]), "cloud_one_point", 183.0, &["1 tip position", "x (mm)"]);
    check(&single([0.0; 3]), "cloud_origin", 183.0, &["1 tip position"]);

    let mut planar = workspace(5000, 0.094);
    planar.points.iter_mut().for_each(|point| point[1] = 0.0);
    planar.values.iter_mut().for_each(|value| *value = 2.0);
    check(&planar, "cloud_planar", 183.0, &["5,000 tip positions"]);

    let mut holes = workspace(5000, 0.094);
    holes.values[17] = f64::NAN;
    holes.points[40][2] = f64::INFINITY;
    check(&holes, "cloud_holes", 183.0, &["4,998 tip positions · 2 not finite, left out"]);

    let empty = Cloud::default().draw().expect_err("no points");
    assert!(empty.to_string().contains("no points were given"), "{empty}");
    let lost = Cloud { points: vec![[f64::NAN; 3]; 3], values: vec![0.0; 3], ..Cloud::default() };
    assert!(lost.draw().expect_err("no point is finite").to_string().contains("none of 3 points"));
    let uneven = Cloud { points: vec![[0.0; 3]; 3], values: vec![0.0; 2], ..Cloud::default() };
    assert!(matches!(uneven.draw(), Err(ReportError::Length { expected: 3, found: 2, .. })));
}

#[test]
fn lengths_choose_their_unit() {
    check(&rod(2e-4), "rod_tiny", 183.0, &["x (µm)", "z (µm)"]);
    check(&rod(3.0), "rod_large", 183.0, &["x (m)", "z (m)"]);
    check(&workspace(3000, 3.0), "cloud_large", 183.0, &["x (m)"]);
    let bare = RodShape { stretches: rod(0.1).stretches[..1].to_vec(), ..RodShape::default() };
    check(&bare, "rod_bare", 183.0, &["flexible", "base clamp"]);
    let straight = Stretch { points: vec![[0.0; 3], [0.0, 0.0, 0.1]], ..rod(0.1).stretches[0].clone() };
    check(&RodShape { stretches: vec![straight], ..rod(0.1) }, "rod_straight", 183.0, &["z (mm)"]);
    assert!(RodShape::default().draw().is_err());
}

#[test]
fn degenerate_panels() {
    let curves = |points: Vec<[f64; 2]>| Curves {
        x: AxisLabel::linear("x", ""),
        y: AxisLabel::logarithmic("y", ""),
        series: vec![Series::scatter("s", points, Marker::Diamond)],
        ..Curves::default()
    };
    check(&curves(vec![[1.0, 1e-7]]), "curves_one_point", 89.0, &["x"]);
    check(&curves(vec![[1.0, 0.0], [2.0, 3.0], [f64::NAN, 1.0]]), "curves_holes", 89.0, &["x"]);
    assert!(curves(vec![[1.0, -1.0]]).draw().is_err());
    assert!(curves(vec![]).draw().is_err());
    assert!(Counts::default().draw().is_err());
    assert!(FailureMap::default().draw().is_err());
    assert!(Histogram::default().draw().is_err());
    assert!(Sheet { panels: vec![], columns: 2 }.draw().is_err());
    let constant = Histogram { x: AxisLabel::linear("v", "s"), values: vec![0.004; 9], ..Histogram::default() };
    check(&constant, "histogram_constant", 89.0, &["v (10"]);
}

#[test]
fn tables_align_numbers_on_the_right() {
    let mut table = TextTable::new(["backend", "samples/s", "largest error"]);
    table.row(["gpu f32", &count(12_345_678), &engineering(3.14e-8)]);
    table.row(["cpu f64", &count(987), &engineering(f64::NAN)]);
    let expected = "backend   samples/s  largest error\n\
                    -------  ----------  -------------\n\
                    gpu f32  12,345,678         3.1e-8\n\
                    cpu f64         987            nan\n";
    assert_eq!(table.to_string(), expected);
    assert_eq!([0.0, -2.0, f64::INFINITY].map(engineering), ["0", "-2.0e0", "inf"]);
    assert_eq!([0, 999, 1000, 226_981].map(count), ["0", "999", "1,000", "226,981"]);
}

#[test]
fn a_plane_has_one_scale() {
    let square = vec![[1.0, -3.0], [3.0, -3.0], [3.0, -1.0], [1.0, -1.0], [1.0, -3.0]];
    let series = vec![Series::line("", square).width(2.25)];
    let (x, y) = (AxisLabel::linear("x", "mm"), AxisLabel::linear("y", "mm"));
    let figure = PlaneCurves(Curves { title: "A square".into(), x, y, series });
    check(&figure, "plane", 89.0, &["A square", "x (mm)", "y (mm)"]);
    let (folder, _kept) = folder();
    let path = folder.join("square.svg");
    write(&figure, &path).expect("a figure");
    let svg = std::fs::read_to_string(path).expect("an SVG");
    let line = svg.lines().find(|line| line.contains("stroke-width=\"2.25\"")).expect("the square");
    let corners = line.split('"').nth(1).expect("its path").trim_start_matches('M').split('L');
    let corners: Vec<Vec<f64>> =
        corners.map(|corner| corner.split(' ').map(|x| x.parse().expect("a number")).collect()).collect();
    let (width, height) = (corners[1][0] - corners[0][0], corners[0][1] - corners[2][1]);
    assert!(width > 50.0 && (width - height).abs() < 0.01, "{width} by {height}");
}

#[test]
fn a_rod_in_motion() {
    let rod = |bend: f64, count: usize| {
        let points = (0..count).map(|k| [bend * (k * k) as f64, 0.0, 0.01 * k as f64]).collect();
        vec![Stretch { name: "rod".into(), kind: StretchKind::Flexible, points, dipole: None }]
    };
    let rods: Vec<Vec<Stretch>> = [0.0, 1e-4, 2e-4].map(|bend| rod(bend, 6)).into();
    let tips: Vec<[f64; 3]> = rods.iter().map(|rod| rod[0].points[5]).collect();
    let motion =
        RodMotion { title: "A rod".into(), desired: tips.clone(), tips, rods, seconds: 3.0, ..RodMotion::default() };
    check(&motion, "motion", 183.0, &["A rod", "desired", "tip so far", "flexible"]);
    let mut uneven = motion.clone();
    uneven.rods[1] = rod(1e-4, 5);
    assert!(matches!(uneven.draw(), Err(ReportError::Length { expected: 6, found: 5, .. })));
    assert!(matches!(RodMotion { rods: Vec::new(), ..motion.clone() }.draw(), Err(ReportError::Empty { .. })));
    let mut lost = motion;
    lost.tips[1][0] = f64::NAN;
    assert!(matches!(lost.draw(), Err(ReportError::Empty { .. })));
}
