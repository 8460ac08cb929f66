//! What other programs do to a laser before ours starts: their requests, from transcripts of the real
//! programs against a scripted device.
//!
//! sicktoolbox (sessions at 38400 and 500000, partial scans, installation mode), MRPT `rawlog-grabber` 2.5.8,
//! CARMEN's `sick_laser`, AriaCoda, Player. A program may end by itself or be killed at any time; then the
//! device is left as it was then.

use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::request::Latency;
use biplane_mock::devices::lms::scans::feed::MirrorFeed;
use biplane_mock::devices::lms::{LmsDevice, LmsParams};
use biplane_mock::rng::Rng;

use crate::rig::devices::mirror;
use crate::rig::world::{Room, SameTime};
use crate::rig::{MS, S};

pub(crate) const STOP: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x25, 0x35, 0x08];
pub(crate) const STREAM: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x24, 0x34, 0x08];
pub(crate) const PARTIAL: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x2A, 0x3A, 0x08];
const TO_9600: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x42, 0x52, 0x08];
pub(crate) const TO_38400: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x40, 0x50, 0x08];
const TO_500000: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x48, 0x58, 0x08];
const STATUS: &[u8] = &[0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12];
const TYPE: &[u8] = &[0x02, 0x00, 0x01, 0x00, 0x3A, 0x1E, 0x12];
pub(crate) const CONFIG: &[u8] = &[0x02, 0x00, 0x01, 0x00, 0x74, 0x50, 0x12];
pub(crate) const WIDE_1: &[u8] = &[0x02, 0x00, 0x05, 0x00, 0x3B, 0xB4, 0x00, 0x64, 0x00, 0x97, 0x49];
const WIDE_HALF: &[u8] = &[0x02, 0x00, 0x05, 0x00, 0x3B, 0xB4, 0x00, 0x32, 0x00, 0x3B, 0x1F];
pub(crate) const NARROW_QUARTER: &[u8] = &[0x02, 0x00, 0x05, 0x00, 0x3B, 0x64, 0x00, 0x19, 0x00, 0xE7, 0x72];
pub(crate) const INSTALL: &[u8] =
    &[0x02, 0x00, 0x0A, 0x00, 0x20, 0x00, 0x53, 0x49, 0x43, 0x4B, 0x5F, 0x4C, 0x4D, 0x53, 0xBE, 0xC5];
/// Sub-range 1..181, as Player asks for it.
const SUB_RANGE: &[u8] = &[0x02, 0x00, 0x06, 0x00, 0x20, 0x27, 0x01, 0x00, 0xB5, 0x00, 0x12, 0x09];
/// Player writes seven bytes: measuring mode 01, millimeters.
const PLAYER_WRITES: &[u8] =
    &[0x02, 0x00, 0x08, 0x00, 0x77, 0x00, 0x00, 0x46, 0x00, 0x00, 0x01, 0x01, 0xA2, 0x4E];
/// MRPT: measuring mode 06, millimeters.
const MRPT_WRITES: &[u8] = &[
    0x02, 0x00, 0x23, 0x00, 0x77, 0x00, 0x00, 0x46, 0x00, 0x00, 0x06, 0x01, 0x00, 0x00, 0x02, 0x02, 0x02,
    0x00, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00,
    0x00, 0x00, 0x00, 0x02, 0x00, 0xCF, 0x21,
];
/// CARMEN: measuring mode 01, available when dazzled.
pub(crate) const CARMEN_WRITES: &[u8] = &[
    0x02, 0x00, 0x21, 0x00, 0x77, 0x00, 0x00, 0x46, 0x00, 0x01, 0x01, 0x00, 0x00, 0x00, 0x02, 0x02, 0x02,
    0x00, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00,
    0x00, 0x00, 0x00, 0xCD, 0x8C,
];
/// AriaCoda: measuring mode 05, millimeters, everything else zero.
pub(crate) const ARIA_WRITES: &[u8] = &[
    0x02, 0x00, 0x21, 0x00, 0x77, 0x00, 0x00, 0x46, 0x00, 0x00, 0x05, 0x01, 0x00, 0x00, 0x02, 0x02, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x5B, 0x51,
];

/// A program's session with a laser.
pub(crate) struct Client {
    /// The program.
    pub name: &'static str,
    /// Rate of the device before.
    pub baud: u32,
    /// Seconds from its start, rate of the program's port, request.
    pub requests: &'static [(f64, u32, &'static [u8])],
    /// Rate of the device after the last request.
    pub baud_at_end: u32,
    /// Moments at which it may be killed, and the device's rate then.
    pub cuts: &'static [(f64, u32)],
    /// The device takes so many milliseconds to write its configuration; drawn between the two.
    pub config_write_ms: (f64, f64),
}

/// The time that a write of what is there takes (a real LMS 200).
const USUAL_WRITE_MS: (f64, f64) = (106.0, 106.0);
/// CARMEN waits 250 ms and repeats itself.
const SLOW_WRITE_MS: (f64, f64) = (260.0, 1200.0);

