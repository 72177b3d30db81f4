//! VTK's XML files of a grid, `ImageData` (.vti): numbers as text, in base64, or appended as they are; not compressed.

use super::data::{Factors, Samples};
use super::{MOST_NODES, vtk, wrong};
use crate::input::InputError;
use crate::model::short_name;
use std::path::Path;

/// A file, up to what is appended to it, and that.
struct File<'a> {
    path: &'a Path,
    xml: &'a str,
    appended: Appended<'a>,
    is_big_endian: bool,
    /// Bytes of the number before each block.
    header: usize,
}

#[derive(Clone, Copy)]
struct Appended<'a> {
    bytes: &'a [u8],
    is_base64: bool,
}

/// A tag and what follows it.
#[derive(Clone, Copy)]
struct Tag<'a> {
    name: &'a str,
    attributes: &'a str,
    rest: &'a str,
}

impl<'a> Tag<'a> {
    /// The next tag of a text; comments are passed over.
    fn next(mut text: &'a str) -> Option<Tag<'a>> {
        loop {
            text = &text[text.find('<')? + 1..];
            if let Some(comment) = text.strip_prefix("!--") {
                text = &comment[comment.find("-->")?..];
                continue;
            }
            let (inner, rest) = text.split_once('>')?;
            let inner = inner.trim_end_matches('/').trim();
            let (name, attributes) = inner.split_once(char::is_whitespace).unwrap_or((inner, ""));
            return Some(Tag { name, attributes, rest });
        }
    }

    fn attribute(&self, name: &str) -> Option<&'a str> {
        let mut text = self.attributes;
        while let Some((key, rest)) = text.split_once('=') {
            let rest = rest.trim_start();
            let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, after) = rest[1..].split_once(quote)?;
            if key.trim() == name {
                return Some(value);
            }
            text = after;
        }
        None
    }

    /// Numbers in an attribute.
    fn numbers<T: std::str::FromStr, const N: usize>(&self, name: &str) -> Option<[T; N]> {
        let words = self.attribute(name)?.split_whitespace().map(|word| word.parse().ok());
        words.collect::<Option<Vec<T>>>()?.try_into().ok()
    }
}

/// Reads the grid and the first field of vectors, or else the first of scalars, which is a potential.
pub(super) fn read(path: &Path, bytes: &[u8], factors: &Factors) -> Result<Samples, InputError> {
    let refused = |words: &str| wrong(path, None, "", words);
    let mark = b"<AppendedData";
    let end = bytes.windows(mark.len()).position(|window| window == mark).unwrap_or(bytes.len());
    let xml = std::str::from_utf8(&bytes[..end]).map_err(|_| refused("is no XML text before <AppendedData>"))?;
    let appended = appended(&bytes[end..]);
    let head =
        tags(xml).find(|tag| tag.name == "VTKFile").ok_or_else(|| refused("is no VTK file: <VTKFile> is missing"))?;
    if head.attribute("type") != Some("ImageData") {
        return Err(refused("is no grid of even steps: save it as ImageData"));
    }
    if head.attribute("compressor").is_some_and(|name| !name.is_empty()) {
        return Err(refused("is compressed: write it without compression, or as legacy .vtk"));
    }
    let header = if head.attribute("header_type") == Some("UInt64") { 8 } else { 4 };
    let is_big_endian = head.attribute("byte_order") == Some("BigEndian");
    let file = File { path, xml, appended, is_big_endian, header };
    let image = tags(xml).find(|tag| tag.name == "ImageData").ok_or_else(|| refused("has no <ImageData>"))?;
    let extent: Option<[i64; 6]> = image.numbers("WholeExtent");
    let extent = extent.ok_or_else(|| refused("`WholeExtent` needs six whole numbers"))?;
    let origin: [f64; 3] = image.numbers("Origin").unwrap_or_default();
    let steps: [f64; 3] = image.numbers("Spacing").unwrap_or([1.0; 3]);
    let turn: [f64; 9] = image.numbers("Direction").unwrap_or(IDENTITY);
    if turn != IDENTITY {
        return Err(refused("its grid is turned (`Direction`): sample the field again along x, y and z"));
    }
    let pieces: Vec<Tag> = tags(xml).filter(|tag| tag.name == "Piece").collect();
    if pieces.len() != 1 || pieces[0].numbers("Extent") != Some(extent) {
        return Err(refused("has several pieces: write the whole grid as one"));
    }
    let count = |k: usize| {
        let nodes = extent[2 * k + 1].checked_sub(extent[2 * k])?.checked_add(1)?;
        usize::try_from(nodes).ok().filter(|nodes| *nodes <= MOST_NODES)
    };
    let too_many = || refused(&format!("`WholeExtent` is no grid of at most {MOST_NODES} nodes"));
    let axis = |k: usize| -> Result<Vec<f64>, InputError> {
        let nodes = count(k).ok_or_else(too_many)?;
        Ok((0..nodes).map(|n| origin[k] + (extent[2 * k] as f64 + n as f64) * steps[k]).collect())
    };
    let axes = [axis(0)?, axis(1)?, axis(2)?];
    let nodes = axes.iter().try_fold(1_usize, |product, axis| product.checked_mul(axis.len()));
    let nodes = nodes.filter(|nodes| *nodes <= MOST_NODES).ok_or_else(too_many)?;
    let vectors = file.values(3, nodes)?;
    let scalars = if vectors.is_some() { None } else { file.values(1, nodes)? };
    vtk::samples(path, axes, vectors, scalars, factors)
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn tags(xml: &str) -> impl Iterator<Item = Tag<'_>> {
    std::iter::successors(Tag::next(xml), |tag| Tag::next(tag.rest))
}

