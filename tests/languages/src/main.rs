//! Kernels in the languages of Metal and DirectX: `rodsweep-languages FOLDER` writes a `.metal` and an `.hlsl` beside each
//! `.wgsl` of the folder, as wgpu would hand them to the driver.

use naga::back::{hlsl, msl};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ShaderStage, front};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).ok_or("name a folder of .wgsl files")?;
    let mut files: Vec<PathBuf> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_, std::io::Error>>()?;
    files.retain(|file| file.extension().is_some_and(|ending| ending == "wgsl"));
    files.sort();
    if files.is_empty() {
        return Err("there is no .wgsl file".into());
    }
    for file in &files {
        translate(file).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    println!("{} kernels written in MSL and HLSL", files.len());
    Ok(())
}

fn translate(file: &Path) -> Result<(), Box<dyn Error>> {
    let module = front::wgsl::parse_str(&fs::read_to_string(file)?)?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::default()).validate(&module)?;
    for (ending, text) in [("metal", to_msl(&module, &info)?), ("hlsl", to_hlsl(&module, &info)?)] {
        for entry in module.entry_points.iter().filter(|entry| entry.stage == ShaderStage::Compute) {
            let begin = if ending == "metal" { "kernel void " } else { "void " };
            if !text.contains(&format!("{begin}{}", entry.name)) {
                return Err(format!("{ending} has no entry point {}", entry.name).into());
            }
        }
        fs::write(file.with_extension(ending), text)?;
    }
    Ok(())
}

fn to_msl(module: &Module, info: &ModuleInfo) -> Result<String, Box<dyn Error>> {
    let options = msl::Options { lang_version: (2, 0), fake_missing_bindings: true, ..Default::default() };
    let (text, translation) = msl::write_string(module, info, &options, &msl::PipelineOptions::default())?;
    for name in translation.entry_point_names {
        name.map_err(|error| error.to_string())?;
    }
    Ok(text)
}

fn to_hlsl(module: &Module, info: &ModuleInfo) -> Result<String, Box<dyn Error>> {
    let options =
        hlsl::Options { shader_model: hlsl::ShaderModel::V5_1, fake_missing_bindings: true, ..Default::default() };
    let mut text = String::new();
    let pipeline = hlsl::PipelineOptions::default();
    let reflection = hlsl::Writer::new(&mut text, &options, &pipeline).write(module, info, None)?;
    for name in reflection.entry_point_names {
        name.map_err(|error| error.to_string())?;
    }
    Ok(text)
}
