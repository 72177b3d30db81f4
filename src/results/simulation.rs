//! Many workers in one process, against a store that answers after a while: requests are counted, workers die.
//!
//! `RODSWEEP_WORKERS=1000` makes it long, `RODSWEEP_CHUNKS` says how many chunks there are a worker; `benches/workers/run` writes
//! what it counts, beside what the formulas of the model say.

use super::claims::{Claims, Next};
use super::directory::{self, RunRecord};
use super::error::ResultsError;
use super::parts::{self, FileMetadata};
use super::store::{Entry, Store};
use super::workers::WorkerReport;
use crate::model::Status;
use crate::spec::Format;
use crate::table::parquet::Encoder;
use crate::table::{Column, Table};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Keys of one answer to a listing, as with S3.
const PAGE: usize = 1000;

/// By folder and name: what a file holds, and when it was written.
type Folders = BTreeMap<String, BTreeMap<String, File>>;
type File = (Vec<u8>, SystemTime);

/// A store in memory that takes `delay` for each request.
#[derive(Debug, Default)]
struct SlowStore {
    folders: Mutex<Folders>,
    delay: Duration,
    puts: AtomicU64,
    gets: AtomicU64,
    lists: AtomicU64,
    /// Claims that were taken.
    lost: AtomicU64,
    /// When somebody first found nothing free, and the requests until then.
    end: OnceLock<(Instant, [u64; 4])>,
}

impl SlowStore {
    /// Puts, gets, lists, claims that were lost.
    fn counts(&self) -> [u64; 4] {
        [&self.puts, &self.gets, &self.lists, &self.lost].map(|count| count.load(Ordering::Relaxed))
    }

    fn ask(&self, counter: &AtomicU64, requests: u64) -> MutexGuard<'_, Folders> {
        counter.fetch_add(requests, Ordering::Relaxed);
        std::thread::sleep(self.delay * requests as u32);
        self.folders.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Folder and name within it.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('/').unwrap_or(("", name))
}

fn find<'a>(folders: &'a Folders, name: &str) -> Option<&'a File> {
    let (folder, name) = split(name);
    folders.get(folder)?.get(name)
}

/// What was there before.
fn insert(folders: &mut Folders, name: &str, bytes: &[u8]) -> Option<File> {
    let (folder, name) = split(name);
    folders.entry(folder.into()).or_default().insert(name.into(), (bytes.into(), SystemTime::now()))
}

fn remove(folders: &mut Folders, name: &str) -> Option<File> {
    let (folder, name) = split(name);
    folders.get_mut(folder)?.remove(name)
}

impl Store for SlowStore {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError> {
        let mut folders = self.ask(&self.puts, 1);
        let is_free = find(&folders, name).is_none();
        if is_free {
            insert(&mut folders, name, bytes);
        } else if name.starts_with("claims/") {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        Ok(is_free)
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), ResultsError> {
        insert(&mut self.ask(&self.puts, 1), name, bytes);
        Ok(())
    }

    fn get(&self, name: &str) -> Result<Option<Vec<u8>>, ResultsError> {
        Ok(find(&self.ask(&self.gets, 1), name).map(|(bytes, _)| bytes.clone()))
    }

    fn get_range(&self, name: &str, range: Range<u64>) -> Result<Vec<u8>, ResultsError> {
        let bytes = self.get(name)?.unwrap_or_default();
        let end = bytes.len().min(range.end as usize);
        Ok(bytes[end.min(range.start as usize)..end].into())
    }

    fn head(&self, name: &str) -> Result<Option<Entry>, ResultsError> {
        Ok(find(&self.ask(&self.gets, 1), name).map(|file| entry(split(name).1, file)))
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, ResultsError> {
        let inside = |folders: &Folders| -> Vec<Entry> {
            folders.get(folder).into_iter().flatten().map(|(name, file)| entry(name, file)).collect()
        };
        let found = inside(&self.ask(&self.lists, 1));
        let more = found.len() / PAGE;
        drop(self.ask(&self.lists, more as u64));
        Ok(found)
    }

    fn remove(&self, name: &str) -> Result<(), ResultsError> {
        remove(&mut self.ask(&self.puts, 1), name);
        Ok(())
    }

    fn rename(&self, from: &str, to: &str) -> Result<bool, ResultsError> {
        let mut folders = self.ask(&self.puts, 2);
        if let Some((bytes, _)) = remove(&mut folders, from) {
            insert(&mut folders, to, &bytes);
        }
        Ok(true)
    }

    fn prepare(&self) -> Result<(), ResultsError> {
        Ok(())
    }

    fn is_remote(&self) -> bool {
        true
    }

    fn place(&self) -> PathBuf {
        "simulated".into()
    }

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }
}

fn entry(name: &str, (bytes, modified): &File) -> Entry {
    Entry { name: name.into(), size: bytes.len() as u64, modified: *modified, is_file: true }
}

fn record(chunks: u64) -> RunRecord {
    let text = format!(
        r#"{{"run_id":"simulated","version":"","sample_count":{chunks},"chunk":1,"format":"parquet","precision":"f64",
            "input":"","columns":""}}"#
    );
    serde_json::from_str(&text).expect("a record")
}

