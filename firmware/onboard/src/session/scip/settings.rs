//! What the rig asks of a Hokuyo laser, and the request for scans that follows from it and from what the
//! device offers.

use std::fmt;

use biplane_recording::rig::Laser;
use biplane_wire::scip::{Delivery, Parameters, ScanRequest};

/// A step that differs by less than this share from a multiple of the device's is that multiple.
const SAME_STEP: f64 = 0.02;
/// The same of rates, which a motor does not keep exactly.
const SAME_RATE: f64 = 0.02;
/// Most steps that a device joins to one value.
const MAX_CLUSTER: f64 = 99.0;
/// Most turns of one scan: nine are left out between two.
const MAX_TURNS: f64 = 10.0;
/// A device that reaches farther sends intensities, in mm. Others, of the time of the URG-04LX, may hang when
/// they are asked (urg_c#4).
const INTENSITY_FROM_MM: u32 = 20_000;

/// What is asked; `None` is all that the device measures.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct ScipSettings {
    /// The rate to run a serial line at, bits per second; `None` on a network.
    pub baud: Option<u32>,
    /// Field of view, degrees.
    pub fov_deg: Option<f64>,
    /// From beam to beam, degrees.
    pub resolution_deg: Option<f64>,
    /// Scans a second.
    pub scan_hz: Option<f64>,
    /// Whether intensities are asked for.
    pub remission: Option<bool>,
}

impl From<&Laser> for ScipSettings {
    fn from(laser: &Laser) -> Self {
        let scip = laser.scip().cloned().unwrap_or_default();
        Self {
            baud: scip.address.is_none().then_some(laser.baud),
            fov_deg: scip.fov_deg,
            resolution_deg: scip.resolution_deg,
            scan_hz: scip.scan_hz,
            remission: scip.remission,
        }
    }
}

/// What a device offers.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct ScipOffer {
    /// What it says of itself.
    parameters: Parameters,
}

impl ScipOffer {
    /// That of a device.
    pub(crate) fn of(parameters: &Parameters) -> Self {
        Self { parameters: *parameters }
    }

    /// Widest field of view whose middle is straight ahead, degrees.
    fn fov_deg(&self) -> f64 {
        let Parameters { first_step, last_step, front_step, .. } = self.parameters;
        let half = front_step.saturating_sub(first_step).min(last_step.saturating_sub(front_step));
        2.0 * f64::from(half) * self.parameters.step_deg()
    }

    /// Turns a second.
    fn turns_hz(&self) -> f64 {
        f64::from(self.parameters.rpm) / 60.0
    }

    /// Whether it sends intensities.
    fn has_intensity(&self) -> bool {
        self.parameters.max_mm > INTENSITY_FROM_MM
    }
}

impl fmt::Display for ScipOffer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (fov_deg, step_deg) = (self.fov_deg(), self.parameters.step_deg());
        let turns_hz = self.turns_hz();
        let intensities = if self.has_intensity() { "with or without remission" } else { "no remission" };
        write!(f, "up to {fov_deg:.1} degrees, in steps of {step_deg:.4} or a multiple, ")?;
        write!(f, "{turns_hz:.1} Hz divided by 1 to 10, {intensities}")
    }
}

impl ScipSettings {
    /// The stream that fits the rig.
    ///
    /// # Errors
    /// The device does not offer it.
    pub(crate) fn request(&self, parameters: &Parameters) -> Result<ScanRequest, ScipOffer> {
        let offer = ScipOffer::of(parameters);
        let (step_deg, fov_deg) = (parameters.step_deg(), offer.fov_deg());
        let cluster = match self.resolution_deg {
            None => 1.0,
            Some(wanted) => multiple(wanted / step_deg, SAME_STEP, MAX_CLUSTER).ok_or(offer)?,
        };
        let turns = match self.scan_hz {
            None => 1.0,
            Some(wanted) => multiple(offer.turns_hz() / wanted, SAME_RATE, MAX_TURNS).ok_or(offer)?,
        };
        if self.remission == Some(true) && !offer.has_intensity() {
            return Err(offer);
        }
        let whole = everything(parameters);
        let [first_step, last_step] = match self.fov_deg {
            None => [whole.first_step, whole.last_step],
            Some(wanted) if wanted > fov_deg + step_deg => return Err(offer),
            Some(wanted) => {
                let half = (wanted.min(fov_deg) / 2.0 / step_deg).round() as u16;
                [parameters.front_step.saturating_sub(half), parameters.front_step.saturating_add(half)]
            }
        };
        Ok(ScanRequest {
            delivery: Delivery::Stream { skip: turns as u8 - 1, count: 0 },
            with_intensity: self.remission == Some(true),
            first_step,
            last_step,
            cluster: cluster as u8,
            ..whole
        })
    }
}

/// All that a device measures.
pub(crate) fn everything(parameters: &Parameters) -> ScanRequest {
    ScanRequest {
        delivery: Delivery::Stream { skip: 0, count: 0 },
        all_echoes: false,
        with_intensity: false,
        first_step: parameters.first_step,
        last_step: parameters.last_step,
        cluster: 1,
    }
}

/// The whole number from 1 on that a ratio is.
fn multiple(ratio: f64, tolerance: f64, max: f64) -> Option<f64> {
    let whole = ratio.round();
    ((1.0..=max).contains(&whole) && (ratio - whole).abs() <= tolerance * whole).then_some(whole)
}
