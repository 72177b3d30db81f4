//! A server in this process, and the plainest of clients.

use rodsweep_view::{Server, View};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// A file of the repository.
pub fn shipped(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A server; it ends when it is dropped.
pub struct Running {
    /// `127.0.0.1:port`
    pub host: String,
    /// `/secret/`
    pub root: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    pub fn new(path: &Path) -> Running {
        let server = Server::bind(View::open(path).expect("a view")).expect("a server");
        let address = server.address();
        let rest = address.strip_prefix("http://").expect("an address");
        let (host, root) = rest.split_once('/').expect("a secret");
        let (host, root) = (host.to_owned(), format!("/{root}"));
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || server.run(&flag, true).expect("it serves"));
        Running { host, root, stop, thread: Some(thread) }
    }

    pub fn scene() -> Running {
        Running::new(&shipped("sweeps/scenes/p6.toml"))
    }

    /// Sends these bytes and returns status and body; 0 where the connection was closed without a word.
    pub fn send(&self, bytes: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.host).expect("a connection");
        stream.set_read_timeout(Some(std::time::Duration::from_secs(60))).expect("a limit");
        // What is refused early may be refused before all of it is sent.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n");
        let Some(end) = end else { return (0, answer) };
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        let status = head.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(0);
        (status, answer[end + 4..].to_vec())
    }

    /// A request with these lines behind `Host`.
    pub fn request(&self, method: &str, path: &str, lines: &str, body: &[u8]) -> (u16, Vec<u8>) {
        let length = if body.is_empty() { String::new() } else { format!("Content-Length: {}\r\n", body.len()) };
        let host = &self.host;
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{lines}{length}\r\n");
        self.send(&[head.as_bytes(), body].concat())
    }

    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        self.request("GET", &format!("{}{path}", self.root), "", b"")
    }

    pub fn post(&self, path: &str, body: &[u8]) -> (u16, Vec<u8>) {
        self.request("POST", &format!("{}{path}", self.root), "Content-Type: application/json\r\n", body)
    }

    pub fn json(&self, path: &str, body: Option<Value>) -> Value {
        let (status, bytes) = match &body {
            None => self.get(path),
            Some(body) => self.post(path, body.to_string().as_bytes()),
        };
        let text = String::from_utf8_lossy(&bytes);
        assert_eq!(status, 200, "{path}: {text}");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}: {text}"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(matches!(ended, Some(Ok(()))), "the server panicked");
    }
}
