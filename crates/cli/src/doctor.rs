//! `rodsweep doctor`: what this machine has, and what would be used.

use super::{CommandError, Exit, flags, print};
use rodsweep::draw::count;
use rodsweep::engines::{F32_TOLERANCE, GpuSurvey, Survey, survey};
use rodsweep::gpu::AdapterSummary;
use rodsweep::input::parse_scene;
use rodsweep::model::{Plan, PlanOptions};
use rodsweep::shipped::CANTILEVER;
use std::path::Path;

pub fn doctor() -> Result<Exit, CommandError> {
    // A rod to try the engines with.
    let (name, text) = CANTILEVER;
    let scene = parse_scene(Path::new(name), text)?;
    let plan = Plan::single(&scene, &[], PlanOptions::default())?;
    print(&(describe(&survey(&plan)?).join("\n") + "\n"))?;
    Ok(Exit::Done)
}

fn describe(survey: &Survey) -> Vec<String> {
    let commit = rodsweep::commit().map_or("commit unknown".into(), |commit| format!("commit {commit}"));
    let mut lines = vec![
        format!(
            "rodsweep {} ({commit}), {} {}",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            std::env::consts::ARCH
        ),
        format!("processor: {}", survey.processor),
    ];
    let memory = survey.memory.map(|m| format!("memory: {} of {} free", bytes(m.available), bytes(m.total)));
    lines.extend(memory);
    lines.push(match survey.adapters.len() {
        0 => "GPU adapters: none; no Vulkan, Metal or Direct3D 12 driver was found".into(),
        number => format!("GPU adapters: {number}"),
    });
    survey.adapters.iter().for_each(|adapter| describe_adapter(adapter, &mut lines));
    match (&survey.engine, &survey.coarse_engine) {
        (Ok(engine), Ok(coarse)) => {
            let (kind, precision, reason) = (engine.kind(), engine.precision(), engine.reason());
            lines.push(format!("`--backend auto` takes: {kind} {precision} ({reason})"));
            let (kind, precision) = (coarse.kind(), coarse.precision());
            lines.push(format!("  from a tolerance of {F32_TOLERANCE:.0e} on: {kind} {precision}"));
        }
        (Err(error), _) | (_, Err(error)) => {
            lines.push(format!("`--backend auto` cannot be used: {}", flags::of_backend(error)));
        }
    }
    lines.push(match &survey.cache_directory {
        Some(place) => format!("compiled kernels are kept in {}, where a driver gives them out", place.display()),
        None => "compiled kernels are not kept (RODSWEEP_CACHE is empty)".into(),
    });
    match &survey.gpu {
        Ok(gpu) => describe_gpu(gpu, &mut lines),
        Err(error) => lines.push(format!("`--backend gpu` cannot be used: {}", flags::of_backend(error))),
    }
    lines
}

fn describe_adapter(adapter: &AdapterSummary, lines: &mut Vec<String>) {
    let yes = |has: bool| if has { "yes" } else { "no" };
    lines.push(format!("  {} ({})", adapter.name, adapter.kind));
    lines.push(format!("    interface {}, driver {}", adapter.api, adapter.driver));
    match adapter.compiler.as_str() {
        "" => {}
        "FXC" => lines.push(
            "    kernels are compiled by FXC, which takes minutes: put `dxcompiler.dll` (DXC) beside the program or on the PATH"
                .into(),
        ),
        compiler => lines.push(format!("    kernels are compiled by {compiler}")),
    }
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
fn describe_gpu(gpu: &GpuSurvey, lines: &mut Vec<String>) {
    lines.push(format!("`--backend gpu` takes: {}", gpu.adapter));
    for other in &gpu.others {
        let alike = if other.is_like(&gpu.adapter) { "" } else { "; its rows may differ in the last digits" };
        lines.push(format!("  sharing every sweep with: {other}{alike}"));
    }
    match &gpu.self_test {
        Ok(test) => {
            let verdict = if test.passed() { "passed" } else { "FAILED: do not trust this driver" };
            lines.push(format!("self-test: {verdict}"));
            lines.extend(test.to_string().lines().map(|line| format!("  {line}")));
            if !test.has_long_loops() {
                lines.push("  this driver ends long loops early".into());
            }
        }
        Err(error) => lines.push(format!("self-test: could not run: {}", flags::of_backend(error))),
    }
    lines.push(match &gpu.start {
        Ok(()) => "GPU engine: ready".into(),
        Err(error) => format!("GPU engine: {}", flags::of_backend(error)),
    });
}

/// `1.5 GiB`
fn bytes(number: u64) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let step = units.len().min(1 + (number.max(1).ilog2() / 10) as usize) - 1;
    let value = number as f64 / 1024f64.powi(step as i32);
    if value.fract() < 0.05 { format!("{value:.0} {}", units[step]) } else { format!("{value:.1} {}", units[step]) }
}
