//! Looks for rows whose error is above the estimate they carry: random sweeps of random scenes, with short tapers and kinks,
//! as `run` solves them, against answers on grids that are refined until they agree.

mod figure;
mod known;
mod ratios;
mod sweeps;
mod truth;

use crate::error::BenchError;
use crate::files::write_file;
use crate::random::RandomScenes;
use known::KnownRows;
use ratios::{Beyond, Ratios};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::draw::{TextTable, engineering};
use rodsweep::engines::{EngineRequest, F32_TOLERANCE};
use rodsweep::model::{Quantity, SMALL_COLUMN, Status, rotation_angle, rotation_matrix};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::SweepJob;
use serde_json::json;
use std::num::NonZero;
use std::ops::Range;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Instant;
use sweeps::random_sweep;
use truth::{OTHER_BRANCH, ROWS, SMALL_IN_DOUBLE, Truth, distance};

/// Scenes between two words of progress.
const SAY_EACH: u64 = 512;
/// One scene in so many is solved by the reference as well.
const WITNESSED: u64 = 64;
/// Rows that are named, the worst first.
const MOST_NAMED: usize = 12;

/// A setup of an engine.
#[derive(Clone, Copy, Debug)]
struct Setup {
    name: &'static str,
    backend: BackendKind,
    precision: Precision,
    /// Sweeps take them in turn.
    tolerances: &'static [f64],
}

impl Setup {
    const fn new(name: &'static str, backend: BackendKind, precision: Precision, tolerances: &'static [f64]) -> Setup {
        Setup { name, backend, precision, tolerances }
    }
}

/// Setups of the CPU engine.
const CPU_SETUPS: &[Setup] = &[
    Setup::new("cpu f64, loose", BackendKind::Cpu, Precision::F64, &[1e-2, 1e-3, 1e-4]),
    Setup::new("cpu f64, usual", BackendKind::Cpu, Precision::F64, &[1e-6]),
    Setup::new("cpu f64, tight", BackendKind::Cpu, Precision::F64, &[1e-8, 1e-9, 1e-11]),
    Setup::new("cpu f32", BackendKind::Cpu, Precision::F32, SINGLE),
];
/// A GPU, which computes in f32.
const GPU_SETUPS: &[Setup] = &[Setup::new("gpu f32", BackendKind::Gpu, Precision::F32, SINGLE)];
/// Tolerances that f32 is asked for; the last one is beyond it.
const SINGLE: &[f64] = &[1e-2, 1e-3, 1e-6];

/// The result of one setup.
#[derive(Clone, Debug, Default)]
struct Account {
    poses: Ratios,
    columns: Ratios,
    unsolved: u64,
    other_branch: u64,
    refined: u64,
}

/// The result of a search: counts and ratios by setup.
pub struct Estimates {
    kind: RandomScenes,
    seed: u64,
    scenes: u64,
    setups: &'static [Setup],
    accounts: Vec<Account>,
    /// Tips of the truth further from the reference's than both their estimates, of so many.
    witnessed: (u64, u64),
    /// The sweep that took longest, and its seconds.
    slowest: (u64, f64),
}

/// Solves random sweeps of `rods` rods, from sweep number `first` on, in each setup of one engine, and compares every row with
/// the truth.
///
/// # Errors
///
/// An engine that fails as a whole.
pub fn search_estimates(
    kind: RandomScenes,
    (rods, first): (u64, u64),
    seed: u64,
    backend: BackendKind,
    progress: &mut dyn FnMut(&str),
) -> Result<Estimates, BenchError> {
    let scenes = rods.div_ceil(ROWS);
    let last = first.saturating_add(scenes);
    let setups = if backend == BackendKind::Gpu { GPU_SETUPS } else { CPU_SETUPS };
    let mut found = Estimates {
        kind,
        seed,
        scenes,
        setups,
        accounts: vec![Account::default(); setups.len()],
        witnessed: (0, 0),
        slowest: (0, 0.0),
    };
    for start in (first..last).step_by(SAY_EACH as usize) {
        let end = last.min(start + SAY_EACH);
        for part in examine_each(kind, seed, setups, start..end) {
            let (accounts, witnessed, took) = part?;
            found.accounts.iter_mut().zip(accounts).for_each(|(all, one)| all.add(one));
            found.witnessed = (found.witnessed.0 + witnessed.0, found.witnessed.1 + witnessed.1);
            if took.1 > found.slowest.1 {
                found.slowest = took;
            }
        }
        progress(&format!("{} sweeps of {scenes}", end - first));
    }
    Ok(found)
}

/// The result of one sweep: an account by setup, the tips that the reference contradicts, of so many, and its number and seconds.
type Examined = Result<(Vec<Account>, (u64, u64), (u64, f64)), BenchError>;

