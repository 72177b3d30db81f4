//! Chunks that are left to be solved: counted and gone through, never listed, since a sweep may have very many.

use crate::results::RunRecord;
use crate::spec::Shard;
use std::collections::BTreeSet;

/// Chunks of a shard that are not there yet.
#[derive(Clone, Copy)]
pub(crate) struct Missing<'a> {
    record: &'a RunRecord,
    shard: Shard,
    done: &'a BTreeSet<u64>,
}

impl<'a> Missing<'a> {
    pub fn new(record: &'a RunRecord, shard: Shard, done: &'a BTreeSet<u64>) -> Missing<'a> {
        Missing { record, shard, done }
    }

    /// In order.
    pub fn chunks(self) -> impl Iterator<Item = u64> + Send + 'a {
        let Missing { record, shard, done } = self;
        let step = usize::try_from(shard.count).unwrap_or(usize::MAX);
        (shard.index - 1..record.chunk_count()).step_by(step).filter(move |chunk| !done.contains(chunk))
    }

    /// Samples of the whole shard.
    pub fn samples_of_shard(self) -> u64 {
        self.record.samples_of(self.shard)
    }

    /// Samples of the shard that are there.
    pub fn samples_done(self) -> u64 {
        self.done.iter().filter(|chunk| self.shard.owns(**chunk)).map(|chunk| self.size(*chunk)).sum()
    }

    fn size(self, chunk: u64) -> u64 {
        self.record.chunk_range(chunk).1
    }
}

#[cfg(test)]
mod tests {
    use super::Missing;
    use crate::results::RunRecord;
    use crate::spec::Shard;
    use std::collections::BTreeSet;

    fn record(sample_count: u64, chunk: u64) -> RunRecord {
        let text = format!(
            r#"{{"run_id":"","version":"","sample_count":{sample_count},"chunk":{chunk},"format":"parquet",
                "precision":"f64","input":"","columns":""}}"#
        );
        serde_json::from_str(&text).expect("a record")
    }

    #[test]
    fn samples_are_counted_as_they_would_be_listed() {
        for (samples, chunk) in [(1, 10), (10, 10), (11, 10), (95, 10), (100, 7)] {
            let record = record(samples, chunk);
            for shard in ["1/1", "1/2", "2/2", "3/3", "4/16", "16/16"].map(|text| Shard::parse(text).expect("a shard"))
            {
                for done in [BTreeSet::new(), BTreeSet::from([0, 1, 3]), (0..record.chunk_count()).collect()] {
                    let missing = Missing::new(&record, shard, &done);
                    let owned: Vec<u64> = (0..record.chunk_count()).filter(|chunk| shard.owns(*chunk)).collect();
                    let size = |chunks: &[u64]| chunks.iter().map(|chunk| record.chunk_range(*chunk).1).sum::<u64>();
                    assert_eq!(missing.samples_of_shard(), size(&owned), "{samples} {chunk} {shard}");
                    let left: Vec<u64> = owned.into_iter().filter(|chunk| !done.contains(chunk)).collect();
                    assert_eq!(missing.chunks().collect::<Vec<_>>(), left);
                    assert_eq!(missing.samples_done() + size(&left), missing.samples_of_shard());
                }
            }
        }
    }
}
