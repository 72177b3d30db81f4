//! Chunks as they come, listed or claimed, shared out over batches.

use super::error::SweepError;
use super::options::RunOptions;
use crate::results::RunRecord;
use crate::results::claims::{Claims, Next};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a worker that waits for others does not look whether it is to end.
const NAP: Duration = Duration::from_millis(20);

/// Consecutive samples of one chunk within a batch.
#[derive(Clone, Copy)]
pub(crate) struct Piece {
    pub chunk: u64,
    pub start: u64,
    pub len: u64,
    pub is_last: bool,
}

/// Which chunks there are to be solved.
pub(crate) enum Chunks<'a> {
    /// These.
    Listed(Box<dyn Iterator<Item = u64> + Send + 'a>),
    /// Those that this worker can claim, until every part is there.
    Claimed(Box<Claims>),
}

/// The pieces of batch after batch: a batch holds several chunks or a piece of one.
pub(crate) struct Jobs<'a> {
    record: &'a RunRecord,
    chunks: Chunks<'a>,
    batch_size: u64,
    options: &'a RunOptions<'a>,
    /// The other stages have ended.
    is_over: &'a AtomicBool,
    /// What the last batch has left of its last chunk.
    rest: Option<Piece>,
}

impl<'a> Jobs<'a> {
    pub fn new(
        record: &'a RunRecord,
        chunks: Chunks<'a>,
        batch_size: u64,
        options: &'a RunOptions<'a>,
        is_over: &'a AtomicBool,
    ) -> Jobs<'a> {
        Jobs { record, chunks, batch_size, options, is_over, rest: None }
    }

    /// What comes next of a chunk; `None` for now, or for good if the second value says so.
    fn next_chunk(&mut self) -> Result<(Option<Piece>, Option<Duration>), SweepError> {
        if let Some(rest) = self.rest.take() {
            return Ok((Some(rest), None));
        }
        if self.options.is_draining() {
            return Ok((None, None));
        }
        let next = match &mut self.chunks {
            Chunks::Listed(chunks) => chunks.next().map_or(Next::Done, Next::Chunk),
            Chunks::Claimed(claims) => claims.next()?,
        };
        Ok(match next {
            Next::Chunk(chunk) => {
                let (start, len) = self.record.chunk_range(chunk);
                (Some(Piece { chunk, start, len, is_last: true }), None)
            }
            Next::Wait(pause) => (None, Some(pause)),
            Next::Done => (None, None),
        })
    }

    /// Whether to take another chunk costs nothing. What a batch holds is claimed at once: others could solve the rest.
    fn has_ready(&self) -> bool {
        match &self.chunks {
            Chunks::Listed(_) => true,
            Chunks::Claimed(claims) => claims.has_ready(),
        }
    }

    fn goes_on(&self) -> bool {
        !self.options.is_interrupted() && !self.is_over.load(Ordering::Relaxed)
    }

    /// The next batch; `None`: there is none.
    fn next_job(&mut self) -> Result<Option<Vec<Piece>>, SweepError> {
        let (mut job, mut room) = (Vec::new(), self.batch_size);
        while room > 0 && self.goes_on() {
            match self.next_chunk()? {
                (Some(piece), _) if piece.len > room => {
                    job.push(Piece { len: room, is_last: false, ..piece });
                    self.rest = Some(Piece { start: piece.start + room, len: piece.len - room, ..piece });
                    room = 0;
                }
                (Some(piece), _) => {
                    job.push(piece);
                    room -= piece.len;
                    if !self.has_ready() {
                        break;
                    }
                }
                // What is there need not wait for more.
                (None, Some(_)) if !job.is_empty() => break,
                (None, Some(pause)) => {
                    let begin = Instant::now();
                    while begin.elapsed() < pause && self.goes_on() && !self.options.is_draining() {
                        std::thread::sleep(NAP.min(pause));
                    }
                }
                (None, None) => break,
            }
        }
        Ok((!job.is_empty()).then_some(job))
    }
}

impl Iterator for Jobs<'_> {
    type Item = Result<Vec<Piece>, SweepError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_job().transpose()
    }
}
