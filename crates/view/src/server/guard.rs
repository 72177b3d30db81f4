//! Who may ask: only this machine, by an address that it was told, from a page that was opened here.

use crate::error::ViewError;
use hyper::HeaderMap;
use std::hint::black_box;

/// Bytes of the secret.
const SECRET: usize = 16;

/// The secret of an address, and the address itself.
pub struct Guard {
    token: String,
    port: u16,
}

impl Guard {
    /// A new secret for a port.
    ///
    /// # Errors
    ///
    /// A system without random numbers.
    pub fn new(port: u16) -> Result<Guard, ViewError> {
        let mut secret = [0; SECRET];
        getrandom::fill(&mut secret).map_err(ViewError::Random)?;
        let token = secret.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Guard { token, port })
    }

    /// What the user opens.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// The rest of a path behind the secret; `None` where the secret is wrong.
    pub fn path<'a>(&self, path: &'a str) -> Option<&'a str> {
        let (token, rest) = path.strip_prefix('/')?.split_once('/')?;
        is_equal(token.as_bytes(), self.token.as_bytes()).then_some(rest)
    }

    /// Whether a request names this server, and comes from its own page or from no page. A name that an attacker's DNS
    /// leads here is not ours.
    pub fn admits(&self, headers: &HeaderMap) -> bool {
        let text = |name: &str| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let hosts = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        let is_host = text("host").is_some_and(|host| hosts.iter().any(|known| known == host));
        let is_origin =
            |origin: &str| origin.strip_prefix("http://").is_some_and(|rest| hosts.iter().any(|h| h == rest));
        let is_site = |site: &str| site == "same-origin" || site == "none";
        is_host && text("origin").is_none_or(is_origin) && text("sec-fetch-site").is_none_or(is_site)
    }
}

/// Compares every byte, whatever the first ones are, so that time tells nothing of the secret.
fn is_equal(one: &[u8], other: &[u8]) -> bool {
    let differing = one.iter().zip(other).fold(0, |sum, (a, b)| black_box(sum | (a ^ b)));
    one.len() == other.len() && differing == 0
}
