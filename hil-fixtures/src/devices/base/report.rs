//! Bodies of the packets that a mock base sends: identity, odometry, configuration.
//!
//! Sources: Pioneer 3 manual (standard server information packet), AriaCoda's reader of the configuration
//! packet; the bytes that no source explains are those of transcripts that AriaCoda and Player accepted.

use super::counters::CountScale;
use crate::rig::source::OdometrySample;
use crate::rig::tick::DEFAULT_SUBCLASS;

const X_MASK: i32 = 0x7FFF;

/// Texts by which a base introduces itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Robot's name.
    pub name: String,
    /// Class; `Pioneer` for all that speak P2OS.
    pub class: String,
    /// Subclass; picks the client's parameters.
    pub subclass: String,
}

impl Default for Identity {
    fn default() -> Self {
        Self {
            name: "MockBase".to_owned(),
            class: "Pioneer".to_owned(),
            subclass: DEFAULT_SUBCLASS.to_owned(),
        }
    }
}

fn push_text(body: &mut Vec<u8>, text: &str) {
    body.extend(text.bytes().filter(|&byte| byte != 0));
    body.push(0);
}

/// The answer to SYNC2.
#[must_use]
pub fn identity_body(identity: &Identity) -> Vec<u8> {
    let mut body = vec![2];
    for text in [&identity.name, &identity.class, &identity.subclass] {
        push_text(&mut body, text);
    }
    body
}

/// Pose in unwrapped raw units, and its zero as the client set it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometer {
    last: Option<OdometrySample>,
    x: i32,
    y: i32,
    zero: (i32, i32, i16),
    was_zeroed: bool,
    zero_at_next: bool,
}

impl Odometer {
    /// One that counts from the pose of its first sample, as after power-on.
    #[must_use]
    pub fn zero_at_first() -> Self {
        Self { zero_at_next: true, ..Self::default() }
    }

    /// Takes in a sample of the source, whose x and y wrap at 15 bits.
    pub fn follow(&mut self, sample: OdometrySample) {
        let step = |now: u16, before: u16| {
            let ahead = (i32::from(now) - i32::from(before)) & X_MASK;
            if ahead > X_MASK / 2 { ahead - X_MASK - 1 } else { ahead }
        };
        match self.last {
            Some(last) => {
                self.x += step(sample.x_raw, last.x_raw);
                self.y += step(sample.y_raw, last.y_raw);
            }
            None => (self.x, self.y) = (i32::from(sample.x_raw), i32::from(sample.y_raw)),
        }
        self.last = Some(sample);
        if std::mem::take(&mut self.zero_at_next) {
            self.set_zero();
        }
    }

    /// Makes the present pose the zero.
    pub fn set_zero(&mut self) {
        self.zero = (self.x, self.y, self.last.map_or(0, |last| last.theta_raw));
        self.was_zeroed = true;
    }

    /// x, y (15 bits) and heading as the base would report them.
    #[must_use]
    pub fn reported(&self) -> (u16, u16, i16) {
        let theta = self.last.map_or(0, |last| last.theta_raw);
        let wrap = |value: i32| u16::try_from(value & X_MASK).unwrap_or(0);
        if !self.was_zeroed {
            return (wrap(self.x), wrap(self.y), theta);
        }
        let (dx, dy) = (f64::from(self.x - self.zero.0), f64::from(self.y - self.zero.1));
        let (sin, cos) = (f64::from(self.zero.2) * std::f64::consts::TAU / 4096.0).sin_cos();
        let x = (cos * dx + sin * dy).round() as i32;
        let y = (cos * dy - sin * dx).round() as i32;
        let turned = (i32::from(theta) - i32::from(self.zero.2) + 2048).rem_euclid(4096) - 2048;
        (wrap(x), wrap(y), i16::try_from(turned).unwrap_or(0))
    }
}

/// A standard packet, 32 bytes of body: pose, wheel speeds, 12.3 V, no bumper, no sonar.
#[must_use]
pub fn sip_body(pose: (u16, u16, i16), sample: &OdometrySample, motors_enabled: bool) -> Vec<u8> {
    let mut body = vec![if sample.moving { 0x33 } else { 0x32 }];
    body.extend(pose.0.to_le_bytes());
    body.extend(pose.1.to_le_bytes());
    body.extend(pose.2.to_le_bytes());
    body.extend(sample.left_mm_s.to_le_bytes());
    body.extend(sample.right_mm_s.to_le_bytes());
    body.extend([123, 0, 0, 0, 0, u8::from(motors_enabled), 0, 0, 0]);
    body.extend([0; 5]);
    body.extend([123, 0, 0, 0, 0, 0, 0]);
    body
}

/// A Pioneer 3's wheels: 128 counts a millimeter, 0.33 m apart.
const WHEELS: CountScale = CountScale::Wheels {
    wheel_base_m: 0.33,
    metres_per_count_left: 1e-3 / 128.0,
    metres_per_count_right: 1e-3 / 128.0,
};

/// The encoder packet, type 90h: both wheels' counts, low word first.
#[must_use]
pub fn encoder_body(sample: &OdometrySample) -> Vec<u8> {
    let [left, right] = WHEELS.counts(sample).map(i32::to_le_bytes);
    [&[0x90][..], &left, &right].concat()
}

/// The configuration packet, type 20h: limits as of a Pioneer 3-DX, 100 ms cycle, 2 s watchdog.
#[must_use]
pub fn config_body(identity: &Identity) -> Vec<u8> {
    const LIMITS: [u8; 10] = [0x00, 0x68, 0x01, 0x98, 0x08, 0x58, 0x02, 0xA0, 0x0F, 0xF4];
    const AFTER_NAME: [u8; 66] = [
        0x64, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x6E, 0x00, 0xBA, 0x40, 0xD0, 0x07, 0x00, 0xC8, 0x00,
        0xC8, 0x00, 0x00, 0x00, 0x00, 0x00, 0x64, 0x00, 0xEE, 0x02, 0x64, 0x00, 0x64, 0x00, 0x28, 0x00, 0x28,
        0x00, 0x28, 0x00, 0x2C, 0x01, 0x2C, 0x01, 0x28, 0x00, 0x28, 0x00, 0x28, 0x00, 0x00, 0x00, 0x00, 0x28,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x8A, 0x00, 0x64, 0x00, 0x32, 0x2E, 0x36, 0x00, 0x00,
    ];
    let mut body = vec![0x20];
    for text in [identity.class.as_str(), identity.subclass.as_str(), "SN0001"] {
        push_text(&mut body, text);
    }
    body.extend(LIMITS);
    body.push(0x01);
    push_text(&mut body, &identity.name);
    body.extend(AFTER_NAME);
    body.extend([0; 4]);
    body
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_back_over_the_wrap_is_small_when_counted_from_a_turned_zero() {
        let sample = |x_raw| OdometrySample { x_raw, theta_raw: 512, ..OdometrySample::default() };
        let mut odometer = Odometer::default();
        odometer.follow(sample(5));
        assert_eq!(odometer.reported(), (5, 0, 512));
        odometer.set_zero();
        odometer.follow(sample(32_760));
        // 13 back along x, seen in axes turned by 45 degrees: 9.19 back and 9.19 to the left.
        assert_eq!(odometer.reported(), (0x8000 - 9, 9, 0));
    }
}
