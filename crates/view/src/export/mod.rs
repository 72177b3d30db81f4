//! One page for a file: looks, script, numbers, figures. It needs neither engine nor network.

mod pack;

use crate::error::{Refusal, ViewError};
use crate::map::ResultMap;
use crate::page;
use crate::rod;
use crate::view::View;
use base64::prelude::{BASE64_STANDARD, Engine};
use pack::Pack;
use rodsweep::table::{Column, Values};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Most bytes of a page; beyond them points are thinned.
pub const MOST_BYTES: usize = 15_000_000;
/// Largest figure that goes along (bytes).
const LARGEST_STILL: usize = 1_500_000;
const LINK: &str = r#"<link rel="stylesheet" href="style.css">"#;
const SCRIPT: &str = r#"<script src="page.js" defer></script>"#;
/// Nothing from anywhere but the file itself.
const POLICY: &str = r#"<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:">"#;

/// What an export wrote.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exported {
    /// Of the file.
    pub bytes: usize,
    /// Points of the map that are in it; 0 without a map.
    pub points: usize,
    /// Points of the map that there are.
    pub of_points: usize,
    /// Largest rounding of a coordinate (m).
    pub rounding: f64,
}

impl View {
    /// Writes the page; an existing file is replaced.
    ///
    /// # Errors
    ///
    /// Results that cannot be read any more, or a file that cannot be written.
    pub fn export(&self, path: &Path) -> Result<Exported, ViewError> {
        let of_points = self.map().map_or(0, |map| map.rows.point_count());
        let mut points = of_points;
        loop {
            let (page, rounding) = self.page(points)?;
            if page.len() <= MOST_BYTES || points < 1000 {
                rodsweep::files::replace(path, &page)
                    .map_err(|source| ViewError::Write { path: path.into(), source })?;
                return Ok(Exported { bytes: page.len(), points, of_points, rounding });
            }
            // Not all of it is points: a little less than in proportion.
            points = (0.95 * points as f64 * MOST_BYTES as f64 / page.len() as f64) as usize;
        }
    }

    /// The page with so many points, and the rounding of their coordinates (m).
    fn page(&self, points: usize) -> Result<(Vec<u8>, f64), Refusal> {
        let mut data = self.describe(false)?;
        data["rod"] = rod::answer(self.scene().clone(), true, self.lines(), Some(0))?;
        data["stills"] = Value::Object(self.small_stills());
        let mut pack = Pack::default();
        if let Some(map) = self.map() {
            pack_points(&mut pack, map, points)?;
            pack_workspace(&mut pack, map);
            data["map"]["points"] = json!(points);
            data["statistics"] = Value::Object(statistics(map)?);
            data["voxel_statistics"] = Value::Object(voxel_statistics(map)?);
        }
        let (blocks, rounding) = (pack.blocks(), pack.rounding());
        data["blocks"] = json!(blocks);
        let packed = BASE64_STANDARD.encode(pack.compressed());
        // No text of the data may end the script that holds it.
        let text = data.to_string().replace('<', "\\u003c");
        let looks = format!("{POLICY}\n<style>\n{}</style>", page::LOOKS);
        let script = format!(
            "<script type=\"application/json\" id=\"data\">{text}</script>\n\
             <script type=\"text/plain\" id=\"packed\">{packed}</script>\n<script>\n{}</script>",
            page::SCRIPT
        );
        // The script stands at the end, as a deferred one runs at the end.
        let document = page::DOCUMENT.replace(LINK, &looks).replace(SCRIPT, "");
        Ok((document.replace("</body>", &format!("{script}\n</body>")).into_bytes(), rounding))
    }

    fn small_stills(&self) -> Map<String, Value> {
        let names = self.stills().names();
        let small = names.into_iter().filter(|name| ["tips.png", crate::stills::ROD].contains(name));
        let encoded = small.filter_map(|name| {
            let bytes = self.stills().read(name, self.scene()).ok()?;
            let text = || format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&bytes));
            (bytes.len() <= LARGEST_STILL).then(|| (name.to_owned(), json!(text())))
        });
        encoded.collect()
    }
}

/// Row, status, position and every column but derivatives, in the order of rows, so that neighbours are alike.
fn pack_points(pack: &mut Pack, map: &ResultMap, count: usize) -> Result<(), Refusal> {
    let rows = &map.rows;
    let mut places: Vec<u32> = (0..count.min(rows.point_count()) as u32).collect();
    places.sort_unstable_by_key(|place| rows.order()[*place as usize]);
    let of = |values: &[f32]| -> Vec<f64> { places.iter().map(|place| f64::from(values[*place as usize])).collect() };
    let numbers: Vec<u32> = places.iter().map(|place| rows.order()[*place as usize]).collect();
    pack.whole("row", &numbers);
    pack.codes("status", &of(&rows.column("status")?).iter().map(|code| *code as u8).collect::<Vec<u8>>());
    let names = drawn_columns(map);
    for (name, unit) in &names {
        pack.numbers("points", name, unit, &of(&rows.column(name)?));
    }
    Ok(())
}

/// Columns of numbers that are no derivatives, the position among them.
fn drawn_columns(map: &ResultMap) -> Vec<(String, String)> {
    let is_drawn = |column: &&rodsweep::table::Column| {
        let is_number = matches!(column.values, Values::Double(_) | Values::Single(_) | Values::Flag(_));
        is_number && !column.name.starts_with("d(")
    };
    map.rows.columns().iter().filter(is_drawn).map(|column| (column.name.clone(), column.unit.clone())).collect()
}

fn statistics(map: &ResultMap) -> Result<Map<String, Value>, Refusal> {
    drawn_columns(map).into_iter().map(|(name, _)| Ok((name.clone(), map.column(&name)?))).collect()
}

fn voxel_statistics(map: &ResultMap) -> Result<Map<String, Value>, Refusal> {
    let columns = map.voxels.iter().flat_map(|voxels| &voxels.columns).filter(|column| is_packed(column));
    columns.map(|column| Ok((column.name.clone(), map.voxel_column(&column.name)?))).collect()
}

/// Whether a column of the voxels goes onto the page.
fn is_packed(column: &Column) -> bool {
    matches!(column.values, Values::Double(_) | Values::Single(_) | Values::Index(_))
}

/// Boundary and voxels, where there are any.
fn pack_workspace(pack: &mut Pack, map: &ResultMap) {
    if let Some(surface) = &map.surface {
        let positions = surface.positions();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            pack.numbers(
                "surface",
                name,
                "m",
                &positions.iter().map(|point| f64::from(point[axis])).collect::<Vec<_>>(),
            );
        }
        for (name, corners) in ["a", "b", "c"].into_iter().zip(surface.corners()) {
            pack.whole(name, corners);
        }
    }
    if let Some(voxels) = &map.voxels {
        for column in voxels.columns.iter().filter(|column| is_packed(column)) {
            pack.numbers("voxels", &column.name, &column.unit, &column.values.numbers());
        }
    }
}
