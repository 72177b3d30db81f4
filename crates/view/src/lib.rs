//! The page of `rodsweep view`: a rod that follows sliders, and the map of a result directory, in a browser.
//!
//! [`View`] reads a scene, a sweep file or a result directory. [`Server`] shows it on the loopback at a secret address.
//! [`View::export`] writes one page that needs neither engine nor network. What goes over the wire is told in
//! `docs/view.md`.
//!
//! ```no_run
//! use rodsweep_view::{Server, View};
//! use std::sync::atomic::AtomicBool;
//!
//! let server = Server::bind(View::open("sweeps/scenes/p6.toml".as_ref())?)?;
//! println!("{}", server.address());
//! server.run(&AtomicBool::new(false), false)?;
//! # Ok::<(), rodsweep_view::ViewError>(())
//! ```

mod api;
mod browser;
mod columns;
mod drag;
mod error;
mod export;
mod lines;
mod map;
mod page;
mod region;
mod rod;
mod rows;
mod server;
mod sliders;
mod sources;
mod stills;
mod style;
mod surface;
mod view;
mod wall;

pub use browser::open_browser;
pub use error::{Refusal, ViewError};
pub use export::{Exported, MOST_BYTES};
pub use server::Server;
pub use view::View;
