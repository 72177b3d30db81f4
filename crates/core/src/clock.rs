//! Processor time: the clocks of a thread and of the process, and counters of what a piece of work takes on all threads.

use std::cell::{Cell, RefCell};
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Processor time of the calling thread; `None`: the system does not tell it.
pub fn thread_time() -> Option<Duration> {
    system::thread_time()
}

/// Processor time of all threads of the process together; `None`: the system does not tell it.
pub fn process_time() -> Option<Duration> {
    system::process_time()
}

/// Counts the processor time of a piece of work.
///
/// The thread that begins the work enters the counter. Where the work is spread over other threads, they enter what
/// [`Busy::here`] has told there. A thread counts for what it has entered last, so nothing is counted twice.
#[derive(Clone, Debug, Default)]
pub struct Busy(Option<Arc<AtomicU64>>);

thread_local! {
    /// What the thread is at.
    static HERE: RefCell<Busy> = const { RefCell::new(Busy(None)) };
    /// Nanoseconds that the thread has counted for other work since it entered this.
    static WITHIN: Cell<u64> = const { Cell::new(0) };
}

impl Busy {
    /// A counter at zero. It counts nothing on a system without such a clock.
    pub fn new() -> Busy {
        Busy(thread_time().map(|_| Arc::default()))
    }

    /// The counter that the calling thread has entered last. It counts nothing if there is none.
    pub fn here() -> Busy {
        HERE.with_borrow(Clone::clone)
    }

    /// The calling thread counts until the guard is dropped.
    pub fn enter(&self) -> Entered {
        let begin = self.0.as_ref().and_then(|_| thread_time());
        let outer = begin.map(|begin| Outer { begin, busy: HERE.replace(self.clone()), within: WITHIN.replace(0) });
        Entered { outer, of_thread: PhantomData }
    }

    /// What was counted so far (s).
    pub fn seconds(&self) -> Option<f64> {
        let counter = self.0.as_ref()?;
        Some(Duration::from_nanos(counter.load(Ordering::Relaxed)).as_secs_f64())
    }
}

/// Ends the count of a thread when it is dropped.
#[must_use]
pub struct Entered {
    outer: Option<Outer>,
    of_thread: PhantomData<*const ()>,
}

/// When the thread entered, and what it was at before.
struct Outer {
    begin: Duration,
    busy: Busy,
    within: u64,
}

impl Drop for Entered {
    fn drop(&mut self) {
        let Some(Outer { begin, busy, within }) = self.outer.take() else { return };
        let elapsed = thread_time().unwrap_or(begin).saturating_sub(begin).as_nanos() as u64;
        let of_others = WITHIN.replace(within + elapsed);
        if let Busy(Some(counter)) = HERE.replace(busy) {
            counter.fetch_add(elapsed.saturating_sub(of_others), Ordering::Relaxed);
        }
    }
}

#[cfg(target_os = "linux")]
mod system {
    use nix::time::ClockId;
    use std::time::Duration;

    pub fn thread_time() -> Option<Duration> {
        ClockId::CLOCK_THREAD_CPUTIME_ID.now().ok().map(Duration::from)
    }

    pub fn process_time() -> Option<Duration> {
        ClockId::CLOCK_PROCESS_CPUTIME_ID.now().ok().map(Duration::from)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::time::Duration;

    pub fn thread_time() -> Option<Duration> {
        None
    }

    pub fn process_time() -> Option<Duration> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keeps the thread's processor busy until its clock has gone on.
    fn work() {
        let begin = thread_time();
        while begin.is_some() && thread_time() <= begin {}
    }

    #[test]
    fn a_thread_counts_for_what_it_has_entered_last() {
        let Some(before) = process_time() else { return };
        let (outer, inner) = (Busy::new(), Busy::new());
        let nobody = Busy::here();
        {
            let _outer = outer.enter();
            work();
            {
                let _inner = inner.enter();
                let here = Busy::here();
                std::thread::scope(|scope| {
                    scope.spawn(|| {
                        let _here = here.enter();
                        work();
                    });
                });
                assert_eq!(inner.seconds(), here.seconds(), "the counter that was entered last");
                work();
            }
            assert_eq!(outer.seconds(), Some(0.0), "what has not ended is not counted");
            work();
        }
        let after = process_time().unwrap_or_default();
        let (outer, inner) = (outer.seconds().unwrap_or(0.0), inner.seconds().unwrap_or(0.0));
        assert!(outer > 0.0 && inner > 0.0, "{outer} {inner}");
        assert!(outer + inner <= (after - before).as_secs_f64(), "counted twice: {outer} {inner}");
        let _nobody = nobody.enter();
        assert_eq!(nobody.seconds(), None);
    }

    #[test]
    fn a_panic_leaves_the_thread_where_it_was() {
        let busy = Busy::new();
        let panics = || {
            let _busy = busy.enter();
            panic!("on purpose");
        };
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(panics)).expect_err("a panic");
        assert_eq!(Busy::here().seconds(), None);
    }
}
