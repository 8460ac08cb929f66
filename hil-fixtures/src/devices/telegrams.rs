//! The bytes that lasers, base and inertial unit put on their lines: scans, odometry packets, samples, and
//! the replies of a start-up.
//!
//! Emitted by `biplane-wire`; buffers are larger than the longest telegram.

use crate::rig::inertial::InertialSample;
use crate::rig::scanner::Variant;
use crate::rig::simulated::{counts_mm, measuring_mode};
use crate::rig::source::{OdometrySample, ScanWords};
use biplane_recording::rig::Laser;
use biplane_wire::lms::{self, Availability, Config, MeasuringMode, ModeResult, Reply, Scan, Status, Unit};
use biplane_wire::p2os::{Command, MAX_PACKET_BYTES, MotorState, Sip};
use biplane_wire::{WireError, p2os, xsens};

/// A laser's unit of length.
fn unit(mm: bool) -> Unit {
    if mm { Unit::Mm } else { Unit::Cm }
}

/// A whole scan (B0) with this status byte.
pub fn scan(words: &ScanWords, mm: bool, status: u8) -> Result<Vec<u8>, WireError> {
    let scan = Scan { unit: unit(mm), values: words.clone(), status: Status(status), ..Scan::default() };
    emitted(lms::MAX_REPLY_BYTES, |out| scan.emit(lms::REPLY_ADDRESS, out))
}

/// A base's standard information packet.
pub fn odometry(sample: &OdometrySample) -> Result<Vec<u8>, WireError> {
    let sip = Sip {
        state: if sample.moving { MotorState::Moving } else { MotorState::Stopped },
        x_raw: sample.x_raw,
        y_raw: sample.y_raw,
        theta_raw: sample.theta_raw,
        left_raw: sample.left_mm_s,
        right_raw: sample.right_mm_s,
        battery_dv: 123,
        flags: 1,
        ..Sip::default()
    };
    emitted(MAX_PACKET_BYTES, |out| sip.emit(out))
}

/// What a laser answers while it is set up: type, installation mode, configuration, variant (an S14 has one
/// only), continuous output; each behind its acknowledgement.
pub fn laser_start_up(laser: &Laser, variant: Variant) -> Result<Vec<Vec<u8>>, WireError> {
    let is_s14 = variant.fov_deg() == 90;
    let mut config = Config::factory();
    config.set_unit(unit(counts_mm(laser)));
    config.set_measuring_mode(MeasuringMode::from_byte(measuring_mode(laser)));
    config.set_availability(Availability(u8::from(laser.index_bytes == Some(true)) << 1));
    let text: &[u8] = if is_s14 { b"LMS291;S14;X01.27 " } else { b"LMS200;S18063;V02.19 " };
    let (angle_deg, resolution_cdeg) = (variant.fov_deg(), variant.resolution_cdeg());
    let mut replies = vec![
        Reply::Type { text: lms::Text(text) },
        Reply::Mode(ModeResult::Done),
        Reply::Config(config),
        Reply::Variant { accepted: true, angle_deg, resolution_cdeg },
        Reply::Mode(ModeResult::Done),
    ];
    replies.retain(|reply| !(is_s14 && matches!(reply, Reply::Variant { .. })));
    let emit = |reply: &Reply<'_>| {
        let reply = emitted(lms::MAX_REPLY_BYTES, |out| reply.emit(lms::REPLY_ADDRESS, Status::OK, out))?;
        Ok([&[lms::ACK], reply.as_slice()].concat())
    };
    replies.iter().map(emit).collect()
}

/// What a base answers while a session is opened: both echoes, then who it is.
pub fn base_start_up() -> Result<Vec<Vec<u8>>, WireError> {
    let echo = |step| emitted(MAX_PACKET_BYTES, |out| Command::Sync(step).emit(out));
    let text = |bytes| lms::Text(bytes);
    let identity = p2os::Report::Identity(p2os::Identity {
        name: text(b"mock"),
        class: text(b"Pioneer"),
        subclass: text(b"p3dx-sh"),
    });
    Ok(vec![echo(0)?, echo(1)?, emitted(MAX_PACKET_BYTES, |out| identity.emit(out))?])
}