/// Sweeps side by side. A run waits for threads of the pool, so that it may not wait on one of them.
fn examine_each(kind: RandomScenes, seed: u64, setups: &[Setup], numbers: Range<u64>) -> Vec<Examined> {
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let of_worker = |worker: usize| -> Vec<Examined> {
        numbers.clone().skip(worker).step_by(workers).map(|number| examine(kind, seed, setups, number)).collect()
    };
    thread::scope(|scope| {
        let of_worker = &of_worker;
        let spawned: Vec<_> = (0..workers).map(|worker| scope.spawn(move || of_worker(worker))).collect();
        spawned.into_iter().flat_map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
    })
}

/// The accounts of one sweep in every setup, and of the reference beside its truth.
fn examine(kind: RandomScenes, seed: u64, setups: &[Setup], number: u64) -> Examined {
    let began = Instant::now();
    let mut accounts = vec![Account::default(); setups.len()];
    let took = || (number, began.elapsed().as_secs_f64());
    let spec = random_sweep(kind, seed, number).filter(|spec| spec.scene.validate().is_ok());
    let Some(mut spec) = spec else { return Ok((accounts, (0, 0), took())) };
    let truth = Truth::of(&spec)?;
    if truth.is_unknown() {
        accounts.iter_mut().for_each(|account| account.unsolved += ROWS);
        return Ok((accounts, (0, 0), took()));
    }
    for (account, Setup { backend, precision, tolerances, .. }) in accounts.iter_mut().zip(setups) {
        spec.tolerance = tolerances[number as usize % tolerances.len()];
        let request = EngineRequest::of(*backend).precision(Some(*precision));
        let mut rows = KnownRows::of(&truth);
        SweepJob::new(spec.clone())
            .engine(request)
            .spot_check(None)
            .path_check(None)
            .limit(Some(ROWS))
            .part_size(Some(rows.part_size()))
            .run(&mut rows)?;
        account.compare(&spec, number, *precision, rows, &truth);
    }
    let witnessed = if number.is_multiple_of(WITNESSED) { truth.witness()? } else { (0, 0) };
    Ok((accounts, witnessed, took()))
}

impl Account {
    fn add(&mut self, other: Account) {
        self.poses.add(other.poses);
        self.columns.add(other.columns);
        self.unsolved += other.unsolved;
        self.other_branch += other.other_branch;
        self.refined += other.refined;
    }

    fn compare(&mut self, spec: &SweepSpec, number: u64, precision: Precision, known: KnownRows, truth: &Truth) {
        let (samples, rows) = known.into_rows();
        self.unsolved += ROWS - samples.len() as u64;
        let numbers = |name: String| rows.numbers(&name).unwrap_or_default();
        let vector = |name: &str| ["x", "y", "z"].map(|axis| numbers(format!("{name}.{axis}")));
        let (position, rotation) = (vector("tip.position"), vector("tip.rotation"));
        let (estimate, derivative_error) = (numbers("error_estimate".into()), numbers("derivative_error".into()));
        let names: Vec<String> = spec.wrt.iter().map(|parameter| parameter.name(&spec.scene)).collect();
        let of = |tip: &str, name: &str| ["x", "y", "z"].map(|axis| numbers(format!("d({tip}.{axis})/d({name})")));
        let columns: Vec<_> = names.iter().map(|name| (of("tip.position", name), of("tip.rotation", name))).collect();
        let (tolerance, small) = match precision {
            Precision::F32 => (spec.tolerance.max(F32_TOLERANCE), SMALL_COLUMN),
            Precision::F64 => (spec.tolerance, SMALL_IN_DOUBLE),
        };
        for (row_at, (at, status)) in samples.into_iter().zip(rows.statuses()).enumerate() {
            if !status.is_success() {
                self.unsolved += 1;
                continue;
            }
            self.refined += u64::from(*status == Status::Refined);
            let length = truth.plan.sample_rod(&truth.batch, at).total_length();
            let p: [f64; 3] = std::array::from_fn(|k| position[k][row_at]);
            let w: [f64; 3] = std::array::from_fn(|k| rotation[k][row_at]);
            let dp = distance(&p, &truth.solutions.vector(at, Quantity::TipPosition)) / length;
            let tip = dp.max(rotation_angle(&rotation_matrix(w), &truth.solutions.tip_rotation(at)));
            if tip > OTHER_BRANCH && tip > 100.0 * spec.tolerance {
                self.other_branch += 1;
                continue;
            }
            let row = |column: &str, error, estimate| Beyond {
                scene: number,
                sample: at as u64,
                tolerance: spec.tolerance,
                column: column.into(),
                error,
                estimate,
                status: status.name(),
            };
            self.poses.take(row("", tip, estimate[row_at]), truth.doubt[at].0.max(1e-14), tolerance);
            for (index, (by_position, by_rotation)) in columns.iter().enumerate() {
                let value = |row: usize| if row < 3 { by_position[row][row_at] } else { by_rotation[row - 3][row_at] };
                let error = truth.column_error((at, index), (length, small), value);
                let doubt = truth.doubt[at].1[index].max(1e-14);
                self.columns.take(
                    row(&names[index], error, derivative_error[row_at]),
                    doubt,
                    spec.derivative_tolerance,
                );
            }
        }
    }
}

