//! The whole shape as an output, measured tangents, and coverage of the intervals on P6 itself.

use crate::sensitivity::{index, p6, study, with_rows};
use rodsweep::input::assign;
use rodsweep::model::{Scene, Vector};
use rodsweep::spec::SweepSpec;
use rodsweep::study::Solve;
use rodsweep::study::sensitivity::{Index, Order, SensitivityJob};

const SMOOTH: [f64; 3] = [0.05, 0.10, -0.20];

#[test]
fn the_last_point_of_the_shape_is_the_tip() {
    let job = SensitivityJob::of_sweep(p6(SMOOTH, "method = \"saltelli\"\nsamples = 64\nseed = 3"));
    let one = with_rows(job.clone().outputs(&["shape:1", "tip.position"])).run().expect("a study");
    let four = with_rows(job.outputs(&["shape:4", "shape.1", "shape.2", "shape.3", "shape.4"])).run().expect("a study");
    let tip = |index: &&Index| index.output == "tip.position";
    let mut compared = 0;
    for expected in one.indices.iter().filter(tip) {
        for (found, output) in [(&one, "shape"), (&four, "shape.4")] {
            let same = |index: &&Index| {
                index.output == output
                    && (&index.input, index.order, index.estimator)
                        == (&expected.input, expected.order, expected.estimator)
            };
            let found = found.indices.iter().find(same).unwrap_or_else(|| panic!("no {output} like {expected:?}"));
            let [a, b] = [found, expected].map(|index| index.estimate.value);
            // The rows are good to 1e-7 of the length, the points to round-off.
            assert!((a - b).abs() < 1e-4, "{output}: {found:?}, not {expected:?}");
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared}");
    // Of the whole shape: shares of the summed variances, here by polynomials.
    let chaos = |output: &str, input: &str| index(&four, output, input, Order::First, "chaos").estimate.value;
    let whole = index(&four, "shape", "coil.turns.z", Order::First, "chaos").estimate;
    let of_points = (1..=4).map(|k| chaos(&format!("shape.{k}"), "coil.turns.z"));
    let (least, most) = of_points.fold((1.0f64, 0.0f64), |(least, most), x| (least.min(x), most.max(x)));
    assert!(least < most && (least..=most).contains(&whole.value), "{whole:?}, points {least} to {most}");
}

/// Position at a share of the length.
fn point(scene: Scene, share: f64) -> Vector {
    let length = scene.total_length();
    let solved = Solve::new(scene).tolerance(1e-10).run().expect("a solution");
    solved.shape(&[share * length]).expect("a shape").positions()[0]
}

/// Lengths, too: the point stays at its share of the rod. Insertion is held where it is swept, so the two lengths vary apart.
#[test]
fn points_have_the_slopes_of_differences() {
    for axes in [
        [("insertion", 0.0943, 1e-4), ("coil.turns.x", 100.0, 0.5)],
        [("distal.length", 0.0185, 1e-4), ("coil.turns.z", 30.0, 0.5)],
    ] {
        slopes_are_differences(axes);
    }
}

fn slopes_are_differences(axes: [(&str, f64, f64); 2]) {
    let axis = |(name, at, _): (&str, f64, f64)| {
        format!("[[axis]]\nparameter = \"{name}\"\nfrom = {}\nto = {}\n", at * 0.98, at * 1.02)
    };
    let sampling = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = 16\n";
    let text = sampling.to_owned() + &axes.map(axis).concat();
    let mut spec = SweepSpec::parse(&crate::common::root().join("sweeps/s.toml"), &text).expect("a sweep");
    let current = ["x", "y", "z"].iter().zip(SMOOTH).map(|(axis, i)| format!("coil.current.{axis}={i}"));
    assign(&mut spec.scene, &current.collect::<Vec<_>>()).expect("currents");
    let job = SensitivityJob::of_sweep(spec.clone()).outputs(&["shape:3", "shape.1", "shape.2", "shape.3"]);
    let found = with_rows(job).run().expect("a study");
    let nominal: Vec<String> = axes.iter().map(|(name, at, _)| format!("{name}={at}")).collect();
    for (k, (name, at, step)) in axes.into_iter().enumerate() {
        for place in 1..=3 {
            let moved = |step: f64| {
                let mut values = nominal.clone();
                values[k] = format!("{name}={}", at + step);
                let mut scene = spec.scene.clone();
                assign(&mut scene, &values).expect("values");
                point(scene, f64::from(place) / 3.0)
            };
            let (more, less) = (moved(step), moved(-step));
            let expected: Vec<f64> = (0..3).map(|axis| (more[axis] - less[axis]) / (2.0 * step)).collect();
            let scale = expected.iter().map(|x| x.abs()).fold(0.0, f64::max);
            for (letter, expected) in ["x", "y", "z"].into_iter().zip(expected) {
                let output = format!("shape.{place}.{letter}");
                let local = found.local.iter().find(|local| local.output == output && local.input == name);
                let slope = local.expect("a slope").slope;
                assert!((slope - expected).abs() < 1e-4 * scale, "{output} by {name}: {slope}, differences {expected}");
            }
        }
    }
}

#[test]
fn a_shape_without_base_moments_is_refused() {
    let spec = p6(SMOOTH, "method = \"sobol\"\nsamples = 16");
    let rows = with_rows(SensitivityJob::of_sweep(spec));
    let error = rows.outputs(&["shape"]).run().expect_err("no base moments").to_string();
    assert!(error.contains("\"base_moment\"") && error.contains("[output]"), "{error}");
    for wrong in ["shape:0", "shape:many", "shape:100000"] {
        let job = SensitivityJob::of_sweep(p6(SMOOTH, "method = \"sobol\"\nsamples = 16")).outputs(&[wrong]);
        let error = job.check().expect_err("no such shape").to_string();
        assert!(error.contains(wrong) && error.contains("shape:20"), "{error}");
    }
}

/// The information of all candidates with tangents is what Jacobians of single solutions add up to.
#[test]
fn tangents_add_what_they_see() {
    let text = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"sobol\"\nsamples = 12\nseed = 2\n\
        [[axis]]\nparameter = \"coil.current.x\"\nfrom = -0.1\nto = 0.1\n\
        [[axis]]\nparameter = \"coil.current.z\"\nfrom = -0.1\nto = 0.1\n\
        [[uncertain]]\nparameter = \"proximal.rest_curvature.x\"\nfrom = -1\nto = 1\n\
        [[uncertain]]\nparameter = \"proximal.rest_curvature.y\"\nfrom = -1\nto = 1\n\
        [solver]\ntolerance = 1e-9\n";
    let spec = SweepSpec::parse(&crate::common::root().join("sweeps/s.toml"), text).unwrap_or_else(|e| panic!("{e}"));
    let (noise, tilt) = (5e-4, 0.02);
    let job = SensitivityJob::of_sweep(spec.clone()).noise(Some(noise)).minimum_margin(0.0);
    let blind = with_rows(job.clone()).run().expect("a study").identification.expect("an identification");
    let seeing = with_rows(job.tangent_noise(Some(tilt)).choose(Some(3))).run().expect("a study");
    let seeing = seeing.identification.expect("an identification");
    let names = ["proximal.rest_curvature.x", "proximal.rest_curvature.y"];
    let (mut positions, mut both) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    for sample in 0..spec.sample_count {
        let solved = Solve::new(spec.sample_scene(sample)).wrt(&names).tolerance(1e-9).run().expect("a solution");
        assert!(solved.is_equilibrium());
        let (length, tangent) = (solved.scene().total_length(), solved.tip_tangent());
        let jacobian = solved.jacobian();
        let column = |rows: &[Vec<f64>; 3], k: usize| -> Vector { std::array::from_fn(|a| rows[a][k] / length) };
        let seen = |k: usize| {
            let (p, w) = (column(&jacobian.position(), k), column(&jacobian.rotation(), k));
            // d(tangent) = w x tangent
            let [x, y, z] = tangent;
            let turned = [w[1] * z - w[2] * y, w[2] * x - w[0] * z, w[0] * y - w[1] * x];
            (p.map(|x| x / noise), turned.map(|x| x / tilt))
        };
        let dot = |a: Vector, b: Vector| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        for i in 0..2 {
            for j in 0..2 {
                let ((pi, ti), (pj, tj)) = (seen(i), seen(j));
                positions[i][j] += dot(pi, pj);
                both[i][j] += dot(pi, pj) + dot(ti, tj);
            }
        }
    }
    for (found, expected) in [(&blind.all.fisher, positions), (&seeing.all.fisher, both)] {
        for i in 0..2 {
            for j in 0..2 {
                let off = (found[i][j] - expected[i][j]).abs() / (expected[i][i] * expected[j][j]).sqrt();
                assert!(off < 1e-6, "{i} {j}: {} is not {}", found[i][j], expected[i][j]);
            }
        }
    }
    assert!(seeing.all.log_determinant > blind.all.log_determinant + 1e-3);
    let chosen = seeing.chosen.expect("a choice");
    let (worst, _) = chosen.worst.expect("the ends of what is uncertain");
    assert!(worst.is_finite() && worst < chosen.information.log_determinant + 1.0, "{worst}");
}

/// 40 scrambles of P6's own design: the intervals hold what all of them together say.
#[test]
fn intervals_cover_the_truth_of_p6() {
    const SCRAMBLES: usize = 40;
    let outputs = ["tip.position.x", "tip.position.y", "tip.position.z", "stability.margin"];
    let of = |seed: usize| {
        let spec = p6(SMOOTH, &format!("method = \"saltelli\"\nsamples = 256\nseed = {}", 1000 + seed));
        let found = study(spec);
        let is_meant = |index: &Index| {
            index.order != Order::Second && index.estimator == "azzini" && outputs.contains(&index.output.as_str())
        };
        found.indices.into_iter().filter(is_meant).collect::<Vec<Index>>()
    };
    let all: Vec<Vec<Index>> = (0..SCRAMBLES).map(of).collect();
    let count = all[0].len();
    assert_eq!(count, 4 * 8 * 2);
    let mut shares = Vec::new();
    for k in 0..count {
        // Their mean is six times as accurate as each.
        let truth = all.iter().map(|indices| indices[k].estimate.value).sum::<f64>() / SCRAMBLES as f64;
        if truth < 1e-4 {
            continue;
        }
        let holds = |indices: &&Vec<Index>| {
            let estimate = indices[k].estimate;
            (estimate.low..=estimate.high).contains(&truth)
        };
        shares.push(all.iter().filter(holds).count() as f64 / SCRAMBLES as f64);
    }
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    let worst = shares.iter().copied().fold(1.0, f64::min);
    println!("P6, n = 256: coverage {mean:.3} over {} indices, of the worst {worst:.3}", shares.len());
    assert!(mean > 0.92 && worst >= 0.83, "{mean}, {worst}");
}
