//! A walk through the Thrift of a footer or a page header before the Parquet crate reads it.
//!
//! The crate skips what it does not know entry by entry, takes no byte for a flag in a list, and reads fields that it knows
//! without a look at their type. A kilobyte can so make it count to 131 million, often. Here a list has at most as many
//! entries as there are bytes, a known field has the type of the format, and no list holds flags: so much as passes is read
//! by both alike. Encoding: thrift/doc/specs/thrift-compact-protocol.md; fields: parquet-format/src/main/thrift/parquet.thrift.

/// Of structures and lists within one another.
const DEEPEST: u32 = 64;

/// What a field holds.
#[derive(Clone, Copy)]
enum Kind {
    /// Unknown fields, and those that are skipped.
    Any,
    Flag,
    Byte,
    /// An integer of any width, or a word from a list of words.
    Integer,
    Double,
    /// Text, too.
    Bytes,
    List(&'static Kind),
    /// Its fields from number 1 on.
    Struct(&'static [Kind]),
}

use Kind::{Any, Byte, Bytes, Double, Flag, Integer, List, Struct};

const EMPTY: Kind = Struct(&[]);
const STATISTICS: Kind = Struct(&[Bytes, Bytes, Integer, Integer, Bytes, Bytes, Flag, Flag, Integer]);
const KEY_VALUE: Kind = Struct(&[Bytes, Bytes]);
const TIME_UNIT: Kind = Struct(&[EMPTY, EMPTY, EMPTY]);
const TIME: Kind = Struct(&[Flag, TIME_UNIT]);
const LOGICAL_TYPE: Kind = Struct(&[
    EMPTY,                       // text
    EMPTY,                       // map
    EMPTY,                       // list
    EMPTY,                       // enumeration
    Struct(&[Integer, Integer]), // decimal
    EMPTY,                       // date
    TIME,
    TIME, // with a date
    Any,
    Struct(&[Byte, Flag]), // integer
    EMPTY,                 // unknown
    EMPTY,                 // JSON
    EMPTY,                 // BSON
    EMPTY,                 // UUID
    EMPTY,                 // half precision
    Struct(&[Byte]),       // variant
    Struct(&[Bytes]),      // geometry
    Struct(&[Bytes, Integer]),
    EMPTY, // file
]);
const SCHEMA_ELEMENT: Kind =
    Struct(&[Integer, Integer, Integer, Bytes, Integer, Integer, Integer, Integer, Integer, LOGICAL_TYPE]);
const BOUNDING_BOX: Kind = Struct(&[Double; 8]);
const COLUMN_METADATA: Kind = Struct(&[
    Integer,
    List(&Integer),
    List(&Bytes),
    Integer,
    Integer,
    Integer,
    Integer,
    List(&KEY_VALUE),
    Integer,
    Integer,
    Integer,
    STATISTICS,
    List(&Struct(&[Integer, Integer, Integer])),
    Integer,
    Integer,
    Struct(&[Integer, List(&Integer), List(&Integer)]),
    Struct(&[BOUNDING_BOX, List(&Integer)]),
]);
const COLUMN_CHUNK: Kind = Struct(&[Bytes, Integer, COLUMN_METADATA, Integer, Integer, Integer, Integer]);
const SORTING_COLUMN: Kind = Struct(&[Integer, Flag, Flag]);
const ROW_GROUP: Kind =
    Struct(&[List(&COLUMN_CHUNK), Integer, Integer, List(&SORTING_COLUMN), Integer, Integer, Integer]);
const FOOTER: &[Kind] = &[
    Integer,
    List(&SCHEMA_ELEMENT),
    Integer,
    List(&ROW_GROUP),
    List(&KEY_VALUE),
    Bytes,
    List(&Struct(&[EMPTY, EMPTY, EMPTY])), // orders of columns
];
const PAGE_HEADER: &[Kind] = &[
    Integer,
    Integer,
    Integer,
    Integer,
    Struct(&[Integer, Integer, Integer, Integer, STATISTICS]),
    EMPTY, // of an index
    Struct(&[Integer, Integer, Flag]),
    Struct(&[Integer, Integer, Integer, Integer, Integer, Integer, Flag, STATISTICS]),
];

const ENDS: &str = "it ends before";

/// What is wrong with the bytes of a footer.
pub(super) fn check_footer(bytes: &[u8]) -> Result<(), &'static str> {
    Walk { rest: bytes }.fields(FOOTER, DEEPEST)
}

/// What is wrong with the page header that bytes begin with.
pub(super) fn check_page_header(bytes: &[u8]) -> Result<(), &'static str> {
    Walk { rest: bytes }.fields(PAGE_HEADER, DEEPEST)
}