impl Estimates {
    /// Whether no pose is off by more than its estimate, at most one column in 10,000 is, and no tolerance is missed unsaid.
    pub fn is_right(&self) -> bool {
        self.accounts.iter().all(|account| {
            let (poses, columns) = (&account.poses, &account.columns);
            poses.beyond.is_empty() && poses.missed == 0 && 10_000 * columns.beyond.len() as u64 <= columns.rows
        })
    }

    /// Writes the sweeps of the worst rows into a folder, for `run`; returns the files.
    ///
    /// # Errors
    ///
    /// A folder or file that cannot be written.
    pub fn write_replays(&self, out: &Path) -> Result<Vec<PathBuf>, BenchError> {
        let mut beyond: Vec<&Beyond> = self
            .accounts
            .iter()
            .flat_map(|account| account.poses.beyond.iter().chain(&account.columns.beyond))
            .collect();
        beyond.sort_by(|a, b| (b.error / b.estimate).total_cmp(&(a.error / a.estimate)));
        let mut written: Vec<u64> = Vec::new();
        let mut files = Vec::new();
        for row in beyond {
            if written.contains(&row.scene) || written.len() == MOST_NAMED {
                continue;
            }
            written.push(row.scene);
            if let Some(mut spec) = random_sweep(self.kind, self.seed, row.scene) {
                spec.tolerance = row.tolerance;
                let kind = self.kind.option().trim_start_matches('-');
                let dash = if kind.is_empty() { "" } else { "-" };
                files.push(out.join(format!("estimates{dash}{kind}-{}-{}.sweep.toml", self.seed, row.scene)));
                // The file that is written now has another digest.
                write_file(&files[files.len() - 1], &spec.to_toml().replace("digest = \"\"\n", ""))?;
                for (name, text) in self.kind.files(self.seed, row.scene) {
                    write_file(&out.join(name), &text)?;
                }
            }
        }
        Ok(files)
    }

    /// A table of counts and ratios, then the worst rows.
    pub fn text(&self) -> String {
        let heads = [
            "engine",
            "of",
            "rows",
            "too exact to tell",
            "beyond",
            "worst error / estimate",
            "median estimate / error",
            "missed",
            "announced",
        ];
        let mut table = TextTable::new(heads);
        let mut lines = String::new();
        for (account, Setup { name, .. }) in self.accounts.iter().zip(self.setups) {
            for (what, ratios) in [("poses", &account.poses), ("columns", &account.columns)] {
                let counts = [ratios.rows, ratios.untold, ratios.beyond.len() as u64].map(|count| count.to_string());
                let values = [ratios.worst(), ratios.median()].map(engineering);
                let misses = [ratios.missed, ratios.announced].map(|count| count.to_string());
                let cells = [(*name).to_owned(), what.to_owned()].into_iter().chain(counts).chain(values).chain(misses);
                table.row(cells);
                let mut worst: Vec<&Beyond> = ratios.beyond.iter().collect();
                worst.sort_by(|a, b| (b.error / b.estimate).total_cmp(&(a.error / a.estimate)));
                for row in worst.into_iter().take(MOST_NAMED) {
                    let Beyond { scene, sample, tolerance, column, error, estimate, status } = row;
                    lines += &format!(
                        "{name}, scene {scene}, sample {sample}, tolerance {tolerance:.0e}, `{status}`: {what} {column} off by {}, estimate {}\n",
                        engineering(*error),
                        engineering(*estimate)
                    );
                }
            }
            let Account { unsolved, other_branch, refined, .. } = account;
            lines += &format!(
                "{name}: {unsolved} rows without an answer, {other_branch} on another branch, {refined} refined\n"
            );
        }
        let (apart, of) = self.witnessed;
        let (slowest, seconds) = self.slowest;
        format!(
            "{table}\n{lines}truth against the reference: {apart} of {of} tips apart\nslowest: scene {slowest}, {seconds:.1} s\n"
        )
    }

    /// For a program: counts, ratios and histograms.
    pub fn json(&self) -> String {
        let ratios = |ratios: &Ratios| {
            json!({
                "rows": ratios.rows,
                "untold": ratios.untold,
                "beyond": ratios.beyond.len(),
                "worst": ratios.worst(),
                "median": ratios.median(),
                "missed": ratios.missed,
                "announced": ratios.announced,
                "histogram": ratios.histogram(),
            })
        };
        let setup = |(account, Setup { name, .. }): (&Account, &Setup)| {
            json!({
                "engine": name,
                "unsolved": account.unsolved,
                "other_branch": account.other_branch,
                "refined": account.refined,
                "poses": ratios(&account.poses),
                "columns": ratios(&account.columns),
            })
        };
        let value = json!({
            "version": rodsweep::VERSION,
            "scenes": self.kind.option().trim_start_matches("--"),
            "seed": self.seed,
            "sweeps": self.scenes,
            "setups": self.accounts.iter().zip(self.setups).map(setup).collect::<Vec<_>>(),
            "apart_from_reference": self.witnessed.0,
            "witnessed": self.witnessed.1,
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}
