//! What the rig asks of a laser on a network, in the device's own units, and what of that differs from how it
//! is set.

use std::fmt;

use biplane_recording::rig::ColaLaser;
use biplane_wire::cola::{Family, Offer, OutputRange, ScanConfig, ScanDataConfig};

/// Directions that differ by less are the same, 1/10000 degree: an LMS111 reads back 3 more than was written.
const SAME_DIRECTION_E4DEG: u32 = 100;
/// The same of steps, which are rounded.
const SAME_STEP_E4DEG: u32 = 3;
/// Straight ahead, 1/10000 degree.
const AHEAD_E4DEG: i32 = 900_000;

/// What is asked; `None` stays as the device is set.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct ColaSettings {
    /// Scans a second, 1/100 Hz.
    pub rate_chz: Option<u32>,
    /// From beam to beam, 1/10000 degree.
    pub step_e4deg: Option<u32>,
    /// Field of view, 1/10000 degree.
    pub fov_e4deg: Option<i32>,
    /// Whether remission is sent.
    pub remission: Option<bool>,
    /// Whether the session may log in.
    pub login: bool,
    /// Whether what is written is kept without power.
    pub save: bool,
}

impl From<&ColaLaser> for ColaSettings {
    fn from(laser: &ColaLaser) -> Self {
        // Thirds are written with three or four digits.
        let step_e4deg = |step_deg: f64| match (step_deg * 1e4).round() as u32 {
            3330 => 3333,
            step_e4deg => step_e4deg,
        };
        Self {
            rate_chz: laser.scan_hz.map(|rate_hz| (rate_hz * 100.0).round() as u32),
            step_e4deg: laser.resolution_deg.map(step_e4deg),
            fov_e4deg: laser.fov_deg.map(|fov_deg| (fov_deg * 1e4).round() as i32),
            remission: laser.remission,
            login: laser.login,
            save: laser.save,
        }
    }
}

/// How a device is set, as far as it has told.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct ColaConfig {
    /// What its telegrams hold.
    pub data: Option<ScanDataConfig>,
    /// Which part of the fan it sends.
    pub range: Option<OutputRange>,
    /// Its rate and step.
    pub scan: Option<ScanConfig>,
}

/// What is to be written: `None` is as the rig asks.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct ColaChange {
    /// What telegrams shall hold.
    pub data: Option<ScanDataConfig>,
    /// Which part of the fan shall be sent.
    pub range: Option<OutputRange>,
    /// Rate and step.
    pub scan: Option<ScanConfig>,
}

impl ColaChange {
    /// Whether nothing is to be written.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The rig asks for what this device does not offer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct NotOffered {
    /// What it is.
    pub family: Family,
}

impl ColaSettings {
    /// What must be written to a device of this family that is set so.
    ///
    /// # Errors
    /// It does not offer what the rig asks.
    pub(crate) fn change(&self, family: Option<Family>, now: &ColaConfig) -> Result<ColaChange, NotOffered> {
        let offer = family.map(|family| self.offer(family, now)).transpose()?;
        Ok(ColaChange {
            data: now.data.and_then(|data| self.data(family, data)),
            range: now.range.and_then(|range| self.range(range)),
            scan: now.scan.zip(offer).and_then(|(scan, offer)| self.scan(scan, offer)),
        })
    }

    /// Whether scans of this rate and step are others than the rig asks.
    pub(super) fn is_other(&self, rate_chz: u32, step_e4deg: u32) -> bool {
        self.rate_chz.is_some_and(|rate| rate != rate_chz)
            || self.step_e4deg.is_some_and(|step| !same_step(step, step_e4deg))
    }

    /// Rate and step that the device offers, that the rig asks for, and that change least.
    fn offer(&self, family: Family, now: &ColaConfig) -> Result<Offer, NotOffered> {
        let refused = NotOffered { family };
        let [first, last] = family.fan_e4deg();
        if self.fov_e4deg.is_some_and(|fov| fov > last - first) {
            return Err(refused);
        }
        let is_asked = |offer: &&Offer| {
            self.rate_chz.is_none_or(|rate| rate == offer.rate_chz)
                && self.step_e4deg.is_none_or(|step| same_step(step, offer.step_e4deg))
        };
        let changed = |offer: &Offer| {
            now.scan.map_or(0, |scan| {
                u8::from(scan.rate_chz != offer.rate_chz)
                    + u8::from(!same_step(scan.step_e4deg, offer.step_e4deg))
            })
        };
        family.offers().iter().filter(is_asked).min_by_key(|offer| changed(offer)).copied().ok_or(refused)
    }

