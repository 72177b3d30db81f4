//! Figures of a workspace are drawn of whatever its table holds.
//!
//! `RODSWEEP_FIGURES=folder` keeps them for a look at them.

use rodsweep::draw::{self, ImageFormat};
use rodsweep::figures::{DesignStudy, Method, MethodPoint, WorkspaceFigures, WorkspaceSummary};
use rodsweep::study::workspace::Estimate;
use rodsweep::table::{Column, Lattice, Table, Values};
use std::path::Path;

const LATTICE: Lattice = Lattice { origin: [-0.05, -0.05, 0.0], spacing: 4e-3 };

/// A thick shell around an axis, thinner towards its ends, with numbers that vary as those of a catheter do.
fn table() -> Table {
    let mut voxels = Vec::new();
    for i in 0..25 {
        for j in 0..25 {
            for k in 0..24 {
                let [x, y, z] = LATTICE.centre([i, j, k]);
                let radius = x.hypot(y);
                let middle = 0.9 * (z * (0.096 - z)).max(0.0).sqrt() - 0.012;
                let inside = 9e-3 - (radius - middle).abs();
                if inside > -LATTICE.spacing && y < 0.6 * radius + 0.01 {
                    voxels.push(([x, y, z], inside, y.atan2(x)));
                }
            }
        }
    }
    let column = |name: &str, unit: &str, of: &dyn Fn([f64; 3], f64, f64) -> f64| {
        let number = |&(p, inside, angle): &([f64; 3], f64, f64)| {
            let number = of(p, inside, angle);
            // Voxels beyond the boundary have a place and a distance alone.
            if inside > 0.0 || ["voxel.x", "voxel.y", "voxel.z", "boundary_distance"].contains(&name) {
                number
            } else {
                f64::NAN
            }
        };
        Column::new(name, unit, voxels.iter().map(number).collect::<Vec<f64>>())
    };
    let cause = |&([_, _, z], inside, angle): &([f64; 3], f64, f64)| match inside {
        inside if inside > LATTICE.spacing => "inside",
        _ if z > 0.07 => "input-limit",
        _ if angle.abs() > 2.2 => "branch",
        _ if z < 0.02 => "singular",
        _ => "stuck",
    };
    let margin = |p: [f64; 3], inside: f64, angle: f64| 0.1 + 60.0 * inside + 0.5 * (1.0 + angle.cos()) + 4.0 * p[2];
    Table::new(vec![
        column("voxel.x", "m", &|p, _, _| p[0]),
        column("voxel.y", "m", &|p, _, _| p[1]),
        column("voxel.z", "m", &|p, _, _| p[2]),
        Column::new("reached", "", voxels.iter().map(|(_, inside, _)| *inside > 0.0).collect::<Vec<bool>>()),
        Column::new("cause", "", voxels.iter().map(|voxel| cause(voxel).to_owned()).collect::<Vec<String>>()),
        column("stability.margin", "", &margin),
        column("stability.margin.least", "", &|p, inside, angle| 0.4 * margin(p, inside, angle)),
        column("manipulability", "m³", &|p, inside, _| 1e-6 + 1e-3 * inside * p[2]),
        column("isotropy", "", &|p, inside, angle| (20.0 * inside + 0.05 * angle.sin() + p[2]).clamp(1e-3, 0.4)),
        column("compliance.least", "m/N", &|p, _, _| 0.1 + 10.0 * p[2]),
        column("compliance.most", "m/N", &|p, inside, _| 0.5 + 0.1 * p[2] / (inside.abs() + 1e-5)),
        column("boundary_distance", "m", &|_, inside, _| inside),
        column("solutions", "", &|p, inside, _| {
            if inside > 3e-3 && p[0] > 0.0 { 2.0 + (p[2] > 0.05) as u8 as f64 } else { 1.0 }
        }),
        column("orientations", "", &|_, inside, _| 0.02 + 10.0 * inside.abs()),
        column("density", "", &|p, inside, _| 1e-7 * (1.0 + 1e3 * inside.abs()).powi(3) / (p[0].abs() + 1e-3)),
        column("reach.probability", "", &|_, inside, _| (150.0 * inside + 0.2).clamp(0.0, 1.0)),
    ])
}

