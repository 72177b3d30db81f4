//! A Parquet file of which only some ranges are in memory.

use super::thrift;
use crate::files;
use bytes::Bytes;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, Length};
use std::fs::File;
use std::io::{Cursor, Error, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is fetched at the end of a file in the hope that it holds the footer, and at least of any place.
const LEAST: u64 = 64 << 10;
/// Ranges nearer than this are fetched as one.
const GAP: u64 = 256 << 10;

/// Bytes of a file, wherever it lies.
pub trait ByteSource: Send + Sync {
    /// Its size.
    fn size(&self) -> u64;

    /// Some of its bytes; fewer, where it ends before.
    ///
    /// # Errors
    ///
    /// It cannot be read.
    fn read(&self, range: Range<u64>) -> std::io::Result<Vec<u8>>;
}

/// A file of the system.
pub(super) struct LocalFile {
    file: File,
    size: u64,
}

impl LocalFile {
    pub fn open(path: &Path) -> std::io::Result<LocalFile> {
        let file = files::open(path)?;
        let size = file.metadata()?.len();
        Ok(LocalFile { file, size })
    }
}

impl ByteSource for LocalFile {
    fn size(&self) -> u64 {
        self.size
    }

    fn read(&self, range: Range<u64>) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        (&self.file).seek(SeekFrom::Start(range.start))?;
        (&self.file).take(range.end.saturating_sub(range.start)).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// Pieces of a file, fetched as they are needed or before.
#[derive(Clone)]
pub(super) struct Ranges {
    source: Arc<dyn ByteSource>,
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    /// Where each begins, and its bytes.
    pieces: Vec<(u64, Bytes)>,
    failure: Option<Error>,
}

impl Ranges {
    pub fn new(source: Arc<dyn ByteSource>) -> Ranges {
        Ranges { source, state: Arc::default() }
    }

    /// What kept a range from being fetched.
    pub fn failure(&self) -> Option<Error> {
        self.state().failure.take()
    }

    /// Fetches some ranges, neighbours at once. What fails is told by [`Ranges::failure`].
    pub fn fetch(&self, mut wanted: Vec<Range<u64>>) {
        wanted.sort_by_key(|range| range.start);
        let mut joined: Vec<Range<u64>> = Vec::new();
        for range in wanted {
            match joined.last_mut() {
                Some(last) if range.start <= last.end.saturating_add(GAP) => last.end = last.end.max(range.end),
                _ => joined.push(range),
            }
        }
        let mut state = self.state();
        for range in joined {
            if self.add(&mut state, range).is_err() {
                return;
            }
        }
    }

    /// The last bytes of the file.
    pub fn end(&self, length: usize) -> Result<Bytes, ParquetError> {
        let start = self.source.size().checked_sub(length as u64);
        self.get_bytes(start.ok_or_else(|| ParquetError::EOF("it ends before".into()))?, length)
    }

    /// Bytes from a place on, at least `length` unless the file ends before.
    fn from(&self, start: u64, length: u64) -> Result<Bytes, ParquetError> {
        let size = self.source.size();
        let end = start.saturating_add(length).min(size);
        let mut state = self.state();
        let covers = |(at, bytes): &&(u64, Bytes)| *at <= start && end <= *at + bytes.len() as u64;
        if let Some((at, bytes)) = state.pieces.iter().find(covers) {
            return Ok(bytes.slice((start - at) as usize..));
        }
        // The footer comes before whatever ends the file.
        let is_end = end == size && length < LEAST;
        let from = if is_end { size.saturating_sub(LEAST) } else { start };
        let bytes = self.add(&mut state, from..end.max(from.saturating_add(LEAST)))?;
        let skipped = usize::try_from(start - from).unwrap_or(usize::MAX);
        if skipped > bytes.len() { Err(ParquetError::EOF("it ends before".into())) } else { Ok(bytes.slice(skipped..)) }
    }

    fn add(&self, state: &mut State, range: Range<u64>) -> Result<Bytes, ParquetError> {
        let end = range.end.min(self.source.size());
        if range.start > end {
            return Err(ParquetError::EOF("it ends before".into()));
        }
        match self.source.read(range.start..end) {
            Ok(bytes) => {
                let bytes = Bytes::from(bytes);
                state.pieces.push((range.start, bytes.clone()));
                Ok(bytes)
            }
            Err(error) => {
                let problem = ParquetError::General(error.to_string());
                state.failure = Some(error);
                Err(problem)
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Length for Ranges {
    fn len(&self) -> u64 {
        self.source.size()
    }
}

/// Bytes in memory. To read beyond their end is an error.
///
/// The crate takes no bytes at the end for success when it skips what it does not know. A list that says it has 124 million
/// entries is then skipped for nine seconds, in a file of a kilobyte.
pub(super) struct Piece(Cursor<Bytes>);

impl Read for Piece {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        match self.0.read(into)? {
            0 if !into.is_empty() => Err(ErrorKind::UnexpectedEof.into()),
            count => Ok(count),
        }
    }
}

impl ChunkReader for Ranges {
    type T = Piece;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        // Here begins a page. A column is fetched as a whole, so that the piece that holds a page's first byte holds the page.
        let bytes = self.from(start, 1)?;
        thrift::check_page_header(&bytes)
            .map_err(|reason| ParquetError::General(format!("in a page header, {reason}")))?;
        Ok(Piece(Cursor::new(bytes)))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        let bytes = self.from(start, length as u64)?;
        if bytes.len() < length { Err(ParquetError::EOF("it ends before".into())) } else { Ok(bytes.slice(..length)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_read_beyond_the_end() {
        let mut piece = Piece(Cursor::new(Bytes::from_static(b"abc")));
        let mut four = [0; 4];
        assert_eq!(piece.read(&mut four).unwrap(), 3);
        assert_eq!(piece.read(&mut []).unwrap(), 0);
        assert_eq!(piece.read(&mut four).unwrap_err().kind(), ErrorKind::UnexpectedEof);
    }
}
