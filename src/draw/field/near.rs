//! Places with a number each, found by where they are.

/// Places in a plane or in space, in cells as wide as the largest distance that is asked for.
pub(super) struct Known<const N: usize> {
    /// Of the first cell.
    from: [f64; N],
    cell: f64,
    counts: [usize; N],
    cells: Vec<Vec<([f64; N], f64)>>,
}

/// Cells along an axis at most; what lies beyond the last is in the last.
const MOST_CELLS: f64 = 64.0;

impl<const N: usize> Known<N> {
    /// Within about these limits, for distances up to `reach`.
    pub fn new(limits: [[f64; 2]; N], reach: f64) -> Self {
        let counts = limits.map(|[low, high]| ((high - low) / reach).ceil().clamp(1.0, MOST_CELLS) as usize);
        Known {
            from: limits.map(|[low, _]| low),
            cell: reach,
            counts,
            cells: vec![Vec::new(); counts.iter().product()],
        }
    }

    fn cell(&self, at: [f64; N]) -> [usize; N] {
        std::array::from_fn(|k| (((at[k] - self.from[k]) / self.cell).max(0.0) as usize).min(self.counts[k] - 1))
    }

    fn index(&self, cell: [usize; N]) -> usize {
        cell.iter().zip(self.counts).fold(0, |index, (place, count)| index * count + place)
    }

    pub fn add(&mut self, at: [f64; N], number: f64) {
        let index = self.index(self.cell(at));
        self.cells[index].push((at, number));
    }

    /// Distances and numbers of all places in the cells around one.
    pub fn around(&self, at: [f64; N]) -> impl Iterator<Item = (f64, f64)> + '_ {
        let middle = self.cell(at);
        let shifted = move |number: usize| {
            let mut cell = middle;
            for (k, place) in cell.iter_mut().enumerate() {
                // One less, the same, one more.
                *place = (*place + number / 3usize.pow(k as u32) % 3).checked_sub(1)?;
            }
            cell.iter().zip(self.counts).all(|(place, count)| *place < count).then_some(cell)
        };
        let cells = (0..3usize.pow(N as u32)).filter_map(shifted);
        cells.flat_map(|cell| &self.cells[self.index(cell)]).map(move |(other, number)| {
            let square: f64 = (0..N).map(|k| (other[k] - at[k]).powi(2)).sum();
            (square.sqrt(), *number)
        })
    }

    /// Whether a place that counts is nearer than a radius, which is no more than a cell.
    pub fn is_near(&self, at: [f64; N], radius: f64, counts: impl Fn(f64) -> bool) -> bool {
        self.around(at).any(|(distance, number)| distance < radius && counts(number))
    }
}
