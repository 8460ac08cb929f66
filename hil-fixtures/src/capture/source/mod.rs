//! A serial capture as the source of a mock rig: every scan and odometry packet in it, with the time at which
//! it left its device.
//!
//! Capture format: `/serial/<port>/rx` of the contract, section 3. It may begin anywhere and hold faults:
//! what does not deframe is passed over and counted. Times are nanoseconds on the capture's clock.

pub mod base_counts;
pub mod base_feed;
pub mod base_track;
pub mod byte_times;
pub mod laser_feed;
pub mod laser_track;
pub mod slots;

use base_track::{BaseReading, BaseTrack};
use biplane_recording::capture::serial;
use biplane_recording::rig::Base;
use biplane_recording::{Direction, Port, ReadError, Reader, Rig};
use laser_track::{LaserReading, LaserTrack};
use std::path::{Path, PathBuf};

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
    /// Lasers on a network are not played.
    #[error("{}: its rig has lasers on a network, which cannot be served from a capture; serve a world", path.display())]
    OnNetwork {
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
    pub horizontal: Option<LaserTrack>,
    /// The building-facing laser.
    pub vertical: Option<LaserTrack>,
    /// The base.
    pub base: Option<BaseTrack>,
    /// The rig that was recorded.
    pub rig: Option<Rig>,
}

impl Capture {
    /// Reads a capture, or a recording made with `--raw`.
    pub fn read(path: &Path) -> Result<Self, CaptureError> {
        let reader = Reader::open(path)?;
        let rig = reader.rig()?;
        let lasers = rig.iter().flat_map(|rig| [Some(&rig.horizontal), rig.vertical.as_ref()]);
        if lasers.flatten().any(|laser| !laser.is_lms2xx()) {
            return Err(CaptureError::OnNetwork { path: path.to_owned() });
        }
        let baud = |port| rig_baud(rig.as_ref(), port);
        let mut horizontal = LaserReading::new(baud(Port::Horizontal));
        let mut vertical = LaserReading::new(baud(Port::Vertical));
        let protocol = rig.as_ref().map_or_else(|| Base::default().protocol, |rig| rig.base.protocol);
        let mut base = BaseReading::new(baud(Port::Base), &protocol);
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
            }
        }
        let bytes = horizontal.bytes.position + vertical.bytes.position + base.bytes.position;
        let capture =
            Self { horizontal: horizontal.finish(), vertical: vertical.finish(), base: base.finish(), rig };
        match (bytes, capture.first_ns()) {
            (0, _) => Err(CaptureError::NoSerialBytes { path: path.to_owned() }),
            (_, None) => Err(CaptureError::NothingWhole { path: path.to_owned(), bytes }),
            _ => Ok(capture),
        }
    }

    fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        let lasers = [&self.horizontal, &self.vertical].into_iter().flatten();
        let scans = lasers.flat_map(|track| track.scans.iter().map(|scan| scan.time_ns));
        let packets = self.base.iter().flat_map(BaseTrack::times_ns);
        scans.chain(packets)
    }

    /// When the first scan or packet left.
    #[must_use]
    pub fn first_ns(&self) -> Option<i64> {
        self.times_ns().min()
    }

    /// From the first to the last scan or packet.
    #[must_use]
    pub fn duration_ns(&self) -> i64 {
        self.times_ns().max().unwrap_or(0) - self.first_ns().unwrap_or(0)
    }
}

fn rig_baud(rig: Option<&Rig>, port: Port) -> u32 {
    match (rig, port) {
        (Some(rig), Port::Horizontal) => rig.horizontal.baud,
        (Some(rig), Port::Vertical) => rig.vertical.as_ref().map_or(38_400, |laser| laser.baud),
        (Some(rig), Port::Base) => rig.base.baud,
        (None, Port::Base) => 9600,
        (None, _) => 38_400,
    }
}
