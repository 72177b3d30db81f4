//! What uncertain designs have in common: at how many of them the tip can be held at each point.

use super::lattice::WallLattice;
use crate::study::columns::Columns;
use crate::study::witness::WitnessCheck;
use crate::study::workspace::clopper_pearson;
use crate::table::{Column, Table};
use serde::Serialize;

/// Shares of designs whose common area is told.
const SHARES: [f64; 4] = [1.0, 0.95, 0.5, 0.0];

/// One design and its part of the wall.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactDesign {
    /// Values of what is uncertain: SI, or factors where several parameters keep their ratio.
    pub values: Vec<f64>,
    /// Of the wall where its tip can press (m²).
    pub area: f64,
}

/// At which points uncertain designs hold, the inputs of each design being its own.
#[derive(Clone, Debug)]
pub struct RobustContact {
    /// Names of what is uncertain.
    pub names: Vec<String>,
    /// Each design.
    pub designs: Vec<ContactDesign>,
    /// Of each point of the map, the designs that hold there.
    pub counts: Vec<u32>,
    /// Equilibria computed.
    pub solves: u64,
}

/// Account of a robust map.
#[derive(Clone, Debug, Serialize)]
pub struct RobustAccount {
    /// Names of what is uncertain.
    pub uncertain: Vec<String>,
    /// Number of designs.
    pub designs: usize,
    /// Share of the designs, and area of the wall where at least so many hold (m²): all, 95 %, 50 %, any.
    pub common: Vec<(f64, f64)>,
    /// Equilibria computed.
    pub solves: u64,
    /// Whether they were checked against the reference, in a sentence.
    pub checked: String,
}

impl RobustContact {
    /// Share of the designs that hold at each point.
    pub fn shares(&self) -> impl Iterator<Item = f64> {
        let designs = self.designs.len() as f64;
        self.counts.iter().map(move |count| f64::from(*count) / designs)
    }

    /// Its account; `lattice` is the map's.
    pub fn account(&self, lattice: &WallLattice) -> RobustAccount {
        let area = |share: f64| {
            let least = ((share * self.designs.len() as f64).ceil() as u32).max(1);
            let counts = self.counts.iter().zip(&lattice.areas);
            counts.filter(|(count, _)| **count >= least).map(|(_, area)| area).sum()
        };
        RobustAccount {
            uncertain: self.names.clone(),
            designs: self.designs.len(),
            common: SHARES.into_iter().map(|share| (share, area(share))).collect(),
            solves: self.solves,
            checked: WitnessCheck::default().sentence(),
        }
    }

    /// Beside the columns of a map: designs that hold at each point, their share and its bounds of 95 %.
    pub(super) fn columns(&self) -> Vec<Column> {
        let trials = self.designs.len() as u32;
        let bounds: Vec<[f64; 2]> = (0..=trials).map(|count| clopper_pearson(count, trials)).collect();
        let bound = |k: usize| self.counts.iter().map(|count| bounds[*count as usize][k]).collect::<Vec<f64>>();
        let mut columns = Columns::default();
        columns.counts("hold.designs", self.counts.iter().map(|count| u64::from(*count)));
        columns.numbers("hold.probability", "", self.shares());
        columns.numbers("hold.low", "", bound(0));
        columns.numbers("hold.high", "", bound(1));
        columns.finish().columns
    }

    /// One row a design: its values, and the area of the wall where its tip can press.
    pub fn table(&self) -> Table {
        let mut columns = Columns::default();
        columns.counts("design", 0..self.designs.len() as u64);
        for (k, name) in self.names.iter().enumerate() {
            columns.numbers(name.clone(), "", self.designs.iter().map(|design| design.values[k]));
        }
        columns.numbers("area", "m²", self.designs.iter().map(|design| design.area));
        columns.finish()
    }
}

impl RobustAccount {
    /// In one line.
    pub fn text(&self) -> String {
        let area = |k: usize| format!("{:.2} cm²", 1e4 * self.common[k].1);
        let [all, most, half] = [0, 1, 2].map(area);
        format!("of {} designs all hold on {all}, 95 % on {most}, half on {half}; {}", self.designs, self.checked)
    }
}
