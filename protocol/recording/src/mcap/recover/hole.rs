//! Bytes of a file that never came to the disk: it grew, and zeros stand where its data should be.

use crate::mcap::records::ChunkHeader;

/// The smallest piece that a disk writes: a run of so many zeros at such a place was never written.
const SECTOR: u64 = 512;
/// Fewer zeros at a sector's end are no sign of anything: packed bytes have them too.
const SHORTEST_HOLE: usize = 8;

/// Where a part of a packed chunk begins that was never written. Where nothing is packed, zeros may well be
/// data.
pub(crate) fn hole_in(header: &ChunkHeader, packed: &[u8], start: u64) -> Option<usize> {
    if header.compression.is_empty() { None } else { find_hole(packed, start) }
}

/// What lies before the zeros that a file may have grown by without its data.
pub(crate) fn written(packed: &[u8]) -> &[u8] {
    let zeros = packed.iter().rev().take_while(|byte| **byte == 0).count();
    let end = if zeros >= SHORTEST_HOLE { packed.len() - zeros } else { packed.len() };
    packed.get(..end).unwrap_or_default()
}

/// Where in `bytes`, which stand at `offset` in the file, a sector of the disk was never written, or not to
/// its end: zeros up to where it ends, or the bytes do.
fn find_hole(bytes: &[u8], offset: u64) -> Option<usize> {
    let first = ((offset.next_multiple_of(SECTOR) - offset) as usize).min(bytes.len());
    let (head, rest) = bytes.split_at(first);
    let mut end = 0;
    for sector in std::iter::once(head).chain(rest.chunks(SECTOR as usize)) {
        end += sector.len();
        let zeros = sector.iter().rev().take_while(|byte| **byte == 0).count();
        if zeros >= SHORTEST_HOLE {
            return Some(end - zeros);
        }
    }
    None
}
