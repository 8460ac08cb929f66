//! Damage done to inputs by somebody who knows how they are written: numbers that no reader likes where
//! numbers stand, sections twice, missing, exchanged or of another input, bits and bytes anywhere, ends cut
//! off. The same seed does the same damage.

use biplane_mock::rng::Rng;

use crate::inputs::Form;

/// What texts have where a number should be.
const WORDS: &[&str] = &[
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e400",
    "1e-320",
    "0",
    "-0",
    "-1",
    "1",
    "",
    "0.5",
    "256",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "99999999999999999999999999",
    "1e9",
    "1e7",
    "0x10",
    "1_000",
    "true",
    "\"",
    "[",
    "]",
    "{",
    "=",
    "#",
    "\u{661}",
    "\u{0}",
];
/// What counts and lengths become.
const COUNTS: &[u64] = &[
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x100,
    0x7FFF,
    0x8000,
    0xFFFF,
    0x1_0000,
    0x0FFF_FFFF,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF,
    0x1_0000_0000,
    0x7FFF_FFFF_FFFF_FFFF,
    0x8000_0000_0000_0000,
    u64::MAX,
];
/// What measured numbers become.
const NUMBERS: &[f64] = &[
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    1e308,
    -1e308,
    1e18,
    -1e18,
    1e9,
    -1e9,
    0.0,
    -0.0,
    1.0,
    -1.0,
];
/// Longest input that comes of it, bytes.
const LONGEST: usize = 1 << 16;

/// One of `inputs`, damaged one to four times; parts of the others may get in.
#[must_use]
pub fn damaged(form: Form, inputs: &[Vec<u8>], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = choose(inputs, rng).cloned().unwrap_or_default();
    for _ in 0..=below(4, rng) {
        match form {
            Form::Text if below(2, rng) == 0 => strike_text(&mut bytes, rng),
            _ => strike(&mut bytes, inputs, rng),
        }
        bytes.truncate(LONGEST);
    }
    bytes
}

/// The same to one input alone.
#[must_use]
pub fn damaged_by_seed(form: Form, input: &[u8], seed: u64) -> Vec<u8> {
    damaged(form, &[input.to_vec()], &mut Rng::new(seed, 0xF022, 1))
}

/// A number below `bound`, 0 for none.
fn below(bound: usize, rng: &mut Rng) -> usize {
    (rng.unit() * bound as f64) as usize
}

fn choose<'a, T>(list: &'a [T], rng: &mut Rng) -> Option<&'a T> {
    list.get(below(list.len(), rng))
}

/// A piece of `length` bytes: mostly a short one.
fn piece(length: usize, rng: &mut Rng) -> std::ops::Range<usize> {
    let from = below(length + 1, rng);
    let longest = if below(4, rng) == 0 { length } else { 16 };
    from..(from + below(longest + 1, rng)).min(length)
}

/// Damage that knows nothing of lines and words.
fn strike(bytes: &mut Vec<u8>, inputs: &[Vec<u8>], rng: &mut Rng) {
    let at = below(bytes.len(), rng);
    match below(10, rng) {
        0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << (at % 8)),
        1 => {
            let value = rng.bits() as u8;
            bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = value);
        }
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(piece(bytes.len(), rng))),
        4 => {
            let part = bytes[piece(bytes.len(), rng)].repeat(1 + below(8, rng));
            bytes.splice(at..at, part);
        }
        5 => {
            let other = choose(inputs, rng).cloned().unwrap_or_default();
            let part = other[piece(other.len(), rng)].to_vec();
            bytes.splice(at..at, part);
        }
        6 => {
            let other = choose(inputs, rng).cloned().unwrap_or_default();
            bytes.truncate(at);
            bytes.extend(&other[below(other.len() + 1, rng)..]);
        }
        7 | 8 => overwrite_count(bytes, at, rng),
        _ => overwrite_number(bytes, at, rng),
    }
}

/// A count or length becomes one that cannot be true.
fn overwrite_count(bytes: &mut [u8], at: usize, rng: &mut Rng) {
    let near = (bytes.len() as u64).wrapping_add(below(5, rng) as u64).wrapping_sub(2);
    let count = if below(6, rng) == 0 { near } else { choose(COUNTS, rng).copied().unwrap_or(0) };
    let width = 1 << below(4, rng);
    let mut written = count.to_le_bytes()[..width].to_vec();
    if below(4, rng) == 0 {
        written.reverse();
    }
    overwrite(bytes, at, &written);
}

/// A measured number becomes one that was never measured.
fn overwrite_number(bytes: &mut [u8], at: usize, rng: &mut Rng) {
    let number = choose(NUMBERS, rng).copied().unwrap_or(0.0);
    // Numbers mostly stand at multiples of four.
    let at = if below(2, rng) == 0 { at & !3 } else { at };
    if below(2, rng) == 0 {
        overwrite(bytes, at, &number.to_le_bytes());
    } else {
        overwrite(bytes, at, &(number as f32).to_le_bytes());
    }
}

fn overwrite(bytes: &mut [u8], at: usize, written: &[u8]) {
    bytes.iter_mut().skip(at).zip(written).for_each(|(byte, value)| *byte = *value);
}

/// Damage to words and lines.
fn strike_text(bytes: &mut Vec<u8>, rng: &mut Rng) {
    let is_between = |byte: &u8| byte.is_ascii_whitespace() || b",=[]{}/".contains(byte);
    match below(4, rng) {
        0 | 1 => {
            let at = below(bytes.len(), rng);
            let from = bytes[..at].iter().rposition(is_between).map_or(0, |place| place + 1);
            let to = bytes[from..].iter().position(is_between).map_or(bytes.len(), |length| from + length);
            bytes.splice(from..to, choose(WORDS, rng).copied().unwrap_or("").bytes());
        }
        _ => {
            let mut lines: Vec<Vec<u8>> =
                bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
            if lines.is_empty() {
                return;
            }
            let (one, other) = (below(lines.len(), rng), below(lines.len(), rng));
            match below(3, rng) {
                0 => drop(lines.remove(one)),
                1 => lines.swap(one, other),
                _ => {
                    let copies = vec![lines[one].clone(); 1 + below(30, rng)];
                    lines.splice(other..other, copies);
                }
            }
            *bytes = lines.concat();
        }
    }
}
