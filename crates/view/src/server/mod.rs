//! The server: HTTP on the loopback, for the user's own browser.
//!
//! One thread reads and writes, others solve. Connections, headers, bodies and the time for them are limited.

mod guard;
mod life;

use crate::api::{self, Request};
use crate::error::ViewError;
use crate::view::View;
use guard::Guard;
use http_body_util::{BodyExt, Either, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{CACHE_CONTROL, CONTENT_TYPE, HeaderValue};
use hyper::service::service_fn;
use hyper::{Method, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use life::{Alive, Life};
use std::convert::Infallible;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Connections at a time; browsers open six.
const MOST_CONNECTIONS: usize = 128;
const MOST_HEADER: usize = 16 << 10;
const MOST_BODY: usize = 64 << 10;
/// For a header, and for a body.
const PATIENCE: Duration = Duration::from_secs(10);
/// Requests that are solved at a time.
const SOLVERS: usize = 4;
/// How often the server looks whether it should end.
const LOOK: Duration = Duration::from_millis(100);
/// Scripts and pictures of this server alone, in no frame.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
                      connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A server that shows a view on the loopback, at a secret address.
pub struct Server {
    listener: TcpListener,
    shared: Arc<Shared>,
}

struct Shared {
    view: View,
    guard: Guard,
    life: Arc<Life>,
    connections: AtomicUsize,
}

type Response = hyper::Response<Either<Full<Bytes>, Alive>>;

impl Server {
    /// Takes a free port of 127.0.0.1 and a new secret.
    ///
    /// # Errors
    ///
    /// A system without free ports or random numbers.
    pub fn bind(view: View) -> Result<Server, ViewError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(ViewError::Listen)?;
        listener.set_nonblocking(true).map_err(ViewError::Listen)?;
        let port = listener.local_addr().map_err(ViewError::Listen)?.port();
        let (guard, life) = (Guard::new(port)?, Arc::default());
        Ok(Server { listener, shared: Arc::new(Shared { view, guard, life, connections: AtomicUsize::new(0) }) })
    }

    /// The address, with its secret.
    pub fn address(&self) -> String {
        self.shared.guard.address()
    }

    /// Serves until `stop` is set or, unless it is to be kept, a few seconds after the last window has gone.
    ///
    /// # Errors
    ///
    /// A system that gives no threads or closes the port.
    pub fn run(self, stop: &AtomicBool, keep: bool) -> Result<(), ViewError> {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime =
            runtime.enable_io().enable_time().max_blocking_threads(SOLVERS).build().map_err(ViewError::Listen)?;
        let Server { listener, shared } = self;
        let result = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            while !stop.load(Ordering::Relaxed) && (keep || !shared.life.is_over()) {
                match tokio::time::timeout(LOOK, listener.accept()).await {
                    Ok(Ok((stream, _))) => accept(stream, &shared),
                    // A connection that was gone before it was taken, or too many files: others may come.
                    Ok(Err(_)) => tokio::time::sleep(LOOK).await,
                    Err(_) => {}
                }
            }
            Ok(())
        });
        // What is still being solved need not be waited for.
        runtime.shutdown_background();
        result.map_err(ViewError::Listen)
    }
}

/// A place among the connections; given back when it is dropped.
struct Place(Arc<Shared>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

fn accept(stream: tokio::net::TcpStream, shared: &Arc<Shared>) {
    // One too many is told so at once and closed.
    let is_crowded = shared.connections.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS;
    let place = Place(Arc::clone(shared));
    let _ = stream.set_nodelay(true);
    tokio::spawn(async move {
        let service = service_fn(|request| {
            let shared = Arc::clone(&place.0);
            async move {
                let response = match is_crowded {
                    true => refused(StatusCode::SERVICE_UNAVAILABLE, "too many connections"),
                    false => respond(request, &shared).await,
                };
                Ok::<Response, Infallible>(response)
            }
        });
        let mut http = hyper::server::conn::http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(MOST_HEADER).keep_alive(!is_crowded);
        // A client that breaks off is no concern of ours.
        let _ = http.serve_connection(TokioIo::new(stream), service).await;
    });
}

async fn respond(request: hyper::Request<Incoming>, shared: &Arc<Shared>) -> Response {
    if !shared.guard.admits(request.headers()) {
        return refused(StatusCode::FORBIDDEN, "only the page at the address that was printed may ask");
    }
    let Some(path) = shared.guard.path(request.uri().path()).map(str::to_owned) else {
        return refused(StatusCode::NOT_FOUND, "no such page");
    };
    let query = request.uri().query().unwrap_or_default().to_owned();
    let is_post = match *request.method() {
        Method::GET => false,
        Method::POST => true,
        _ => return refused(StatusCode::METHOD_NOT_ALLOWED, "ask by GET or POST"),
    };
    if !is_post && path == "alive" {
        return with_headers(StatusCode::OK, "text/event-stream", Either::Right(Alive::new(&shared.life)));
    }
    // A page of another origin could send a form, but not this type.
    let is_json = request.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
    if is_post && !is_json {
        return refused(StatusCode::UNSUPPORTED_MEDIA_TYPE, "send application/json");
    }
    let body = Limited::new(request.into_body(), MOST_BODY).collect();
    let body = match tokio::time::timeout(PATIENCE, body).await {
        Ok(Ok(body)) => body.to_bytes().to_vec(),
        Ok(Err(_)) => return refused(StatusCode::PAYLOAD_TOO_LARGE, "the body is too large or broken"),
        Err(_) => return refused(StatusCode::REQUEST_TIMEOUT, "the body did not come"),
    };
    let request = Request { is_post, path, query, body };
    let worker = Arc::clone(shared);
    match tokio::task::spawn_blocking(move || api::answer(&worker.view, &request)).await {
        Ok(answer) => {
            let status = StatusCode::from_u16(answer.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
            with_headers(status, answer.kind, Either::Left(Full::from(answer.body)))
        }
        Err(_) => refused(StatusCode::INTERNAL_SERVER_ERROR, "the request could not be answered"),
    }
}

fn refused(status: StatusCode, why: &'static str) -> Response {
    with_headers(status, "text/plain; charset=utf-8", Either::Left(Full::from(why)))
}

fn with_headers(status: StatusCode, kind: &'static str, body: Either<Full<Bytes>, Alive>) -> Response {
    let mut response = Response::new(body);
    *response.status_mut() = status;
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    for (name, value) in [
        ("content-security-policy", POLICY),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
        ("referrer-policy", "no-referrer"),
        ("x-content-type-options", "nosniff"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}
