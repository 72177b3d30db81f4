//! How long the server lives: each window holds a stream open; when the last has gone, the server may end.

use hyper::body::{Body, Bytes, Frame};
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};
use tokio::time::{Interval, interval};

/// Time between signs of life.
const BEAT: Duration = Duration::from_secs(1);
/// A window that is loaded anew comes back within this time.
const GRACE: Duration = Duration::from_secs(4);

/// Windows that are open.
#[derive(Default)]
pub struct Life {
    windows: Mutex<Windows>,
}

#[derive(Default)]
struct Windows {
    open: usize,
    last_gone: Option<Instant>,
}

impl Life {
    /// Whether the last window has gone and none has come back.
    pub fn is_over(&self) -> bool {
        let windows = self.windows.lock().unwrap_or_else(PoisonError::into_inner);
        windows.open == 0 && windows.last_gone.is_some_and(|gone| gone.elapsed() > GRACE)
    }

    fn change(&self, comes: bool) {
        let mut windows = self.windows.lock().unwrap_or_else(PoisonError::into_inner);
        match comes {
            true => windows.open += 1,
            false => {
                windows.open = windows.open.saturating_sub(1);
                windows.last_gone = Some(Instant::now());
            }
        }
    }
}

/// The stream of one window: a comment now and then, as long as it is open.
pub struct Alive {
    beat: Interval,
    life: Arc<Life>,
}

impl Alive {
    /// Of a window that has just come.
    pub fn new(life: &Arc<Life>) -> Alive {
        life.change(true);
        Alive { beat: interval(BEAT), life: Arc::clone(life) }
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        self.life.change(false);
    }
}

impl Body for Alive {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        ready!(self.beat.poll_tick(context));
        Poll::Ready(Some(Ok(Frame::data(Bytes::from_static(b": alive\n\n")))))
    }
}
