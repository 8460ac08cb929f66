//! Random bytes through every deframer, and damaged laser telegrams past their checksum: how much is taken
//! for true, and how much the checksum's length allows. Shared by a test (little) and an example (much).
//!
//! The bytes at a checksum's place are random and know nothing of the bytes before them, so a frame that its
//! head announces is taken with 2^-16 (laser, Pioneer) or 2^-24 (rFLEX: sum and trailer). How often random
//! bytes announce a frame follows from the framing itself, by trying every head.
#![allow(dead_code)] // the test and the example use their own parts

use biplane_wire::framing::{Framing, Measure};
use biplane_wire::lms::{self, DeviceFraming, HostFraming, Reply, Request, Scan, Telegram};
use biplane_wire::p2os::{self, P2osFraming};
use biplane_wire::rflex::{self, RflexFraming};
use biplane_wire::roboclaw::{Collector, Motor, Question, Request as Asked, StatusWidth};
use biplane_wire::{Deframer, Item};

/// Reproducible random numbers (splitmix64).
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        ((self.word() >> 32) as usize * bound) >> 32
    }

    pub(crate) fn byte(&mut self) -> u8 {
        (self.word() >> 56) as u8
    }

    pub(crate) fn fill(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            let word = self.word().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
    }
}

/// What is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Noise {
    /// Every byte by itself.
    Uniform,
    /// The same with a head that announces a frame every 64 bytes on average.
    Heads,
}

/// What came of a stream.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub name: &'static str,
    pub noise: Noise,
    pub bytes: u64,
    /// Frames whose checksum fits.
    pub accepted: u64,
    /// Those of them that read as something a session would take.
    pub read: u64,
    /// Mean of `accepted` by the checksum's length.
    pub expected: f64,
}

impl Outcome {
    /// No more than six deviations over the mean: less than once in 10^8 runs.
    pub(crate) fn allowed(&self) -> f64 {
        self.expected + 6.0 * self.expected.sqrt() + 3.0
    }

    pub(crate) fn is_within(&self) -> bool {
        self.accepted as f64 <= self.allowed()
    }
}

/// One deframer under noise.
struct Line {
    name: &'static str,
    /// Share of places in uniform noise where a frame is announced.
    announced: f64,
    /// Chance that checksum and trailer fit.
    fits: f64,
    head: fn(&mut Random) -> [u8; 6],
    read: fn(&[u8]) -> bool,
}

/// Share of five-byte heads behind a laser's start byte that announce a frame, by trying all lengths and
/// codes in one direction.
fn announced_by<F: Framing>(address: u8) -> f64 {
    let mut frames = 0_u64;
    for length in 0..=u16::MAX {
        let [low, high] = length.to_le_bytes();
        for code in 0..=255 {
            frames +=
                u64::from(matches!(F::measure(&[F::START, address, low, high, code]), Measure::Frame(_)));
        }
    }
    // Start byte, half of the addresses, length, code.
    frames as f64 / (65_536.0 * 256.0) / 2.0 / 256.0
}

fn laser_head(random: &mut Random) -> [u8; 6] {
    let codes = [0xB0, 0xB7, 0xBF, 0xF5, 0xF0, 0x91, 0xA0, 0xB1];
    let length = (2 + random.below(200)) as u8;
    let code = codes[random.below(codes.len())];
    [lms::STX, 0x80 | random.byte(), length, 0, code, random.byte()]
}

fn host_head(random: &mut Random) -> [u8; 6] {
    let length = (1 + random.below(90)) as u8;
    [lms::STX, random.byte() & 0x7F, length, 0, 0x10 + random.below(0x70) as u8, random.byte()]
}

fn pioneer_head(random: &mut Random) -> [u8; 6] {
    let kind = [0x32, 0x33, 0x20, 0x90, random.byte()][random.below(5)];
    [0xFA, 0xFB, (3 + random.below(253)) as u8, kind, random.byte(), random.byte()]
}

fn rflex_head(random: &mut Random) -> [u8; 6] {
    let (port, opcode, length) = [(2, 33, 25), (1, 1, 9), (5, 1, 7), (4, 2, random.byte())][random.below(4)];
    [0x1B, 0x02, port, random.byte(), opcode, length]
}

fn laser_reads(frame: &[u8]) -> bool {
    let reply = Telegram::parse(frame).and_then(|telegram| telegram.reply());
    matches!(reply, Ok(reply) if !matches!(reply, Reply::Raw { .. }))
}