struct Walk<'a> {
    rest: &'a [u8],
}

/// Numbers of the types, as fields have them.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;
const UUID: u8 = 13;

impl Walk<'_> {
    fn fields(&mut self, kinds: &'static [Kind], depth: u32) -> Result<(), &'static str> {
        let mut id: i16 = 0;
        loop {
            let head = self.byte()?;
            let of = head & 0xf;
            if of == 0 {
                return Ok(());
            }
            id = match head >> 4 {
                0 => self.number().map(|number| (number >> 1) as i64 ^ -((number & 1) as i64))?.try_into().ok(),
                step => id.checked_add(step.into()),
            }
            .ok_or("a field has a number that no field has")?;
            let known = usize::try_from(id).ok().and_then(|id| kinds.get(id.checked_sub(1)?));
            self.value(*known.unwrap_or(&Any), of, depth)?;
        }
    }

    fn value(&mut self, kind: Kind, of: u8, depth: u32) -> Result<(), &'static str> {
        let depth = depth.checked_sub(1).ok_or("it nests too deeply")?;
        match (kind, of) {
            (Any | Flag, TRUE | FALSE) => Ok(()),
            (Any | Byte, BYTE) => self.skip(1),
            (Any | Integer, 4..=6) => self.number().map(drop),
            (Any | Double, DOUBLE) => self.skip(8),
            (Any | Bytes, BINARY) => self.number().and_then(|length| self.skip(length)),
            (Any, LIST | SET) => self.list(Any, depth),
            (List(entry), LIST | SET) => self.list(*entry, depth),
            (Any, MAP) => self.map(depth),
            (Any, STRUCT) => self.fields(&[], depth),
            (Struct(kinds), STRUCT) => self.fields(kinds, depth),
            (Any, UUID) => self.skip(16),
            _ => Err("a field has a type that it cannot have"),
        }
    }

    fn list(&mut self, entry: Kind, depth: u32) -> Result<(), &'static str> {
        let head = self.byte()?;
        let count = match head >> 4 {
            15 => self.number()?,
            count => count.into(),
        };
        self.entries(count, &[(entry, head & 0xf)], depth)
    }

    fn map(&mut self, depth: u32) -> Result<(), &'static str> {
        match self.number()? {
            0 => Ok(()),
            count => {
                let of = self.byte()?;
                self.entries(count, &[(Any, of >> 4), (Any, of & 0xf)], depth)
            }
        }
    }

    /// So many entries of the same one or two parts, each of a byte at least.
    fn entries(&mut self, count: u64, parts: &[(Kind, u8)], depth: u32) -> Result<(), &'static str> {
        if count > self.rest.len() as u64 {
            return Err("a list has more entries than there are bytes");
        }
        if count > 0 && parts.iter().any(|(_, of)| matches!(*of, TRUE | FALSE)) {
            return Err("it has a list of flags, which this format has not");
        }
        for _ in 0..count {
            parts.iter().try_for_each(|(kind, of)| self.value(*kind, *of, depth))?;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<u64, &'static str> {
        let mut number = 0;
        for place in 0..10 {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << (7 * place);
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("a number is too long")
    }

    fn byte(&mut self) -> Result<u8, &'static str> {
        let (first, rest) = self.rest.split_first().ok_or(ENDS)?;
        self.rest = rest;
        Ok(*first)
    }

    fn skip(&mut self, length: u64) -> Result<(), &'static str> {
        self.rest = usize::try_from(length).ok().and_then(|length| self.rest.get(length..)).ok_or(ENDS)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const END: u8 = 0;

    /// A field that no structure knows, of the type.
    fn unknown(of: u8, value: &[u8]) -> Vec<u8> {
        [&[of, 0xc8, 0x01], value, &[END]].concat()
    }

    fn said(bytes: &[u8]) -> Result<(), &'static str> {
        assert_eq!(check_footer(bytes), check_page_header(bytes));
        check_footer(bytes)
    }

    #[test]
    fn lists_are_no_longer_than_what_holds_them() {
        const MORE: Result<(), &str> = Err("a list has more entries than there are bytes");
        // 131 million flags; the same of bytes, as a set, and as a map of numbers.
        for of in [0xf1, 0xf2, 0xf3, 0xfc] {
            assert_eq!(said(&unknown(LIST, &[of, 0xff, 0xff, 0xff, 0x3e])), MORE);
            assert_eq!(said(&unknown(SET, &[of, 0xff, 0xff, 0xff, 0x3e])), MORE);
        }
        assert_eq!(said(&unknown(MAP, &[0xff, 0xff, 0xff, 0x3e, 0x55])), MORE);
        assert_eq!(said(&unknown(LIST, &[0x33, 1, 2, 3])), Ok(()));
        assert_eq!(said(&unknown(MAP, &[1, 0x58, 7, 2, b'a', b'b'])), Ok(()));
        assert_eq!(said(&unknown(LIST, &[0x27, 1, 2])), Err(ENDS));
        // A structure takes a byte at least.
        assert_eq!(said(&unknown(LIST, &[0x2c, END, END])), Ok(()));
    }

    #[test]
    fn flags_stand_alone() {
        const FLAGS: Result<(), &str> = Err("it has a list of flags, which this format has not");
        assert_eq!(said(&unknown(TRUE, &[])), Ok(()));
        assert_eq!(said(&unknown(LIST, &[0x22, 1, 2])), FLAGS);
        assert_eq!(said(&unknown(MAP, &[1, 0x52, 1, 2])), FLAGS);
        assert_eq!(said(&unknown(LIST, &[0x02])), Ok(()));
    }

    #[test]
    fn known_fields_have_their_type() {
        // The first field of both is a number.
        assert_eq!(said(&[0x15, 2, END]), Ok(()));
        assert_eq!(said(&[0x16, 2, END]), Ok(()));
        assert_eq!(said(&[0x18, 1, b'a', END]), Err("a field has a type that it cannot have"));
        // Entries of a schema are structures.
        assert_eq!(check_footer(&[0x29, 0x15, 2, END]), Err("a field has a type that it cannot have"));
        assert_eq!(check_footer(&[0x29, 0x1c, 0x48, 1, b'a', END, END]), Ok(()));
    }

    #[test]
    fn nothing_is_endless() {
        let deep = |times| [&[0x1c][..], &[0x1c].repeat(times), &[END].repeat(times + 2)].concat();
        assert_eq!(Walk { rest: &deep(60) }.fields(&[], DEEPEST), Ok(()));
        assert_eq!(Walk { rest: &deep(64) }.fields(&[], DEEPEST), Err("it nests too deeply"));
        let lists = [0x19].repeat(1 << 20);
        assert_eq!(Walk { rest: &lists }.fields(&[], DEEPEST), Err("it nests too deeply"));
        assert_eq!(said(&[0x15; 1]), Err(ENDS));
        assert_eq!(said(&[&[0x15][..], &[0x80; 12]].concat()), Err("a number is too long"));
        assert_eq!(said(&unknown(BINARY, &[0xff, 0xff, 0x03])), Err(ENDS));
        assert_eq!(said(&[0x05, 0xff, 0xff, 0xff, 0x07]), Err("a field has a number that no field has"));
    }
}
