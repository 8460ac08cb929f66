//! Scripted sessions with an Xsens unit. Commands and answers are by hand, with their sums, or out of the
//! documentation.

use biplane_recording::rig::InertialUnit;

use crate::session::device_session::{Input, Session};
use crate::session::inertial::InertialSession;
use crate::session::testing::noise::{Noise, endure};
use crate::session::testing::script::{check, play};

const GO_TO_CONFIG: &str = "FA FF 30 00 D1";
const CONFIG_STATE: &str = "FA FF 31 00 D0";
const ASK_DEVICE_ID: &str = "FA FF 00 00 01";
const DEVICE_ID: &str = "FA FF 01 04 03 70 03 F8 8E";
const SET_OUTPUTS: &str = "FA FF C0 14 10 20 FF FF 10 60 FF FF 40 20 00 64 80 20 00 64 E0 20 FF FF CB";
const OUTPUTS: &str = "FA FF C1 14 10 20 FF FF 10 60 FF FF 40 20 00 64 80 20 00 64 E0 20 FF FF CA";
const GO_TO_MEASUREMENT: &str = "FA FF 10 00 F1";
const MEASURING_STATE: &str = "FA FF 11 00 F0";
const WAKE_UP: &str = "FA FF 3E 00 C3";
const WAKE_UP_ACKNOWLEDGE: &str = "FA FF 3F 00 C2";
const UNTRIED: &str = "this driver was never tried on hardware";

fn unit() -> InertialUnit {
    InertialUnit::xsens("")
}

fn framed(mid: u8, data: &[u8]) -> String {
    let mut bytes = vec![0xFA, 0xFF, mid, data.len() as u8];
    bytes.extend(data);
    let sum = bytes[1..].iter().fold(0_u8, |rest, byte| rest.wrapping_sub(*byte));
    bytes.push(sum);
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// A whole measurement: turns with 0.5 rad/s about z, 9.75 m/s^2 upward.
fn measurement(counter: u16, ticks: u32) -> String {
    measurement_with(counter, ticks, 0.5, 1)
}

fn measurement_with(counter: u16, ticks: u32, turn_rad_s: f32, word: u32) -> String {
    let mut data = vec![0x10, 0x20, 2];
    data.extend(counter.to_be_bytes());
    data.extend([0x10, 0x60, 4]);
    data.extend(ticks.to_be_bytes());
    for (identifier, numbers) in [(0x4020_u16, [0.0, 0.0, 9.75_f32]), (0x8020, [0.0, 0.0, turn_rad_s])] {
        data.extend(identifier.to_be_bytes());
        data.push(12);
        data.extend(numbers.into_iter().flat_map(f32::to_be_bytes));
    }
    data.extend([0xE0, 0x20, 4]);
    data.extend(word.to_be_bytes());
    framed(0x36, &data)
}

fn started() -> String {
    format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n10 < {CONFIG_STATE}\n10 > {ASK_DEVICE_ID}\n20 < {DEVICE_ID}\n\
         20 ! is a Xsens MTi 037003F8\n20 > {SET_OUTPUTS}\n40 < {OUTPUTS}\n40 > {GO_TO_MEASUREMENT}\n\
         50 < {MEASURING_STATE}\n70 < {}\n70 ! streams\n70 * 100000 0.000 0.000 0.500 9.75",
        measurement(0, 1000)
    )
}

