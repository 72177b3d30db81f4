//! The server as its own page and as strangers find it, and the exported page.

mod client;
mod export;
mod guard;
mod lines;
mod numbers;
mod results;
mod walls;
