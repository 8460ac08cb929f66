//! A mock base in simulated time, spoken to as AriaCoda and Player do.

mod sessions;

use super::feed::{CycleFeed, Sip, SipAnswer, SipFeed};
use super::{BaseDevice, BaseParams};
use crate::devices::bench;
use crate::devices::bench::{Same, hex};
use crate::devices::device::Device;
use crate::rig::source::{OdometrySample, OdometrySource};

const MS: i64 = 1_000_000;

/// Drives along x, one tick a millisecond, beginning just below the wrap.
struct Forward;

impl OdometrySource for Forward {
    fn sample(&mut self, t_ns: i64) -> OdometrySample {
        let x_raw = u16::try_from((32_600 + t_ns / MS) & 0x7FFF).expect("15 bits");
        OdometrySample { x_raw, theta_raw: 1024, moving: true, ..OdometrySample::default() }
    }
}

/// Stands where the transcripts' base stood.
struct Still;

impl SipFeed for Still {
    fn next(&mut self, _now_ns: i64) -> SipAnswer {
        SipAnswer::Now(Sip::Odometry(OdometrySample { x_raw: 32_600, ..OdometrySample::default() }))
    }
}

type Bench = bench::Bench<BaseDevice>;

impl Bench {
    fn new() -> Self {
        let feed = CycleFeed::new(Box::new(Forward), Box::new(Same), 100 * MS);
        Self::with(BaseParams::default(), Box::new(feed))
    }

    fn with(params: BaseParams, feed: Box<dyn SipFeed>) -> Self {
        Self::of(BaseDevice::new(params, feed))
    }

    fn ask(&mut self, request: &[u8], wait_ms: i64) -> Vec<u8> {
        self.send(request);
        self.run_ms(wait_ms);
        self.bytes()
    }

    fn open(&mut self) {
        for sync in [0, 1, 2] {
            self.ask(&[0xFA, 0xFB, 3, sync, 0, sync], 60);
        }
        self.ask(&hex("fa fb 06 01 3b 01 00 02 3b"), 0);
    }

    /// First byte's time and body of each standard packet heard.
    fn sips(&self) -> Vec<(i64, Vec<u8>)> {
        let bytes = self.bytes();
        let starts = (0..bytes.len().saturating_sub(36)).filter(|&i| bytes[i..i + 3] == [0xFA, 0xFB, 34]);
        starts.map(|i| (self.received[i].0, bytes[i + 3..i + 35].to_vec())).collect()
    }
}

const SYNC_0: &str = "fa fb 03 00 00 00";
const SYNC_1: &str = "fa fb 03 01 00 01";
const SYNC_2: &str = "fa fb 03 02 00 02";
const IDENTITY: &str =
    "fa fb 1c 02 4d 6f 63 6b 42 61 73 65 00 50 69 6f 6e 65 65 72 00 70 33 64 78 2d 73 68 00 a4 bf";
const STANDING: &str = "fa fb 22 32 58 7f 00 00 00 00 00 00 00 00 7b 00 00 00 00 00 00 00 00 00 00 00 00 00 7b 00 00 00 00 00 00 b2 4e";

#[test]
fn ariacoda_opens_behind_a_modem_string_and_gets_the_bytes_of_its_transcript() {
    let mut bench = Bench::with(BaseParams::default(), Box::new(Still));
    assert_eq!(bench.ask(b"WMS2\r", 70), [0_u8; 0]);
    assert_eq!(bench.ask(&hex(SYNC_0), 70), hex(SYNC_0));
    assert_eq!(bench.ask(&hex(SYNC_1), 70), hex(SYNC_1));
    assert_eq!(bench.ask(&hex(SYNC_2), 90), hex(IDENTITY));
    assert_eq!(bench.ask(&hex("fa fb 06 01 3b 01 00 02 3b"), 39), hex(STANDING));
    let config = "fa fb 74 20 50 69 6f 6e 65 65 72 00 70 33 64 78 2d 73 68 00 53 4e 30 30 30 31 00 00 68 01 98 08 58 02 a0 0f f4 \
        01 4d 6f 63 6b 42 61 73 65 00 64 00 00 00 00 00 00 00 6e 00 ba 40 d0 07 00 c8 00 c8 00 00 00 00 00 64 00 ee 02 64 00 64 00 \
        28 00 28 00 28 00 2c 01 2c 01 28 00 28 00 28 00 00 00 00 28 00 00 00 00 00 00 8a 00 64 00 32 2e 36 00 00 00 00 00 00 a8 92";
    let received = bench.ask(&hex("fa fb 06 12 3b 01 00 13 3b"), 300);
    assert!(received.windows(119).any(|window| window == hex(config)));
}

#[test]
fn player_opens_without_an_argument_and_sends_several_commands_in_one_write() {
    let mut bench = Bench::new();
    for sync in [SYNC_0, SYNC_1, SYNC_2] {
        bench.ask(&hex(sync), 400);
    }
    bench.ask(&hex(SYNC_1), 400);
    assert!(bench.device.is_streaming());
    let several =
        "fa fb 06 1c 3b 00 00 1c 3b fa fb 06 04 3b 00 00 04 3b fa fb 04 07 3b 07 3b fa fb 03 00 00 00";
    bench.ask(&hex(several), 150);
    assert_eq!(bench.device.counts().requests, 8);
    // SETO: the pose is counted from here, in the axes of the heading then, which was a quarter turn to the
    // left.
    bench.run_ms(1000);
    let (_, sip) = bench.sips().last().expect("packets").clone();
    let signed = |at: usize| (i32::from(u16::from_le_bytes([sip[at], sip[at + 1]])) ^ 0x4000) - 0x4000;
    let (x, y) = (signed(1), signed(3));
    assert!(x.abs() <= 1 && (-1200..=-900).contains(&y), "{x} {y}");
    assert_eq!(sip[5..7], [0, 0]);
}

