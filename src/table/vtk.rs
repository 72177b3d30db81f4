//! Files of VTK, for ParaView and its like: triangles (`.vtp`) and dense grids of voxels (`.vti`) with a table's columns.
//!
//! XML with appended raw data, compressed by blocks with zlib. Counts are `UInt64`, numbers `Float64` or `Float32` with
//! NaN for none, flags `Int8`: 1, 0, or -1 where it is unknown. Words are `Int16`: places in the list `NAME.words` among
//! the file's field data, -1 for none. Units are the arrays' `UNITS_LABEL`. What speaks against the data is a comment, and
//! the word `distrusted` among the field data.

use super::triangles::codes;
use super::{Column, Lattice, Table, TableError, Triangles, Values};
use crate::text::xml;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use std::fmt::Write as _;
use std::io::Write;

/// Most cells of a dense grid.
pub const MOST_CELLS: u64 = 64_000_000;
/// Bytes of a block before compression, a multiple of every number's width.
const BLOCK: usize = 1 << 16;
const IMAGE: &str = "VTI";

/// A `.vtp` file of triangles, with normals and the table's columns at their points. Coordinates are in m.
///
/// # Errors
///
/// Rows, normals or corners that do not fit the points.
pub fn poly_data(surface: &Triangles) -> Result<Vec<u8>, TableError> {
    surface.check("VTP")?;
    let columns: Vec<Encoded> = surface.data.columns.iter().map(Encoded::new).collect();
    let mut file = File::open("PolyData", "", &columns, surface.mark);
    let (points, triangles) = (surface.points.len(), surface.triangles.len());
    file.line(&format!(
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{triangles}\">"
    ));
    let vectors =
        |vectors: &[[f64; 3]]| compress(vectors.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect());
    if surface.normals.is_empty() {
        file.line("<PointData>");
    } else {
        file.line("<PointData Normals=\"Normals\">");
        file.array("Normals", "Float64", 3, "", &vectors(surface.normals));
    }
    for column in columns {
        file.array(column.name, column.kind, 1, column.unit, &compress(column.bytes));
    }
    file.line("</PointData>\n<Points>");
    file.array("Points", "Float64", 3, "m", &vectors(surface.points));
    file.line("</Points>\n<Polys>");
    let corners = surface.triangles.as_flattened().iter().flat_map(|corner| i64::from(*corner).to_le_bytes());
    file.array("connectivity", "Int64", 1, "", &compress(corners.collect()));
    let ends = (1..=triangles as i64).flat_map(|triangle| (3 * triangle).to_le_bytes());
    file.array("offsets", "Int64", 1, "", &compress(ends.collect()));
    file.line("</Polys>\n</Piece>");
    Ok(file.close("PolyData"))
}

