//! Long work on a thread of its own, without the GIL, while Python listens for Ctrl-C.

use super::failure::{Failure, Kind};
use pyo3::prelude::*;
use rodsweep::sweep::Progress;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How often Python is asked whether Ctrl-C was pressed.
const LISTEN: Duration = Duration::from_millis(50);
/// How long interrupted work is waited for. What takes longer ends unseen, at its next batch.
const GRACE: Duration = Duration::from_millis(100);

/// What work tells on its way.
pub enum Told {
    /// How far a sweep is.
    Progress(Progress),
    /// What a study is at, in words.
    Stage(String),
    /// What the user should know.
    Warning(String),
}

/// The line between the work and Python.
#[derive(Clone)]
pub struct Line {
    /// Ends the work between batches.
    pub stop: Arc<AtomicBool>,
    tell: Sender<Told>,
}

impl Line {
    /// Tells something.
    pub fn tell(&self, told: Told) {
        // Nobody listens any more after an interruption.
        let _ = self.tell.send(told);
    }
}

/// The process that first ran anything: threads do not survive a fork.
static PROCESS: AtomicU32 = AtomicU32::new(0);

/// Refuses to work in a forked child, where the parent's threads are missing and every call would wait for ever.
fn check_process() -> Result<(), Failure> {
    let own = std::process::id();
    match PROCESS.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed) {
        Err(first) if first != own => Err(Failure::new(
            Kind::Engine,
            "this process was forked from one that has used rodsweep, and its threads are gone: start workers with \
             multiprocessing.get_context(\"spawn\")",
        )),
        _ => Ok(()),
    }
}

type Work = Box<dyn FnOnce() + Send>;

/// Threads that wait for work: to wake one is quicker than to start one.
static IDLE: Mutex<Vec<Sender<Work>>> = Mutex::new(Vec::new());
/// Threads that are kept.
const MOST_IDLE: usize = 8;

/// A thread that waits for work. It ends when its sender is dropped.
fn hire() -> Result<Sender<Work>, Failure> {
    if let Some(worker) = IDLE.lock().ok().and_then(|mut idle| idle.pop()) {
        return Ok(worker);
    }
    let (give, take) = channel::<Work>();
    let spawned = std::thread::Builder::new().name("rodsweep".into()).spawn(move || take.into_iter().for_each(|w| w()));
    spawned.map_err(|error| Failure::new(Kind::Engine, format!("no thread can be started: {error}")))?;
    Ok(give)
}

fn dismiss(worker: Sender<Work>) {
    if let Ok(mut idle) = IDLE.lock()
        && idle.len() < MOST_IDLE
    {
        idle.push(worker);
    }
}

/// Runs work on a thread, and calls `listener` with what it tells. Ctrl-C and an exception of the listener end it.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    listener: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Line) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    check_process()?;
    let (tell, told) = channel();
    let (finish, finished) = channel();
    let line = Line { stop: Arc::default(), tell };
    let stop = line.stop.clone();
    let on_thread = move || {
        let done = catch_unwind(AssertUnwindSafe(|| on_threads(threads, || work(&line))));
        // The caller may have been interrupted.
        let _ = finish.send(done.unwrap_or_else(|panic| Err(broken(panic))));
    };
    let worker = hire()?;
    worker.send(Box::new(on_thread)).map_err(|_| lost())?;
    let mut finished = finished;
    loop {
        let (back, ended) = py.detach(move || {
            let ended = finished.recv_timeout(LISTEN);
            (finished, ended)
        });
        finished = back;
        let heard = told.try_iter().collect::<Vec<_>>();
        let result = heard.into_iter().try_for_each(|told| hear(py, told, listener)).and_then(|()| py.check_signals());
        match (result, ended) {
            (Ok(()), Ok(done)) => {
                dismiss(worker);
                return Ok(done?);
            }
            (Ok(()), Err(RecvTimeoutError::Timeout)) => {}
            (Ok(()), Err(RecvTimeoutError::Disconnected)) => return Err(lost().into()),
            (Err(error), _) => {
                stop.store(true, Ordering::Relaxed);
                py.detach(move || {
                    let _ = finished.recv_timeout(GRACE);
                });
                return Err(error);
            }
        }
    }
}

/// Hands something told to Python.
fn hear(py: Python<'_>, told: Told, listener: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    match (told, listener) {
        (Told::Warning(text), _) => {
            py.import("warnings")?.call_method1("warn", (text,))?;
        }
        (Told::Progress(progress), Some(listener)) => {
            listener.call1((progress.done, progress.total, progress.failed, progress.rate))?;
        }
        (Told::Stage(text), Some(listener)) => {
            listener.call1((text,))?;
        }
        (_, None) => {}
    }
    Ok(())
}

/// Runs work with so many threads; `None`: as many as there are cores.
fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
    let Some(threads) = threads else { return work() };
    if threads == 0 || threads > 4096 {
        return Err(Failure::at("threads", format!("is {threads}; give a number from 1 to 4096, or None")));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Failure::new(Kind::Engine, format!("no threads can be started: {error}")))?;
    pool.install(work)
}

fn lost() -> Failure {
    Failure::new(Kind::Other, "the work ended without an answer; please report this")
}

/// A panic of the library: a mistake of ours, and no reason to end the user's session.
fn broken(panic: Box<dyn Any + Send>) -> Failure {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    Failure::new(Kind::Other, format!("rodsweep has failed inside; please report this: {text}"))
}

/// Seconds of a piece of work beside what came of it.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let done = work();
    (done, begin.elapsed().as_secs_f64())
}