fn rows(chunk: u64) -> Table {
    Table { columns: vec![Column::new("sample", "", vec![chunk]), Column::new("status", "", vec![Status::Ok])] }
}

/// What one worker does: chunk after chunk, until all are there, or until it dies.
fn work(
    store: &Arc<SlowStore>,
    record: &RunRecord,
    chunk_time: Duration,
    silence: Duration,
    dies_after: u64,
) -> Worked {
    let metadata = FileMetadata {
        run_id: "simulated".into(),
        engine: "none".into(),
        method: None,
        sweep: String::new(),
        seed: 0,
        verdict: String::new(),
    };
    let mut claims = Claims::join(store.clone(), record, WorkerReport::new("none".into()), silence).expect("joins");
    let (mut worked, mut encoder, beat) = (Worked::default(), Encoder::default(), claims.beat());
    loop {
        let begin = Instant::now();
        let next = claims.next().expect("an answer");
        match next {
            Next::Done => break,
            Next::Wait(pause) => {
                store.end.get_or_init(|| (Instant::now(), store.counts()));
                worked.waited += pause;
                std::thread::sleep(pause);
            }
            Next::Chunk(_) if worked.chunks == dies_after => {
                beat.die();
                return worked;
            }
            Next::Chunk(chunk) => {
                worked.claiming += begin.elapsed();
                std::thread::sleep(chunk_time);
                let name = record.part_files().name(chunk);
                let (_, is_new) =
                    parts::write_part(store.as_ref(), &name, &rows(chunk), Format::Parquet, &metadata, &mut encoder)
                        .expect("a part");
                worked.chunks += 1;
                worked.twice += u64::from(!is_new);
                beat.add(1, 0);
            }
        }
    }
    if claims.state().finishes.load(Ordering::Relaxed) {
        Claims::done(store.as_ref()).expect("done");
        worked.finished = 1;
    }
    worked
}

#[derive(Clone, Copy, Default)]
struct Worked {
    chunks: u64,
    twice: u64,
    finished: u64,
    claiming: Duration,
    waited: Duration,
}

