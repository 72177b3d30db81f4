//! Progress of a run on the standard error: a line that changes on a terminal, plain lines elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rodsweep::backend::BackendInfo;
use rodsweep::draw::count;
use rodsweep::sweep::Progress;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Without a terminal, a line at most this often.
const INTERVAL: Duration = Duration::from_secs(5);

pub struct Meter {
    bar: Option<ProgressBar>,
    last: Mutex<Option<Instant>>,
    device: String,
}

impl Meter {
    pub fn new(info: &BackendInfo) -> Meter {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            bar.set_style(ProgressStyle::with_template("{wide_bar} {msg}").unwrap_or(ProgressStyle::default_bar()));
            bar
        });
        Meter { bar, last: Mutex::new(None), device: info.to_string() }
    }

    pub fn show(&self, progress: &Progress) {
        let line = self.line(progress);
        if let Some(bar) = &self.bar {
            bar.set_length(progress.total);
            bar.set_position(progress.done);
            bar.set_message(line);
            return;
        }
        let Ok(mut last) = self.last.lock() else { return };
        let finished = progress.done == progress.total;
        if finished || last.is_none_or(|last| last.elapsed() >= INTERVAL) {
            *last = Some(Instant::now());
            super::say(&line);
        }
    }

    fn line(&self, progress: &Progress) -> String {
        let Progress { done, total, failed, rate, left, checking, .. } = *progress;
        if checking {
            return format!("{} of {} samples; checking some against the reference", count(done), count(total));
        }
        let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
        let failed = if failed > 0 { format!(", {} failed", count(failed)) } else { String::new() };
        let rate = count(rate.round() as u64);
        format!("{} of {} samples, {rate}/s{left}{failed}, {}", count(done), count(total), self.device)
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// `950 ms`, `12.3 s`, `4 min 05 s`, `3 h 12 min`
pub fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), s % 60.0),
        s => format!("{:.0} h {:02.0} min", (s / 3600.0).floor(), (s % 3600.0) / 60.0),
    }
}
