//! The boundary of a workspace, read from the `boundary.ply` that `rodsweep workspace` wrote.

use crate::columns::{WireColumn, typed_columns};
use crate::error::Refusal;

/// More than any workspace has.
const MOST: usize = 20_000_000;

/// A surface of triangles.
pub struct Surface {
    /// x, y, z and the like, one number a point.
    columns: Vec<(String, Vec<f32>)>,
    /// Three corners a triangle.
    corners: [Vec<u32>; 3],
}

impl Surface {
    /// Reads a binary little-endian PLY as this program writes it; `None` for anything else.
    pub fn parse(bytes: &[u8]) -> Option<Surface> {
        let marker = b"end_header\n";
        let end = bytes.windows(marker.len()).position(|window| window == marker)? + marker.len();
        let header = std::str::from_utf8(&bytes[..end]).ok()?;
        let mut lines = header.lines();
        if lines.next()? != "ply" || lines.next()? != "format binary_little_endian 1.0" {
            return None;
        }
        let (mut points, mut faces) = (0, 0);
        let mut properties: Vec<(String, Kind)> = Vec::new();
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["element", "vertex", count] => points = count.parse().ok().filter(|count| *count <= MOST)?,
                ["element", "face", count] => faces = count.parse().ok().filter(|count| *count <= MOST)?,
                ["property", kind, name] => properties.push((name.into(), Kind::of(kind)?)),
                _ => {}
            }
        }
        let mut data = bytes.get(end..)?;
        let mut columns: Vec<(String, Vec<f32>)> =
            properties.iter().map(|(name, _)| (name.clone(), Vec::with_capacity(points))).collect();
        for _ in 0..points {
            for ((_, values), (_, kind)) in columns.iter_mut().zip(&properties) {
                values.push(kind.take(&mut data)?);
            }
        }
        let mut corners: [Vec<u32>; 3] = Default::default();
        for _ in 0..faces {
            let (count, rest) = data.split_first()?;
            data = rest;
            if *count != 3 {
                return None;
            }
            for corner in &mut corners {
                let (number, rest) = data.split_first_chunk()?;
                data = rest;
                corner.push(u32::from_le_bytes(*number));
            }
        }
        let is_whole = corners.iter().flatten().all(|corner| (*corner as usize) < points);
        (is_whole && ["x", "y", "z"].iter().all(|axis| columns.iter().any(|(name, _)| name == axis)))
            .then_some(Surface { columns, corners })
    }

    /// Positions (m) of the points, x y z of each.
    pub fn positions(&self) -> Vec<[f32; 3]> {
        let of = |axis: &str| self.columns.iter().find(|(name, _)| name == axis).map(|(_, values)| values.as_slice());
        let [x, y, z] = ["x", "y", "z"].map(|axis| of(axis).unwrap_or_default());
        x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z]).collect()
    }

    /// Corners of the triangles.
    pub fn corners(&self) -> &[Vec<u32>; 3] {
        &self.corners
    }

    /// Its points as typed columns.
    ///
    /// # Errors
    ///
    /// As [`typed_columns`].
    pub fn point_columns(&self) -> Result<Vec<u8>, Refusal> {
        let column = |(name, values): &(String, Vec<f32>)| WireColumn::single(name, "", values.clone());
        let places = self.columns.iter().filter(|(name, _)| ["x", "y", "z"].contains(&name.as_str()));
        typed_columns(&places.map(column).collect::<Vec<_>>())
    }

    /// Its triangles as the columns `a`, `b`, `c`.
    ///
    /// # Errors
    ///
    /// As [`typed_columns`].
    pub fn triangle_columns(&self) -> Result<Vec<u8>, Refusal> {
        let columns = ["a", "b", "c"].into_iter().zip(&self.corners);
        typed_columns(&columns.map(|(name, values)| WireColumn::index(name, values.clone())).collect::<Vec<_>>())
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Float,
    Double,
    Char,
    Short,
}

impl Kind {
    fn of(word: &str) -> Option<Kind> {
        match word {
            "float" => Some(Kind::Float),
            "double" => Some(Kind::Double),
            "char" => Some(Kind::Char),
            "short" => Some(Kind::Short),
            _ => None,
        }
    }

    fn take(self, data: &mut &[u8]) -> Option<f32> {
        let (number, rest) = match self {
            Kind::Float => data.split_first_chunk().map(|(bytes, rest)| (f32::from_le_bytes(*bytes), rest)),
            Kind::Double => data.split_first_chunk().map(|(bytes, rest)| (f64::from_le_bytes(*bytes) as f32, rest)),
            Kind::Char => data.split_first_chunk().map(|(bytes, rest)| (f32::from(i8::from_le_bytes(*bytes)), rest)),
            Kind::Short => data.split_first_chunk().map(|(bytes, rest)| (f32::from(i16::from_le_bytes(*bytes)), rest)),
        }?;
        *data = rest;
        Some(number)
    }
}
