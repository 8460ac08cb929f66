//! A serial capture as the source of a mock rig: every scan and odometry packet in it, with the time at which
//! it left its device.
//!
//! Capture format: `/serial/<port>/rx` of the contract, section 3. It may begin anywhere and hold faults:
//! what does not deframe is passed over and counted. Times are nanoseconds on the capture's clock.

pub mod base_counts;
pub mod base_feed;
pub mod base_track;
pub mod byte_times;
pub mod captured_laser;
pub mod fan;
pub mod inertial_track;
pub mod laser_feed;
pub mod laser_track;
pub mod slots;

use base_track::{BaseReading, BaseTrack};
use biplane_recording::capture::serial;
use biplane_recording::rig::Base;
use biplane_recording::{Direction, Port, ReadError, Reader, Rig};
use captured_laser::AnyReading;
pub use captured_laser::CapturedLaser;
use inertial_track::{InertialReading, InertialTrack};
use std::path::{Path, PathBuf};

/// Rate of a base's line whose rig is not known, Bd.
const BASE_BAUD: u32 = 9600;

/// Why a capture cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It has no serial bytes.
    #[error("{}: no bytes of any device (/serial/.../rx); a recording has them when it was made with --raw", path.display())]
    NoSerialBytes {
        /// The file.
        path: PathBuf,
    },
    /// Serial bytes, but nothing in them that a device could send.
    #[error("{}: {bytes} serial bytes, but no whole scan and no odometry packet in them", path.display())]
    NothingWhole {
        /// The file.
        path: PathBuf,
        /// Bytes looked through.
        bytes: u64,
    },
}

/// All that a capture holds of the devices' bytes.
#[derive(Clone, Debug, Default)]
pub struct Capture {
    /// The localizing laser.
    pub horizontal: Option<CapturedLaser>,
    /// The building-facing laser.
    pub vertical: Option<CapturedLaser>,
    /// The base.
    pub base: Option<BaseTrack>,
    /// The inertial unit.
    pub inertial: Option<InertialTrack>,
    /// The rig that was recorded.
    pub rig: Option<Rig>,
}

impl Capture {
    /// Reads a capture, or a recording made with `--raw`.
    pub fn read(path: &Path) -> Result<Self, CaptureError> {
        let reader = Reader::open(path)?;
        let rig = reader.rig()?;
        let mut horizontal = AnyReading::new(rig.as_ref().map(|rig| &rig.horizontal));
        let mut vertical = AnyReading::new(rig.as_ref().and_then(|rig| rig.vertical.as_ref()));
        let protocol = rig.as_ref().map_or_else(|| Base::default().protocol, |rig| rig.base.protocol);
        let mut base = BaseReading::new(rig.as_ref().map_or(BASE_BAUD, |rig| rig.base.baud), &protocol);
        let mut inertial = InertialReading::default();
        for message in serial(&reader) {
            let message = message?;
            if message.direction == Direction::Tx {
                if message.port == Port::Base {
                    base.asked(&message.bytes);
                }
                continue;
            }
            match message.port {
                Port::Horizontal => horizontal.take(message.time_ns, &message.bytes),
                Port::Vertical => vertical.take(message.time_ns, &message.bytes),
                Port::Base => base.take(message.time_ns, &message.bytes),
                Port::Imu => inertial.take(message.time_ns, &message.bytes),
            }
        }
        let lasers = horizontal.position() + vertical.position();
        let bytes = lasers + base.bytes.position + inertial.position();
        let capture = Self {
            horizontal: horizontal.finish(),
            vertical: vertical.finish(),
            base: base.finish(),
            inertial: inertial.finish(),
            rig,
        };
        match (bytes, capture.first_ns()) {
            (0, _) => Err(CaptureError::NoSerialBytes { path: path.to_owned() }),
            (_, None) => Err(CaptureError::NothingWhole { path: path.to_owned(), bytes }),
            _ => Ok(capture),
        }
    }

    fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        let lasers = [&self.horizontal, &self.vertical].into_iter().flatten();
        let scans = lasers.flat_map(CapturedLaser::times_ns);
        let packets = self.base.iter().flat_map(BaseTrack::times_ns);
        let samples = self.inertial.iter().flat_map(InertialTrack::times_ns);
        scans.chain(packets).chain(samples)
    }

    /// When the first scan, packet or sample left.
    #[must_use]
    pub fn first_ns(&self) -> Option<i64> {
        self.times_ns().min()
    }

    /// From the first to the last of them.
    #[must_use]
    pub fn duration_ns(&self) -> i64 {
        self.times_ns().max().unwrap_or(0) - self.first_ns().unwrap_or(0)
    }
}