#[test]
fn a_unit_is_told_what_to_send_measures_and_is_left_idle() {
    let script = format!(
        "{}\n80 < {}\n80 * 110000 0.000 0.000 0.500 9.75\n95 stop\n95 > {GO_TO_CONFIG}\n100 < {}\n\
         100 * 120000 0.000 0.000 0.500 9.75\n105 < {CONFIG_STATE}\n105 ! left idle\n200 end",
        started(),
        measurement(1, 1100),
        measurement(2, 1200),
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    check(&mut session, &script);
    assert!(session.is_done() && session.not_kept() == 0);
    assert_eq!(session.info().has_fault, Some(false));
}

#[test]
fn one_that_measures_already_is_recorded_while_it_is_set() {
    // Its own outputs lack something at first: that is not lost, it was never told to send it.
    let euler = framed(0x36, &[0x10, 0x20, 2, 0, 7]);
    let script = format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n3 < {euler}\n5 < {}\n5 * 9000000 0.000 0.000 0.500 9.75\n\
         10 < {CONFIG_STATE}\n10 > {ASK_DEVICE_ID}\n20 < {DEVICE_ID}\n20 ! is a Xsens MTi 037003F8\n20 > {SET_OUTPUTS}\n\
         40 < {OUTPUTS}\n40 > {GO_TO_MEASUREMENT}\n60 < {}\n60 * 9055000 0.000 0.000 0.500 9.75\n\
         61 < {MEASURING_STATE}\n70 < {}\n70 ! streams\n70 * 9065000 0.000 0.000 0.500 9.75\n75 end",
        measurement(600, 90_000),
        measurement(601, 90_550),
        measurement(602, 90_650),
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    check(&mut session, &script);
    assert_eq!((session.not_kept(), session.health().incomplete, session.health().rejected), (0, 1, 0));
}

#[test]
fn silence_is_said_and_a_unit_that_is_switched_on_again_is_set_at_its_wake_up() {
    let script = format!(
        "{}\n570 ! silent for 500 ms, starting again\n570 > {GO_TO_CONFIG}\n900 < {WAKE_UP}\n900 > {WAKE_UP_ACKNOWLEDGE}\n\
         900 > {GO_TO_CONFIG}\n905 < {CONFIG_STATE}\n905 > {ASK_DEVICE_ID}\n910 < {DEVICE_ID}\n910 > {SET_OUTPUTS}\n\
         930 < {OUTPUTS}\n930 > {GO_TO_MEASUREMENT}\n940 < {MEASURING_STATE}\n960 < {}\n960 ! streams\n\
         960 * 5000 0.000 0.000 0.500 9.75\n970 < {WAKE_UP}\n970 ! was switched on or reset, starting again\n\
         970 > {WAKE_UP_ACKNOWLEDGE}\n970 > {GO_TO_CONFIG}\n971 end",
        started(),
        measurement(0, 50),
    );
    check(&mut InertialSession::streaming(&unit(), 0), &script);
}

#[test]
fn nobody_there_is_said_once_asked_again_behind_zeros_and_not_at_the_stop() {
    let zeros = format!("1600 > {}\n", "00 ".repeat(64)).repeat(5);
    let script = format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n400 > {GO_TO_CONFIG}\n800 > {GO_TO_CONFIG}\n1200 > {GO_TO_CONFIG}\n\
         1600 ! no answer yet, asking on (is it switched on and connected?)\n{zeros}2100 > {GO_TO_CONFIG}\n2200 stop\n2300 end"
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn wrong_answers_are_said_and_the_unit_is_asked_again() {
    let begun = format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n10 < {CONFIG_STATE}\n10 > {ASK_DEVICE_ID}\n20 < {DEVICE_ID}\n\
         20 ! is a Xsens MTi 037003F8\n20 > {SET_OUTPUTS}"
    );
    // Without turn rates; then an error; then at half the rate.
    let no_turns = framed(0xC1, &[0x10, 0x20, 0xFF, 0xFF, 0x10, 0x60, 0xFF, 0xFF, 0x40, 0x20, 0, 100]);
    let error = framed(0x42, &[0x21]);
    let slow =
        framed(0xC1, &[0x10, 0x20, 0xFF, 0xFF, 0x10, 0x60, 0xFF, 0xFF, 0x40, 0x20, 0, 50, 0x80, 0x20, 0, 50]);
    let again = |ms: i64| {
        format!(
            "{ms} > {GO_TO_CONFIG}\n{a} < {CONFIG_STATE}\n{a} > {ASK_DEVICE_ID}\n{a} < {DEVICE_ID}\n{a} > {SET_OUTPUTS}",
            a = ms + 10
        )
    };
    let script = format!(
        "{begun}\n30 < {no_turns}\n\
         30 ! does not send all of count, time, accelerations and turn rates: is it an MTi?\n{}\n\
         550 < {error}\n550 ! reports an error: parameter not valid\n{}\n1070 < {OUTPUTS}\n1070 > {GO_TO_MEASUREMENT}\n\
         1080 < {MEASURING_STATE}\n3080 ! silent for 2000 ms, starting again\n{}\n3100 < {slow}\n\
         3100 ! sends 50 samples a second, not as many as the rig asks\n3100 > {GO_TO_MEASUREMENT}\n3101 end",
        again(530),
        again(1050),
        again(3080),
    );
    check(&mut InertialSession::streaming(&unit(), 0), &script);
}

#[test]
fn a_refused_number_keeps_nothing_up_and_lost_answers_are_asked_for_again() {
    let error = framed(0x42, &[0x04]);
    let script = format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n10 < {CONFIG_STATE}\n10 > {ASK_DEVICE_ID}\n20 < {error}\n\
         20 ! reports an error: message not known\n20 > {SET_OUTPUTS}\n1020 ! no answer while writing the configuration, attempt 2\n\
         1020 > {SET_OUTPUTS}\n1030 < {OUTPUTS}\n1030 > {GO_TO_MEASUREMENT}\n\
         1430 ! no answer while starting continuous output, attempt 2\n1430 > {GO_TO_MEASUREMENT}\n1431 end"
    );
    check(&mut InertialSession::streaming(&unit(), 0), &script);
}

