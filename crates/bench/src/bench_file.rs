//! Reads a bench file: a sweep file with a `[bench]` table that says what is measured on it.

use rodsweep::input::toml::{Reader, Source};
use rodsweep::input::{BuiltIn, InputError, Problem, choice, one_of, parameters, read_text, sweep_of};
use rodsweep::model::{Parameter, Stepper};
use rodsweep::spec::SweepSpec;
use std::path::Path;

/// What is done to each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// At the equilibrium's own base moment, with the few derivatives that `tip` names: what remains is to integrate.
    Given,
    /// From rest, with the few derivatives that `tip` names.
    Tip,
    /// From rest, with all derivatives of the sweep.
    Cold,
    /// The same as a sweep of many samples does it, from anchors where they certify a start.
    Sweep,
    /// The same from the base moment of a sample near by.
    Warm,
}

/// Which instruction sets are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sets {
    /// The best of the machine.
    Best,
    /// Every one that the machine has.
    All,
}

/// One bench file.
#[derive(Clone, Debug)]
pub struct BenchSpec {
    /// The file's, without extension.
    pub name: String,
    /// As the report names it.
    pub title: String,
    /// Scene, samples and derivatives.
    pub sweep: SweepSpec,
    /// Derivatives of [`Work::Given`] and [`Work::Tip`].
    pub tip: Vec<Parameter>,
    /// What is done to each sample, one after the other.
    pub work: Vec<Work>,
    /// Samples that are timed on a CPU, over and over.
    pub timed: usize,
    /// Methods of integration to measure.
    pub steppers: Vec<Stepper>,
    /// Over the rod; chosen by the stepper's order where the file does not say.
    pub steps: Option<Vec<usize>>,
    /// Instruction sets to measure.
    pub sets: Sets,
    /// Whether the literature's methods are measured beside the engines.
    pub literature: bool,
    /// Whether a GPU in software is measured in f64, too, and in more steps: each of its kernels takes long to compile.
    pub software_gpu: bool,
}

impl Work {
    /// Every kind of work.
    pub const ALL: [Work; 5] = [Work::Given, Work::Tip, Work::Cold, Work::Sweep, Work::Warm];

    /// The word in bench files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Work::Given => "given",
            Work::Tip => "tip",
            Work::Cold => "cold",
            Work::Sweep => "sweep",
            Work::Warm => "warm",
        }
    }
}

impl Sets {
    const ALL: [Sets; 2] = [Sets::Best, Sets::All];

    fn name(self) -> &'static str {
        match self {
            Sets::Best => "best",
            Sets::All => "all",
        }
    }
}

/// Samples that are timed where the file does not say: what one in a thousand costs should show as that.
const TIMED: u64 = 2048;
const MOST_TIMED: u64 = 1 << 20;
/// Most steps over a rod.
const MOST_STEPS: u64 = 4096;
const FEW: [usize; 9] = [4, 6, 8, 12, 16, 24, 32, 64, 128];
const FEWER: [usize; 8] = [2, 3, 4, 6, 8, 12, 16, 24];

impl BenchSpec {
    /// Reads a bench file.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a mistake in it.
    pub fn read(file: &Path) -> Result<BenchSpec, InputError> {
        Self::parse(file, &read_text(file)?, &[])
    }

    /// Parses the text of a bench file; scenes that `built_in` lists are not read from files.
    ///
    /// # Errors
    ///
    /// A mistake in the text.
    pub fn parse(file: &Path, text: &str, built_in: &BuiltIn) -> Result<BenchSpec, InputError> {
        let source = Source::parse(file, text)?;
        let sweep = sweep_of(&source, file, built_in)?;
        let root = source.root();
        let bench = root.table("bench")?;
        let bench =
            bench.ok_or_else(|| root.missing("bench", "add [bench] with work = [\"tip\", \"cold\", \"warm\"]"))?;
        let keys =
            ["title", "tip", "work", "timed", "steppers", "steps", "instruction_sets", "literature", "software_gpu"];
        bench.check_keys(&keys)?;
        let mut tip = Vec::new();
        for (index, name) in bench.strings("tip")?.unwrap_or_default().iter().enumerate() {
            tip.extend(parameters(&bench, &format!("tip[{index}]"), &sweep.scene, name)?);
        }
        if tip.is_empty() {
            return Err(bench.missing("tip", "name a few derivatives, such as [\"coil.current\"]"));
        }
        if sweep.wrt.is_empty() {
            return Err(root.missing("output.derivatives", "name what the Jacobian is taken by"));
        }
        let name = file.file_stem().map_or("bench".into(), |name| name.to_string_lossy().into_owned());
        Ok(BenchSpec {
            title: bench.string("title")?.map_or_else(|| name.clone(), str::to_owned),
            name,
            tip,
            work: words(&bench, "work", &Work::ALL, Work::name)?,
            timed: bench.count("timed", 1)?.unwrap_or(TIMED).min(MOST_TIMED) as usize,
            steppers: words(&bench, "steppers", &Stepper::ALL, Stepper::name)?,
            steps: steps(&bench)?,
            sets: choice(&bench, "instruction_sets", &Sets::ALL, Sets::name)?.unwrap_or(Sets::Best),
            literature: bench.boolean("literature")?.unwrap_or(false),
            software_gpu: bench.boolean("software_gpu")?.unwrap_or(false),
            sweep,
        })
    }

    /// Steps to try with a stepper, growing.
    pub fn steps(&self, stepper: Stepper) -> Vec<usize> {
        let usual = if stepper.order() <= 4 { &FEW[..] } else { &FEWER[..] };
        self.steps.clone().unwrap_or_else(|| usual.to_vec())
    }
}

/// Words of a fixed list, all of them where the file does not say.
fn words<T: Copy + PartialEq>(
    bench: &Reader,
    key: &str,
    all: &[T],
    word: fn(T) -> &'static str,
) -> Result<Vec<T>, InputError> {
    let Some(names) = bench.strings(key)? else { return Ok(all.to_vec()) };
    let mut found = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let key = format!("{key}[{index}]");
        let item = one_of(name, all, word).map_err(|problem| bench.error(&key, problem))?;
        if !found.contains(&item) {
            found.push(item);
        }
    }
    if found.is_empty() {
        let expected = "at least one, or leave it out for all".into();
        return Err(bench.error(key, Problem::Range { value: "an empty list".into(), expected }));
    }
    Ok(found)
}

fn steps(bench: &Reader) -> Result<Option<Vec<usize>>, InputError> {
    let Some(list) = bench.counts("steps", 1)? else { return Ok(None) };
    let grows = list.windows(2).all(|pair| pair[0] < pair[1]);
    if list.is_empty() || !grows || list.iter().any(|steps| *steps > MOST_STEPS) {
        let expected = format!("growing numbers of steps over the rod, at most {MOST_STEPS}");
        return Err(bench.error("steps", Problem::Range { value: format!("{list:?}"), expected }));
    }
    Ok(Some(list.into_iter().map(|steps| steps as usize).collect()))
}