/// A `.vti` file: every voxel of the box around the rows of a table as a cell, with the table's columns. Cells without a
/// row have no number, and count nothing. Of several rows of one voxel the first counts. `mark` says what speaks against them.
///
/// # Errors
///
/// A table without voxels, or a box of more than [`MOST_CELLS`] of them.
pub fn image_data(lattice: &Lattice, table: &Table, mark: Option<&str>) -> Result<Vec<u8>, TableError> {
    let unwritable = |reason: String| TableError::Unwritable { format: IMAGE, reason };
    let voxels =
        lattice.voxels(table).ok_or_else(|| unwritable("it has no columns voxel.x, voxel.y, voxel.z".into()))?;
    let first = voxels.iter().flatten().copied().reduce(|a, b| std::array::from_fn(|k| a[k].min(b[k])));
    let last = voxels.iter().flatten().copied().reduce(|a, b| std::array::from_fn(|k| a[k].max(b[k])));
    let (Some(first), Some(last)) = (first, last) else { return Err(unwritable("it has no voxel".into())) };
    let counts: [u64; 3] = std::array::from_fn(|k| (i64::from(last[k]) - i64::from(first[k])) as u64 + 1);
    let cells = counts.iter().try_fold(1u64, |cells, count| cells.checked_mul(*count)).unwrap_or(u64::MAX);
    if cells > MOST_CELLS {
        let [x, y, z] = counts;
        return Err(unwritable(format!("{x} x {y} x {z} cells are more than {MOST_CELLS}: choose larger voxels")));
    }
    let cell = |voxel: [i32; 3]| {
        let [x, y, z]: [u64; 3] = std::array::from_fn(|k| (i64::from(voxel[k]) - i64::from(first[k])) as u64);
        ((z * counts[1] + y) * counts[0] + x) as usize
    };
    let mut rows: Vec<(usize, usize)> =
        voxels.iter().enumerate().filter_map(|(row, voxel)| Some((cell((*voxel)?), row))).collect();
    rows.sort_unstable();
    rows.dedup_by_key(|(cell, _)| *cell);
    let columns: Vec<Encoded> =
        table.columns.iter().filter(|column| !column.name.starts_with("voxel.")).map(Encoded::new).collect();
    let data: Vec<Vec<u8>> = columns.par_iter().map(|column| column.dense(&rows, cells as usize)).collect();
    let [x, y, z] = counts;
    let extent = format!("0 {x} 0 {y} 0 {z}");
    let corner = lattice.place(first.map(|index| f64::from(index) - 0.5)).map(|x| format!("{x:?}")).join(" ");
    let spacing = lattice.spacing;
    let about =
        format!(" WholeExtent=\"{extent}\" Origin=\"{corner}\" Spacing=\"{spacing:?} {spacing:?} {spacing:?}\"");
    let mut file = File::open("ImageData", &about, &columns, mark);
    file.line(&format!("<Piece Extent=\"{extent}\">\n<CellData>"));
    for (column, data) in columns.iter().zip(&data) {
        file.array(column.name, column.kind, 1, column.unit, data);
    }
    file.line("</CellData>\n</Piece>");
    Ok(file.close("ImageData"))
}

/// A column as VTK's numbers.
struct Encoded<'a> {
    name: &'a str,
    unit: &'a str,
    kind: &'static str,
    /// Of all rows, little endian.
    bytes: Vec<u8>,
    /// Of a cell without a row.
    none: Vec<u8>,
    words: Vec<&'a str>,
}

impl<'a> Encoded<'a> {
    fn new(column: &'a Column) -> Self {
        let mut words = Vec::new();
        let mut of_words = |(codes, known): (Vec<i16>, Vec<&'a str>)| {
            words = known;
            ("Int16", codes.into_iter().flat_map(i16::to_le_bytes).collect(), (-1i16).to_le_bytes().to_vec())
        };
        let (kind, bytes, none): (_, Vec<u8>, _) = match &column.values {
            Values::Index(values) => {
                ("UInt64", values.iter().flat_map(|x| x.to_le_bytes()).collect(), 0u64.to_le_bytes().to_vec())
            }
            Values::Double(values) => {
                ("Float64", values.iter().flat_map(|x| x.to_le_bytes()).collect(), f64::NAN.to_le_bytes().to_vec())
            }
            Values::Single(values) => {
                ("Float32", values.iter().flat_map(|x| x.to_le_bytes()).collect(), f32::NAN.to_le_bytes().to_vec())
            }
            Values::Flag(values) => {
                let flag = |flag: &Option<bool>| flag.map_or(-1i8, i8::from).to_le_bytes();
                ("Int8", values.iter().flat_map(flag).collect(), (-1i8).to_le_bytes().to_vec())
            }
            Values::Status(values) => of_words(codes(values.iter().map(|status| status.name()))),
            Values::Text(values) => of_words(codes(values.iter().map(String::as_str))),
        };
        Self { name: &column.name, unit: &column.unit, kind, bytes, none, words }
    }

    /// One number a cell, compressed; `rows` are pairs of a cell and its row, by cells.
    fn dense(&self, rows: &[(usize, usize)], cells: usize) -> Vec<u8> {
        let width = self.none.len();
        let in_block = BLOCK / width;
        let nothing = self.none.repeat(in_block);
        let mut no_row = None;
        let mut blocks = Blocks::default();
        let mut rest = rows;
        for start in (0..cells).step_by(in_block) {
            let count = in_block.min(cells - start);
            let (here, after) = rest.split_at(rest.partition_point(|(cell, _)| *cell < start + count));
            rest = after;
            if here.is_empty() && count == in_block {
                blocks.push_compressed(no_row.get_or_insert_with(|| zlib(&nothing)), nothing.len());
                continue;
            }
            let mut block = nothing[..count * width].to_vec();
            for (cell, row) in here {
                let at = (cell - start) * width;
                block[at..at + width].copy_from_slice(&self.bytes[row * width..(row + 1) * width]);
            }
            blocks.push_compressed(&zlib(&block), block.len());
        }
        blocks.finish()
    }
}