#[test]
fn numbers_that_no_unit_sends_are_left_out_and_flags_are_said_once() {
    let fault = "says in its status report that it has a fault";
    let clipped = "a sensor was out of its range: it shakes or turns harder than it can measure";
    let lacks = framed(0x36, &[0x10, 0x20, 2, 0, 9]);
    // One alone is damaged; a unit that sends them sends them again and again.
    let lacking: String = (110..125).map(|ms| format!("{ms} < {lacks}\n")).collect();
    let script = format!(
        "{}\n80 < {}\n90 < {}\n90 ! {clipped}\n90 ! {fault}\n90 * 120000 0.000 0.000 0.500 9.75\n100 < {}\n\
         100 * 130000 0.000 0.000 0.500 9.75\n105 < {lacks}\n\
         106 < {}\n106 * 140000 0.000 0.000 0.500 9.75\n{lacking}125 < {lacks}\n\
         125 ! sends measurements without count, time, accelerations or turn rates: not kept\n126 < {lacks}\n127 end",
        started(),
        measurement_with(1, 1100, 1e20, 1),
        measurement_with(2, 1200, 0.5, 1 << 19),
        measurement_with(3, 1300, 0.5, 1 << 19),
        measurement_with(4, 1400, 0.5, 1),
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    check(&mut session, &script);
    let health = *session.health();
    assert_eq!((health.rejected, health.missing, health.clipped), (2, 1, 2));
    assert_eq!((health.incomplete, health.not_kept, session.not_kept()), (17, 17, 17));
}

#[test]
fn a_message_that_lost_a_byte_and_passes_the_checksum_by_chance_does_not_take_the_next_one_with_it() {
    // The last byte of its frame is the first of the next one; a byte of its count is chosen so that the sum
    // fits, one of its accelerations is lost.
    let bytes = |text: &str| -> Vec<u8> {
        text.split(' ').map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal")).collect()
    };
    let mut damaged = bytes(&measurement(1, 1100));
    damaged.remove(24);
    let sum = damaged[1..].iter().chain(&[0xFA]).fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    damaged[8] = damaged[8].wrapping_sub(sum);
    let next = measurement(2, 1200);
    let text: Vec<String> = damaged.iter().map(|byte| format!("{byte:02X}")).collect();
    let script = format!(
        "{}\n90 < {} {next}\n90 * 120000 0.000 0.000 0.500 9.75\n100 < {}\n100 * 130000 0.000 0.000 0.500 9.75\n101 end",
        started(),
        text.join(" "),
        measurement(3, 1300),
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    check(&mut session, &script);
    let health = *session.health();
    assert_eq!((health.rejected, health.missing, session.not_kept()), (1, 1, 0));
}

#[test]
fn a_port_that_was_gone_is_listened_to_before_anything_is_asked() {
    let script = format!(
        "{}\n200 gone\n3000 back\n3000 = 115200\n3100 < {}\n3110 < {}\n3110 * 3130000 0.000 0.000 0.500 9.75\n\
         3110 * 3140000 0.000 0.000 0.500 9.75\n3200 end",
        started(),
        measurement(303, 31_300),
        measurement(304, 31_400),
    );
    let mut session = InertialSession::streaming(&unit(), 0);
    let sent = play(&mut session, &script.lines().map(str::to_owned).collect::<Vec<_>>());
    let asked = sent.iter().filter(|line| line.contains(&format!("> {GO_TO_CONFIG}"))).count();
    assert_eq!(asked, 1, "{sent:#?}");
    assert!(session.is_streaming(), "{sent:#?}");
}

#[test]
fn a_probe_asks_for_the_number_and_nothing_else() {
    let script = format!(
        "0 = 115200\n0 ! {UNTRIED}\n0 > {GO_TO_CONFIG}\n10 < {CONFIG_STATE}\n10 > {ASK_DEVICE_ID}\n20 < {DEVICE_ID}\n\
         20 ! is a Xsens MTi 037003F8\n300 end"
    );
    let mut session = InertialSession::probing(&unit(), 0);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn a_recording_is_only_listened_to() {
    let script = format!(
        "0 < {}\n0 * 100000 0.000 0.000 0.500 9.75\n10 < {WAKE_UP}\n20 < {CONFIG_STATE}\n30 < {}\n\
         30 * 130000 0.000 0.000 0.500 9.75\n9000 end",
        measurement(0, 1000),
        measurement(3, 1300),
    );
    let mut session = InertialSession::listening(&unit(), 0);
    check(&mut session, &script);
    assert_eq!(session.health().missing, 2);
}

#[test]
fn random_bytes_never_panic() {
    let mut noise = Noise::new(9);
    let whole: Vec<u8> = measurement(7, 700)
        .split(' ')
        .map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal"))
        .collect();
    for _ in 0..10 {
        let mut session = InertialSession::streaming(&unit(), 0);
        endure(&mut session, &mut noise, 500, 400_000_000, |noise| {
            let mut bytes = whole.clone();
            for _ in 0..noise.below(4) {
                let at = noise.below(bytes.len() as u32);
                bytes[at] = [0xFA, 0xFF, 0x36, noise.byte()][noise.below(4)];
            }
            bytes
        });
        session.handle(i64::MAX, Input::Stop);
    }
}
