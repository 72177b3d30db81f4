//! The files of the page. `page.js` is generated: `page/build`.

/// The document of the server.
pub const DOCUMENT: &str = include_str!("../page/index.html");
/// Its script, with the licence of three.js.
pub const SCRIPT: &str = include_str!("../page/dist/page.js");
/// Its looks.
pub const LOOKS: &str = include_str!("../page/style.css");
