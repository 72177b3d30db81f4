//! How far estimates lie above errors, as a figure.

use super::ratios::Ratios;
use super::{Account, Estimates};
use crate::error::BenchError;
use crate::files::create_directory;
use rodsweep::draw::{AxisLabel, Colour, Curves, Marker, Panel, Series, Sheet, write_all};
use std::path::{Path, PathBuf};

/// Names of the figure's files.
const FILES: [&str; 2] = ["estimates.png", "estimates.svg"];

impl Estimates {
    /// Draws how often an estimate is how many times the error, for poses and for columns, into a directory; returns the files.
    ///
    /// # Errors
    ///
    /// Nothing to draw, or files that cannot be written.
    pub fn write_figure(&self, out: &Path) -> Result<Vec<PathBuf>, BenchError> {
        create_directory(out)?;
        let paths: Vec<PathBuf> = FILES.iter().map(|file| out.join(file)).collect();
        let poses = self.panel("poses", |account| &account.poses);
        let columns = self.panel("columns of the Jacobian", |account| &account.columns);
        let panels: Vec<&dyn Panel> = vec![&poses, &columns];
        write_all(&Sheet { panels, columns: 2 }, &paths)?;
        Ok(paths)
    }

    fn panel(&self, title: &str, of: impl Fn(&Account) -> &Ratios) -> Curves {
        let mut series = Vec::new();
        let mut most = 0.0f64;
        for ((account, setup), marker) in self.accounts.iter().zip(self.setups).zip(Marker::ALL) {
            let histogram = of(account).histogram();
            let rows = histogram.iter().sum::<u64>().max(1) as f64;
            // The middle of each half of a decade; the first holds what is below 1.
            let share = |(bin, n): (usize, &u64)| [10f64.powf(0.5 * bin as f64 - 0.25), 100.0 * *n as f64 / rows];
            let points: Vec<[f64; 2]> = histogram.iter().enumerate().map(share).collect();
            most = points.iter().fold(most, |most, point| most.max(point[1]));
            series.push(Series::line(setup.name, points).marker(marker));
        }
        series.insert(0, Series::line("", vec![[1.0, 0.0], [1.0, most]]).colour(Colour::MUTED).dashed());
        Curves {
            title: title.into(),
            x: AxisLabel::logarithmic("estimate over true error", ""),
            y: AxisLabel::linear("rows in half a decade", "%"),
            series,
        }
    }
}
