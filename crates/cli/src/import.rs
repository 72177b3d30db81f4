//! `rodsweep import`: a laboratory's text file as a scene or as a table of currents.

use super::{CommandError, Exit, flags, say};
use clap::Args;
use rodsweep::files;
use rodsweep::input::{self, ImportKind, ImportOptions};
use rodsweep::results::ResultsError;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct ImportArguments {
    /// Parameter file (lines such as `CatheterConfig F A F`) or play file (lines `channel,mA,ms`)
    pub file: PathBuf,
    /// Where the scene or table is written [default: NAME-OF-THE-FILE.toml or .csv, here]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Spatial configuration with field, gravity and base pose, for a parameter file
    #[arg(long, value_name = "FILE")]
    pub spatial: Option<PathBuf>,
    /// Segment that channels 1 to 3 of a play file drive, and 4 to 6 [default: coil; coil_1,coil_2]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub coil: Vec<String>,
    /// Change the sign of a play file's axial currents
    #[arg(long)]
    pub negate_axial: bool,
}

pub fn import(arguments: &ImportArguments) -> Result<Exit, CommandError> {
    let options = ImportOptions {
        spatial: arguments.spatial.clone(),
        coils: arguments.coil.clone(),
        negate_axial: arguments.negate_axial,
    };
    let import = input::import(&arguments.file, &options)?;
    check_options(arguments, import.kind)?;
    let out = arguments.out.clone().unwrap_or_else(|| default_file(&arguments.file, import.kind));
    write(&arguments.file, &out, arguments.force, &import.text)?;
    say(&format!("wrote {}: {}", out.display(), import.summary));
    for note in &import.notes {
        say(&format!("note: {note}"));
    }
    say(&match import.kind {
        ImportKind::Scene => format!("go on with: rodsweep solve {}", out.display()),
        ImportKind::Currents => {
            format!("go on with a sweep whose [sampling] says method = \"table\", file = \"{}\"", out.display())
        }
    });
    Ok(Exit::Done)
}

/// Refuses options that mean nothing for this kind of file.
fn check_options(arguments: &ImportArguments, kind: ImportKind) -> Result<(), CommandError> {
    let (name, what) = match kind {
        ImportKind::Scene if !arguments.coil.is_empty() => ("--coil", "play"),
        ImportKind::Scene if arguments.negate_axial => ("--negate-axial", "play"),
        ImportKind::Currents if arguments.spatial.is_some() => ("--spatial", "parameter"),
        _ => return Ok(()),
    };
    let file = arguments.file.display();
    Err(CommandError::Usage(format!("`{name}` is for {what} files, which {file} is not: leave it out")))
}

fn default_file(file: &Path, kind: ImportKind) -> PathBuf {
    let extension = match kind {
        ImportKind::Scene => "toml",
        ImportKind::Currents => "csv",
    };
    // A name such as P11.P35.1.a.txt loses its last part only.
    PathBuf::from(format!("{}.{extension}", file.file_stem().unwrap_or_default().to_string_lossy()))
}

fn write(file: &Path, out: &Path, force: bool, text: &str) -> Result<(), CommandError> {
    if let (Ok(source), Ok(target)) = (file.canonicalize(), out.canonicalize())
        && source == target
    {
        let problem = format!("{} is the file to import: choose another name with `--out`", out.display());
        return Err(CommandError::Usage(problem));
    }
    flags::refuse_to_overwrite(out, force, "name with `--out`")?;
    files::replace(out, text.as_bytes())
        .map_err(|error| ResultsError::Io { path: out.into(), action: "writing", reason: error.to_string() }.into())
}