fn host_reads(frame: &[u8]) -> bool {
    let request = Telegram::parse(frame).and_then(|telegram| telegram.request());
    matches!(request, Ok(request) if !matches!(request, Request::Raw(_)))
}

fn pioneer_reads(frame: &[u8]) -> bool {
    let report = p2os::Packet::parse(frame).and_then(|packet| packet.report());
    matches!(report, Ok(report) if !matches!(report, p2os::Report::Raw { .. } | p2os::Report::Config(_)))
}

fn rflex_reads(frame: &[u8]) -> bool {
    let report = rflex::Packet::parse(frame).and_then(|packet| packet.report());
    matches!(report, Ok(report) if !matches!(report, rflex::Report::Raw { .. }))
}

fn feed<F: Framing, const N: usize>(
    line: &Line,
    mut deframer: Deframer<F, N>,
    noise: Noise,
    bytes: u64,
    seed: u64,
) -> Outcome {
    let mut random = Random(seed);
    let mut chunk = vec![0; 1 << 16];
    let (mut sent, mut planted, mut accepted, mut read) = (0_u64, 0_u64, 0_u64, 0_u64);
    while sent < bytes {
        chunk.truncate((bytes - sent).min(1 << 16) as usize);
        random.fill(&mut chunk);
        let mut at = random.below(64);
        while noise == Noise::Heads && at + 6 <= chunk.len() {
            chunk[at..at + 6].copy_from_slice(&(line.head)(&mut random));
            planted += 1;
            at += 16 + random.below(97);
        }
        deframer.feed(&chunk, |item| {
            if let Item::Frame { bytes, .. } = item {
                accepted += 1;
                read += u64::from((line.read)(bytes));
            }
        });
        sent += chunk.len() as u64;
        assert_eq!(
            deframer.counts().bytes() + deframer.buffered() as u64,
            sent,
            "every byte is accounted for"
        );
    }
    let expected = (sent as f64 * line.announced + planted as f64) * line.fits;
    Outcome { name: line.name, noise, bytes: sent, accepted, read, expected }
}

/// This many bytes of each kind of noise through each deframer.
pub(crate) fn deframers(bytes: u64, seed: u64) -> Vec<Outcome> {
    const WORD: f64 = 1.0 / 65_536.0;
    let laser = Line {
        name: "LMS, from the laser",
        announced: announced_by::<DeviceFraming>(0x80),
        fits: WORD,
        head: laser_head,
        read: laser_reads,
    };
    let host = Line {
        name: "LMS, from the host",
        announced: announced_by::<HostFraming>(0),
        fits: WORD,
        head: host_head,
        read: host_reads,
    };
    let pioneer = Line {
        name: "P2OS",
        announced: 253.0 / 256.0 * WORD,
        fits: WORD,
        head: pioneer_head,
        read: pioneer_reads,
    };
    let rflex =
        Line { name: "rFLEX", announced: WORD, fits: WORD / 256.0, head: rflex_head, read: rflex_reads };
    let mut outcomes = Vec::new();
    for (noise, salt) in [(Noise::Uniform, 0), (Noise::Heads, 100)] {
        let seed = seed.wrapping_mul(1000) + salt;
        outcomes.push(feed::<DeviceFraming, 2048>(&laser, Deframer::new(), noise, bytes, seed));
        outcomes.push(feed::<HostFraming, 512>(&host, Deframer::new(), noise, bytes, seed + 1));
        outcomes.push(feed::<P2osFraming, 1024>(&pioneer, Deframer::new(), noise, bytes, seed + 2));
        outcomes.push(feed::<RflexFraming, 1024>(&rflex, Deframer::new(), noise, bytes, seed + 3));
    }
    outcomes
}