#[test]
fn packets_come_each_100_ms_and_take_39_ms_at_9600() {
    let mut bench = Bench::new();
    bench.open();
    bench.received.clear();
    bench.run_ms(1000);
    let sips = bench.sips();
    assert_eq!(sips.len(), 10);
    for pair in sips.windows(2) {
        assert_eq!(pair[1].0 - pair[0].0, 100 * MS);
    }
    let last = bench.received[36].0 - (bench.received[0].0 - 1_041_666);
    assert!((last - 38_541_666).abs() < 10, "{last}");
}

#[test]
fn the_pose_is_sampled_when_the_first_byte_leaves_and_wraps_at_15_bits() {
    let mut bench = Bench::new();
    bench.open();
    bench.run_ms(2000);
    for (at_ns, body) in bench.sips() {
        let left_ms = (at_ns - 1_041_666) / MS;
        let expected = ((32_600 + left_ms) & 0x7FFF) as u16;
        assert_eq!(u16::from_le_bytes([body[1], body[2]]), expected);
    }
}

#[test]
fn an_open_session_is_closed_before_it_can_be_opened_again() {
    let mut bench = Bench::new();
    bench.open();
    bench.run_ms(50);
    bench.ask(&hex(SYNC_0), 300);
    assert_eq!((bench.sips().len(), bench.received.len()), (3, 3 * 37));
    bench.ask(&hex("fa fb 06 02 3b 01 00 03 3b"), 100);
    assert!(!bench.device.is_streaming());
    assert_eq!(bench.ask(&hex(SYNC_0), 70), hex(SYNC_0));
}

#[test]
fn a_host_that_falls_silent_for_two_seconds_is_noticed_once() {
    let mut bench = Bench::new();
    bench.open();
    for _ in 0..5 {
        bench.ask(&hex(SYNC_0), 1000);
    }
    assert_eq!(bench.device.counts().watchdog, 0);
    bench.run_ms(10_000);
    assert_eq!(bench.device.counts().watchdog, 1);
}

#[test]
fn hostbaud_changes_the_rate_behind_what_is_being_sent() {
    let mut bench = Bench::new();
    bench.open();
    bench.ask(&hex("fa fb 06 32 3b 02 00 34 3b"), 200);
    assert_eq!(bench.device.baud(), 38_400);
}

#[test]
fn encoder_packets_follow_the_standard_ones_once_or_until_they_are_stopped() {
    let mut bench = Bench::new();
    bench.open();
    // ENCODER 1, then 2, then 0; a packet is FA FB 0B 90, two counts of four bytes, sum.
    let packets =
        |received: &[u8]| received.windows(4).filter(|head| *head == [0xFA, 0xFB, 11, 0x90]).count();
    assert_eq!(packets(&bench.ask(&hex("fa fb 06 13 3b 01 00 14 3b"), 500)), 1);
    assert!(packets(&bench.ask(&hex("fa fb 06 13 3b 02 00 15 3b"), 500)) >= 4);
    // One may have been on its way.
    bench.ask(&hex("fa fb 06 13 3b 00 00 13 3b"), 100);
    assert_eq!(packets(&bench.ask(&[], 500)), 0);
}

#[test]
fn a_close_between_the_syncs_begins_anew() {
    let mut bench = Bench::new();
    bench.ask(&hex(SYNC_0), 70);
    bench.ask(&hex(SYNC_1), 70);
    bench.ask(&hex("fa fb 06 02 3b 01 00 03 3b"), 70);
    assert_eq!(bench.ask(&hex(SYNC_2), 70), [0_u8; 0]);
    assert_eq!(bench.ask(&hex(SYNC_0), 70), hex(SYNC_0));
}

#[test]
fn a_base_that_its_watchdog_stopped_resumes_its_speed_at_any_command_but_a_stop() {
    let left = BaseParams { left_open: true, left_mm_s: 250, ..BaseParams::default() };
    let commands =
        ["FA FB 03 00 00 00", "FA FB 03 1D 00 1D", "FA FB 06 0B 3B 00 00 0B 3B", "FA FB 03 02 00 02"];
    for (command, driven_mm_s) in commands.into_iter().zip([250, 0, 0, 0]) {
        let mut bench = Bench::with(left.clone(), Box::new(Still));
        bench.run_ms(100);
        assert_eq!(bench.device.driven_mm_s(), 0);
        bench.ask(&hex(command), 100);
        assert_eq!(bench.device.driven_mm_s(), driven_mm_s, "{command}");
        bench.run_ms(3000);
        assert_eq!(bench.device.driven_mm_s(), 0);
    }
}

#[test]
fn a_strict_base_takes_a_packet_before_sync0_for_a_sync_out_of_turn() {
    let strict = BaseParams { strict: true, ..BaseParams::default() };
    let mut bench = Bench::with(strict, Box::new(Still));
    let stop_first = format!("fa fb 03 1d 00 1d {SYNC_0}");
    for _ in 0..5 {
        assert_eq!(bench.ask(&hex(&stop_first), 500), [0_u8; 0]);
    }
    assert_eq!(bench.ask(b"WMS2\r", 70), [0_u8; 0]);
    for (sync, answer) in [(SYNC_0, SYNC_0), (SYNC_1, SYNC_1), (SYNC_2, IDENTITY)] {
        assert_eq!(bench.ask(&hex(sync), 90), hex(answer));
    }
    bench.ask(&hex("fa fb 06 01 3b 01 00 02 3b"), 200);
    assert!(bench.device.is_streaming());
    // In a session it takes what any base does.
    bench.ask(&hex("fa fb 03 1d 00 1d"), 200);
    assert!(bench.device.is_streaming());
}
