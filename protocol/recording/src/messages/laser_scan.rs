//! `sensor_msgs/msg/LaserScan`: one telegram of a laser, in the laser's own frame (REP 117 for what is no
//! range).

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// One scan: beam i points to `angle_min_rad + i * angle_increment_rad`, counted counter-clockwise seen from
/// +z.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LaserScan {
    /// When the first beam was taken, in ns.
    pub stamp_ns: i64,
    /// The laser's frame.
    pub frame_id: String,
    /// Direction of the first beam, in rad.
    pub angle_min_rad: f32,
    /// Direction of the last beam, in rad.
    pub angle_max_rad: f32,
    /// From a beam to the next, in rad.
    pub angle_increment_rad: f32,
    /// From a beam to the next of the same mirror turn, divided by the number of turns of a scan, in s. The
    /// exact beam times follow from the rig's time model ([`crate::rig::Laser::beam_delay_ns`]).
    pub time_increment_s: f32,
    /// From a scan to the next, in s.
    pub scan_time_s: f32,
    /// The shortest range that is one, in m.
    pub range_min_m: f32,
    /// The longest range that is one, in m.
    pub range_max_m: f32,
    /// One a beam, in m: a range, `+inf` for no echo or beyond range, NaN for invalid.
    pub ranges_m: Vec<f32>,
    /// Remission, one a beam, device units; empty where the device sends none.
    pub intensities: Vec<f32>,
}

impl LaserScan {
    /// All that comes before the beams, which `sensor_msgs/msg/MultiEchoLaserScan` has as well.
    ///
    /// # Errors
    /// When the bytes end before.
    pub fn read_without_beams(decoder: &mut Decoder<'_>) -> Result<Self, CdrError> {
        let (stamp_ns, frame_id) = decoder.header()?;
        Ok(Self {
            stamp_ns,
            frame_id,
            angle_min_rad: decoder.f32()?,
            angle_max_rad: decoder.f32()?,
            angle_increment_rad: decoder.f32()?,
            time_increment_s: decoder.f32()?,
            scan_time_s: decoder.f32()?,
            range_min_m: decoder.f32()?,
            range_max_m: decoder.f32()?,
            ..Self::default()
        })
    }
}

impl Message for LaserScan {
    const TYPE: &'static str = "sensor_msgs/msg/LaserScan";

    fn write(&self, encoder: &mut Encoder) {
        encoder.header(self.stamp_ns, &self.frame_id);
        encoder.f32(self.angle_min_rad);
        encoder.f32(self.angle_max_rad);
        encoder.f32(self.angle_increment_rad);
        encoder.f32(self.time_increment_s);
        encoder.f32(self.scan_time_s);
        encoder.f32(self.range_min_m);
        encoder.f32(self.range_max_m);
        encoder.f32_sequence(&self.ranges_m);
        encoder.f32_sequence(&self.intensities);
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let scan = Self::read_without_beams(decoder)?;
        Ok(Self { ranges_m: decoder.f32_sequence()?, intensities: decoder.f32_sequence()?, ..scan })
    }
}
