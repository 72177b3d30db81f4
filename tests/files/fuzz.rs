//! Every reader on thousands of mutated files: the smoke run of `tests/fuzz`, the same at each call.
//!
//! `RODSWEEP_FUZZ_ROUNDS` sets the mutations of each seed, `RODSWEEP_FUZZ_SEED` another start, and
//! `RODSWEEP_FUZZ_CORPUS` a folder that the seeds are written to, for cargo-fuzz.

#[path = "../fuzz/src/readers.rs"]
mod readers;

use rayon::prelude::*;
use readers::{Place, READERS, Reader};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Mutations of all seeds of a reader together: some seconds in all.
const ROUNDS: u64 = 8000;
/// Words that readers may trip over.
const WORDS: [&str; 18] = [
    "-1",
    "0",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "9223372036854775807",
    "18446744073709551615",
    "1e-320",
    "\"\"",
    "[]",
    "{}",
    "[[",
    "null",
    "é",
    "\0",
    "\n",
    ",",
];

/// Numbers that look random and are always the same.
struct Chance(u64);

impl Chance {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % below.max(1)
    }
}

/// Changes some bytes, words or lines.
fn mutate(bytes: &mut Vec<u8>, chance: &mut Chance) {
    for _ in 0..=chance.next(4) {
        let (at, length) = (chance.next(bytes.len() + 1), bytes.len());
        let end = length.min(at + 1 + chance.next(40));
        match chance.next(9) {
            0 if at < length => bytes[at] ^= 1 << chance.next(8),
            1 if at < length => bytes[at] = [0, 0x7f, 0x80, 0xff, b'"', b'\n'][chance.next(6)],
            2 => drop(bytes.drain(at..end)),
            3 => {
                let copy = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, copy));
            }
            4 => bytes.truncate(at),
            5 => drop(bytes.splice(at..at, WORDS[chance.next(WORDS.len())].bytes())),
            6 => {
                // A number becomes another.
                let from = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k);
                if let Some(from) = from {
                    let digits = bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
                    drop(bytes.splice(from..from + digits, WORDS[chance.next(WORDS.len())].bytes()));
                }
            }
            7 if at + 8 <= length => {
                let number = [0, 1, u64::MAX, 1 << 31, 1 << 40][chance.next(5)];
                let width = [2, 4, 8][chance.next(3)];
                bytes[at..at + width].copy_from_slice(&number.to_le_bytes()[..width]);
            }
            _ => {
                let from = chance.next(length);
                let copy = bytes[from..length.min(from + 60)].to_vec();
                drop(bytes.splice(at..at, copy));
            }
        }
    }
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

fn try_all(reader: &Reader, seeds: &[Vec<u8>]) {
    let place = Place::new();
    assert!(!seeds.is_empty(), "{}: nothing to begin from", reader.name);
    if let Ok(corpus) = std::env::var("RODSWEEP_FUZZ_CORPUS") {
        let folder = Path::new(&corpus).join(reader.name);
        std::fs::create_dir_all(&folder).expect("a folder");
        seeds
            .iter()
            .enumerate()
            .for_each(|(k, seed)| std::fs::write(folder.join(k.to_string()), seed).expect("a file"));
    }
    let (rounds, start) = (number("RODSWEEP_FUZZ_ROUNDS").unwrap_or(ROUNDS), number("RODSWEEP_FUZZ_SEED").unwrap_or(0));
    for seed in seeds {
        (reader.read)(&place, seed);
    }
    for round in 0..rounds {
        let mut chance = Chance((start + round + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut bytes = seeds[chance.next(seeds.len())].clone();
        mutate(&mut bytes, &mut chance);
        if catch_unwind(AssertUnwindSafe(|| (reader.read)(&place, &bytes))).is_err() {
            let file = std::env::temp_dir().join(format!("rodsweep-{}-{}", reader.name, start + round));
            let _ = std::fs::write(&file, &bytes);
            eprintln!("{}: mutation {} panics; it is kept as {}", reader.name, start + round, file.display());
            std::process::exit(1);
        }
    }
}

/// Memory is looked at, too, which other tests would take part of: a process of its own.
#[test]
fn no_reader_panics_on_mutated_files() {
    const ALONE: &str = "RODSWEEP_FUZZ_ALONE";
    if std::env::var_os(ALONE).is_none() {
        let mut command = std::process::Command::new(std::env::current_exe().expect("this program"));
        command.args(["--exact", "fuzz::no_reader_panics_on_mutated_files", "--nocapture"]);
        let output = command.env(ALONE, "1").output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        let last: Vec<&str> = said.lines().rev().take(20).collect();
        return assert!(output.status.success(), "{}: {last:#?}", output.status);
    }
    // The Parquet crate panics on some damaged pages; its reader here catches that.
    std::panic::set_hook(Box::new(|_| {}));
    // Some seeds are made by a run, which takes all threads.
    let seeds: Vec<Vec<Vec<u8>>> = READERS.iter().map(|reader| (reader.seeds)()).collect();
    READERS.par_iter().zip(&seeds).for_each(|(reader, seeds)| {
        let begin = std::time::Instant::now();
        try_all(reader, seeds);
        eprintln!("{}: {:.1} s", reader.name, begin.elapsed().as_secs_f64());
    });
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|text| text.split_whitespace().next()).and_then(|number| number.parse::<u64>().ok());
    if peak.is_some_and(|peak| peak >= 1 << 20) {
        eprintln!("{peak:?} kB at the peak");
        std::process::exit(1);
    }
}
