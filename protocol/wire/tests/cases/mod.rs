//! Known-good telegrams, byte for byte as the manufacturers print them or as devices and drivers sent them,
//! and the small tools that the tests share.
#![allow(dead_code)] // each test binary uses its own part

pub(crate) mod pieces;
pub(crate) mod table;

/// Requests to a laser, checksum included.
pub(crate) const LMS_REQUESTS: &[&str] = &[
    "02 00 01 00 10 34 12",
    "02 00 02 00 20 24 34 08",
    "02 00 02 00 20 25 35 08",
    "02 00 02 00 20 2A 3A 08",
    "02 00 02 00 20 40 50 08",
    "02 00 02 00 20 41 51 08",
    "02 00 02 00 20 42 52 08",
    "02 00 02 00 20 48 58 08",
    "02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5",
    "02 00 0A 00 20 30 53 49 43 4B 5F 4C 4D 53 EE F5",
    "02 00 03 00 20 26 05 79 3E",
    "02 00 06 00 20 27 1B 00 2B 01 FF FE",
    "02 00 06 00 20 27 01 00 0A 00 6C B7",
    "02 00 06 00 20 50 01 00 B5 00 68 B6",
    "02 00 02 00 30 01 31 18",
    "02 00 01 00 31 15 12",
    "02 00 01 00 32 16 12",
    "02 00 01 00 35 11 12",
    "02 00 02 00 36 02 3E 1E",
    "02 00 05 00 37 01 00 69 01 EB 75",
    "02 00 01 00 3A 1E 12",
    "02 00 05 00 3B B4 00 32 00 3B 1F",
    "02 00 05 00 3B B4 00 64 00 97 49",
    "02 00 05 00 3B 64 00 19 00 E7 72",
    "02 00 05 00 3B 64 00 64 00 1D 0F",
    "02 00 02 00 66 00 9C 4E",
    "02 00 01 00 74 50 12",
    "02 00 23 00 77 00 00 46 00 00 00 01 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 80 00 0A 0A 50 64 00 00 00 \
     00 02 00 7B 4B",
    // Two drivers write less than the whole block.
    "02 00 21 00 77 00 00 46 00 01 01 00 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 \
     00 CD 8C",
    "02 00 08 00 77 00 00 46 00 00 01 01 A2 4E",
    "02 00 01 00 7B 5F 12",
    "02 00 05 00 44 01 00 B5 00 68 37",
    "02 00 07 00 75 01 00 01 00 91 01 7D B6",
    "02 00 05 00 76 01 00 2A 01 72 BA",
];

/// Replies of a laser.
pub(crate) const LMS_REPLIES: &[&str] = &[
    "02 80 17 00 90 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 31 30 20 10 63 5E",
    "02 81 17 00 90 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 30 36 20 13 64 5A",
    "02 80 02 00 91 10 79 30",
    "02 80 02 00 92 10 7F 33",
    "02 80 03 00 A0 00 10 16 0A",
    "02 81 03 00 A0 00 10 36 1A",
    "02 80 02 00 B2 10 3F 13",
    "02 80 06 00 B5 00 00 01 00 10 04 42",
    "02 80 14 00 BA 4C 4D 53 32 39 31 3B 53 30 35 3B 58 30 31 2E 32 37 20 10 3D 00",
    "02 80 07 00 BB 01 B4 00 32 00 10 03 9D",
    "02 80 07 00 BB 01 64 00 19 00 10 BB 46",
    "02 81 07 00 BB 01 64 00 64 00 10 4A 3F",
    "02 80 05 00 CA 01 01 01 10 2C B8",
    "02 80 24 00 F4 00 00 46 00 00 00 00 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 \
     00 02 00 10 AA 4F",
    "02 80 25 00 F7 01 00 00 70 00 00 00 01 00 00 02 02 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 \
     00 00 02 00 10 C5 7A",
    // A sub-range of ten values.
    "02 80 1C 00 B7 01 00 0A 00 0A 00 2E 01 30 01 31 01 33 01 35 01 36 01 38 01 3A 01 3C 01 3D 01 10 3F A7",
    LMS_STATUS,
];

