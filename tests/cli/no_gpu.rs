//! Without a GPU that is worth it the CPU is taken.

use crate::common::root;
use rodsweep::gpu::testing::device_or_skip;

/// The program on a machine without any driver, and with one in software.
#[test]
fn without_a_gpu_the_cpu_is_taken_and_the_program_says_why() {
    let dir = tempfile::tempdir().expect("a directory");
    let sweep = root().join("sweeps/workspace.toml");
    let go = |backend: &str, drivers: Option<&str>| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rodsweep"));
        command.args(["run", "--limit", "600", "--no-figures", "--backend", backend]).arg(&sweep);
        command.arg("--out").arg(dir.path().join(format!("{backend}-{}", drivers.is_some())));
        if let Some(drivers) = drivers {
            command.env("VK_DRIVER_FILES", drivers).env("VK_ICD_FILENAMES", drivers);
        }
        let output = command.output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    if cfg!(target_os = "linux") {
        let (code, said) = go("auto", Some("/nowhere.json"));
        assert!(code == Some(0) && said.contains("engine: cpu f64 (this machine has no GPU)"), "{said}");
        let (code, said) = go("gpu", Some("/nowhere.json"));
        assert!(code == Some(1) && said.contains("no usable GPU") && said.contains("use `--backend cpu`"), "{said}");
    }
    let Some(device) = device_or_skip("a GPU in software") else { return };
    if device.adapter().is_software() {
        let (code, said) = go("auto", None);
        assert!(code == Some(0) && said.contains("engine: cpu f64 (the only GPU is software"), "{said}");
    }
}
