//! Ways to damage a file, by seed.

use std::ops::{Range, RangeInclusive};

/// The seeds of a test: a few, or as many as `BIPLANE_SEEDS` asks for.
pub(crate) fn seeds(few: u64) -> RangeInclusive<u64> {
    let many = std::env::var("BIPLANE_SEEDS").ok().and_then(|text| text.parse().ok());
    1..=many.unwrap_or(few)
}

/// Numbers that look random (SplitMix64: Steele, Lea, Flood 2014).
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xD6E8_FEB8_6659_FD93))
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit.max(1) as u64) as usize
    }
}

/// A damaged file.
pub(crate) struct Damage {
    /// What was done, in words.
    pub what: String,
    pub bytes: Vec<u8>,
    /// Which bytes of the whole file are gone or changed.
    pub touched: Vec<Range<usize>>,
    /// What is whole may stand elsewhere, or twice.
    pub moved: bool,
    /// Bytes that were never written, or not there, stand where a chunk was cut.
    pub invented_end: bool,
}

impl Damage {
    fn new(what: String, bytes: Vec<u8>, touched: Vec<Range<usize>>) -> Self {
        Self { what, bytes, touched, moved: false, invented_end: false }
    }

    pub(crate) fn cut(whole: &[u8], length: usize) -> Self {
        Self::new(format!("cut at {length}"), whole[..length].to_vec(), once(length..whole.len()))
    }
}

fn once(range: Range<usize>) -> Vec<Range<usize>> {
    std::iter::once(range).collect()
}

/// A way to damage a file.
pub(crate) type Kind = fn(&[u8], &mut Dice) -> Damage;

pub(crate) const KINDS: [(&str, Kind); 9] = [
    ("cut", |whole, dice| Damage::cut(whole, dice.below(whole.len()))),
    ("cut, zeros behind", |whole, dice| torn(whole, dice, false)),
    ("cut, random bytes behind", |whole, dice| torn(whole, dice, true)),
    ("one to eight bits flipped", flipped),
    ("sectors never written", holes),
    ("a huge number somewhere", huge),
    ("a huge length of a record", huge_length),
    ("a stretch lost", lost),
    ("a stretch twice", doubled),
];

fn torn(whole: &[u8], dice: &mut Dice, random: bool) -> Damage {
    let length = dice.below(whole.len());
    let mut damage = Damage::cut(whole, length);
    let behind = dice.below(3000);
    damage.bytes.extend((0..behind).map(|_| if random { dice.bits() as u8 } else { 0 }));
    damage.what = format!("{}, {behind} bytes behind", damage.what);
    damage.invented_end = random;
    damage
}

fn flipped(whole: &[u8], dice: &mut Dice) -> Damage {
    let mut bytes = whole.to_vec();
    let mut touched = Vec::new();
    for _ in 0..=dice.below(8) {
        let (place, bit) = (dice.below(whole.len()), dice.below(8));
        bytes[place] ^= 1 << bit;
        touched.push(place..place + 1);
    }
    Damage::new(format!("bits flipped at {touched:?}"), bytes, touched)
}

fn holes(whole: &[u8], dice: &mut Dice) -> Damage {
    let mut bytes = whole.to_vec();
    let mut touched = Vec::new();
    for _ in 0..=dice.below(3) {
        let start = dice.below(whole.len() / 512) * 512;
        let end = (start + 512 * (1 + dice.below(8))).min(whole.len());
        bytes[start..end].fill(0);
        touched.push(start..end);
    }
    Damage::new(format!("zeros at {touched:?}"), bytes, touched)
}

fn claim(dice: &mut Dice) -> u64 {
    [u64::MAX, 1 << 63, 1 << 40, u64::from(u32::MAX), 1 << 31, 1 << 24, 0][dice.below(7)]
}

fn huge(whole: &[u8], dice: &mut Dice) -> Damage {
    let place = dice.below(whole.len() - 8);
    let width = [4, 8][dice.below(2)];
    let mut bytes = whole.to_vec();
    bytes[place..place + width].copy_from_slice(&claim(dice).to_le_bytes()[..width]);
    Damage::new(format!("a huge number at {place}"), bytes, once(place..place + width))
}

/// Where the records of a whole file begin.
fn records(whole: &[u8]) -> Vec<usize> {
    let mut places = vec![8];
    while let Some(length) = places.last().and_then(|place| whole.get(place + 1..place + 9)) {
        let length = u64::from_le_bytes(length.try_into().unwrap()) as usize;
        places.extend(places.last().map(|place| place + 9 + length));
    }
    places.retain(|place| place + 9 < whole.len());
    places
}

fn huge_length(whole: &[u8], dice: &mut Dice) -> Damage {
    let records = records(whole);
    let place = records[dice.below(records.len())] + 1;
    let mut bytes = whole.to_vec();
    let length = u64::from_le_bytes(bytes[place..place + 8].try_into().unwrap());
    let near = length.wrapping_add(dice.bits() % 4000).wrapping_sub(dice.bits() % 2000);
    let claim = if dice.below(2) == 0 { claim(dice) } else { near };
    bytes[place..place + 8].copy_from_slice(&claim.to_le_bytes());
    Damage::new(format!("length {claim} at {place}"), bytes, once(place..place + 8))
}

fn byte_range(whole: &[u8], dice: &mut Dice) -> Range<usize> {
    let start = dice.below(whole.len());
    start..(start + 1 + dice.below(6000)).min(whole.len())
}

fn lost(whole: &[u8], dice: &mut Dice) -> Damage {
    let gone = byte_range(whole, dice);
    let bytes = [&whole[..gone.start], &whole[gone.end..]].concat();
    let damage = Damage::new(format!("{gone:?} lost"), bytes, once(gone));
    Damage { moved: true, invented_end: true, ..damage }
}

fn doubled(whole: &[u8], dice: &mut Dice) -> Damage {
    let twice = byte_range(whole, dice);
    let bytes = [&whole[..twice.end], &whole[twice.start..]].concat();
    // What stands around the second copy's beginning is torn there.
    let damage = Damage::new(format!("{twice:?} twice"), bytes, once(twice));
    Damage { moved: true, invented_end: true, ..damage }
}
