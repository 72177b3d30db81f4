//! A row of the comparison: errors and times of one method over all configurations.
//!
//! A time is that of the second of two calls (a slow call is made once), the median over the repeats of each
//! configuration.

use std::hint::black_box;
use std::time::Instant;

/// Tips further than this from the reference's, over the length, lie on another branch.
const OTHER_BRANCH: f64 = 0.02;
/// A call that takes longer needs no other to warm up (s).
const SLOW: f64 = 2e-3;

/// What is timed.
pub const TIMED: [&str; 4] = ["jacobian", "warm", "cold", "control"];

/// Median of the configurations, and what 5 % and 95 % of them stay below (s).
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    pub p5: f64,
    pub median: f64,
    pub p95: f64,
}

/// One method.
pub struct Row {
    pub method: String,
    /// What 95 % of the tip errors are to stay below.
    pub tolerance: f64,
    pub resolution: String,
    /// Configurations that it was measured on.
    pub samples: usize,
    pub other_branch: usize,
    pub failed: usize,
    /// Of the tip and of the worst column: 95 %, largest; over those on the branch from rest.
    pub errors: [[f64; 2]; 2],
    /// As `TIMED`; `None` where a method has no such thing.
    pub times: [Option<Spread>; 4],
    /// Published times (s), as `TIMED`.
    pub published: [Option<f64>; 4],
}

/// Seconds of each repeat, by configuration.
pub struct Stopwatch {
    seconds: Vec<Vec<f64>>,
}

impl Stopwatch {
    pub fn new(cases: usize) -> Stopwatch {
        Stopwatch { seconds: vec![Vec::new(); cases] }
    }

    /// Times a call; one that returns `None` failed and does not count.
    pub fn time<T>(&mut self, case: usize, mut call: impl FnMut() -> Option<T>) {
        let mut once = || {
            let start = Instant::now();
            let done = black_box(call()).is_some();
            (start.elapsed().as_secs_f64(), done)
        };
        let (mut seconds, mut done) = once();
        if seconds < SLOW {
            (seconds, done) = once();
        }
        if done {
            self.seconds[case].push(seconds);
        }
    }

    pub fn spread(self) -> Option<Spread> {
        let median = |mut values: Vec<f64>| -> Option<f64> {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let mut of_cases: Vec<f64> = self.seconds.into_iter().filter_map(median).collect();
        of_cases.sort_by(f64::total_cmp);
        let at = |share: f64| of_cases.get((share * (of_cases.len().max(1) - 1) as f64).round() as usize).copied();
        Some(Spread { p5: at(0.05)?, median: at(0.5)?, p95: at(0.95)? })
    }
}

/// Errors gathered over configurations.
#[derive(Default)]
pub struct Errors {
    tips: Vec<f64>,
    columns: Vec<f64>,
    pub other_branch: usize,
    pub failed: usize,
}

impl Errors {
    pub fn add(&mut self, [tip, column]: [f64; 2]) {
        if tip > OTHER_BRANCH {
            self.other_branch += 1;
        } else {
            self.tips.push(tip);
            self.columns.push(column);
        }
    }

    pub fn summary(&mut self) -> [[f64; 2]; 2] {
        [&mut self.tips, &mut self.columns].map(|values| {
            let p95 = p95(values);
            [p95, values.last().copied().unwrap_or(f64::NAN)]
        })
    }
}

/// 95 % of the values are at or below it.
pub fn p95(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((values.len() * 95).div_ceil(100).max(1) - 1).copied().unwrap_or(f64::NAN)
}