/// Answers of random bytes to a RoboClaw's questions; `expected` counts questions that were answered by
/// anything at all.
pub(crate) fn questions(bytes: u64, seed: u64) -> Outcome {
    let asked = [
        Question::Encoders,
        Question::Encoder(Motor::M1),
        Question::MainBattery,
        Question::Status(StatusWidth::Wide),
        Question::Status(StatusWidth::Narrow),
        Question::Firmware,
    ];
    let (mut random, mut collector) = (Random(seed), Collector::new());
    let (mut sent, mut answered, mut accepted) = (0_u64, 0_u64, 0_u64);
    let mut chunk = [0; 256];
    while sent < bytes {
        collector.ask(Asked { address: 0x80, question: asked[random.below(asked.len())] });
        // Until something has ended the question, or it is given up.
        for _ in 0..random.below(6) {
            let chunk = &mut chunk[..1 + random.below(40)];
            random.fill(chunk);
            sent += chunk.len() as u64;
            if let Some(received) = collector.take(chunk) {
                answered += 1;
                accepted += u64::from(received.is_ok());
            }
        }
        assert_eq!(collector.counts().bytes() + collector.buffered() as u64, sent);
    }
    let expected = answered as f64 / 65_536.0;
    Outcome {
        name: "RoboClaw, by questions",
        noise: Noise::Uniform,
        bytes: sent,
        accepted,
        read: accepted,
        expected,
    }
}

/// The same bytes without a question: nothing may ever be an answer.
pub(crate) fn unasked(bytes: u64, seed: u64) -> Outcome {
    let (mut random, mut collector) = (Random(seed), Collector::new());
    let mut chunk = vec![0; 1 << 16];
    let (mut sent, mut accepted) = (0_u64, 0_u64);
    while sent < bytes {
        random.fill(&mut chunk);
        accepted += u64::from(collector.take(&chunk).is_some());
        sent += chunk.len() as u64;
    }
    Outcome {
        name: "RoboClaw, unasked",
        noise: Noise::Uniform,
        bytes: sent,
        accepted,
        read: accepted,
        expected: 0.0,
    }
}

/// A kind of damage to a laser's telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Damage {
    /// So many bits anywhere.
    Bits(usize),
    /// So many neighboring bytes are replaced by random ones.
    Bytes(usize),
    /// A byte is lost.
    Lost,
    /// One bit of one byte with chance 1e-4 a byte, at least one: the mock's `bit-noise`.
    BitNoise,
}

impl Damage {
    pub(crate) const ALL: [Self; 8] = [
        Self::Bits(1),
        Self::Bits(2),
        Self::Bits(3),
        Self::Bits(4),
        Self::Bytes(2),
        Self::Bytes(3),
        Self::Lost,
        Self::BitNoise,
    ];

    fn strike(self, bytes: &mut Vec<u8>, random: &mut Random) {
        match self {
            Self::Bits(count) => (0..count).for_each(|_| flip(bytes, random)),
            Self::Bytes(count) => {
                let at = random.below(bytes.len() - count + 1);
                random.fill(&mut bytes[at..at + count]);
            }
            Self::Lost => {
                bytes.remove(random.below(bytes.len()));
            }
            Self::BitNoise => {
                flip(bytes, random);
                for _ in 1..bytes.len() {
                    if random.below(10_000) == 0 {
                        flip(bytes, random);
                    }
                }
            }
        }
    }
}

fn flip(bytes: &mut [u8], random: &mut Random) {
    let at = random.below(bytes.len());
    bytes[at] ^= 1 << random.below(8);
}

/// Damaged telegrams, and those whose checksum fits all the same.
#[derive(Clone, Debug)]
pub(crate) struct Missed {
    pub damage: Damage,
    pub damaged: u64,
    pub by_checksum: u64,
    /// Those that also read as a scan of as many values.
    pub by_reading: u64,
}

/// Scans of 181 values with noise like a room's, each damaged once.
pub(crate) fn damage(damage: Damage, telegrams: u64, seed: u64) -> Missed {
    let mut random = Random(seed);
    let mut missed = Missed { damage, damaged: 0, by_checksum: 0, by_reading: 0 };
    let mut good = Vec::new();
    for index in 0..telegrams {
        if index % 64 == 0 {
            good = scan(&mut random);
        }
        let mut bad = good.clone();
        damage.strike(&mut bad, &mut random);
        if bad == good {
            continue;
        }
        missed.damaged += 1;
        let Ok(telegram) = Telegram::parse(&bad) else { continue };
        missed.by_checksum += 1;
        let same_count = matches!(telegram.reply(), Ok(Reply::Scan(scan)) if scan.values().count() == 181);
        missed.by_reading += u64::from(same_count);
    }
    missed
}

fn scan(random: &mut Random) -> Vec<u8> {
    let values = (0..181).map(|_| 150 + random.below(700) as u16).collect();
    let scan = Scan { values, ..Scan::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(lms::REPLY_ADDRESS, &mut bytes).expect("it fits");
    bytes
}