fn summary() -> WorkspaceSummary {
    let estimate = |value: f64, half: f64| Estimate { value, low: value - half, high: value + half };
    let growth = [(4e-3, 47_084, 279.68, 1.2), (2e-3, 235_127, 280.752, 0.4), (1e-3, 1_335_424, 281.42, 0.1)];
    let touched = [(1e-3, 1 << 14, 14.6), (1e-3, 1 << 16, 45.8), (1e-3, 1 << 18, 110.6), (1e-3, 1 << 22, 259.5)];
    let faces = [(1536, 277.85, 9.5), (6144, 280.38, 3.2), (24576, 280.84, 1.0), (393_216, 281.49, 0.3)];
    let point = |spacing, solves, size| MethodPoint { spacing, solves, size };
    WorkspaceSummary {
        title: "Catheter with two coils".into(),
        dimension: 3,
        size: Some(estimate(281.42e-6, 0.1e-6)),
        methods: vec![
            Method {
                name: "growth".into(),
                points: growth.map(|(h, n, v, e)| point(Some(h), n, estimate(1e-6 * v, 1e-6 * e))).into(),
            },
            Method {
                name: "change of variables".into(),
                points: faces.map(|(n, v, e)| point(None, n, estimate(1e-6 * v, 1e-6 * e))).into(),
            },
            Method {
                name: "touched voxels".into(),
                points: touched.map(|(h, n, v)| point(Some(h), n, Estimate::without_bounds(1e-6 * v))).into(),
            },
        ],
        wall: None,
        reference: Some(("best value".into(), estimate(281.5e-6, 0.3e-6))),
    }
}

fn designs() -> DesignStudy {
    let values: Vec<f64> = (0..5).map(|k| -2.0 + f64::from(k)).collect();
    let size = |x: &f64| 1e-6 * (281.5 - 2.39 * x);
    DesignStudy {
        title: "Young's modulus".into(),
        dimension: 3,
        name: "change of E and G".into(),
        unit: "%".into(),
        sizes: values.iter().map(|x| Estimate { value: size(x), low: size(x) - 4e-7, high: size(x) + 4e-7 }).collect(),
        slope: Some([-2.39e-6, 0.06e-6]),
        margins: [(0.05, 0.2), (0.5, 0.9), (0.95, 1.8)]
            .map(|(share, margin)| (share, values.iter().map(|x| margin + 0.02 * x).collect()))
            .into(),
        values,
    }
}

/// Names of the figures, which are all drawn.
fn names(table: &Table, summary: &WorkspaceSummary) -> Vec<&'static str> {
    let figures = WorkspaceFigures { table, lattice: LATTICE, summary }.figures();
    for (name, figure) in &figures {
        check_svg(name, &String::from_utf8(draw::encode(figure.as_ref(), ImageFormat::Svg).unwrap()).unwrap());
    }
    figures.into_iter().map(|(name, _)| name).collect()
}

fn check_svg(name: &str, svg: &str) {
    assert!(svg.trim_end().ends_with("</svg>"));
    let lines = svg.lines().filter(|line| !line.starts_with("<image"));
    lines.for_each(|line| assert!(!line.contains("NaN") && !line.contains("\"inf"), "{name}: {line}"));
}

/// Every figure is written in both formats; returns their names.
fn drawn(table: &Table, summary: &WorkspaceSummary, folder: &Path) -> Vec<String> {
    let files = WorkspaceFigures { table, lattice: LATTICE, summary }.draw(folder).unwrap();
    for pair in files.chunks(2) {
        assert!(std::fs::read(&pair[0]).unwrap().starts_with(b"\x89PNG"));
        check_svg(&pair[1].display().to_string(), &std::fs::read_to_string(&pair[1]).unwrap());
    }
    files.chunks(2).map(|pair| pair[0].file_stem().unwrap().to_string_lossy().into_owned()).collect()
}

fn folder() -> (std::path::PathBuf, Option<tempfile::TempDir>) {
    match std::env::var_os("RODSWEEP_FIGURES") {
        Some(kept) => {
            std::fs::create_dir_all(&kept).unwrap();
            (kept.into(), None)
        }
        None => {
            let temporary = tempfile::tempdir().unwrap();
            (temporary.path().to_owned(), Some(temporary))
        }
    }
}

