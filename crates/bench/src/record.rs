//! What a benchmark measured: one flat table, a row a measurement, as `raw.csv` keeps it.

use std::fmt::Write;

/// What is wrong with a table of records.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// Another version wrote it, or it is no such table.
    #[error("line 1 is not the header of this version's table; measure again")]
    Header,
    /// A row is too short or too long.
    #[error("line {line}: {found} cells, {expected} expected")]
    Cells {
        /// From 1.
        line: usize,
        /// Cells in the row.
        found: usize,
        /// Columns of the table.
        expected: usize,
    },
    /// A cell that should hold a number does not.
    #[error("line {line}: `{column}` is \"{cell}\", no number")]
    Number {
        /// From 1.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// What stands there.
        cell: String,
    },
}

/// Median, 95 % and worst of the samples.
pub type Errors = [f64; 3];

/// Where no number belongs: an empty cell.
pub const NONE: f64 = f64::NAN;

/// One measurement. What a part has no use for stays empty or NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Which part of the report it belongs to.
    pub part: String,
    /// Scene, feature, stage or hard case.
    pub case: String,
    /// What was done; the verdict on a hard case.
    pub work: String,
    /// Instruction set, GPU or method of the literature.
    pub engine: String,
    /// Its arithmetic.
    pub precision: String,
    /// Integration method.
    pub method: String,
    /// The status of a hard case.
    pub status: String,
    /// Steps over the rod, or what a figure has on its x axis.
    pub size: f64,
    /// Samples with a known answer.
    pub samples: f64,
    /// Of these, without a success.
    pub failed: f64,
    /// Of the successes, with the tip on another branch.
    pub elsewhere: f64,
    /// Tip position over length.
    pub tip: Errors,
    /// The worst column of the Jacobian, relative.
    pub column: Errors,
    /// The Jacobian's norm, relative, parameters in natural units.
    pub norm: Errors,
    /// A sample's error estimate; the median over samples.
    pub estimate: f64,
    /// Successes whose error is within their estimate.
    pub bounded: f64,
    /// For one sample, the median of the repeats (s).
    pub seconds: f64,
    /// The same, the least (s).
    pub least: f64,
    /// (median - least) / least
    pub spread: f64,
    /// To make the engine and solve for the first time, beyond what a solve takes (s).
    pub setup: f64,
    /// Operations on numbers for one sample, a fused one being two.
    pub operations: f64,
    /// Passes over the rod for one sample, on average.
    pub passes: f64,
}

const TEXTS: [&str; 7] = ["part", "case", "work", "engine", "precision", "method", "status"];
const NUMBERS: [&str; 21] = [
    "size",
    "samples",
    "failed",
    "elsewhere",
    "tip_median",
    "tip_p95",
    "tip_worst",
    "column_median",
    "column_p95",
    "column_worst",
    "norm_median",
    "norm_p95",
    "norm_worst",
    "estimate",
    "bounded",
    "seconds",
    "least",
    "spread",
    "setup",
    "operations",
    "passes",
];

impl Default for Record {
    fn default() -> Self {
        Record::from_cells(std::array::from_fn(|_| String::new()), [NONE; NUMBERS.len()])
    }
}

impl Record {
    /// A record of a part and a case, the rest empty.
    pub fn new(part: &str, case: impl Into<String>) -> Record {
        Record { part: part.into(), case: case.into(), ..Record::default() }
    }

    /// Engine with its precision, as legends and tables name it.
    pub fn engine_name(&self) -> String {
        format!("{} {}", self.engine, self.precision).trim().to_owned()
    }

    fn from_cells(texts: [String; TEXTS.len()], numbers: [f64; NUMBERS.len()]) -> Record {
        let [part, case, work, engine, precision, method, status] = texts;
        let three = |first: usize| [numbers[first], numbers[first + 1], numbers[first + 2]];
        Record {
            part,
            case,
            work,
            engine,
            precision,
            method,
            status,
            size: numbers[0],
            samples: numbers[1],
            failed: numbers[2],
            elsewhere: numbers[3],
            tip: three(4),
            column: three(7),
            norm: three(10),
            estimate: numbers[13],
            bounded: numbers[14],
            seconds: numbers[15],
            least: numbers[16],
            spread: numbers[17],
            setup: numbers[18],
            operations: numbers[19],
            passes: numbers[20],
        }
    }

    fn texts(&self) -> [&str; TEXTS.len()] {
        [&self.part, &self.case, &self.work, &self.engine, &self.precision, &self.method, &self.status]
    }

    fn numbers(&self) -> [f64; NUMBERS.len()] {
        let [[t0, t1, t2], [c0, c1, c2], [n0, n1, n2]] = [self.tip, self.column, self.norm];
        [
            self.size,
            self.samples,
            self.failed,
            self.elsewhere,
            t0,
            t1,
            t2,
            c0,
            c1,
            c2,
            n0,
            n1,
            n2,
            self.estimate,
            self.bounded,
            self.seconds,
            self.least,
            self.spread,
            self.setup,
            self.operations,
            self.passes,
        ]
    }
}

/// The table as CSV, five digits a number.
pub fn to_csv(records: &[Record]) -> String {
    let mut text = format!("{},{}\n", TEXTS.join(","), NUMBERS.join(","));
    for record in records {
        let cells = record.texts().into_iter().map(|cell| match cell {
            cell if cell.contains([',', '"', '\n']) => format!("\"{}\"", cell.replace('"', "\"\"")),
            cell => cell.to_owned(),
        });
        text += &cells.collect::<Vec<_>>().join(",");
        for number in record.numbers() {
            let _ = match number {
                x if x.is_nan() => write!(text, ","),
                x if x.fract() == 0.0 && x.abs() < 1e6 => write!(text, ",{x}"),
                x => write!(text, ",{x:.4e}"),
            };
        }
        text += "\n";
    }
    text
}

/// Reads what [`to_csv`] wrote.
///
/// # Errors
///
/// Another header, or a row that cannot be read.
pub fn from_csv(text: &str) -> Result<Vec<Record>, RecordError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    let header = format!("{},{}", TEXTS.join(","), NUMBERS.join(","));
    match lines.next() {
        Some((_, first)) if first == header => {}
        _ => return Err(RecordError::Header),
    }
    lines.map(|(number, line)| from_line(number, line)).collect()
}

fn from_line(line: usize, text: &str) -> Result<Record, RecordError> {
    let cells = split(text);
    let expected = TEXTS.len() + NUMBERS.len();
    if cells.len() != expected {
        return Err(RecordError::Cells { line, found: cells.len(), expected });
    }
    let texts = std::array::from_fn(|k| cells[k].clone());
    let mut numbers = [NONE; NUMBERS.len()];
    for ((number, cell), column) in numbers.iter_mut().zip(&cells[TEXTS.len()..]).zip(NUMBERS) {
        if !cell.is_empty() {
            *number = cell.parse().map_err(|_| RecordError::Number { line, column, cell: cell.clone() })?;
        }
    }
    Ok(Record::from_cells(texts, numbers))
}

/// Cells of a line; in quotes a comma is a letter and two quotes are one.
fn split(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                cells.last_mut().into_iter().for_each(|cell| cell.push('"'));
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            letter => cells.last_mut().into_iter().for_each(|cell| cell.push(letter)),
        }
    }
    cells
}