    /// Every scan is wanted, with its first echo; the rest stays.
    fn data(&self, family: Option<Family>, now: ScanDataConfig) -> Option<ScanDataConfig> {
        let mut wanted = ScanDataConfig { every: 1, ..now };
        // An LMS5xx says 0 where its echo filter decides.
        if now.channels[0] & 1 == 0 && family != Some(Family::Lms5xx) {
            wanted.channels = [now.channels[0] | 1, now.channels[1]];
        }
        wanted.remission = self.remission.unwrap_or(now.remission);
        if wanted.remission != now.remission {
            wanted.is_remission_wide = wanted.remission && family != Some(Family::Lms5xx);
        }
        (wanted != now).then_some(wanted)
    }

    fn range(&self, now: OutputRange) -> Option<OutputRange> {
        let fan = self.fov_e4deg.map(|fov| [AHEAD_E4DEG - fov / 2, AHEAD_E4DEG + fov / 2]);
        let [start_e4deg, stop_e4deg] = fan.unwrap_or([now.start_e4deg, now.stop_e4deg]);
        let step_e4deg = self.step_e4deg.unwrap_or(now.step_e4deg);
        let is_same = same_step(step_e4deg, now.step_e4deg)
            && start_e4deg.abs_diff(now.start_e4deg) <= SAME_DIRECTION_E4DEG
            && stop_e4deg.abs_diff(now.stop_e4deg) <= SAME_DIRECTION_E4DEG;
        (!is_same).then_some(OutputRange { step_e4deg, start_e4deg, stop_e4deg })
    }

    fn scan(&self, now: ScanConfig, offer: Offer) -> Option<ScanConfig> {
        let is_asked = self.rate_chz.is_some() || self.step_e4deg.is_some();
        let is_same = now.rate_chz == offer.rate_chz && same_step(now.step_e4deg, offer.step_e4deg);
        let Offer { rate_chz, step_e4deg } = offer;
        (is_asked && !is_same).then_some(ScanConfig { rate_chz, step_e4deg, ..now })
    }
}

fn same_step(a_e4deg: u32, b_e4deg: u32) -> bool {
    a_e4deg.abs_diff(b_e4deg) <= SAME_STEP_E4DEG
}

impl fmt::Display for ColaChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut gap = "";
        if let Some(scan) = self.scan {
            let (rate_hz, step_deg) = (f64::from(scan.rate_chz) / 100.0, f64::from(scan.step_e4deg) / 1e4);
            write!(f, "{rate_hz} Hz in steps of {step_deg} degrees")?;
            gap = ", ";
        }
        if let Some(range) = self.range {
            let [start, stop] = [range.start_e4deg, range.stop_e4deg].map(|angle| f64::from(angle) / 1e4);
            let step_deg = f64::from(range.step_e4deg) / 1e4;
            write!(f, "{gap}output from {start} to {stop} degrees in steps of {step_deg}")?;
            gap = ", ";
        }
        if let Some(data) = self.data {
            let remission = if data.remission { "with" } else { "without" };
            write!(f, "{gap}every scan, {remission} remission")?;
        }
        Ok(())
    }
}

impl fmt::Display for NotOffered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, last] = self.family.fan_e4deg();
        let fov_deg = f64::from(last - first) / 1e4;
        write!(f, "a {} offers up to {fov_deg} degrees and", self.family.name())?;
        for (place, offer) in self.family.offers().iter().enumerate() {
            let (rate_hz, step_deg) = (f64::from(offer.rate_chz) / 100.0, f64::from(offer.step_e4deg) / 1e4);
            let gap = if place == 0 { "" } else { "," };
            write!(f, "{gap} {rate_hz} Hz by {step_deg}")?;
        }
        Ok(())
    }
}
