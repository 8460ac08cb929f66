//! Scripted sessions with an rFLEX base. Commands and reports are by hand, with their sums.

use biplane_recording::rig::BaseProtocol;

use crate::session::base::{BaseSession, BaseSettings};
use crate::session::device_session::Session;
use crate::session::testing::noise::{Noise, endure};
use crate::session::testing::script::{check, play};

/// 1000 counts a meter, 500 a radian.
const SETTINGS: BaseSettings = BaseSettings {
    baud: 115_200,
    protocol: BaseProtocol::Rflex { counts_per_m: 1000.0, counts_per_rad: 500.0 },
};

const STATUS: &str = "1B 02 01 00 01 00 00 1B 03";
const ODOMETRY_ON: &str = "1B 02 02 00 22 08 00 01 86 A0 00 00 00 03 0C 1B 03";
const INPUTS_ON: &str = "1B 02 05 00 00 04 00 01 86 A0 26 1B 03";
const DEFAULTS: &str = "1B 02 02 00 0A 00 08 1B 03";
const BRAKE_OFF: &str = "1B 02 02 00 0C 00 0E 1B 03";
const STAND: &str = "1B 02 02 00 07 0E 00 00 00 00 00 00 00 03 E8 00 00 75 30 01 A4 1B 03";
/// Axis 1: one bit of data and of the sum.
const STAND_TURNING: &str = "1B 02 02 00 07 0E 01 00 00 00 00 00 00 03 E8 00 00 75 30 01 A5 1B 03";
const ODOMETRY_OFF: &str = "1B 02 02 00 22 08 00 00 00 00 00 00 00 00 28 1B 03";
const INPUTS_OFF: &str = "1B 02 05 00 00 04 00 00 00 00 01 1B 03";
const BRAKE_ON: &str = "1B 02 02 00 0B 00 09 1B 03";
/// 24.60 V, brake on.
const STATE: &str = "1B 02 01 08 01 09 00 00 00 63 00 00 09 9C 01 F6 1B 03";

fn report(axis: u8, position: i32) -> String {
    let mut body = vec![2, 7, 33, 25, 0, 0, 0, 0, 0, 0, 0, 0, axis];
    body.extend(position.to_be_bytes());
    body.extend([0; 12]);
    let sum = body.iter().fold(0, |sum, byte| sum ^ byte);
    let bytes = [&[0x1B, 0x02][..], &body, &[sum, 0x1B, 0x03]].concat();
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

fn started() -> String {
    format!(
        "0 = 115200\n0 ! this driver was never tried on hardware\n0 > {STATUS}\n10 < {STATE}\n10 ! is a rFLEX\n30 > {ODOMETRY_ON}\n\
         50 > {INPUTS_ON}\n70 > {DEFAULTS}\n90 > {BRAKE_OFF}\n110 > {STAND}\n130 > {STAND_TURNING}\n\
         160 < {}\n163 < {}\n163 ! streams\n163 * 0.000 0.000 0.0000",
        report(0, -5),
        report(1, i32::MAX),
    )
}

#[test]
fn the_sheets_start_order_is_kept_way_and_bearing_pair_and_the_stop_order_is_kept() {
    // 100 counts ahead while turning 785 counts over the wrap: an arc of 0.1 m and a quarter of a turn.
    let script = format!(
        "{}\n500 < {}\n503 < {}\n503 * 0.064 0.064 1.5700\n600 stop\n620 > {ODOMETRY_OFF}\n640 > {INPUTS_OFF}\n\
         660 > {BRAKE_ON}\n680 ! left idle\n700 end",
        started(),
        report(0, 95),
        report(1, i32::MIN + 784),
    );
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn no_axis_is_ever_given_a_speed() {
    let mut session = BaseSession::streaming(SETTINGS, 0);
    let lines: Vec<String> =
        format!("{}\n9000 stop\n9900 end", started()).lines().map(str::to_owned).collect();
    let sent: Vec<String> = play(&mut session, &lines);
    let set_direction = sent.iter().filter(|line| line.contains("> 1B 02 02 00 07")).count();
    let standing = sent.iter().filter(|line| line.contains(STAND) || line.contains(STAND_TURNING)).count();
    assert!(set_direction >= 2 && set_direction == standing, "{sent:#?}");
    assert!(!sent.iter().any(|line| line.contains("> 1B 02 02 00 08")), "{sent:#?}");
}

#[test]
fn a_silent_base_is_said_within_a_second_and_started_anew_when_it_is_back() {
    let script = format!(
        "{}\n1063 ! silent for 900 ms, starting again\n1063 > {STATUS}\n1500 < {STATE}\n1520 > {ODOMETRY_ON}\n1540 > {INPUTS_ON}\n\
         1560 > {DEFAULTS}\n1561 end",
        started()
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
}

#[test]
fn a_silent_base_is_reported_asked_again_behind_zeros_and_not_at_the_stop() {
    // The longest packet has 264 bytes.
    let zeros = format!("2000 > {}\n", "00 ".repeat(64)).repeat(5);
    let script = format!(
        "0 = 115200\n0 ! this driver was never tried on hardware\n0 > {STATUS}\n500 > {STATUS}\n1000 > {STATUS}\n1500 > {STATUS}\n\
         2000 ! no answer yet, asking on (is it switched on and connected?)\n{zeros}2500 > {STATUS}\n2600 stop\n2700 end"
    );
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn a_probe_asks_for_the_state_and_nothing_else() {
    let script = format!(
        "0 = 115200\n0 ! this driver was never tried on hardware\n0 > {STATUS}\n10 < {STATE}\n10 ! is a rFLEX\n300 end"
    );
    let mut session = BaseSession::probing(SETTINGS, 0);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn random_bytes_never_panic() {
    let mut noise = Noise::new(7);
    for _ in 0..10 {
        let mut session = BaseSession::streaming(SETTINGS, 0);
        endure(&mut session, &mut noise, 500, 400_000_000, |noise| {
            (0..noise.below(256)).map(|_| [0x1B, 2, 3, noise.byte()][noise.below(4)]).collect()
        });
    }
}
