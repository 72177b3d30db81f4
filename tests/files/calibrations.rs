//! Calibrations of electromagnets by multipoles: the scene that `import` makes of them has the calibration's field.

use rodsweep::input::{ImportKind, ImportOptions, import, parse_scene, write_scene};
use rodsweep::model::Scene;
use tempfile::TempDir;

/// Two coils, in the order of `Coil_List` alone.
const CALIBRATION: &str = include_str!("../data/import/calibration.yaml");

fn imported(text: &str) -> Result<(Scene, String), String> {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("calibration.yaml");
    std::fs::write(&file, text).expect("a file");
    let import = import(&file, &ImportOptions::default()).map_err(|error| error.to_string())?;
    assert_eq!(import.kind, ImportKind::Scene);
    let scene = parse_scene("scene.toml".as_ref(), &import.text).unwrap_or_else(|error| panic!("{error}"));
    Ok((scene, format!("{}\n{}", import.summary, import.notes.join("\n"))))
}

/// b (3 (d·r) r - d) / r³
fn source(b: f64, d: [f64; 3], at: [f64; 3], x: [f64; 3]) -> [f64; 3] {
    let r: [f64; 3] = std::array::from_fn(|k| x[k] - at[k]);
    let size = r.iter().map(|r| r * r).sum::<f64>().sqrt();
    let along = (0..3).map(|k| d[k] * r[k]).sum::<f64>() / size;
    std::array::from_fn(|k| b * (3.0 * along * r[k] / size - d[k]) / size.powi(3))
}

#[test]
fn the_field_is_that_of_the_calibration() {
    let (mut scene, words) = imported(CALIBRATION).expect("a scene");
    assert!(words.contains("2 coils with 3 sources") && words.contains("`clearance = 0`"), "{words}");
    assert!(!words.contains("lie in the workspace"), "{words}");
    let array = &mut scene.sources.arrays[0];
    assert_eq!((array.coils.len(), array.clearance), (2, 0.0));
    array.current = vec![5.0, -7.0];
    let field = scene.rod().field.expect("a field");
    for x in [[0.0, 0.0, 0.0], [0.01, -0.015, 0.005], [-0.018, 0.002, -0.009]] {
        let found = field.flux_density(x);
        let parts = [
            (5.0, source(0.003, [0.0, 0.0, 1.0], [0.017, 0.0, 0.012], x)),
            (-7.0, source(1.5e-6, [0.48, 0.64, 0.6], [0.07, -0.03, 0.01], x)),
            (-7.0, source(-2.5e-6, [0.6, 0.0, -0.8], [-0.05, 0.02, -0.04], x)),
        ];
        for k in 0..3 {
            let expected: f64 = parts.iter().map(|(current, b)| current * b[k]).sum();
            let size: f64 = parts.iter().map(|(current, b)| (current * b[k]).abs()).sum();
            assert!((found[k] - expected).abs() < 1e-13 * size, "{found:?} {expected}");
        }
    }
    assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&scene)).expect("what was written"), scene);
}

#[test]
fn mistakes_are_named() {
    let cases = [
        ("      - 0.003\n", "      - 0.003\n      - 0.1\n", "2 numbers in B_Coeff"),
        ("A_Coeff: ~ # none", "A_Coeff: [1.0]", "1 numbers in A_Coeff"),
        ("  - Coil_1\n", "  - Coil_2\n", "`Coil_2`: is missing"),
        ("      - 0.003\n", "      - -1e300\n", "is -1e300; give numbers of at most 1e60 in size"),
        // Over mu0 / (4 pi) it is ten million times as large.
        ("      - 0.003\n", "      - 1e55\n", "makes no scene: `coil_array[0]"),
        ("Coil_1:\n", "Coil_1: ~\nCoil_1:\n", "`Coil_1` is given twice"),
        (
            "    Source_Position: [-0.05, 0.02, -0.04]\n",
            "    Source_Position: [-0.05, 0.02]\n",
            "`Coil_1.Src_1.Source_Position`",
        ),
        ("Coil_List:\n", "Coil_List: {a: 1}\n", "is YAML that is not read"),
        ("  - Src_0\n  Src_0:", "  - Src_0\n   Src_0:", "indented"),
    ];
    for (from, to, words) in cases {
        assert!(CALIBRATION.contains(from), "{from}");
        let error = imported(&CALIBRATION.replacen(from, to, 1)).expect_err(words);
        assert!(error.contains("calibration.yaml:") && error.contains(words), "{error}\n  has not: {words}");
    }
}

#[test]
fn sources_in_the_workspace_are_told() {
    let (_, words) = imported(&CALIBRATION.replace("      - 0.012\n", "      - 0.002\n")).expect("a scene");
    assert!(words.contains("1 sources lie in the workspace"), "{words}");
}

#[test]
fn arrays_of_coils_have_a_clearance() {
    let array = |clearance: &str| {
        let text = format!(
            "[[coil_array]]\nname = \"a\"\n{clearance}\n[[coil_array.coil]]\ndipoles = [{{ position = [0, 0, 0.1], \
             moment_per_ampere = [0, 0, 1] }}]\n[[segment]]\nname = \"w\"\nkind = \"flexible\"\nlength = 0.05\nstiffness = \
             {{ bending = 1e-5, torsion = 1e-5 }}\n"
        );
        parse_scene("scene.toml".as_ref(), &text)
    };
    let found = |clearance: &str| array(clearance).expect("a scene").sources.arrays[0].clearance;
    assert_eq!((found(""), found("clearance = 0"), found("clearance = \"3 mm\"")), (0.01, 0.0, 0.003));
    let error = array("clearance = -1").expect_err("a negative clearance").to_string();
    assert!(error.contains("scene.toml:3") && error.contains("coil_array[0].clearance"), "{error}");
}
