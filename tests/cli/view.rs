//! `rodsweep view` as a program: the address, an answer that is that of `solve`, its end, its mistakes.

use super::sandbox::{Sandbox, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

/// Ends the program with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn post(address: &str, path: &str, body: &str) -> String {
    let rest = address.strip_prefix("http://").expect("an address");
    let (host, root) = rest.split_once('/').expect("a secret");
    let mut stream = TcpStream::connect(host).expect("a connection");
    let head = format!(
        "POST /{root}{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(head.as_bytes()).expect("a request");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer.split_once("\r\n\r\n").expect("a body").1.to_owned()
}

#[test]
fn the_page_solves_as_solve_does() {
    let sandbox = Sandbox::new();
    let mut command = sandbox.command(&["view", "scene.toml", "--no-open", "--keep"]);
    let mut running = Running(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program"));
    let mut address = String::new();
    let stdout = running.0.stdout.take().expect("a pipe");
    BufReader::new(stdout).read_line(&mut address).expect("an address");
    let answer = post(address.trim(), "api/solve", r#"{"values": {"coil.current.x": 0.07, "insertion": 0.09}}"#);
    let arguments = ["solve", "scene.toml", "--json", "--set", "coil.current.x=0.07", "--set", "insertion=0.09"];
    let solved = json(&sandbox.ok(&arguments).stdout);
    assert!(solved["tip"].is_object());
    assert_eq!(json(&answer)["solution"], solved);
}

#[test]
fn a_page_is_exported() {
    let sandbox = Sandbox::new();
    let output = sandbox.ok(&["view", "sweep.toml", "--export", "rod.html"]);
    assert!(output.stdout.is_empty() && output.stderr.contains("rod.html"), "{}", output.stderr);
    let page = std::fs::read_to_string(sandbox.path("rod.html")).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.contains("\"engine\":false"));
}

#[test]
fn what_cannot_be_viewed_is_told() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("empty")).expect("a folder");
    for (arguments, code, words) in [
        (&["view", "none.toml", "--no-open"][..], 2, "none.toml"),
        (&["view", "empty", "--no-open"], 2, "empty"),
        (&["view", "scene.toml", "--export", "no/such/folder.html"], 1, "folder.html"),
        (&["view", "scene.toml", "--export", "a.html", "--keep"], 2, "--keep"),
    ] {
        let output = sandbox.run(arguments);
        assert_eq!(output.code, code, "{arguments:?}: {}", output.stderr);
        assert!(output.stderr.contains(words), "{arguments:?}: {}", output.stderr);
    }
}
