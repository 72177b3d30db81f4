//! `rodsweep doctor`: what this machine has, and what would be used.

use super::args::{BackendName, EngineArguments};
use super::engine::{Engine, F32_TOLERANCE};
use super::{CommandError, Exit, print};
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::gpu::{self, AdapterSummary, Device, self_test};
use rodsweep::lanes::Lanes;
use rodsweep::model::{Plan, PlanOptions};
use rodsweep::report::count;
use rodsweep::sweep::parse_scene;
use std::path::Path;

/// A rod to try the engines with.
const SCENE: &str = include_str!("../../sweeps/scenes/cantilever.toml");

pub fn doctor() -> Result<Exit, CommandError> {
    let scene = parse_scene(Path::new("cantilever.toml"), SCENE)?;
    let plan = Plan::single(&scene, &[], PlanOptions::default())?;
    let commit = option_env!("RODSWEEP_COMMIT").map_or("commit unknown".into(), |commit| format!("commit {commit}"));
    let mut lines = vec![
        format!(
            "rodsweep {} ({commit}), {} {}",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            std::env::consts::ARCH
        ),
        format!("processor: {}", Lanes::new(&plan, Precision::F64)?.info().device),
    ];
    lines.extend(memory().map(|(total, free)| format!("memory: {} of {} free", bytes(free), bytes(total))));
    let adapters = gpu::adapters();
    lines.push(match adapters.len() {
        0 => "GPU adapters: none; no Vulkan, Metal or Direct3D 12 driver was found".into(),
        number => format!("GPU adapters: {number}"),
    });
    adapters.iter().for_each(|adapter| describe_adapter(adapter, &mut lines));
    let arguments = EngineArguments { backend: BackendName::Auto, precision: None };
    let tolerance = PlanOptions::default().tolerance;
    match (Engine::choose(&arguments, tolerance), Engine::choose(&arguments, F32_TOLERANCE)) {
        (Ok(engine), Ok(coarse)) => {
            let Engine { kind, precision, reason } = engine;
            lines.push(format!("`--backend auto` takes: {kind} {precision} ({reason})"));
            lines.push(format!("  from a tolerance of {F32_TOLERANCE:.0e} on: {} {}", coarse.kind, coarse.precision));
        }
        (Err(error), _) | (_, Err(error)) => lines.push(format!("`--backend auto` cannot be used: {error}")),
    }
    lines.push(match gpu::cache_directory() {
        Some(place) => format!("compiled kernels are kept in {}, where a driver gives them out", place.display()),
        None => "compiled kernels are not kept (RODSWEEP_CACHE is empty)".into(),
    });
    describe_gpu(&plan, &mut lines);
    print(&(lines.join("\n") + "\n"))?;
    Ok(Exit::Done)
}

fn describe_adapter(adapter: &AdapterSummary, lines: &mut Vec<String>) {
    let yes = |has: bool| if has { "yes" } else { "no" };
    lines.push(format!("  {} ({})", adapter.name, adapter.kind));
    lines.push(format!("    interface {}, driver {}", adapter.api, adapter.driver));
    lines.push(format!(
        "    largest buffer {}, storage binding {}",
        bytes(adapter.max_buffer_size),
        bytes(adapter.max_storage_binding_size)
    ));
    lines.push(format!(
        "    workgroups {} in one dimension, of {} invocations, with {} of shared memory; subgroups of {} to {}",
        count(adapter.max_workgroups.into()),
        adapter.max_workgroup_size,
        bytes(adapter.max_workgroup_storage.into()),
        adapter.min_subgroup_size,
        adapter.max_subgroup_size
    ));
    lines.push(format!(
        "    f64 in shaders: {}, timestamps: {}, pipeline cache: {}",
        yes(adapter.has_f64),
        yes(adapter.has_timestamps),
        yes(adapter.has_pipeline_cache)
    ));
}

/// The adapter that `--backend gpu` takes: whether it computes as it should, and whether the engine starts on it.
fn describe_gpu(plan: &Plan, lines: &mut Vec<String>) {
    let device = match Device::open() {
        Ok(device) => device,
        Err(error) => return lines.push(format!("`--backend gpu` cannot be used: {error}")),
    };
    lines.push(format!("`--backend gpu` takes: {}", device.adapter()));
    let others = gpu::chosen_adapters().unwrap_or_default();
    for other in others.iter().skip(1) {
        let alike = if other.is_like(device.adapter()) { "" } else { "; its rows may differ in the last digits" };
        lines.push(format!("  sharing every sweep with: {other}{alike}"));
    }
    match self_test(&device) {
        Ok(test) => {
            let verdict = if test.passed() { "passed" } else { "FAILED: do not trust this driver" };
            lines.push(format!("self-test: {verdict}"));
            lines.extend(test.to_string().lines().map(|line| format!("  {line}")));
            if !test.has_long_loops() {
                lines.push("  this driver ends long loops early".into());
            }
        }
        Err(error) => lines.push(format!("self-test: could not run: {error}")),
    }
    let engine = Engine { kind: BackendKind::Gpu, precision: Precision::F32, reason: String::new() };
    lines.push(match engine.make(plan) {
        Ok(_) => "GPU engine: ready".into(),
        Err(error) => format!("GPU engine: {error}"),
    });
}

/// `1.5 GiB`
fn bytes(number: u64) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let step = units.len().min(1 + (number.max(1).ilog2() / 10) as usize) - 1;
    let value = number as f64 / 1024f64.powi(step as i32);
    if value.fract() < 0.05 { format!("{value:.0} {}", units[step]) } else { format!("{value:.1} {}", units[step]) }
}

/// Total and available memory [bytes], where the system tells.
fn memory() -> Option<(u64, u64)> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
    };
    Some((line("MemTotal:")?, line("MemAvailable:")?))
}