/// What one number of the environment says.
fn given(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// Requests a second of the model, while there is work: signs of life, parts, claims.
fn model(workers: u64, chunks: u64, chunk_time: Duration, silence: Duration) -> [f64; 3] {
    let unit = chunks.div_ceil(4096).clamp(1, 64);
    let (workers, time) = (workers as f64, chunk_time.as_secs_f64());
    [workers / (silence.as_secs_f64() / 6.0), workers / time, workers / (time * unit as f64)]
}

#[test]
fn many_workers_share_chunks_and_outlive_some() {
    let (workers, each, chunk_time, silence, delay) = match given("RODSWEEP_WORKERS") {
        Some(workers) => {
            let each = given("RODSWEEP_CHUNKS").unwrap_or(12);
            (workers, each, Duration::from_secs(5), Duration::from_secs(60), Duration::from_millis(30))
        }
        None => (24, 6, Duration::from_millis(40), Duration::from_millis(1500), Duration::from_millis(1)),
    };
    let chunks = workers * each;
    let (store, record) = (Arc::new(SlowStore { delay, ..SlowStore::default() }), record(chunks));
    let begin = Instant::now();
    let worked: Vec<Worked> = std::thread::scope(|scope| {
        let worker = |number: u64| {
            // One of twelve dies.
            let dies_after = if number % 12 == 5 { 2 } else { u64::MAX };
            let (store, record) = (&store, &record);
            scope.spawn(move || work(store, record, chunk_time, silence, dies_after))
        };
        let threads: Vec<_> = (0..workers).map(worker).collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    });
    let (all, seconds) = (store.counts(), begin.elapsed().as_secs_f64());
    let found = directory::parts(store.as_ref(), &record).expect("parts");
    assert_eq!((found.sound.len() as u64, found.damaged.len()), (chunks, 0));
    let sum = |of: &dyn Fn(&Worked) -> u64| worked.iter().map(of).sum::<u64>();
    // A machine under load may keep a living worker silent for long: then a chunk is solved twice, and put once.
    assert!(sum(&|worked| worked.finished) >= 1, "somebody ends the run");
    assert_eq!(sum(&|worked| worked.chunks), chunks + sum(&|worked| worked.twice));
    let total = |of: &dyn Fn(&Worked) -> Duration| worked.iter().map(of).sum::<Duration>().as_secs_f64();
    let busy = chunks as f64 * chunk_time.as_secs_f64();
    println!(
        "{workers} workers, {chunks} chunks of {chunk_time:?}, delay {delay:?}: {seconds:.1} s; claiming {:.2} % of solving, \
         waiting at the end {:.1} s a worker; {} chunks solved twice",
        100.0 * total(&|worked| worked.claiming) / busy,
        total(&|worked| worked.waited) / workers as f64,
        sum(&|worked| worked.twice),
    );
    let (end, before) = store.end.get().copied().unwrap_or((Instant::now(), all));
    let working = end.duration_since(begin).as_secs_f64();
    let after = std::array::from_fn(|k| all[k] - before[k]);
    for (when, counts, seconds) in [("while there is work", before, working), ("at the end", after, seconds - working)]
    {
        let [puts, gets, lists, lost] = counts;
        println!(
            "of {workers} workers, {when} ({seconds:.1} s): {puts} puts ({lost} of claims that were taken), {gets} gets, {lists} \
             lists, {:.0} a second",
            (puts + gets + lists) as f64 / seconds
        );
    }
    let [signs, parts, claims] = model(workers, chunks, chunk_time, silence);
    println!("the model of {workers} workers, while there is work: {signs:.0} + {parts:.0} + {claims:.0} a second");
}

/// A worker and what it asks of the store, after it has joined a run of so many chunks.
fn joined(chunks: u64) -> (Arc<SlowStore>, Claims) {
    let store = Arc::new(SlowStore::default());
    let report = WorkerReport::new("none".into());
    let claims = Claims::join(store.clone(), &record(chunks), report, Duration::from_secs(60)).expect("joins");
    (store, claims)
}

#[test]
fn a_lost_race_is_not_run_with_the_neighbours() {
    let (store, mut claims) = joined(4000);
    let Next::Chunk(first) = claims.next().expect("an answer") else { panic!("nothing is free") };
    for unit in 1..=200 {
        store.create(&format!("claims/{:010}-0", (first + unit) % 4000), b"another").expect("a claim");
    }
    let before = store.counts();
    let Next::Chunk(second) = claims.next().expect("an answer") else { panic!("nothing is free") };
    let after = store.counts();
    // Of twenty units one is taken: eight losses in a row would be a wonder.
    assert!((1..8).contains(&(after[3] - before[3])), "{} claims are lost", after[3] - before[3]);
    assert_eq!(after[2], before[2], "nothing is listed");
    assert!((second + 4000 - first) % 4000 > 200);
}

#[test]
fn the_living_share_out_whose_claims_they_ask_for() {
    const UNITS: u64 = 600;
    let (store, mut claims) = joined(UNITS);
    let id = |number: u64| format!("{number:032x}");
    for unit in 0..UNITS {
        store.create(&format!("claims/{unit:010}-0"), id(unit % 100).as_bytes()).expect("a claim");
    }
    // Of the hundred that have claimed, the first is dead.
    (1..100).for_each(|number| store.put(&format!("workers/{}.json", id(number)), b"{}").expect("a sign"));
    let (mut looks, before) = (0, store.counts());
    let taken = loop {
        match claims.next().expect("an answer") {
            Next::Chunk(chunk) => break chunk,
            Next::Wait(_) => claims.may_look(),
            Next::Done => panic!("there are no parts"),
        }
        looks += 1;
        let asked = store.counts()[1] - before[1];
        // Six a unit and worker, twice, and four; one more to see whether all is done.
        assert!(asked <= looks * 17, "{asked} in {looks} looks");
    };
    assert_eq!(taken % 100, 0, "only what the dead one had");
    assert!(looks <= UNITS.div_ceil(16), "{looks} looks");
}

#[test]
fn very_many_workers_look_seldom() {
    let (store, mut claims) = joined(4000);
    for unit in 0..4000 {
        store.create(&format!("claims/{unit:010}-0"), b"another").expect("a claim");
    }
    (0..2999).for_each(|number| store.put(&format!("workers/{number:032x}.json"), b"{}").expect("a sign"));
    claims.may_look();
    let next = claims.next().expect("an answer");
    // Nine requests a look of three thousand workers, 500 a second; claims of nobody are free after the first look.
    assert!(matches!(next, Next::Chunk(_)), "{next:?}");
    assert_eq!(claims.looks_every(), Duration::from_secs(54));
    let (_, alone) = joined(4000);
    assert!(alone.looks_every() < Duration::from_secs(10));
}