/// The programs.
pub(crate) const CLIENTS: &[Client] = &[
    Client {
        name: "sicktoolbox at 38400 Bd",
        baud: 9600,
        requests: &[
            (0.5, 9600, TO_38400),
            (0.8, 38_400, STOP),
            (0.9, 38_400, TYPE),
            (1.0, 38_400, STATUS),
            (1.1, 38_400, CONFIG),
            (1.2, 38_400, STREAM),
            (6.0, 38_400, STOP),
            (6.1, 38_400, TO_9600),
        ],
        baud_at_end: 9600,
        cuts: &[(0.55, 38_400), (3.0, 38_400), (6.05, 38_400)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "sicktoolbox with partial scans at 500000 Bd",
        baud: 9600,
        requests: &[
            (0.5, 9600, TO_500000),
            (0.8, 500_000, STOP),
            (0.9, 500_000, WIDE_HALF),
            (1.1, 500_000, PARTIAL),
            (4.0, 500_000, STOP),
            (4.1, 500_000, TO_9600),
        ],
        baud_at_end: 9600,
        cuts: &[(2.0, 500_000)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "sicktoolbox in installation mode",
        baud: 9600,
        requests: &[(0.5, 9600, TO_500000), (0.8, 500_000, STOP), (0.98, 500_000, INSTALL)],
        baud_at_end: 500_000,
        cuts: &[(0.99, 500_000)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "MRPT",
        baud: 9600,
        requests: &[
            (2.37, 9600, STOP),
            (2.51, 9600, STATUS),
            (2.72, 9600, TO_500000),
            (3.24, 500_000, STATUS),
            (3.26, 500_000, INSTALL),
            (3.34, 500_000, CONFIG),
            (3.45, 500_000, MRPT_WRITES),
            (3.9, 500_000, STOP),
            (4.0, 500_000, WIDE_1),
            (4.2, 500_000, STREAM),
            (10.2, 500_000, STOP),
        ],
        baud_at_end: 500_000,
        cuts: &[(3.3, 500_000), (7.0, 500_000)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "CARMEN, interlaced",
        baud: 500_000,
        requests: &[
            (0.48, 500_000, STOP),
            (6.57, 500_000, CONFIG),
            (7.58, 500_000, INSTALL),
            (8.61, 500_000, CARMEN_WRITES),
            (9.86, 500_000, NARROW_QUARTER),
            (10.96, 500_000, STOP),
            (12.0, 500_000, PARTIAL),
            (26.5, 500_000, STOP),
        ],
        baud_at_end: 500_000,
        cuts: &[(8.0, 500_000), (20.0, 500_000)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "CARMEN that repeats its write",
        baud: 500_000,
        requests: &[
            (0.48, 500_000, STOP),
            (1.57, 500_000, CONFIG),
            (2.58, 500_000, INSTALL),
            (3.61, 500_000, CARMEN_WRITES),
            (3.86, 500_000, CARMEN_WRITES),
            (5.86, 500_000, NARROW_QUARTER),
            (6.96, 500_000, STOP),
            (8.0, 500_000, PARTIAL),
            (12.5, 500_000, STOP),
        ],
        baud_at_end: 500_000,
        cuts: &[(3.7, 500_000), (3.9, 500_000), (5.9, 500_000), (9.0, 500_000)],
        config_write_ms: SLOW_WRITE_MS,
    },
    Client {
        name: "AriaCoda",
        baud: 9600,
        requests: &[
            (0.57, 9600, TO_38400),
            (0.94, 38_400, WIDE_1),
            (1.40, 38_400, INSTALL),
            (1.76, 38_400, ARIA_WRITES),
            (2.3, 38_400, STREAM),
            (12.3, 38_400, STOP),
            (13.3, 38_400, TO_9600),
        ],
        baud_at_end: 9600,
        cuts: &[(1.5, 38_400), (8.0, 38_400)],
        config_write_ms: USUAL_WRITE_MS,
    },
    Client {
        name: "Player",
        baud: 9600,
        requests: &[
            (0.54, 9600, STOP),
            (1.58, 9600, TO_38400),
            (2.60, 38_400, TYPE),
            (2.70, 38_400, INSTALL),
            (2.80, 38_400, STATUS),
            (2.95, 38_400, WIDE_1),
            (3.10, 38_400, CONFIG),
            (3.25, 38_400, PLAYER_WRITES),
            (3.80, 38_400, SUB_RANGE),
        ],
        baud_at_end: 38_400,
        cuts: &[(2.75, 38_400)],
        config_write_ms: USUAL_WRITE_MS,
    },
];

/// A laser to which a program has spoken until it ended, or until it was killed; then half a second passed.
#[must_use]
pub(crate) fn after_client(client: &Client, cut_s: Option<f64>, seed: u64) -> Box<dyn Device> {
    let (low_ms, high_ms) = client.config_write_ms;
    let write_ms = Rng::new(seed, 0x77, 0).between(low_ms, high_ms);
    let latency = Latency { config_write_ns: (write_ms * MS as f64) as i64, ..Latency::default() };
    let params = LmsParams { baud: client.baud, mirror: mirror(seed, 0), latency, ..LmsParams::default() };
    let feed = MirrorFeed::new(Box::new(Room::new(seed, 0)), Box::new(SameTime));
    let mut device = LmsDevice::new(params, Box::new(feed));
    let last_s = client.requests.last().map_or(0.0, |request| request.0);
    let end_s = cut_s.unwrap_or(last_s) + 0.5;
    let mut now_ns = (-end_s * S as f64) as i64;
    let start_ns = now_ns;
    for &(at_s, baud, request) in client.requests {
        if cut_s.is_some_and(|cut_s| at_s > cut_s) {
            break;
        }
        let at_ns = start_ns + (at_s * S as f64) as i64;
        live(&mut device, &mut now_ns, at_ns);
        assert_eq!(device.baud(), baud, "{} at {at_s} s", client.name);
        device.handle(now_ns, request);
    }
    live(&mut device, &mut now_ns, -MS);
    Box::new(device)
}

/// The device goes on until then; what it sends was for somebody else.
fn live(device: &mut LmsDevice, now_ns: &mut i64, until_ns: i64) {
    let mut out = Vec::new();
    while *now_ns < until_ns {
        out.clear();
        let due_ns = device.poll(*now_ns, &mut out);
        *now_ns = due_ns.max(*now_ns + MS / 10).min(until_ns);
    }
}
