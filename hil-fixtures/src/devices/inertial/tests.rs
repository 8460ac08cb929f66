//! A mock unit on the bench, its answers by hand or out of Xsens' documentation.

use super::feed::InertialFeed;
use super::{XsensDevice, XsensParams};
use crate::devices::bench::{Bench, hex};
use crate::devices::device::Device;
use crate::rig::inertial::InertialSample;

/// Turns with 0.5 rad/s about its x axis and lies still, upright.
struct Turning;

impl InertialFeed for Turning {
    fn sample(&mut self, middle_ns: i64, _period_ns: i64) -> Option<InertialSample> {
        let (turn_rad_s, force_m_s2) = ([0.5, 0.0, 0.0], [0.0, 0.0, 9.75]);
        Some(InertialSample { time_ns: middle_ns, turn_rad_s, force_m_s2 })
    }
}

fn bench(params: XsensParams) -> Bench<XsensDevice> {
    Bench::of(XsensDevice::new(params, Box::new(Turning)))
}

const GO_TO_CONFIG: &str = "FA FF 30 00 D1";
const GO_TO_MEASUREMENT: &str = "FA FF 10 00 F1";
/// Acceleration and turn rates at 100 Hz behind counter and time.
const OUTPUTS: &str = "10 20 FF FF 10 60 FF FF 40 20 00 64 80 20 00 64";

fn with_outputs(bench: &mut Bench<XsensDevice>) {
    bench.send(&hex(GO_TO_CONFIG));
    bench.run_ms(20);
    bench.send(&hex(&format!("FA FF C0 10 {OUTPUTS} CD")));
    bench.run_ms(20);
}

#[test]
fn it_is_set_by_the_documentations_messages_and_measures_at_its_rate() {
    let mut bench = bench(XsensParams { left_idle: true, ..XsensParams::default() });
    bench.send(&hex(GO_TO_CONFIG));
    bench.run_ms(20);
    assert_eq!(bench.bytes(), hex("FA FF 31 00 D0"));
    with_outputs(&mut bench);
    assert_eq!(bench.bytes(), hex(&format!("FA FF C1 10 {OUTPUTS} CC")));
    bench.send(&hex(GO_TO_MEASUREMENT));
    bench.run_ms(1000);
    let received = bench.bytes();
    assert_eq!(received[..5], hex("FA FF 11 00 F0"));
    // 4 + 5 + 7 + 15 + 15 + 1 bytes, about a hundred of them.
    let messages: Vec<&[u8]> = received[5..].chunks(47).collect();
    assert!((98..=100).contains(&messages.len()), "{}", messages.len());
    assert_eq!(messages[3][..9], hex("FA FF 36 2A 10 20 02 00 03"));
    assert_eq!(messages[3][16..31], hex("40 20 0C 00 00 00 00 00 00 00 00 41 1C 00 00"));
    assert_eq!(messages[3][31..46], hex("80 20 0C 3F 00 00 00 00 00 00 00 00 00 00 00"));
    let ticks = |n: usize| u32::from_be_bytes(messages[n][12..16].try_into().unwrap());
    assert!((ticks(90) - ticks(10)).abs_diff(8000) <= 1);
}

#[test]
fn one_that_is_switched_on_measures_unless_it_is_answered_and_keeps_its_outputs() {
    let mut bench = bench(XsensParams::default());
    with_outputs(&mut bench);
    bench.device.power_on(bench.now_ns);
    bench.received.clear();
    bench.run_ms(1000);
    assert_eq!(bench.bytes(), hex("FA FF 3E 00 C3"));
    bench.received.clear();
    bench.run_ms(200);
    assert_eq!(bench.bytes()[..6], hex("FA FF 36 2A 10 20"));
    bench.device.power_on(bench.now_ns);
    bench.run_ms(700);
    bench.send(&hex("FA FF 3F 00 C2"));
    bench.run_ms(2000);
    assert_eq!(bench.bytes(), [0_u8; 0]);
}

#[test]
fn what_it_does_not_know_is_an_error_and_damage_is_nothing() {
    let mut bench = bench(XsensParams { left_idle: true, ..XsensParams::default() });
    bench.send(&hex("FA FF 70 00 91"));
    bench.run_ms(20);
    assert_eq!(bench.bytes(), hex("FA FF 42 01 04 BA"));
    bench.send(&hex("FA FF 70 00 92"));
    bench.run_ms(20);
    assert_eq!((bench.bytes().len(), bench.device.counts().bad_checksums), (0, 1));
    // Faster than it can.
    let slow = XsensParams { left_idle: true, fastest_hz: 100, ..XsensParams::default() };
    let mut bench = self::bench(slow);
    bench.send(&hex("FA FF C0 04 80 20 01 90 0C"));
    bench.run_ms(20);
    assert_eq!(bench.bytes(), hex("FA FF C1 04 80 20 00 64 38"));
}
