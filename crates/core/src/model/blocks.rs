//! Array of structures of arrays: samples in blocks of `BLOCK`, each block column by column.

use std::ops::Range;

/// Samples in one block. A multiple of every SIMD width and of the GPU workgroup size.
pub const BLOCK: usize = 256;

/// A table of `sample_count` rows and `column_count` columns, stored block by block, so that one thread owns one
/// block and neighbouring samples of a column lie side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks<T> {
    column_count: usize,
    sample_count: usize,
    data: Vec<T>,
}

impl<T: Copy + Default> Blocks<T> {
    /// A table of default values.
    pub fn new(column_count: usize, sample_count: usize) -> Self {
        let data = vec![T::default(); sample_count.div_ceil(BLOCK) * BLOCK * column_count];
        Self { column_count, sample_count, data }
    }

    /// Another shape in the same memory; values are left over from before.
    pub fn reuse(&mut self, column_count: usize, sample_count: usize) {
        self.data.resize(sample_count.div_ceil(BLOCK) * BLOCK * column_count, T::default());
        (self.column_count, self.sample_count) = (column_count, sample_count);
    }

    /// Numbers of one sample.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// Rows, without the padding of the last block.
    pub fn sample_count(&self) -> usize {
        self.sample_count
    }

    /// Position of an element in the flat data.
    pub fn index(&self, sample: usize, column: usize) -> usize {
        debug_assert!(sample < self.sample_count && column < self.column_count);
        (sample / BLOCK) * self.block_len() + column * BLOCK + sample % BLOCK
    }

    /// Element of a sample in a column; both must lie in the table.
    pub fn get(&self, sample: usize, column: usize) -> T {
        self.data[self.index(sample, column)]
    }

    /// Replaces an element; both must lie in the table.
    pub fn set(&mut self, sample: usize, column: usize, value: T) {
        let index = self.index(sample, column);
        self.data[index] = value;
    }

    /// Elements in one block: `BLOCK x columns`.
    pub fn block_len(&self) -> usize {
        BLOCK * self.column_count
    }

    /// The whole flat data, padding of the last block included.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// The same, for changes.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// One column over a range of samples, as one slice for each block.
    pub fn runs(&self, column: usize, range: Range<usize>) -> impl Iterator<Item = &[T]> + '_ {
        let mut start = range.start;
        std::iter::from_fn(move || {
            let end = range.end.min((start / BLOCK + 1) * BLOCK);
            let len = end.checked_sub(start).filter(|len| *len > 0)?;
            let first = self.index(start, column);
            start = end;
            Some(&self.data[first..first + len])
        })
    }

    /// One column over all samples.
    pub fn column(&self, column: usize) -> impl Iterator<Item = T> + '_ {
        (0..self.sample_count).map(move |sample| self.get(sample, column))
    }
}