/// A status report as drivers accept it: 180 degrees, 0.5, 38400, centimeters.
pub(crate) const LMS_STATUS: &str = "02 80 9A 00 B1 58 30 31 2E 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 \
     00 67 00 68 00 69 00 6A 00 6B 00 6C 00 6D 00 6E 00 6F 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 \
     00 79 00 7A 00 7B 00 94 00 00 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 \
     00 50 00 50 00 00 00 00 00 00 00 B4 00 32 00 02 02 00 00 00 19 80 02 00 00 01 00 01 56 30 32 2E 31 30 20 00 \
     00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 10 43 FF";

/// Commands to a base.
pub(crate) const P2OS_COMMANDS: &[&str] = &[
    "FA FB 03 00 00 00",
    "FA FB 03 01 00 01",
    "FA FB 03 02 00 02",
    "FA FB 06 01 3B 01 00 02 3B",
    "FA FB 06 02 3B 01 00 03 3B",
    "FA FB 06 04 3B 01 00 05 3B",
    "FA FB 06 04 3B 00 00 04 3B",
    "FA FB 06 1C 3B 00 00 1C 3B",
    "FA FB 06 0B 3B FA 00 05 3B",
    "FA FB 06 0B 1B C8 00 D3 1B",
    "FA FB 06 15 3B 1E 00 33 3B",
    "FA FB 06 05 1B 2C 01 31 1C",
    "FA FB 06 12 3B 01 00 13 3B",
    "FA FB 06 13 3B 02 00 15 3B",
    "FA FB 06 32 3B 02 00 34 3B",
    "FA FB 03 1D 00 1D",
    "FA FB 03 07 00 07",
    // An argument type without an argument, as one driver sends it.
    "FA FB 04 07 3B 07 3B",
];

/// A standard information packet that two drivers accept: stopped, x 32600, 12.3 V.
pub(crate) const P2OS_SIP: &str = "FA FB 22 32 58 7F 00 00 00 00 00 00 00 00 7B 00 00 00 00 00 00 00 00 00 00 00 00 00 7B \
     00 00 00 00 00 00 B2 4E";

/// Commands to an rFLEX base, worked out from its rule; the last sets axis 0 to speed 0.
pub(crate) const RFLEX_COMMANDS: &[&str] = &[
    "1B 02 02 00 22 08 00 01 86 A0 00 00 00 03 0C 1B 03",
    "1B 02 02 00 0C 00 0E 1B 03",
    "1B 02 02 00 0A 00 08 1B 03",
    "1B 02 05 00 00 04 00 01 86 A0 26 1B 03",
    "1B 02 01 00 01 00 00 1B 03",
    "1B 02 02 00 07 0E 00 00 00 00 00 00 00 03 E8 00 00 75 30 01 A4 1B 03",
];

/// Reports of an rFLEX base: axis 0 at -5 counts, 1200 a second; 24.60 V with the brake on; two bumpers.
pub(crate) const RFLEX_REPORTS: &[&str] = &[
    "1B 02 02 07 21 19 00 00 00 00 00 03 D0 90 00 FF FF FF FB 00 00 04 B0 00 00 00 00 00 00 00 00 CE 1B 03",
    "1B 02 01 08 01 09 00 00 00 63 00 00 09 9C 01 F6 1B 03",
    "1B 02 05 09 01 07 00 00 00 63 40 00 03 2A 1B 03",
];

/// Requests to a RoboClaw and its answers, the CRCs from another implementation.
pub(crate) const ROBOCLAW: &[(&str, &str)] = &[
    ("80 15", "52 6F 62 6F 43 6C 61 77 20 32 78 31 35 61 20 76 34 2E 31 2E 33 34 0A 00 6A 6B"),
    ("80 4E", "00 00 03 E8 FF FF FF FF A6 94"),
    ("81 4E", "00 00 03 E8 FF FF FF FF C9 D1"),
    ("80 10", "7F FF FF FF 02 6E 7F"),
    ("87 11", "00 00 00 00 05 BD 3C"),
    ("80 18", "00 7B F8 06"),
    ("80 5A", "00 08 00 01 3E 3C"),
    ("80 14 49 2D", "FF"),
];

/// Bytes of a line such as `02 00 # what`.
pub(crate) fn bytes(line: &str) -> Vec<u8> {
    let text = line.split('#').next().unwrap_or("");
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two hex digits")).collect()
}

/// Reproducible noise: the high bytes of a linear congruential generator.
pub(crate) struct Noise(pub u64);

impl Noise {
    pub(crate) fn byte(&mut self) -> u8 {
        self.word() as u8
    }

    pub(crate) fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.word() as usize % bound
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.byte()).collect()
    }
}
