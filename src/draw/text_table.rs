//! Tables: aligned plain text for the terminal, Markdown for reports.

use std::fmt;

/// Rows of words and numbers under headers. Columns that hold only numbers are aligned on the right.
#[derive(Clone, Debug, PartialEq)]
pub struct TextTable {
    headers: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl TextTable {
    /// A table without rows.
    pub fn new<S: Into<String>>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { headers: headers.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row; missing cells stay empty, surplus cells get a column without header.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    /// Whether no row has been added.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The same table in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule = format!("|{}\n", "---|".repeat(self.headers.len()));
        line(&self.headers) + &rule + &self.rows.iter().map(|row| line(row)).collect::<String>()
    }
}

impl fmt::Display for TextTable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0).max(self.headers.len());
        let cell = |row: &Vec<String>, column: usize| row.get(column).cloned().unwrap_or_default();
        let lines: Vec<&Vec<String>> = std::iter::once(&self.headers).chain(&self.rows).collect();
        let widths: Vec<usize> =
            (0..columns).map(|k| lines.iter().map(|line| cell(line, k).chars().count()).max().unwrap_or(0)).collect();
        let right: Vec<bool> = (0..columns)
            .map(|k| {
                let cells: Vec<String> = self.rows.iter().map(|row| cell(row, k)).collect();
                cells.iter().all(|cell| is_number(cell)) && cells.iter().any(|cell| cell.contains(char::is_numeric))
            })
            .collect();
        for (index, line) in lines.into_iter().enumerate() {
            let mut out = String::new();
            for k in 0..columns {
                let width = widths[k];
                let gap = if k == 0 { "" } else { "  " };
                let text = cell(line, k);
                out += &if right[k] { format!("{gap}{text:>width$}") } else { format!("{gap}{text:<width$}") };
            }
            writeln!(f, "{}", out.trim_end())?;
            if index == 0 {
                let rule: Vec<String> = widths.iter().map(|width| "-".repeat(*width)).collect();
                writeln!(f, "{}", rule.join("  "))?;
            }
        }
        Ok(())
    }
}

/// Numbers, with a unit attached or not, and the words that stand in their place.
fn is_number(cell: &str) -> bool {
    matches!(cell, "" | "-" | "nan" | "inf" | "-inf" | "n/a")
        || cell.trim_start_matches(['-', '+', '<', '>', '≤', '≥', ' ']).starts_with(|c: char| c.is_ascii_digit())
}

/// An error or a residual with two significant digits: `3.1e-8`.
pub fn engineering(x: f64) -> String {
    match x {
        x if x.is_nan() => "nan".into(),
        x if x.is_infinite() => {
            if x > 0.0 {
                "inf".into()
            } else {
                "-inf".into()
            }
        }
        0.0 => "0".into(),
        x => format!("{x:.1e}"),
    }
}

/// A count in groups of three digits: `226,981`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}
