//! Streams to cut up, and what they are cut into.

use biplane_wire::framing::Framing;
use biplane_wire::lms::{DeviceDeframer, Scan};
use biplane_wire::{Counts, Deframer, Item, SkipReason};

use super::bytes;

/// An item that has left the deframer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Piece {
    Frame(u64, Vec<u8>),
    Control(u64, u8),
    Skipped(u64, usize, SkipReason),
}

impl From<Item<'_>> for Piece {
    fn from(item: Item<'_>) -> Self {
        match item {
            Item::Frame { offset, bytes } => Piece::Frame(offset, bytes.to_vec()),
            Item::Control { offset, byte } => Piece::Control(offset, byte),
            Item::Skipped { offset, count, reason } => Piece::Skipped(offset, count, reason),
        }
    }
}

/// All pieces of a stream that arrives in these chunks and then ends. Neighboring skips of one reason are
/// joined, since how long runs are handed out depends on the chunks. Checks that the pieces tile the stream.
pub(crate) fn pieces<'a, F: Framing, const N: usize>(
    mut deframer: Deframer<F, N>,
    chunks: impl IntoIterator<Item = &'a [u8]>,
) -> (Vec<Piece>, Counts) {
    let mut found: Vec<Piece> = Vec::new();
    let mut position = 0;
    let mut keep = |item: Item<'_>| {
        let piece = Piece::from(item);
        let (offset, length) = match &piece {
            Piece::Frame(offset, bytes) => (*offset, bytes.len()),
            Piece::Control(offset, _) => (*offset, 1),
            Piece::Skipped(offset, count, _) => (*offset, *count),
        };
        assert_eq!(offset, position, "pieces follow each other: {piece:?}");
        position += length as u64;
        match (found.last_mut(), piece) {
            (Some(Piece::Skipped(_, total, before)), Piece::Skipped(_, count, reason))
                if *before == reason =>
            {
                *total += count;
            }
            (_, piece) => found.push(piece),
        }
    };
    let mut pushed = 0;
    for chunk in chunks {
        deframer.feed(chunk, &mut keep);
        pushed += chunk.len() as u64;
        assert_eq!(deframer.position(), pushed);
        assert_eq!(deframer.counts().bytes() + deframer.buffered() as u64, pushed);
        assert!(deframer.buffered() < F::MAX_FRAME);
    }
    deframer.finish();
    while let Some(item) = deframer.next() {
        keep(item);
    }
    assert_eq!(position, pushed, "every byte is in one piece");
    assert_eq!(deframer.counts().bytes(), pushed, "every byte is in the account");
    (found, deframer.counts())
}

pub(crate) fn whole(stream: &[u8]) -> (Vec<Piece>, Counts) {
    pieces(DeviceDeframer::new(), [stream])
}

pub(crate) fn frames(found: &[Piece]) -> Vec<Vec<u8>> {
    let frame = |piece: &Piece| match piece {
        Piece::Frame(_, bytes) => Some(bytes.clone()),
        _ => None,
    };
    found.iter().filter_map(frame).collect()
}

/// A scan whose values hold the start of a telegram again and again.
pub(crate) fn scan(count: u16, seed: u16) -> Vec<u8> {
    let value = |i: u16| if i.is_multiple_of(7) { 0x8002 } else { i.wrapping_mul(seed) };
    let scan = Scan { values: (0..count).map(value).collect(), index: Some((2, 0x80)), ..Scan::default() };
    let mut out = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut out).unwrap();
    out
}

pub(crate) fn mode_done() -> Vec<u8> {
    bytes("02 80 03 00 A0 00 10 16 0A")
}
