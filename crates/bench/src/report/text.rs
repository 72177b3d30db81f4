//! Numbers and tables as the report writes them.

use rodsweep::draw::{TextTable, engineering};

/// `870 ns`, `1.24 µs`, three digits.
pub fn time(seconds: f64) -> String {
    let (number, unit) = match seconds {
        s if s.is_nan() => return "-".into(),
        s if s < 999.5e-9 => return format!("{:.0} ns", s * 1e9),
        s if s < 999.5e-6 => (s * 1e6, "µs"),
        s if s < 0.9995 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    format!("{} {unit}", three(number))
}

/// Three digits.
pub fn three(x: f64) -> String {
    match x {
        x if !x.is_finite() => "-".into(),
        x if x.abs() < 10.0 => format!("{x:.2}"),
        x if x.abs() < 100.0 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}

/// `12.4x`
pub fn ratio(x: f64) -> String {
    if x.is_finite() { format!("{}x", three(x)) } else { "-".into() }
}

pub fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.0} %", 100.0 * share) } else { "-".into() }
}

/// `3.1e-8`
pub fn error(x: f64) -> String {
    if x.is_nan() { "-".into() } else { engineering(x) }
}

/// A whole number; a dash where there is none.
pub fn whole(x: f64) -> String {
    if x.is_nan() { "-".into() } else { rodsweep::draw::count(x.max(0.0) as u64) }
}

/// A table in Markdown.
pub fn table<S: AsRef<str>>(headers: &[S], rows: &[Vec<String>]) -> String {
    let mut table = TextTable::new(headers.iter().map(AsRef::as_ref));
    rows.iter().for_each(|row| {
        table.row(row);
    });
    table.markdown()
}
