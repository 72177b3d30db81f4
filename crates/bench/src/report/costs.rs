//! Costs of what a scene has, of batches, threads and stages, as tables.

use super::measured::Report;
use super::text::{percent, ratio, table, three, time, whole};
use crate::record::Record;

/// Parts of features and what their size counts.
const GROWING: [(&str, &str); 3] = [
    ("columns", "derivatives"),
    ("segments", "flexible segments, the same steps in all"),
    ("coils", "coils, each behind a flexible segment"),
];

impl Report {
    /// Time over that of the plainest scene in the same arithmetic; the least of the repeats, for these are compared.
    pub(super) fn relative(&self, record: &Record) -> f64 {
        let plain = self.part("terms").find(|plain| plain.case == "plain" && plain.precision == record.precision);
        plain.map_or(f64::NAN, |plain| record.least / plain.least)
    }

    pub(super) fn costs_section(&self) -> String {
        let mut rows = Vec::new();
        let of = |precision: &str, record: &Record| {
            let same = |other: &&Record| {
                other.part == record.part
                    && other.case == record.case
                    && other.precision == precision
                    && other.size.total_cmp(&record.size).is_eq()
            };
            self.records.iter().find(same).map_or(f64::NAN, |record| self.relative(record))
        };
        let mut add = |name: String, record: &Record| {
            rows.push(vec![name, time(record.seconds), ratio(of("f64", record)), ratio(of("f32", record))]);
        };
        for record in self.part("terms").filter(|record| record.precision == "f64") {
            add(record.case.clone(), record);
        }
        for (part, name) in GROWING {
            for record in self.part(part).filter(|record| record.precision == "f64") {
                add(format!("{name}: {}", record.size), record);
            }
        }
        if rows.is_empty() {
            return String::new();
        }
        let headers = ["scene", "f64, a sample", "f64, over the plainest", "f32, over the plainest"];
        format!(
            "## What features cost\n\nA sample from rest on one thread with the best instructions. The plainest scene is a \
             flexible segment with a coil at its end, differentiated by three currents; the others have one thing more, on \
             the same steps.\n\n{}\n![Costs of features](features.png)\n\n{}",
            table(&headers, &rows),
            self.passes()
        )
    }

    /// What a sample spends its operations on.
    fn passes(&self) -> String {
        let all: Vec<&Record> = self.part("passes").collect();
        let Some(mean) = all.first().map(|record| record.passes) else { return String::new() };
        let operations = |k: usize| all.get(k).map_or(f64::NAN, |record| record.operations);
        let path = (mean - 2.0).max(0.0) * operations(0);
        let total = path + operations(1) + operations(2) + operations(3);
        let row = |(k, record): (usize, &&Record)| {
            let (times, all) = if k == 0 { (mean - 2.0, path) } else { (1.0, record.operations) };
            vec![record.case.clone(), whole(record.operations), three(times), percent(all / total)]
        };
        let rows: Vec<Vec<String>> = all.iter().enumerate().map(row).collect();
        let headers = ["pass over the rod", "operations", "times, about", "share"];
        format!("What a sample of the plainest scene spends its operations on:\n\n{}", table(&headers, &rows))
    }

    pub(super) fn throughput_section(&self) -> String {
        let mut text = String::new();
        let sizes = sorted(self.part("batch").map(|record| record.size));
        let engines = names(self.part("batch"));
        if !engines.is_empty() {
            let mut headers = vec!["samples in a batch".to_owned()];
            headers.extend(engines.iter().cloned());
            let rate = |size: f64, engine: &String| {
                let found = self.part("batch").find(|record| record.size == size && record.engine_name() == *engine);
                found.map_or("-".into(), |record| whole(1.0 / record.seconds))
            };
            let row = |size: &f64| {
                let mut row = vec![whole(*size)];
                row.extend(engines.iter().map(|engine| rate(*size, engine)));
                row
            };
            let rows: Vec<Vec<String>> = sizes.iter().map(row).collect();
            text += &format!(
                "## Throughput\n\nSamples a second of the first scene, from rest with its Jacobian, all threads, time on the \
                 wall, one call a batch.\n\n{}\n{}\n![Throughput](throughput.png)\n",
                table(&headers, &rows),
                self.crossover()
            );
        }
        let rows: Vec<Vec<String>> = self
            .part("threads")
            .map(|record| {
                let one = self.part("threads").find(|other| other.size == 1.0 && other.precision == record.precision);
                let gain = one.map_or(f64::NAN, |one| one.seconds / record.seconds);
                vec![record.engine_name(), whole(record.size), whole(1.0 / record.seconds), ratio(gain)]
            })
            .collect();
        if !rows.is_empty() {
            text += &format!("\n{}", table(&["engine", "threads", "samples a second", "over one thread"], &rows));
        }
        text + &self.stages()
    }

    /// At which sizes a GPU is faster than the CPU in the same arithmetic.
    fn crossover(&self) -> String {
        let mut lines = String::new();
        for gpu in names(self.part("batch").filter(|record| record.is_gpu())) {
            let is_faster = |record: &Record| {
                let cpu = |other: &&Record| {
                    !other.is_gpu() && other.precision == record.precision && other.size == record.size
                };
                self.part("batch").find(cpu).is_some_and(|cpu| record.seconds < cpu.seconds)
            };
            let measured: Vec<&Record> = self.part("batch").filter(|record| record.engine_name() == gpu).collect();
            let faster: Vec<&Record> = measured.iter().copied().filter(|record| is_faster(record)).collect();
            let most = measured.last().map_or(f64::NAN, |record| record.size);
            let from_there_on = measured.iter().rev().zip(faster.iter().rev()).all(|(a, b)| std::ptr::eq(*a, *b));
            lines += &match (faster.first(), from_there_on) {
                (None, _) => format!("- {gpu}: slower than the CPU in the same arithmetic at every size.\n"),
                (Some(first), true) => format!(
                    "- {gpu}: faster than the CPU in the same arithmetic from {} samples a batch on, up to the {} measured.\n",
                    whole(first.size),
                    whole(most)
                ),
                (Some(_), false) => {
                    let sizes: Vec<String> = faster.iter().map(|record| whole(record.size)).collect();
                    format!(
                        "- {gpu}: faster than the CPU in the same arithmetic at {} samples a batch, slower at the \
                         other sizes up to {}.\n",
                        sizes.join(" and "),
                        whole(most)
                    )
                }
            };
        }
        lines
    }

    fn stages(&self) -> String {
        let of = |precision: &str, stage: &str| {
            let found = self.part("stages").find(|record| record.precision == precision && record.case == stage);
            found.map_or(f64::NAN, |record| record.seconds)
        };
        let stages: Vec<&Record> = self.part("stages").filter(|record| record.precision == "f64").collect();
        let Some(first) = stages.first() else { return String::new() };
        let row =
            |record: &&Record| vec![record.case.clone(), time(of("f64", &record.case)), time(of("f32", &record.case))];
        let rows: Vec<Vec<String>> = stages.iter().map(row).collect();
        format!(
            "\nThe workspace map, {} samples, on all threads and with its files; stages overlap ({} failed):\n\n{}",
            whole(first.samples),
            whole(first.failed),
            table(&["stage, busy for", "f64", "f32"], &rows)
        )
    }
}

/// Engines with their precision, as they come.
pub(super) fn names<'a>(records: impl Iterator<Item = &'a Record>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for record in records {
        if !names.contains(&record.engine_name()) {
            names.push(record.engine_name());
        }
    }
    names
}

fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = numbers.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}
