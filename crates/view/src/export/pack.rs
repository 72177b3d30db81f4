//! Columns as small whole numbers: 16 bits over their range, differences of neighbours, byte by byte, deflated.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};
use std::io::Write;

/// Code of a number that is none.
const NONE: u16 = u16::MAX;
/// Steps between the ends of a range.
const STEPS: f64 = 65_534.0;

/// Blocks of numbers, one after another.
#[derive(Default)]
pub struct Pack {
    blocks: Vec<Value>,
    bytes: Vec<u8>,
    rounding: f64,
}

impl Pack {
    /// Numbers, each rounded to one of 65,535 even steps over their range; NaN is none.
    pub fn numbers(&mut self, group: &str, name: &str, unit: &str, values: &[f64]) {
        let finite = || values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let step = (high - low) / STEPS;
        let code = |x: &f64| match x.is_finite() {
            true if step > 0.0 => ((x - low) / step).round() as u16,
            true => 0,
            false => NONE,
        };
        let codes: Vec<u16> = values.iter().map(code).collect();
        if group == "points" && name.starts_with("tip.position") {
            self.rounding = self.rounding.max(0.5 * step);
        }
        let block = json!({ "group": group, "name": name, "unit": unit, "kind": "number", "count": codes.len(),
                            "low": low, "step": step });
        self.blocks.push(block);
        let mut before = 0u16;
        let differences = codes.iter().map(|code| {
            let difference = code.wrapping_sub(before);
            before = *code;
            difference.to_le_bytes()
        });
        self.planes(&differences.collect::<Vec<[u8; 2]>>());
    }

    /// Whole numbers, kept as they are.
    pub fn whole(&mut self, name: &str, values: &[u32]) {
        self.blocks.push(json!({ "group": "whole", "name": name, "kind": "whole", "count": values.len() }));
        let mut before = 0u32;
        let differences = values.iter().map(|value| {
            let difference = value.wrapping_sub(before);
            before = *value;
            difference.to_le_bytes()
        });
        self.planes(&differences.collect::<Vec<[u8; 4]>>());
    }

    /// Codes below 256, kept as they are.
    pub fn codes(&mut self, name: &str, values: &[u8]) {
        self.blocks.push(json!({ "group": "whole", "name": name, "kind": "code", "count": values.len() }));
        self.bytes.extend_from_slice(values);
    }

    /// All first bytes, then all second ones: those that hardly change compress well.
    fn planes<const WIDTH: usize>(&mut self, numbers: &[[u8; WIDTH]]) {
        for byte in 0..WIDTH {
            self.bytes.extend(numbers.iter().map(|number| number[byte]));
        }
    }

    /// What the blocks are, in their order.
    pub fn blocks(&self) -> &[Value] {
        &self.blocks
    }

    /// Largest rounding of a position (m).
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// All blocks, compressed (zlib).
    pub fn compressed(self) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory cannot fail.
        let _ = encoder.write_all(&self.bytes);
        encoder.finish().unwrap_or_default()
    }
}
