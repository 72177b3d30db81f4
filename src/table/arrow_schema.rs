//! The Arrow schema in a Parquet file's metadata: it carries the unit of each field to pyarrow, polars and others.
//!
//! It is an Arrow IPC message (flatbuffers, base64) under the key `ARROW:schema`. The numbers of slots and the codes
//! are those of Arrow's `Message.fbs` and `Schema.fbs`.

use super::{Column, Values};
use base64::prelude::{BASE64_STANDARD, Engine};
use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, VOffsetT, WIPOffset};
use std::collections::HashMap;

/// Key of the schema in a file's metadata.
pub(super) const KEY: &str = "ARROW:schema";
/// Key of the unit in a field's metadata.
const UNIT: &str = "unit";
/// What stands before a message: it is one, and its length follows.
const CONTINUATION: [u8; 4] = [0xff; 4];

mod message {
    pub const VERSION: usize = 0;
    pub const HEADER_KIND: usize = 1;
    pub const HEADER: usize = 2;
    pub const VERSION_5: i16 = 4;
    pub const SCHEMA: u8 = 1;
}
mod schema {
    pub const FIELDS: usize = 1;
}
mod field {
    pub const NAME: usize = 0;
    pub const NULLABLE: usize = 1;
    pub const KIND: usize = 2;
    pub const TYPE: usize = 3;
    pub const CHILDREN: usize = 5;
    pub const METADATA: usize = 6;
    pub const INT: u8 = 2;
    pub const FLOATING_POINT: u8 = 3;
    pub const UTF8: u8 = 5;
    pub const BOOL: u8 = 6;
}
mod pair {
    pub const KEY: usize = 0;
    pub const VALUE: usize = 1;
}

type Builder<'a> = FlatBufferBuilder<'a>;
type Made = WIPOffset<flatbuffers::TableFinishedWIPOffset>;

/// Where the table's directory tells the place of a slot.
fn slot(number: usize) -> VOffsetT {
    4 + 2 * number as VOffsetT
}

/// The schema of these columns.
pub(super) fn encode(columns: &[Column]) -> String {
    let mut builder = Builder::new();
    let fields: Vec<Made> = columns.iter().map(|column| build_field(&mut builder, column)).collect();
    let fields = builder.create_vector(&fields);
    let start = builder.start_table();
    builder.push_slot_always(slot(schema::FIELDS), fields);
    let schema = builder.end_table(start);
    let start = builder.start_table();
    builder.push_slot_always(slot(message::HEADER), schema);
    builder.push_slot_always(slot(message::VERSION), message::VERSION_5);
    builder.push_slot_always(slot(message::HEADER_KIND), message::SCHEMA);
    let message = builder.end_table(start);
    builder.finish_minimal(message);
    let message = builder.finished_data();
    BASE64_STANDARD.encode([&CONTINUATION, &(message.len() as u32).to_le_bytes(), message].concat())
}

fn build_field(builder: &mut Builder, column: &Column) -> Made {
    let name = builder.create_string(&column.name);
    let (key, value) = (builder.create_string(UNIT), builder.create_string(&column.unit));
    let start = builder.start_table();
    builder.push_slot_always(slot(pair::KEY), key);
    builder.push_slot_always(slot(pair::VALUE), value);
    let unit = builder.end_table(start);
    let metadata = builder.create_vector(&[unit]);
    let children = builder.create_vector::<ForwardsUOffset<UnionWIPOffset>>(&[]);
    let (kind, of_kind) = build_type(builder, &column.values);
    let start = builder.start_table();
    builder.push_slot_always(slot(field::NAME), name);
    builder.push_slot_always(slot(field::TYPE), of_kind);
    builder.push_slot_always(slot(field::CHILDREN), children);
    builder.push_slot_always(slot(field::METADATA), metadata);
    builder.push_slot_always(slot(field::KIND), kind);
    builder.push_slot_always(slot(field::NULLABLE), column.values.is_nullable());
    builder.end_table(start)
}

fn build_type(builder: &mut Builder, values: &Values) -> (u8, Made) {
    let start = builder.start_table();
    let kind = match values {
        Values::Index(_) => {
            // Width in bits; the second slot, left out, says unsigned.
            builder.push_slot_always(slot(0), 64_i32);
            field::INT
        }
        Values::Double(_) | Values::Single(_) => {
            let precision: i16 = if matches!(values, Values::Double(_)) { 2 } else { 1 };
            builder.push_slot_always(slot(0), precision);
            field::FLOATING_POINT
        }
        Values::Status(_) | Values::Text(_) => field::UTF8,
        Values::Flag(_) => field::BOOL,
    };
    (kind, builder.end_table(start))
}

/// Units by name of a column; empty if the text is no schema.
pub(super) fn units(text: &str) -> HashMap<String, String> {
    let bytes = BASE64_STANDARD.decode(text).unwrap_or_default();
    read_units(&bytes).unwrap_or_default()
}

fn read_units(bytes: &[u8]) -> Option<HashMap<String, String>> {
    // The length stands behind the mark, or alone in files of old.
    let message = bytes.get(if bytes.starts_with(&CONTINUATION) { 8 } else { 4 }..)?;
    let schema = Flat { bytes: message, at: 0 }.follow()?.slot(message::HEADER)?.follow()?;
    let mut units = HashMap::new();
    for field in schema.slot(schema::FIELDS)?.follow()?.items()? {
        let field = field.follow()?;
        let Some(metadata) = field.slot(field::METADATA) else { continue };
        for pair in metadata.follow()?.items()? {
            let pair = pair.follow()?;
            if pair.slot(pair::KEY)?.follow()?.text()? == UNIT {
                let unit = pair.slot(pair::VALUE)?.follow()?.text()?;
                units.insert(field.slot(field::NAME)?.follow()?.text()?.to_owned(), unit.to_owned());
            }
        }
    }
    Some(units)
}

/// A place in a flatbuffer. Every step stays within it, or is `None`.
#[derive(Clone, Copy)]
struct Flat<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Flat<'a> {
    fn number<const WIDTH: usize>(self, at: usize) -> Option<[u8; WIDTH]> {
        self.bytes.get(at..)?.first_chunk().copied()
    }

    fn length(self) -> Option<usize> {
        Some(u32::from_le_bytes(self.number(self.at)?) as usize)
    }

    /// Where the offset that stands here leads.
    fn follow(self) -> Option<Self> {
        Some(Self { at: self.at.checked_add(self.length()?)?, ..self })
    }

    /// A slot of the table that stands here, if it is filled.
    fn slot(self, number: usize) -> Option<Self> {
        let back = i32::from_le_bytes(self.number(self.at)?);
        let directory = usize::try_from(self.at as i64 - i64::from(back)).ok()?;
        let size = u16::from_le_bytes(self.number(directory)?);
        let place = slot(number);
        if place >= size {
            return None;
        }
        let offset = usize::from(u16::from_le_bytes(self.number(directory + usize::from(place))?));
        (offset > 0).then_some(Self { at: self.at + offset, ..self })
    }

    /// Places of the offsets of the vector that stands here.
    fn items(self) -> Option<impl Iterator<Item = Self>> {
        let (start, count) = (self.at + 4, self.length()?);
        self.bytes.get(start..start.checked_add(count.checked_mul(4)?)?)?;
        Some((0..count).map(move |index| Self { at: start + 4 * index, ..self }))
    }

    fn text(self) -> Option<&'a str> {
        let bytes = self.bytes.get(self.at.checked_add(4)?..)?.get(..self.length()?)?;
        std::str::from_utf8(bytes).ok()
    }
}
