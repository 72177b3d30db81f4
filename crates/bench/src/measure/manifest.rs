//! What ran where, for `manifest.json`, and the name of the report's directory.

use super::clock;
use super::problem::{NEAR, SMALL_COLUMN};
use super::session::Session;
use crate::bench_file::BenchSpec;
use crate::machine;
use rodsweep::cpu::InstructionSet;
use rodsweep::model::Stepper;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Year, month and day (Gregorian, UTC) of a day since 1970-01-01.
fn date(day: u64) -> String {
    let (mut year, mut left) = (1970u64, day);
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    while left >= 365 + u64::from(leap(year)) {
        left -= 365 + u64::from(leap(year));
        year += 1;
    }
    let months = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while left >= months[month] {
        left -= months[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02}", month + 1, left + 1)
}

fn today() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    date(since / 86_400)
}

/// `2-core-avx512`, with the GPU's name where it is none in software.
fn device(session: &Session) -> String {
    let set = InstructionSet::available()[0].name().to_lowercase().replace('-', "");
    let adapter = session.adapter.as_ref().filter(|adapter| !adapter.is_software());
    let gpu = adapter.map_or(String::new(), |adapter| format!("-{}", adapter.name.to_lowercase()));
    let name = format!("{}-core-{set}{gpu}", machine::cores());
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-")
}

pub fn default_directory(session: &Session) -> PathBuf {
    PathBuf::from("sweeps/reports").join(format!("{}-{}", today(), device(session)))
}

pub fn manifest(session: &Session, specs: &[BenchSpec]) -> String {
    let scene = |spec: &BenchSpec| -> Value {
        let names = |list: &[rodsweep::model::Parameter]| -> Vec<String> {
            list.iter().map(|parameter| parameter.name(&spec.sweep.scene)).collect()
        };
        json!({
            "name": spec.name,
            "title": spec.title,
            "length": spec.sweep.scene.total_length(),
            "segments": spec.sweep.scene.segments.len(),
            "axes": spec.sweep.axes.iter().map(|axis| {
                let mut said = json!({ "parameters": names(&axis.parameters) });
                axis.distribution.numbers().into_iter().for_each(|(key, number)| said[key] = json!(number));
                said
            }).collect::<Vec<_>>(),
            "tip": names(&spec.tip),
            "derivatives": names(&spec.sweep.wrt),
            "seed": spec.sweep.seed,
        })
    };
    let stepper = |stepper: &Stepper| json!({ "name": stepper.name(), "order": stepper.order() });
    let value = json!({
        "program": "rodsweep",
        "version": rodsweep::VERSION,
        "commit": rodsweep::commit(),
        "date": today(),
        "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        "processor": machine::processor(),
        "cores": machine::cores(),
        "instruction_sets": InstructionSet::available().iter().map(|set| set.name()).collect::<Vec<_>>(),
        "gpu": session.adapter.as_ref().map(ToString::to_string),
        "gpu_in_software": session.adapter.as_ref().is_some_and(|adapter| adapter.is_software()),
        "clock": if clock::has_thread_time() { "processor time of the thread" } else { "time on the wall" },
        "load_average": machine::load_average(),
        "quick": session.quick,
        "seconds": session.seconds().round() as u64,
        "near": NEAR,
        "small_column": SMALL_COLUMN,
        "steppers": Stepper::ALL.iter().map(stepper).collect::<Vec<_>>(),
        "scenes": specs.iter().map(scene).collect::<Vec<_>>(),
        "notes": session.notes,
    });
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

#[cfg(test)]
mod tests {
    #[test]
    fn days_have_dates() {
        let dates = [0, 59, 364, 365, 789, 19_782, 20_778].map(super::date);
        let expected =
            ["1970-01-01", "1970-03-01", "1970-12-31", "1971-01-01", "1972-02-29", "2024-02-29", "2026-11-21"];
        assert_eq!(dates, expected);
    }
}
