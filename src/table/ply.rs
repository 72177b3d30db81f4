//! PLY, binary and little endian: triangles with the columns of a table as properties of their points.
//!
//! Numbers are `float`, counts `double`, flags `char`: 1, 0, or -1 where it is unknown. Words are `short`: places in a
//! list that stands in comments of the header, as do units and what speaks against the surface.

use super::triangles::codes;
use super::{TableError, Triangles, Values};
use std::fmt::Write;

/// One property of every point: its type, and its bytes one after another.
struct Property {
    name: String,
    kind: &'static str,
    width: usize,
    bytes: Vec<u8>,
}

/// The bytes of a file. Coordinates are in m.
///
/// # Errors
///
/// Rows, normals or corners that do not fit the points.
pub fn encode(surface: &Triangles) -> Result<Vec<u8>, TableError> {
    surface.check("PLY")?;
    let mut header = String::from("ply\nformat binary_little_endian 1.0\ncomment lengths in m\n");
    if let Some(mark) = surface.mark {
        let _ = writeln!(header, "comment {}", mark.replace(['\n', '\r'], " "));
    }
    let mut properties = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        properties.push(floats(name, surface.points.iter().map(|point| point[axis])));
    }
    if !surface.normals.is_empty() {
        for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
            properties.push(floats(name, surface.normals.iter().map(|normal| normal[axis])));
        }
    }
    for column in &surface.data.columns {
        // A name is one word.
        let name = column.name.replace(char::is_whitespace, "_");
        // Writing to a String cannot fail.
        if !column.unit.is_empty() {
            let _ = writeln!(header, "comment unit of {name}: {}", column.unit);
        }
        let (property, words) = property(name, &column.values);
        for (code, word) in words.iter().enumerate() {
            let _ = writeln!(header, "comment {} {code}: {}", property.name, word.replace(['\n', '\r'], " "));
        }
        properties.push(property);
    }
    let _ = writeln!(header, "element vertex {}", surface.points.len());
    for property in &properties {
        let _ = writeln!(header, "property {} {}", property.kind, property.name);
    }
    let _ = writeln!(header, "element face {}", surface.triangles.len());
    header += "property list uchar int vertex_indices\nend_header\n";
    let mut bytes = header.into_bytes();
    for point in 0..surface.points.len() {
        for Property { width, bytes: values, .. } in &properties {
            bytes.extend_from_slice(&values[point * width..(point + 1) * width]);
        }
    }
    for triangle in surface.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
    }
    Ok(bytes)
}

fn floats(name: impl Into<String>, values: impl Iterator<Item = f64>) -> Property {
    let bytes = values.flat_map(|x| (x as f32).to_le_bytes()).collect();
    Property { name: name.into(), kind: "float", width: 4, bytes }
}

/// The property of a column, and the words that its numbers stand for.
fn property(name: String, values: &Values) -> (Property, Vec<String>) {
    let words = |(codes, known): (Vec<i16>, Vec<&str>)| {
        let bytes = codes.into_iter().flat_map(i16::to_le_bytes).collect();
        (
            Property { name: name.clone(), kind: "short", width: 2, bytes },
            known.into_iter().map(str::to_owned).collect(),
        )
    };
    match values {
        Values::Text(texts) => words(codes(texts.iter().map(String::as_str))),
        Values::Status(statuses) => words(codes(statuses.iter().map(|status| status.name()))),
        Values::Flag(flags) => {
            let bytes = flags.iter().flat_map(|flag| flag.map_or(-1, i8::from).to_le_bytes()).collect();
            (Property { name, kind: "char", width: 1, bytes }, Vec::new())
        }
        Values::Index(counts) => {
            let bytes = counts.iter().flat_map(|count| (*count as f64).to_le_bytes()).collect();
            (Property { name, kind: "double", width: 8, bytes }, Vec::new())
        }
        Values::Double(_) | Values::Single(_) => {
            (floats(name, (0..values.len()).map(|row| values.number(row))), Vec::new())
        }
    }
}
