//! The side of a laser of any kind in a capture.

use super::fan::cola::{ColaReading, ColaTrack};
use super::fan::scip::{ScipReading, ScipTrack};
use super::laser_track::{LaserReading, LaserTrack};
use biplane_recording::rig::{Laser, LaserProtocol};

/// Rate of the line of an LMS 2xx whose rig is not known, Bd.
const LASER_BAUD: u32 = 38_400;

/// A laser's side of a capture.
#[derive(Clone, Debug)]
pub enum CapturedLaser {
    /// An LMS 2xx.
    Lms(LaserTrack),
    /// A SICK laser on a network.
    Cola(ColaTrack),
    /// A Hokuyo laser.
    Scip(ScipTrack),
}

impl CapturedLaser {
    /// The track of an LMS 2xx.
    #[must_use]
    pub fn lms(&self) -> Option<&LaserTrack> {
        match self {
            Self::Lms(track) => Some(track),
            Self::Cola(_) | Self::Scip(_) => None,
        }
    }

    /// When each of its scans left.
    #[must_use]
    pub fn times_ns(&self) -> Vec<i64> {
        match self {
            Self::Lms(track) => track.scans.iter().map(|scan| scan.time_ns).collect(),
            Self::Cola(ColaTrack { scans, .. }) | Self::Scip(ScipTrack { scans, .. }) => {
                scans.iter().map(|scan| scan.time_ns).collect()
            }
        }
    }

    /// Values of its scans.
    #[must_use]
    pub fn beams(&self) -> usize {
        match self {
            Self::Lms(track) => track.scans.first().map_or(0, |scan| scan.words.len()),
            Self::Cola(track) => track.beams(),
            Self::Scip(track) => track.request.map_or(0, |request| request.values()),
        }
    }

    /// Scans that are not played.
    #[must_use]
    pub fn other_scans(&self) -> u64 {
        match self {
            Self::Lms(track) => track.other_scans,
            Self::Cola(_) => 0,
            Self::Scip(track) => track.other_scans,
        }
    }

    /// Bytes that are in no telegram.
    #[must_use]
    pub fn skipped_bytes(&self) -> u64 {
        match self {
            Self::Lms(LaserTrack { skipped_bytes, .. })
            | Self::Cola(ColaTrack { skipped_bytes, .. })
            | Self::Scip(ScipTrack { skipped_bytes, .. }) => *skipped_bytes,
        }
    }
}

/// Bytes of a laser of any kind on their way to a track.
pub(super) enum AnyReading {
    Lms(Box<LaserReading>),
    Cola(ColaReading),
    Scip(ScipReading),
}

impl AnyReading {
    pub(super) fn new(laser: Option<&Laser>) -> Self {
        let Some(laser) = laser else { return Self::lms(LASER_BAUD) };
        match &laser.protocol {
            LaserProtocol::Lms2xx => Self::lms(laser.baud),
            LaserProtocol::Cola(_) => Self::Cola(ColaReading::default()),
            LaserProtocol::Scip(_) => {
                Self::Scip(ScipReading::new(laser.address().is_none().then_some(laser.baud)))
            }
        }
    }

    fn lms(baud: u32) -> Self {
        Self::Lms(Box::new(LaserReading::new(baud)))
    }

    pub(super) fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        match self {
            Self::Lms(reading) => reading.take(time_ns, bytes),
            Self::Cola(reading) => reading.take(time_ns, bytes),
            Self::Scip(reading) => reading.take(time_ns, bytes),
        }
    }

    pub(super) fn position(&self) -> u64 {
        match self {
            Self::Lms(reading) => reading.bytes.position,
            Self::Cola(reading) => reading.bytes.position,
            Self::Scip(reading) => reading.bytes.position,
        }
    }

    pub(super) fn finish(self) -> Option<CapturedLaser> {
        match self {
            Self::Lms(reading) => reading.finish().map(CapturedLaser::Lms),
            Self::Cola(reading) => reading.finish().map(CapturedLaser::Cola),
            Self::Scip(reading) => reading.finish().map(CapturedLaser::Scip),
        }
    }
}
