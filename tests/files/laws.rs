//! What a sweep says about how its numbers vary: laws of axes, designs of samples, uncertain numbers, workspace.

use crate::arc::{arc, options, shipped};
use crate::common::runs::{read_columns, run_into, spec_of};
use rodsweep::model::{Parameter, PlanOptions};
use rodsweep::spec::{DesignKind, Distribution, SkeletonError, SobolNet, SweepSpec};

const MODULI_AS_THEY_ARE: &str = "parameter = \"proximal.youngs_modulus\"\nrelative = 0.1";
const MODULI: &str = "parameters = [\"proximal.youngs_modulus\", \"distal.youngs_modulus\"]";

/// P6 with this sampling and these axes.
fn sweep(sampling: &str, axes: &[&str]) -> SweepSpec {
    let axes: String = axes.iter().map(|axis| format!("[[axis]]\n{axis}\n")).collect();
    parse(&format!("[sampling]\n{sampling}\n{axes}"))
}

fn parse(text: &str) -> SweepSpec {
    let text = format!("scene = \"scenes/p6.toml\"\n{text}");
    SweepSpec::parse(&shipped().join("s.toml"), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// It is written out, and reads back to the same.
fn round_trip(spec: &SweepSpec) {
    let text = spec.to_toml();
    let again = SweepSpec::parse(&spec.file, &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(again.to_toml(), text);
    let same = SweepSpec { notes: spec.notes.clone(), ..again };
    assert_eq!(&same, spec, "{text}");
}

fn row(spec: &SweepSpec, index: u64) -> Vec<f64> {
    let sampler = spec.sampler();
    let mut row = vec![f64::NAN; sampler.value_count()];
    sampler.values(index, &mut row);
    row
}

fn nominal(spec: &SweepSpec, name: &str) -> f64 {
    Parameter::parse(&spec.scene, name).unwrap()[0].get(&spec.scene)
}

#[test]
fn relative_axes_lie_around_the_scene() {
    let spec =
        sweep("method = \"sobol\"\nsamples = 8", &["parameter = \"proximal.youngs_modulus\"\nrelative = \"10 %\""]);
    let modulus = nominal(&spec, "proximal.youngs_modulus");
    let Some((from, to)) = spec.axes[0].distribution.limits() else { panic!() };
    assert!((from / modulus - 0.9).abs() < 1e-15 && (to / modulus - 1.1).abs() < 1e-15);
    assert!(!spec.axes[0].scales && spec.to_toml().contains(&format!("from = {from:?}")));
    round_trip(&spec);
    let normal = "parameter = \"proximal.youngs_modulus\"\nrelative = 0.1\ndistribution = \"normal\"";
    let spec = sweep("method = \"sobol\"\nsamples = 8", &[normal]);
    let expected = Distribution::Normal { mean: modulus, standard_deviation: 0.1 * modulus };
    assert_eq!(spec.axes[0].distribution, expected);
    round_trip(&spec);
    let scaled = "parameter = \"proximal.youngs_modulus\"\nscale = true\nfrom = 0.5\nto = 2";
    let spec = sweep("method = \"sobol\"\nsamples = 8", &[scaled]);
    assert_eq!(spec.axes[0].distribution, Distribution::Uniform { from: 0.5 * modulus, to: 2.0 * modulus });
}

#[test]
fn scaled_parameters_keep_their_ratio() {
    for (law, from, to) in [("relative = \"10 %\"", 0.9, 1.1), ("scale = true\nfrom = 0.5\nto = \"200 %\"", 0.5, 2.0)] {
        let current = "parameter = \"coil.current.x\"\nfrom = -0.3\nto = 0.3";
        let axes = [current, &format!("{MODULI}\n{law}")];
        let spec = sweep("method = \"sobol\"\nsamples = 16\nseed = 3", &axes);
        assert!(spec.axes[1].scales && spec.axes[1].nominal(&spec.scene) == 1.0);
        assert_eq!(spec.axes[1].distribution.limits(), Some((from, to)));
        let nominal = ["proximal.youngs_modulus", "distal.youngs_modulus"].map(|name| nominal(&spec, name));
        assert_eq!(spec.axes[1].rates(&spec.scene), nominal);
        let (sampler, net) = (spec.sampler(), SobolNet::new(2, 3));
        assert!(sampler.recipe().is_none() && (sampler.axis_count(), sampler.value_count()) == (2, 3));
        for index in 0..16 {
            let (mut values, mut point, mut expanded) = ([0.0; 2], [0.0; 2], [0.0; 3]);
            net.point(index, &mut point);
            sampler.axis_values(index, &mut values);
            sampler.expand(&values, &mut expanded);
            assert_eq!(values, [-0.3 + 0.6 * point[0], from + (to - from) * point[1]]);
            assert_eq!(row(&spec, index), [values[0], values[1] * nominal[0], values[1] * nominal[1]]);
            assert_eq!(row(&spec, index), expanded);
            let scene = spec.sample_scene(index);
            for (name, value) in
                ["coil.current.x", "proximal.youngs_modulus", "distal.youngs_modulus"].iter().zip(expanded)
            {
                assert_eq!(Parameter::parse(&scene, name).unwrap()[0].get(&scene), value);
            }
        }
        round_trip(&spec);
    }
}

#[test]
fn rows_show_each_scaled_parameter() {
    let current = "parameter = \"coil.current.x\"\nfrom = -0.3\nto = 0.3";
    let spec = sweep("method = \"sobol\"\nsamples = 64", &[&format!("{MODULI}\nrelative = \"20 %\""), current]);
    let dir = tempfile::tempdir().unwrap();
    run_into(dir.path(), &spec, &mut arc(&spec), &options()).unwrap();
    let names = ["proximal.youngs_modulus", "distal.youngs_modulus", "coil.current.x"];
    let table = read_columns(dir.path(), &names).unwrap();
    for (column, name) in names.iter().enumerate() {
        let written = table.numbers(name).unwrap();
        let made: Vec<f64> = (0..64).map(|index| row(&spec, index)[column]).collect();
        assert_eq!(written, made, "{name}");
    }
    assert_eq!(spec_of(dir.path()).unwrap().to_toml(), spec.to_toml());
    assert_eq!(spec.plan(PlanOptions::default()).unwrap().axes, spec.axis_parameters());
}

#[test]
fn normal_axes_have_their_moments() {
    let axis = "parameter = \"proximal.rest_curvature.x\"\ndistribution = \"normal\"\nstandard_deviation = \"0.5 1/m\"";
    for method in ["sobol", "latin_hypercube", "uniform"] {
        let spec = sweep(&format!("method = \"{method}\"\nsamples = 65_536"), &[axis]);
        let law = &spec.axes[0].distribution;
        assert_eq!(law.mean(), nominal(&spec, "proximal.rest_curvature.x"));
        assert_eq!((law.standard_deviation(), law.limits()), (0.5, None));
        assert!(spec.sampler().recipe().is_none());
        let (n, sampler) = (spec.sample_count as f64, spec.sampler());
        let deviation = |index: u64| {
            let mut row = [0.0];
            sampler.values(index, &mut row);
            (row[0] - law.mean()) / 0.5
        };
        let deviations: Vec<f64> = (0..spec.sample_count).map(deviation).collect();
        let moment = |k: i32| deviations.iter().map(|x| x.powi(k)).sum::<f64>() / n;
        // Four standard errors of independent samples: 1, 2, 96 of these powers.
        for (k, expected, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (4, 3.0, 96.0f64)] {
            assert!((moment(k) - expected).abs() < 4.0 * (variance / n).sqrt(), "{method} {k}: {}", moment(k));
        }
        round_trip(&spec);
    }
}

#[test]
fn laws_map_the_unit_interval() {
    let laws = [
        Distribution::Uniform { from: -1.0, to: 3.0 },
        Distribution::Uniform { from: 2.0, to: 1.0 },
        Distribution::Normal { mean: -2.0, standard_deviation: 0.3 },
        Distribution::LogUniform { from: 1e-3, to: 40.0 },
        Distribution::LogUniform { from: -2.0, to: -0.5 },
        Distribution::Triangular { from: -1.0, mode: 0.5, to: 4.0 },
        Distribution::Triangular { from: 2.0, mode: 2.0, to: 3.0 },
        Distribution::Triangular { from: 2.0, mode: 3.0, to: 3.0 },
        Distribution::TruncatedNormal { mean: 1.0, standard_deviation: 2.0, from: -1.0, to: 7.0 },
        Distribution::TruncatedNormal { mean: 1.0, standard_deviation: 0.5, from: 3.0, to: 4.0 },
        Distribution::TruncatedNormal { mean: 1.0, standard_deviation: 0.5, from: -2.0, to: -1.0 },
        Distribution::LogNormal { mean: 2.0, standard_deviation: 0.7 },
        Distribution::LogNormal { mean: -3.0, standard_deviation: 0.2 },
    ];
    for law in &laws {
        let count = 20_000;
        let units: Vec<f64> = (0..count).map(|k| (f64::from(k) + 0.5) / f64::from(count)).collect();
        let mean = |f: &dyn Fn(f64) -> f64| units.iter().map(|unit| f(*unit)).sum::<f64>() / f64::from(count);
        let value_mean = mean(&|unit| law.value(unit));
        // The sum is by midpoints: off by the curvature of the quantile, most where it has no end.
        assert!((value_mean - law.mean()).abs() < 1e-5 * law.half_range(), "{law:?}: {value_mean}");
        let deviation = mean(&|unit| (law.value(unit) - law.mean()).powi(2)).sqrt();
        assert!((deviation / law.standard_deviation() - 1.0).abs() < 2e-4, "{law:?}: {deviation}");
        if matches!(law, Distribution::Uniform { .. } | Distribution::Normal { .. }) {
            assert!((value_mean - law.mean()).abs() < 1e-12 * law.half_range() + 1e-12);
            assert!((law.half_range() / law.standard_deviation() - 3f64.sqrt()).abs() < 1e-14);
        }
        for unit in &units {
            let value = law.value(*unit);
            assert!((law.unit(value) - unit).abs() < 1e-11, "{law:?} {unit}");
            // One over the density, with the sign of the direction.
            let rate = law.rate(*unit);
            assert!((rate.abs() * law.density(value) - 1.0).abs() < 1e-12, "{law:?} {unit}");
            let step = 1e-4 * unit.min(1.0 - unit);
            let slope = (law.value(unit + step) - law.value(unit - step)) / (2.0 * step);
            assert!((slope / rate - 1.0).abs() < 1e-6, "{law:?} {unit}: {slope} {rate}");
        }
    }
    assert_eq!(laws[0].density(3.5), 0.0);
}

/// Means and standard deviations of laws by closed forms.
#[test]
fn laws_have_the_moments_of_tables() {
    let check = |law: Distribution, mean: f64, deviation: f64| {
        let (found, spread) = (law.mean(), law.standard_deviation());
        assert!((found / mean - 1.0).abs() < 1e-12, "{law:?}: {found}");
        assert!((spread / deviation - 1.0).abs() < 1e-11, "{law:?}: {spread}");
    };
    check(Distribution::LogUniform { from: 1.0, to: 100.0 }, 99.0 / 100f64.ln(), {
        (9_999.0 / (2.0 * 100f64.ln()) - (99.0 / 100f64.ln()).powi(2)).sqrt()
    });
    check(Distribution::Triangular { from: 0.0, mode: 0.0, to: 1.0 }, 1.0 / 3.0, (1.0f64 / 18.0).sqrt());
    check(Distribution::Triangular { from: -1.0, mode: 3.0, to: 7.0 }, 3.0, (8.0f64 / 3.0).sqrt());
    // Half a normal law: sqrt(2/π) and sqrt(1 - 2/π), for an end that is as good as none.
    let half = Distribution::TruncatedNormal { mean: 0.0, standard_deviation: 1.0, from: 0.0, to: 30.0 };
    check(half, (2.0 / std::f64::consts::PI).sqrt(), (1.0 - 2.0 / std::f64::consts::PI).sqrt());
    check(Distribution::LogNormal { mean: 2.0, standard_deviation: 0.5 }, 2.0, 0.5);
    check(Distribution::Values([1.0, 2.0, 4.0, 5.0].into()), 3.0, 2.5f64.sqrt());
    // Narrow laws are uniform.
    check(Distribution::LogUniform { from: 1.0, to: 1.0 + 1e-9 }, 1.0 + 0.5e-9, (1.0 + 1e-9 - 1.0) / 12f64.sqrt());
}

#[test]
fn a_logarithmic_grid_has_equal_ratios() {
    let axes =
        ["parameter = \"proximal.youngs_modulus\"\nspacing = \"log\"\nfrom = \"1 kPa\"\nto = \"1 GPa\"\npoints = 7"];
    let spec = sweep("method = \"grid\"", &axes);
    assert_eq!(spec.axes[0].distribution, Distribution::LogUniform { from: 1e3, to: 1e9 });
    let values: Vec<f64> = (0..7).map(|index| row(&spec, index)[0]).collect();
    assert_eq!((values[0], values[6]), (1e3, 1e9));
    assert!(values.windows(2).all(|pair| (pair[1] / pair[0] - 10.0).abs() < 1e-13), "{values:?}");
    round_trip(&spec);
    // Equal shares of drawn samples in every decade, whatever draws them, and no recipe for a device.
    for method in ["sobol", "latin_hypercube", "uniform"] {
        let axis = "parameter = \"proximal.youngs_modulus\"\ndistribution = \"log-uniform\"\nfrom = 1e9\nto = 1e3";
        let spec = sweep(&format!("method = \"{method}\"\nsamples = 6144"), &[axis]);
        let mut counts = [0; 6];
        (0..spec.sample_count).for_each(|index| counts[row(&spec, index)[0].log10() as usize - 3] += 1);
        let expected = spec.sample_count as f64 / 6.0;
        assert!(
            counts.iter().all(|count| (f64::from(*count) - expected).abs() < 0.15 * expected),
            "{method}: {counts:?}"
        );
        assert!(spec.sampler().recipe().is_none());
        round_trip(&spec);
    }
}

#[test]
fn listed_values_are_taken_as_they_are() {
    let axes = [
        "parameter = \"coil.current.x\"\nvalues = [0.3, -0.1, \"200 mA\"]",
        "parameter = \"insertion\"\nfrom = \"65 mm\"\nto = \"94 mm\"\npoints = 2",
    ];
    let spec = sweep("method = \"grid\"", &axes);
    assert_eq!((spec.axes[0].points, spec.sample_count), (3, 6));
    let rows: Vec<Vec<f64>> = (0..6).map(|index| row(&spec, index)).collect();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.3, -0.1, 0.2, 0.3, -0.1, 0.2]);
    assert_eq!((rows[0][1], rows[5][1]), (0.065, 0.094));
    round_trip(&spec);
    let drawn = sweep("method = \"latin_hypercube\"\nsamples = 300", &axes[..1]);
    let count = |value: f64| (0..300).filter(|index| row(&drawn, *index)[0] == value).count();
    assert_eq!([0.3, -0.1, 0.2].map(count), [100, 100, 100]);
    let law = &drawn.axes[0].distribution;
    assert_eq!([0.3, -0.1, 0.2].map(|value| (law.unit(value) * 6.0).round()), [1.0, 3.0, 5.0]);
    assert!(law.unit(0.0).is_nan());
    round_trip(&drawn);
}

#[test]
fn laws_of_factors_follow_the_scene() {
    let modulus = nominal(&sweep("method = \"sobol\"\nsamples = 8", &[MODULI_AS_THEY_ARE]), "proximal.youngs_modulus");
    for (law, expected) in [
        (
            "distribution = \"lognormal\"\nrelative = 0.2",
            Distribution::LogNormal { mean: modulus, standard_deviation: 0.2 * modulus },
        ),
        (
            "distribution = \"log-uniform\"\nrelative = 0.25",
            Distribution::LogUniform { from: modulus / 1.25, to: modulus * 1.25 },
        ),
        (
            "distribution = \"triangular\"\nscale = true\nfrom = 0.5\nto = 2",
            Distribution::Triangular { from: 0.5 * modulus, mode: modulus, to: 2.0 * modulus },
        ),
        ("scale = true\nvalues = [0.5, 2]", Distribution::Values([0.5 * modulus, 2.0 * modulus].into())),
    ] {
        let spec =
            sweep("method = \"sobol\"\nsamples = 8", &[&format!("parameter = \"proximal.youngs_modulus\"\n{law}")]);
        assert_eq!(spec.axes[0].distribution, expected);
        round_trip(&spec);
    }
    // A factor below zero turns a law with a lower and an upper end over.
    let cut = Distribution::TruncatedNormal { mean: 1.0, standard_deviation: 1.0, from: 0.0, to: 5.0 };
    let turned = Distribution::TruncatedNormal { mean: -2.0, standard_deviation: 2.0, from: -10.0, to: -0.0 };
    assert_eq!(cut.times(-2.0), turned);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(close(turned.mean(), -2.0 * cut.mean()) && close(turned.value(0.3), -2.0 * cut.value(0.7)));
}

#[test]
fn saltelli_takes_its_matrices_from_one_net() {
    let axes = [
        "parameter = \"coil.current.x\"\nfrom = -0.3\nto = 0.3",
        "parameter = \"insertion\"\nfrom = \"65 mm\"\nto = \"94 mm\"",
        &format!("{MODULI}\nrelative = \"10 %\"\ndistribution = \"normal\""),
    ];
    let spec = sweep("method = \"saltelli\"\nsamples = 100\nseed = 5", &axes);
    let design = spec.saltelli_design().unwrap();
    assert_eq!((design.rows_per_base(), spec.sample_count), (8, 128 * 8));
    assert!(spec.notes.iter().any(|note| note.contains("100 base rows rounded up to 128")), "{:?}", spec.notes);
    let (sampler, net) = (spec.sampler(), SobolNet::new(6, 5));
    assert!(sampler.recipe().is_none());
    for base in 0..128 {
        let mut point = [0.0; 6];
        net.point(base, &mut point);
        let expect = |kind: DesignKind, from: [usize; 3]| {
            let mut values = [0.0; 3];
            sampler.axis_values(design.index(base, kind), &mut values);
            let expected = [0, 1, 2].map(|axis: usize| spec.axes[axis].distribution.value(point[from[axis]]));
            assert_eq!(values, expected, "{base} {kind:?}");
        };
        expect(DesignKind::A, [0, 1, 2]);
        expect(DesignKind::AB(0), [3, 1, 2]);
        expect(DesignKind::AB(2), [0, 1, 5]);
        expect(DesignKind::B, [3, 4, 5]);
        expect(DesignKind::BA(1), [3, 1, 5]);
    }
    round_trip(&spec);
    assert!(spec.to_toml().contains("samples = 128\n"));
}

#[test]
fn a_skeleton_has_axes_at_their_limits() {
    let axes: Vec<String> = ["x", "y", "z"]
        .iter()
        .map(|axis| format!("parameter = \"coil.current.{axis}\"\nfrom = -0.3\nto = 0.1"))
        .chain([format!("{MODULI}\nrelative = \"10 %\"")])
        .collect();
    let axes: Vec<&str> = axes.iter().map(String::as_str).collect();
    let spec = sweep("method = \"skeleton\"\nsamples = 1000\ndimension = 2", &axes);
    let faces = spec.skeleton_faces().unwrap();
    assert_eq!((faces.face_count(), spec.sample_count), (6 * 4, 24 * 64));
    let note = "1,000 samples rounded up to 1,536: 24 faces with 64 each; 2 of 4 axes vary on each";
    assert!(spec.notes.iter().any(|found| found == note), "{:?}", spec.notes);
    let sampler = spec.sampler();
    assert!(sampler.recipe().is_none());
    let mut values = [0.0; 4];
    for face_index in 0..24 {
        let face = faces.face(face_index);
        let mut strata = [[0; 64]; 2];
        for index in 0..64 {
            sampler.axis_values(face_index * 64 + index, &mut values);
            for (axis, is_upper) in &face.fixed {
                let (from, to) = spec.axes[*axis].distribution.limits().unwrap();
                assert_eq!(values[*axis], if *is_upper { to } else { from });
            }
            for (hits, axis) in strata.iter_mut().zip(&face.free) {
                hits[(spec.axes[*axis].distribution.unit(values[*axis]) * 64.0) as usize] += 1;
            }
        }
        assert!(strata.iter().flatten().all(|hits| *hits == 1), "face {face_index} has no net");
    }
    // Faces that share their free axes have nets of their own.
    let free = |index: u64| {
        let mut values = [0.0; 4];
        sampler.axis_values(index, &mut values);
        [values[0], values[1]]
    };
    assert_eq!(faces.face(0).free, faces.face(1).free);
    assert!((0..64).all(|index| free(index) != free(64 + index)));
    round_trip(&spec);
}

#[test]
fn a_skeleton_gets_its_dimension_later() {
    let axes: Vec<String> = ["current.x", "current.y", "current.z", "turns.x"]
        .iter()
        .map(|name| format!("parameter = \"coil.{name}\"\nfrom = 0.1\nto = 0.3"))
        .collect();
    let axes: Vec<&str> = axes.iter().map(String::as_str).collect();
    let spec = sweep("method = \"skeleton\"\nsamples = 1000", &axes);
    assert_eq!(spec.skeleton.unwrap().dimension, None);
    assert_eq!(spec.skeleton_faces().unwrap().dimension(), 3);
    assert_eq!(spec.sample_count, 8 * 128);
    assert!(spec.notes.iter().any(|note| note.contains("3 of 4 axes vary")), "{:?}", spec.notes);
    assert!(!spec.to_toml().contains("dimension"));
    round_trip(&spec);
    let settled = spec.clone().with_skeleton_dimension(1).unwrap();
    assert_eq!((settled.sample_count, settled.skeleton.unwrap().dimension), (32 * 32, Some(1)));
    assert!(settled.notes.iter().any(|note| note.contains("32 faces with 32 each; 1 of 4 axes vary")));
    assert!(!settled.notes.iter().any(|note| note.contains("3 of 4")), "{:?}", settled.notes);
    let asked = sweep("method = \"skeleton\"\nsamples = 1000\ndimension = 1", &axes);
    assert_eq!((asked.to_toml(), &asked.notes), (settled.to_toml(), &settled.notes));
    for dimension in [0, 5] {
        let error = spec.clone().with_skeleton_dimension(dimension).unwrap_err();
        assert_eq!(error, SkeletonError::Dimension { dimension, axis_count: 4 });
    }
    let grid = sweep("method = \"sobol\"\nsamples = 8", &axes);
    assert_eq!(grid.clone().with_skeleton_dimension(2).unwrap(), grid);
}

#[test]
fn uncertain_numbers_stay_with_the_sweep_and_change_no_sample() {
    let head =
        "[sampling]\nmethod = \"grid\"\n[[axis]]\nparameter = \"coil.current.x\"\nfrom = -0.3\nto = 0.3\npoints = 5\n";
    let uncertain = "[[uncertain]]\nparameters = [\"proximal.youngs_modulus\", \"distal.youngs_modulus\"]\nrelative = \"10 %\"\n\
         [[uncertain]]\nparameter = \"coil.turns.x\"\ndistribution = \"normal\"\nstandard_deviation = 1\n\
         [workspace]\nvoxel = \"2 mm\"\nminimum_margin = \"10 %\"\nseed = 9\nlength = \"20 mm\"\n";
    let (plain, spec) = (parse(head), parse(&format!("{head}{uncertain}")));
    assert_eq!(spec.uncertain.len(), 2);
    assert!(spec.uncertain[0].scales && !spec.uncertain[1].scales);
    assert_eq!(spec.uncertain[0].name(&spec.scene), "proximal.youngs_modulus+distal.youngs_modulus");
    assert_eq!(spec.uncertain[1].distribution.mean(), nominal(&spec, "coil.turns.x"));
    let options = spec.workspace;
    assert_eq!((options.voxel, options.minimum_margin, options.seed, options.length), (2e-3, 0.1, 9, Some(0.02)));
    assert_eq!(plain.axes, spec.axes);
    assert!((0..5).all(|index| row(&plain, index) == row(&spec, index)));
    round_trip(&spec);
    round_trip(&plain);
    assert!(!plain.to_toml().contains("uncertain"));
    assert!(plain.to_toml().contains("\n[workspace]\nvoxel = 0.001\n\n[scene"));
    assert_eq!(spec.axis_parameters(), plain.axis_parameters());
}

/// Numbers and text are those of the program before there were laws: they are part of a run's identity.
#[test]
fn sweeps_without_laws_are_as_they_were() {
    let golden: [(&str, [[f64; 2]; 2]); 4] = [
        ("grid", [[-0.2333333333333333, 5833333.333333333], [-0.16666666666666666, 5833333.333333333]]),
        ("sobol", [[-0.06175804263912138, 5248541.158507578], [-0.14153975597582755, 5872413.060511462]]),
        ("latin_hypercube", [[0.037823599691865384, 5572480.660233365], [-0.2085148075449476, 5379862.540936793]]),
        ("uniform", [[0.05431094394815461, 5715275.783008355], [0.03001338104682455, 5592595.485214397]]),
    ];
    for (method, rows) in golden {
        let (points, samples) = if method == "grid" { ("points = 7\n", "") } else { ("", "samples = 1000\n") };
        let spec = parse(&format!(
            "[sampling]\nmethod = \"{method}\"\n{samples}seed = 11\n\
             [[axis]]\nparameter = \"coil.current.x\"\nfrom = -0.3\nto = 0.1\n{points}\
             [[axis]]\n{MODULI}\nfrom = \"5 MPa\"\nto = \"6 MPa\"\n{points}\
             [output]\nquantities = [\"tip_position\"]\nformat = \"csv\"\n"
        ));
        assert_eq!([row(&spec, 36), row(&spec, 37)], rows, "{method}");
        let samples = match method {
            "grid" => "",
            "sobol" => "samples = 1024\n",
            _ => samples,
        };
        let text = format!(
            "[sampling]\nmethod = \"{method}\"\nseed = 11\n{samples}\n\
             [[axis]]\nparameters = [\"coil.current.x\"]\nfrom = -0.3\nto = 0.1\n{points}\n\
             [[axis]]\n{MODULI}\nfrom = 5000000.0\nto = 6000000.0\n{points}\n\
             [solver]\ntolerance = 1e-6\nbranch = \"from_rest\"\n\n\
             [output]\nquantities = [\"tip_position\"]\nderivatives = []\nformat = \"csv\"\n\n\
             [workspace]\nvoxel = 0.001\n\n[scene]\n"
        );
        assert!(spec.to_toml().starts_with(&text), "{}", spec.to_toml());
    }
}
