//! A checksum of a file's footer, in the footer itself: what names, units, types and counts a column has is covered, too.
//!
//! It is taken with zeros in its own place.

use xxhash_rust::xxh3::xxh3_64;

/// Key of the checksum, the last of the file.
pub(super) const KEY: &str = "rodsweep.footer";
/// The value before the checksum is known.
pub(super) const UNSEALED: &str = "footer-xxh3:0000000000000000";
const MARK: &[u8] = b"footer-xxh3:";
const DIGITS: usize = 16;

/// Puts the checksum into all that follows the data.
pub(super) fn seal(footer: &mut [u8]) {
    if let Some(at) = place(footer) {
        let sum = format!("{:016x}", xxh3_64(footer));
        footer[at..at + DIGITS].copy_from_slice(sum.as_bytes());
    }
}

/// Whether all that follows the data is what was written; `None` where it carries no checksum.
pub fn is_sealed(footer: &[u8]) -> Option<bool> {
    let at = place(footer)?;
    let mut unsealed = footer.to_vec();
    unsealed[at..at + DIGITS].fill(b'0');
    Some(format!("{:016x}", xxh3_64(&unsealed)).as_bytes() == &footer[at..at + DIGITS])
}

/// Where the digits stand.
fn place(footer: &[u8]) -> Option<usize> {
    let at = footer.windows(MARK.len() + DIGITS).rposition(|bytes| bytes.starts_with(MARK))?;
    Some(at + MARK.len())
}