/// Compressed blocks of one array.
#[derive(Default)]
struct Blocks {
    /// Bytes of each after compression, and of the last before it.
    sizes: Vec<u64>,
    last: usize,
    data: Vec<u8>,
}

impl Blocks {
    fn push_compressed(&mut self, bytes: &[u8], size_before: usize) {
        self.sizes.push(bytes.len() as u64);
        self.last = size_before;
        self.data.extend_from_slice(bytes);
    }

    /// How many blocks there are and how large, then the blocks.
    fn finish(self) -> Vec<u8> {
        let partial = if self.last == BLOCK { 0 } else { self.last };
        let head = [self.sizes.len() as u64, BLOCK as u64, partial as u64];
        let head = head.iter().chain(&self.sizes).flat_map(|x| x.to_le_bytes());
        head.chain(self.data).collect()
    }
}

fn compress(bytes: Vec<u8>) -> Vec<u8> {
    let mut blocks = Blocks::default();
    bytes.chunks(BLOCK).for_each(|block| blocks.push_compressed(&zlib(block), block.len()));
    blocks.finish()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    // Memory takes whatever is written.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// A file in the making: its XML, and the data that follow it.
struct File {
    xml: String,
    appended: Vec<u8>,
}

impl File {
    /// The beginning, down to the words for which numbers stand.
    fn open(kind: &str, about: &str, columns: &[Encoded], mark: Option<&str>) -> Self {
        let mut file = Self { xml: "<?xml version=\"1.0\"?>\n".into(), appended: Vec::new() };
        if let Some(mark) = mark {
            // Two hyphens would end the comment.
            file.line(&format!("<!-- {} -->", xml(&mark.replace("--", "- -"))));
        }
        file.line(&format!(
            "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
             compressor=\"vtkZLibDataCompressor\">\n<{kind}{about}>"
        ));
        let of_columns = columns.iter().filter(|column| !column.words.is_empty());
        let lists: Vec<(String, &[&str])> = of_columns
            .map(|column| (format!("{}.words", column.name), column.words.as_slice()))
            .chain(mark.as_ref().map(|mark| ("distrusted".to_owned(), std::slice::from_ref(mark))))
            .collect();
        if !lists.is_empty() {
            file.line("<FieldData>");
            for (name, words) in lists {
                let (name, count) = (xml(&name), words.len());
                let letters = words.iter().flat_map(|word| word.bytes().chain([0]));
                let letters: Vec<String> = letters.map(|letter| letter.to_string()).collect();
                file.line(&format!(
                    "<Array type=\"String\" Name=\"{name}\" NumberOfTuples=\"{count}\" format=\"ascii\">\n{}\n</Array>",
                    letters.join(" ")
                ));
            }
            file.line("</FieldData>");
        }
        file
    }

    fn line(&mut self, line: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.xml, "{line}");
    }

    fn array(&mut self, name: &str, kind: &str, components: usize, unit: &str, data: &[u8]) {
        let (name, offset) = (xml(name), self.appended.len());
        let start = format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{offset}\""
        );
        if unit.is_empty() {
            self.line(&format!("{start}/>"));
        } else {
            let key = "<InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">";
            self.line(&format!("{start}>\n{key}{}</InformationKey>\n</DataArray>", xml(unit)));
        }
        self.appended.extend_from_slice(data);
    }

    fn close(mut self, kind: &str) -> Vec<u8> {
        self.line(&format!("</{kind}>"));
        self.xml += "<AppendedData encoding=\"raw\">\n_";
        let mut bytes = self.xml.into_bytes();
        bytes.extend_from_slice(&self.appended);
        bytes.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
        bytes
    }
}