/// A sample of an inertial unit, with the time and the count of its message.
pub fn inertial(counter: u16, ticks: u32, sample: &InertialSample) -> Result<Vec<u8>, WireError> {
    let sample = xsens::Sample {
        packet_counter: Some(counter),
        time_fine: Some(ticks),
        acceleration_m_s2: Some(sample.force_m_s2),
        turn_rad_s: Some(sample.turn_rad_s),
        status_word: Some(xsens::status::SELF_TEST),
        ..xsens::Sample::default()
    };
    let mut items = xsens::ItemsWriter::default();
    sample.write(xsens::Precision::Float32, &mut items)?;
    let report = xsens::Report::Data(xsens::Items::parse(items.bytes())?);
    emitted(xsens::MAX_MESSAGE_BYTES, |out| report.emit(out))
}

/// What an inertial unit answers while it is set up: config state, who it is, its outputs, measuring state.
pub fn inertial_start_up(rate_hz: u16) -> Result<Vec<Vec<u8>>, WireError> {
    use xsens::{DeviceId, EVERY_SAMPLE, Output, Report, quantity};
    let outputs = [
        (quantity::PACKET_COUNTER, EVERY_SAMPLE),
        (quantity::SAMPLE_TIME_FINE, EVERY_SAMPLE),
        (quantity::ACCELERATION, rate_hz),
        (quantity::RATE_OF_TURN, rate_hz),
        (quantity::STATUS_WORD, EVERY_SAMPLE),
    ];
    let outputs = outputs.map(|(identifier, rate_hz)| Output { identifier, rate_hz });
    let reports = [
        Report::ConfigState,
        Report::DeviceId(DeviceId::Short(0x0380_0D10)),
        Report::Outputs(outputs.into_iter().collect()),
        Report::MeasuringState,
    ];
    reports.iter().map(|report| emitted(xsens::MAX_MESSAGE_BYTES, |out| report.emit(out))).collect()
}

fn emitted(
    capacity: usize,
    emit: impl FnOnce(&mut [u8]) -> Result<usize, WireError>,
) -> Result<Vec<u8>, WireError> {
    let mut bytes = vec![0; capacity];
    let length = emit(&mut bytes)?;
    bytes.truncate(length);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::{laser_start_up, odometry, scan};
    use crate::rig::scanner::Variant;
    use crate::rig::source::{OdometrySample, ScanWords};
    use biplane_recording::rig::{Laser, Units};

    #[test]
    fn a_scan_of_three_values_comes_out_byte_for_byte() {
        let words = ScanWords::from_slice(&[100, 8191, 250]).expect("three fit");
        let bytes = scan(&words, true, 0x10).expect("emits");
        // STX, address, length, B0, count with the millimeter bit, values, status; the checksum is the wire
        // crate's matter.
        let expected = [0x02, 0x80, 0x0A, 0x00, 0xB0, 0x03, 0x40, 100, 0, 0xFF, 0x1F, 250, 0, 0x10];
        assert_eq!(bytes[..bytes.len() - 2], expected);
    }

    #[test]
    fn an_odometry_packet_starts_as_the_manual_says() {
        let sample = OdometrySample { x_raw: 32600, moving: false, ..OdometrySample::default() };
        let bytes = odometry(&sample).expect("emits");
        assert_eq!(bytes[..8], [0xFA, 0xFB, bytes[2], 0x32, 0x58, 0x7F, 0x00, 0x00]);
        assert_eq!(usize::from(bytes[2]) + 3, bytes.len());
    }

    #[test]
    fn the_start_up_tells_unit_and_variant() {
        let laser = Laser { units: Units::Mm, index_bytes: Some(true), ..Laser::horizontal() };
        let variant = Variant::new(180, 50).expect("a variant");
        let replies = laser_start_up(&laser, variant).expect("emits");
        // Configuration F4: unit at offset 6 behind the code byte; ACK and 4 bytes of head stand before.
        assert_eq!((replies[2][5], &replies[2][6 + 4..=6 + 6]), (0xF4, &[2, 0, 1][..]));
        assert_eq!(
            replies[3][1..],
            [0x02, 0x80, 0x07, 0x00, 0xBB, 0x01, 0xB4, 0x00, 0x32, 0x00, 0x10, 0x03, 0x9D]
        );
    }
}