const EVERY: [&str; 8] =
    ["workspace", "margin", "dexterity", "compliance", "density", "multiplicity", "robust", "convergence"];

#[test]
fn a_workspace_has_every_figure() {
    let (folder, _kept) = folder();
    assert_eq!(drawn(&table(), &summary(), &folder), EVERY);
    let read = |name: &str| std::fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
    let workspace = read("workspace");
    for words in [
        "volume 281.42 (281.32 to 281.52) cm³",
        "end of the branch",
        "input limit",
        "slice y = ",
        "greatest along z",
        "stability margin",
    ] {
        // Raised digits are set apart.
        let words = words.replace("cm³", "cm");
        assert!(workspace.contains(&words), "`{words}` is missing from the workspace");
    }
    assert!(read("margin").contains("least along x"));
    assert!(read("compliance").contains("(m/N)"));
    assert!(read("multiplicity").contains("share of volume (%)"));
    draw::write(&designs(), &folder.join("designs.png")).unwrap();
    draw::write(&designs(), &folder.join("designs.svg")).unwrap();
    let designs = std::fs::read_to_string(folder.join("designs.svg")).unwrap();
    assert!(designs.contains("slope −2.39 ± 0.06"), "{designs}");
}

/// The words under which lines along the boundary are drawn.
fn causes(table: &Table) -> Vec<&'static str> {
    let summary = WorkspaceSummary { dimension: 3, ..WorkspaceSummary::default() };
    let figures = WorkspaceFigures { table, lattice: LATTICE, summary: &summary }.figures();
    let svg = String::from_utf8(draw::encode(figures[0].1.as_ref(), ImageFormat::Svg).unwrap()).unwrap();
    let words = ["input limit", "singular", "end of the branch", "undecided"];
    words.into_iter().filter(|words| svg.contains(*words)).collect()
}

#[test]
fn boundaries_are_drawn_by_their_cause() {
    // A cube of three voxels a side in a shell of voxels that are not reached.
    let voxels: Vec<[i32; 3]> = (0..125).map(|k| [k % 5, k / 5 % 5, k / 25]).collect();
    let is_inside = |voxel: &[i32; 3]| voxel.iter().all(|index| (1..4).contains(index));
    let with = |reached: bool, cause: &dyn Fn(&[i32; 3]) -> &'static str| {
        let axis = |k: usize| voxels.iter().map(|voxel| LATTICE.centre(*voxel)[k]).collect::<Vec<f64>>();
        let words = voxels.iter().map(|voxel| if is_inside(voxel) == reached { cause(voxel) } else { "inside" });
        Table::new(vec![
            Column::new("voxel.x", "m", axis(0)),
            Column::new("voxel.y", "m", axis(1)),
            Column::new("voxel.z", "m", axis(2)),
            Column::new("reached", "", voxels.iter().map(is_inside).collect::<Vec<bool>>()),
            Column::new("cause", "", words.map(str::to_owned).collect::<Vec<String>>()),
            Column::new("stability.margin", "", vec![1.0; voxels.len()]),
        ])
    };
    let by_height = |voxel: &[i32; 3]| if voxel[2] >= 3 { "input-limit" } else { "branch" };
    for reached in [true, false] {
        assert_eq!(causes(&with(reached, &by_height)), ["input limit", "end of the branch"], "reached: {reached}");
        assert_eq!(causes(&with(reached, &|_| "stuck")), ["undecided"], "reached: {reached}");
    }
    let mut coded = with(false, &|_| "singular");
    coded.columns[4] = Column::new("cause", "", vec![2u64; voxels.len()]);
    assert_eq!(causes(&coded), ["singular"]);
    assert!(causes(&with(true, &|_| "inside")).is_empty());
}

