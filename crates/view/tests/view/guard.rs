//! Strangers: other origins, wrong secrets, other names of the host, paths to files, too much of everything.

use super::client::Running;
use serde_json::json;
use std::io::Write;
use std::net::TcpStream;

#[test]
fn only_the_own_page_may_ask() {
    let server = Running::scene();
    let path = format!("{}api/view", server.root);
    let port = server.host.rsplit(':').next().expect("a port").to_owned();
    let status = |lines: &str| server.request("GET", &path, lines, b"").0;
    assert_eq!(status(""), 200);
    assert_eq!(status(&format!("Origin: http://127.0.0.1:{port}\r\n")), 200);
    assert_eq!(status("Sec-Fetch-Site: same-origin\r\n"), 200);
    for stranger in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1", "http://127.0.0.1.evil:80"]
    {
        assert_eq!(status(&format!("Origin: {stranger}\r\n")), 403, "{stranger}");
    }
    assert_eq!(status(&format!("Origin: https://127.0.0.1:{port}\r\n")), 403);
    assert_eq!(status("Sec-Fetch-Site: cross-site\r\n"), 403);
    assert_eq!(status("Sec-Fetch-Site: same-site\r\n"), 403);
    // A name that an attacker's DNS leads here.
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1", "", "localhost.evil.example"] {
        let head = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        assert_eq!(server.send(head.as_bytes()).0, 403, "{host}");
    }
    let head = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n\r\n");
    assert_eq!(server.send(head.as_bytes()).0, 403, "no host");
}

#[test]
fn a_wrong_secret_opens_nothing() {
    let server = Running::scene();
    let right = server.root.trim_matches('/').to_owned();
    let last = if right.ends_with('0') { '1' } else { '0' };
    let wrong =
        [String::new(), "0".repeat(32), right[..31].to_owned(), format!("{}{last}", &right[..31]), format!("{right}0")];
    for secret in wrong {
        for path in ["", "api/view", "alive", "page.js"] {
            let (status, body) = server.request("GET", &format!("/{secret}/{path}"), "", b"");
            assert_eq!((status, body), (404, b"no such page".to_vec()), "{secret}/{path}");
        }
    }
    assert_eq!(server.request("GET", "/", "", b"").0, 404);
    assert_eq!(server.request("GET", &format!("/{right}"), "", b"").0, 404);
}

#[test]
fn paths_lead_to_no_file() {
    let server = Running::scene();
    let ways = [
        "../Cargo.toml",
        "..%2f..%2fetc/passwd",
        "stills/../../Cargo.toml",
        "stills/%2e%2e%2fp6.toml",
        "//etc/passwd",
        "stills/",
        "stills//etc/passwd",
        "page.js/",
        "index.html",
        "stills/p6.toml",
        "%00",
        "stills/rod.png%00.toml",
        "api/points?columns=../x&from=0&count=1",
    ];
    for way in ways {
        let (status, body) = server.get(way);
        assert!((400..500).contains(&status), "{way}: {status}");
        assert!(!String::from_utf8_lossy(&body).contains("flux_density"), "{way}");
    }
    assert_eq!(server.get("stills/rod.png").1[..4], *b"\x89PNG");
    // A figure that another path names.
    assert_eq!(server.request("GET", "/stills/rod.png", "", b"").0, 404);
}

#[test]
fn too_much_and_nonsense_are_refused() {
    let server = Running::scene();
    let body = vec![b' '; (64 << 10) + 1];
    assert_eq!(server.post("api/solve", &body).0, 413);
    let long = format!("X-Long: {}\r\n", "a".repeat(20 << 10));
    assert!([0, 400, 431].contains(&server.request("GET", &server.root, &long, b"").0));
    for nonsense in [
        "",
        "{",
        "[]",
        "null",
        "{\"values\": 3}",
        "{\"values\": {\"coil.current.x\": \"0.1\"}}",
        "{\"values\": {\"coil.current.x\": null}}",
        "{\"values\": {\"no.such\": 1}}",
        "{\"values\": {\"insertion\": -1}}",
        "{\"values\": {\"coil.current.x\": 1e999}}",
        "{\"values\": {\"proximal.tube.inner_radius\": 1}}",
        "\u{0}\u{1}\u{ff}",
    ] {
        let (status, body) = server.post("api/solve", nonsense.as_bytes());
        // Nothing, or a list, asks for the scene as it is.
        let is_plain = ["[]", "null"].contains(&nonsense);
        assert_eq!(status, if is_plain { 200 } else { 400 }, "{nonsense}: {}", String::from_utf8_lossy(&body));
    }
    assert_eq!(server.post("api/drag", b"{\"target\": [1, 2]}").0, 400);
    assert_eq!(server.post("api/drag", b"{\"target\": [1e300, 0, 0]}").0, 400);
    assert_eq!(
        server.request("POST", &format!("{}api/solve", server.root), "Content-Type: text/plain\r\n", b"{}").0,
        415
    );
    assert_eq!(server.request("PUT", &server.root, "", b"").0, 405);
    assert_eq!(server.get("api/points?columns=status&from=0&count=9").0, 404);
    for bytes in ["\0\0\0\0\r\n\r\n", "GET\r\n\r\n", "GET / HTTP/9.9\r\n\r\n", "\u{16}\u{3}\u{1}\r\n\r\n"] {
        assert!([0, 400].contains(&server.send(bytes.as_bytes()).0), "{bytes:?}");
    }
    // Deep nesting must not overflow the stack.
    let deep = "[".repeat(60_000);
    assert_eq!(server.post("api/solve", deep.as_bytes()).0, 400);
    assert_eq!(server.get("api/view").0, 200, "it goes on");
}

#[test]
fn a_hundred_clients_are_served_and_more_refused() {
    let server = Running::scene();
    let body = json!({ "values": { "coil.current.x": 0.1 } }).to_string();
    let answers: Vec<(u16, Vec<u8>)> = std::thread::scope(|scope| {
        let ask = || server.post("api/solve", body.as_bytes());
        let clients: Vec<_> = (0..100).map(|_| scope.spawn(ask)).collect();
        clients.into_iter().map(|client| client.join().expect("a client")).collect()
    });
    let tip = |bytes: &[u8]| {
        let answer: serde_json::Value = serde_json::from_slice(bytes).expect("JSON");
        answer["solution"]["tip"]["position"].clone()
    };
    let first = tip(&answers[0].1);
    assert!(answers.iter().all(|(status, body)| *status == 200 && tip(body) == first));
    // Clients that say nothing hold places; one too many is told so.
    let silent: Vec<TcpStream> = (0..128).map(|_| TcpStream::connect(&server.host).expect("a connection")).collect();
    let refused = (0..50).any(|_| server.get("api/view").0 == 503);
    assert!(refused, "128 silent clients and one more");
    for mut stream in silent {
        let _ = stream.write_all(b"GET / HT");
    }
    let back = (0..200).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(20));
        server.get("api/view").0 == 200
    });
    assert!(back, "places are given back");
}
