//! Tells the program the commit it was built from, where there is one.

use std::path::Path;
use std::process::Command;

fn main() {
    // A watched file that is missing would mean a rebuild every time.
    for file in ["build.rs", "../../.git/HEAD", "../../.git/index"].into_iter().filter(|file| Path::new(file).exists())
    {
        println!("cargo:rerun-if-changed={file}");
    }
    let output = Command::new("git").args(["describe", "--always", "--dirty", "--abbrev=12"]).output();
    if let Some(text) = output.ok().filter(|o| o.status.success()).and_then(|o| String::from_utf8(o.stdout).ok()) {
        println!("cargo:rustc-env=RODSWEEP_COMMIT={}", text.trim());
    }
}