#[test]
fn a_surface_is_drawn_by_projections() {
    let (folder, _kept) = folder();
    let folder = folder.join("surface");
    std::fs::create_dir_all(&folder).unwrap();
    let all = table();
    let distance = all.numbers("boundary_distance").unwrap();
    let thin: Vec<usize> = (0..all.row_count()).filter(|row| (0.0..3e-3).contains(&distance[*row])).collect();
    let summary = WorkspaceSummary { dimension: 2, size: Some(Estimate::without_bounds(0.01714)), ..summary() };
    drawn(&all.select(&thin), &summary, &folder);
    let workspace = std::fs::read_to_string(folder.join("workspace.svg")).unwrap();
    assert!(workspace.contains("area 171.4 cm") && !workspace.contains("slice"), "{workspace}");
}

#[test]
fn little_is_drawn_of_little() {
    let all = table();
    let nothing = WorkspaceSummary::default();
    let none: [&str; 0] = [];
    let reached: Vec<usize> =
        (0..all.row_count()).filter(|row| all.column("reached").unwrap().values.number(*row) == 1.0).collect();
    // Without rows, without columns, with nothing reached, and with voxels that are nowhere.
    assert_eq!(names(&all.empty(), &nothing), none);
    assert_eq!(names(&Table::default(), &nothing), none);
    let outside: Vec<usize> = (0..all.row_count()).filter(|row| !reached.contains(row)).collect();
    assert_eq!(names(&all.select(&outside), &nothing), none);
    let mut lost = all.clone();
    lost.columns[0] = Column::new("voxel.x", "m", vec![f64::NAN; all.row_count()]);
    assert_eq!(names(&lost, &nothing), none);
    // What only another design reaches is drawn for that alone.
    let mut others = all.select(&outside);
    others.columns.retain(|column| column.name != "reach.probability");
    others.columns.push(Column::new("reach.probability", "", vec![0.25; outside.len()]));
    assert_eq!(names(&others, &nothing), ["robust"]);
    // One voxel, and voxels of which nothing is known but that they were counted.
    assert_eq!(names(&all.select(&reached[..1]), &nothing), EVERY[..7]);
    let mut counted = all.select(&reached);
    counted.columns.truncate(3);
    assert_eq!(names(&counted, &nothing), none);
    counted.columns.push(Column::new("count", "", vec![7u64; reached.len()]));
    assert_eq!(names(&counted, &nothing), ["workspace"]);
}

#[test]
fn columns_without_numbers_are_left_out() {
    for spoilt in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let mut table = table();
        let rows = table.row_count();
        for column in &mut table.columns[5..] {
            if matches!(column.values, Values::Double(_)) {
                *column = column.with_values(vec![spoilt; rows].into());
            }
        }
        let names = names(&table, &WorkspaceSummary { dimension: 3, ..WorkspaceSummary::default() });
        assert_eq!(names.is_empty(), !spoilt.is_finite(), "{spoilt}: {names:?}");
    }
    // Two voxels, as far apart as indices go.
    let far = f64::from(i32::MAX) * LATTICE.spacing;
    let axis = |name: &str| Column::new(name, "m", vec![-far, far]);
    let mut columns: Vec<Column> = ["voxel.x", "voxel.y", "voxel.z"].map(axis).into();
    columns.push(Column::new("stability.margin", "", vec![0.5, 1.0]));
    assert_eq!(names(&Table::new(columns), &WorkspaceSummary::default()), ["workspace", "margin"]);
}

#[test]
fn convergence_and_designs_need_little() {
    let summary = summary();
    let only = |method: usize| WorkspaceSummary {
        methods: vec![summary.methods[method].clone()],
        reference: None,
        ..summary.clone()
    };
    for method in 0..3 {
        assert_eq!(names(&Table::default(), &only(method)), ["convergence"]);
    }
    let mut broken = only(0);
    broken.methods[0].points[0].size = Estimate { value: 1e-6, low: f64::NEG_INFINITY, high: f64::NAN };
    broken.methods[0].points[1].size.low = -1.0;
    assert_eq!(names(&Table::default(), &broken), ["convergence"]);
    let study = DesignStudy { slope: None, margins: Vec::new(), ..designs() };
    assert!(draw::encode(&study, ImageFormat::Svg).is_ok());
    let nothing = DesignStudy::default();
    assert!(matches!(draw::encode(&nothing, ImageFormat::Svg), Err(draw::ReportError::Empty { .. })));
}