/// What stands behind the underscore of `<AppendedData>`.
fn appended(bytes: &[u8]) -> Appended<'_> {
    let open = bytes.iter().position(|byte| *byte == b'>').unwrap_or(bytes.len());
    let tag = String::from_utf8_lossy(&bytes[..open]);
    let is_base64 =
        Tag::next(&format!("{tag}>")).and_then(|tag| tag.attribute("encoding").map(|word| word == "base64"));
    let start = bytes[open..].iter().position(|byte| *byte == b'_').map_or(bytes.len(), |at| open + at + 1);
    Appended { bytes: &bytes[start..], is_base64: is_base64.unwrap_or(false) }
}

impl File<'_> {
    fn wrong(&self, words: impl Into<String>) -> InputError {
        wrong(self.path, None, "", words)
    }

    /// The first array at points with so many components, if there is one.
    fn values(&self, components: usize, nodes: usize) -> Result<Option<Vec<f64>>, InputError> {
        let in_points =
            tags(self.xml).skip_while(|tag| tag.name != "PointData").take_while(|tag| tag.name != "/PointData");
        let has_components =
            |tag: &Tag| tag.attribute("NumberOfComponents").unwrap_or("1").trim().parse() == Ok(components);
        let found = in_points.filter(|tag| tag.name == "DataArray").find(has_components);
        found.map(|tag| self.array(&tag, components * nodes)).transpose()
    }

    fn array(&self, tag: &Tag, count: usize) -> Result<Vec<f64>, InputError> {
        let text = tag.rest.split_once('<').map(|(text, _)| text);
        let text = text.ok_or_else(|| self.wrong("ends before its numbers do"))?;
        let blob = match tag.attribute("format") {
            Some("ascii") => {
                let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
                let numbers = numbers.filter(|numbers| numbers.len() == count);
                return numbers.ok_or_else(|| self.wrong(format!("needs {count} numbers in a <DataArray>")));
            }
            Some("binary") => decoded(text.as_bytes()),
            Some("appended") => {
                let offset: Option<usize> = tag.attribute("offset").and_then(|offset| offset.trim().parse().ok());
                let block = offset.and_then(|offset| self.appended.bytes.get(offset..));
                let block = block.ok_or_else(|| self.wrong("a <DataArray> has an `offset` beyond the file"))?;
                if self.appended.is_base64 { decoded(block) } else { block.to_vec() }
            }
            _ => return Err(self.wrong("the `format` of a <DataArray> is ascii, binary or appended")),
        };
        let width = match tag.attribute("type") {
            Some("Float64") => 8,
            Some("Float32") => 4,
            other => {
                let found = short_name(other.unwrap_or("nothing"));
                return Err(self.wrong(format!("holds {found} numbers; write Float32 or Float64")));
            }
        };
        let data = blob.get(self.header..self.header + count * width);
        let data = data.ok_or_else(|| self.wrong("ends before its numbers do"))?;
        let said = blob[..self.header].iter().rev().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
        if !self.is_big_endian && said != (count * width) as u64 {
            return Err(self.wrong(format!("a <DataArray> has {said} bytes where {} have to stand", count * width)));
        }
        Ok(match (width, self.is_big_endian) {
            (8, false) => data.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect(),
            (8, true) => data.as_chunks().0.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect(),
            (_, false) => data.as_chunks().0.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect(),
            (_, true) => data.as_chunks().0.iter().map(|bytes| f64::from(f32::from_be_bytes(*bytes))).collect(),
        })
    }
}

/// Base64 up to the first byte that is none; a block that ends with `=` may be followed by another.
fn decoded(text: &[u8]) -> Vec<u8> {
    let digit = |byte: u8| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for byte in text.iter().filter(|byte| !byte.is_ascii_whitespace()) {
        match digit(*byte) {
            Some(digit) => {
                bits = bits << 6 | u32::from(digit);
                count += 6;
                if count >= 8 {
                    count -= 8;
                    bytes.push((bits >> count) as u8);
                }
            }
            None if *byte == b'=' => (bits, count) = (0, 0),
            None => break,
        }
    }
    bytes
}
