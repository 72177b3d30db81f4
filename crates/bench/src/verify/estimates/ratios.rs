//! Estimates over errors, and the rows whose error is above.

/// The truth must be so many times nearer to itself than a row to it, else the row's error is not told.
const SURE: f64 = 5.0;
/// Bins of the estimate over the error, by halves of a decade; the first is below one.
const BINS: usize = 16;

/// A row whose error is above its estimate.
#[derive(Clone, Debug)]
pub struct Beyond {
    pub scene: u64,
    pub sample: u64,
    pub tolerance: f64,
    pub column: String,
    pub error: f64,
    pub estimate: f64,
    pub status: &'static str,
}

/// Estimates over errors, of poses or of columns.
#[derive(Clone, Debug, Default)]
pub struct Ratios {
    pub rows: u64,
    /// Errors too small to be told apart from those of the truth: no estimate is below them.
    pub untold: u64,
    pub beyond: Vec<Beyond>,
    ratios: Vec<f32>,
    /// Errors above the tolerance that were not announced, and those that were.
    pub missed: u64,
    pub announced: u64,
}

impl Ratios {
    pub fn take(&mut self, row: Beyond, doubt: f64, tolerance: f64) {
        self.rows += 1;
        let is_within = row.error <= row.estimate + doubt;
        if is_within && row.error <= SURE * doubt {
            self.untold += 1;
            return;
        }
        if row.error > tolerance {
            if row.estimate > tolerance { self.announced += 1 } else { self.missed += 1 }
        }
        self.ratios.push((row.estimate / row.error) as f32);
        if !is_within {
            self.beyond.push(row);
        }
    }

    pub fn add(&mut self, other: Ratios) {
        self.rows += other.rows;
        self.untold += other.untold;
        self.missed += other.missed;
        self.announced += other.announced;
        self.ratios.extend(other.ratios);
        self.beyond.extend(other.beyond);
    }

    /// Estimate over error of the middle row.
    pub fn median(&self) -> f64 {
        let mut ratios = self.ratios.clone();
        ratios.sort_by(f32::total_cmp);
        ratios.get(ratios.len() / 2).map_or(f64::NAN, |ratio| f64::from(*ratio))
    }

    /// Error over estimate of the worst row.
    pub fn worst(&self) -> f64 {
        self.ratios.iter().map(|ratio| 1.0 / f64::from(*ratio)).fold(0.0, f64::max)
    }

    /// Rows by the estimate over the error, by halves of a decade from 1 on; first those below 1.
    pub fn histogram(&self) -> [u64; BINS] {
        let mut bins = [0; BINS];
        for ratio in &self.ratios {
            let bin = if *ratio < 1.0 { 0 } else { 1 + (2.0 * ratio.log10()) as usize };
            bins[bin.min(BINS - 1)] += 1;
        }
        bins
    }
}
