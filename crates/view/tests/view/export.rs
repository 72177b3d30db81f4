//! The exported page: whole, small, rounded as it says, and asking for nothing.

use super::client::shipped;
use super::results::directory;
use base64::prelude::{BASE64_STANDARD, Engine};
use rodsweep::results::Results;
use rodsweep_view::{MOST_BYTES, View};
use serde_json::Value;
use std::io::Read;
use std::path::Path;

fn exported(of: &Path) -> (String, rodsweep_view::Exported) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("page.html");
    let done = View::open(of).expect("a view").export(&path).expect("an export");
    let text = std::fs::read_to_string(path).expect("a page");
    assert_eq!(text.len(), done.bytes);
    (text, done)
}

fn part<'a>(page: &'a str, id: &str) -> &'a str {
    let start = page.find(&format!("id=\"{id}\">")).expect("a part") + id.len() + 6;
    &page[start..start + page[start..].find("</script>").expect("its end")]
}

/// The data that an exported page carries.
pub fn data(of: &Path) -> Value {
    serde_json::from_str(part(&exported(of).0, "data")).expect("JSON")
}

#[test]
fn a_page_asks_for_nothing() {
    let (page, done) = exported(&shipped("sweeps/scenes/p6.toml"));
    assert!(done.bytes < MOST_BYTES && done.points == 0);
    for outside in ["src=\"", "href=\"http", "href=\"style", "@import", "url(http"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("default-src 'none'; script-src 'unsafe-inline'"));
    let data: Value = serde_json::from_str(part(&page, "data")).expect("JSON");
    assert_eq!(data["engine"], false);
    assert!(data["rod"]["solution"]["tip"].is_object());
    assert!(page.contains("three.js authors"), "the licence goes along");
}

#[test]
fn a_page_has_the_lines_of_its_field() {
    let arm = data(&shipped("sweeps/scenes/arm_magnet.toml"));
    assert!(arm["rod"]["lines"]["lines"].as_array().is_some_and(|lines| lines.len() > 20));
    assert!(arm["rod"]["shape"]["flux_density_at_tip"].is_number());
    assert!(data(&shipped("sweeps/scenes/p6.toml"))["rod"].get("lines").is_none());
}

#[test]
fn points_are_rounded_as_it_says() {
    let (page, done) = exported(directory());
    let data: Value = serde_json::from_str(part(&page, "data")).expect("JSON");
    let packed = BASE64_STANDARD.decode(part(&page, "packed")).expect("base64");
    let mut bytes = Vec::new();
    flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("zlib");
    let rows = Results::open(directory()).expect("results").read(&[]).expect("rows");
    let (mut at, mut checked) = (0, 0);
    for block in data["blocks"].as_array().expect("blocks") {
        let count = block["count"].as_u64().expect("a count") as usize;
        let width = match block["kind"].as_str() {
            Some("number") => 2,
            Some("whole") => 4,
            _ => 1,
        };
        if block["kind"] == "number" {
            let (low, step) = (block["low"].as_f64().expect("low"), block["step"].as_f64().expect("step"));
            let expected = rows.column(block["name"].as_str().expect("a name")).expect("a column");
            let mut code = 0u16;
            for row in 0..count {
                code = code.wrapping_add(u16::from_le_bytes([bytes[at + row], bytes[at + count + row]]));
                let (found, value) = (low + f64::from(code) * step, expected.values.number(row));
                assert!(if value.is_nan() {
                    code == u16::MAX
                } else {
                    (found - value).abs() <= 0.5001 * step + 1e-6 * value.abs()
                });
                checked += 1;
            }
        }
        at += width * count;
    }
    assert_eq!((at, done.points), (bytes.len(), 3000));
    assert!(checked > 3000 * 5, "{checked} numbers");
    assert!(done.rounding > 0.0 && done.rounding < 2e-6, "{}", done.rounding);
}
