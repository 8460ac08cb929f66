//! What a device says of its geometry, reach and rate: the reply to `PP`.

use super::block::Block;
use super::command::Command;
use crate::WireError;

/// Geometry, reach and rate of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// Shortest range, in mm: values below it are codes.
    pub min_mm: u32,
    /// Longest range, in mm.
    pub max_mm: u32,
    /// Steps of a whole turn.
    pub steps_per_turn: u32,
    /// First step that is measured.
    pub first_step: u16,
    /// Last step that is measured.
    pub last_step: u16,
    /// The step straight ahead.
    pub front_step: u16,
    /// Turns a minute.
    pub rpm: u32,
}

impl Parameters {
    /// Reads a reply; `None` when it is none to `PP`.
    ///
    /// # Errors
    /// A value is missing, no number, or cannot be true. Lines with a wrong sum are missing.
    pub fn parse(block: &Block<'_>) -> Option<Result<Self, WireError>> {
        (block.request.command == Command::Parameters).then(|| Self::of(block))
    }

    fn of(block: &Block<'_>) -> Result<Self, WireError> {
        let number = |key: &'static str, max: u32| {
            let refuse = |found| WireError::Value { field: key, found, offset: 0 };
            let text = block.value(key.as_bytes()).ok_or(refuse(0))?;
            let text = core::str::from_utf8(text.trim_ascii()).map_err(|_| refuse(0))?;
            let value = text.parse::<u32>().map_err(|_| refuse(0))?;
            if value <= max { Ok(value) } else { Err(refuse(value)) }
        };
        let step = |key| number(key, 9999).map(|step| step as u16);
        let parameters = Self {
            min_mm: number("DMIN", 1 << 18)?,
            max_mm: number("DMAX", 1 << 18)?,
            steps_per_turn: number("ARES", 1 << 20)?,
            first_step: step("AMIN")?,
            last_step: step("AMAX")?,
            front_step: step("AFRT")?,
            rpm: number("SCAN", 1 << 20)?,
        };
        let Self { steps_per_turn, first_step, last_step, rpm, .. } = parameters;
        match () {
            () if steps_per_turn == 0 => Err(WireError::Value { field: "ARES", found: 0, offset: 0 }),
            () if rpm == 0 => Err(WireError::Value { field: "SCAN", found: 0, offset: 0 }),
            () if last_step < first_step || u32::from(last_step) > steps_per_turn => {
                Err(WireError::Value { field: "AMAX", found: u32::from(last_step), offset: 0 })
            }
            () => Ok(parameters),
        }
    }

    /// One turn, in ns.
    #[must_use]
    pub fn turn_ns(&self) -> f64 {
        60e9 / f64::from(self.rpm)
    }

    /// From a step to the next, in ns.
    #[must_use]
    pub fn step_ns(&self) -> f64 {
        self.turn_ns() / f64::from(self.steps_per_turn)
    }

    /// From a step to the next, in degrees.
    #[must_use]
    pub fn step_deg(&self) -> f64 {
        360.0 / f64::from(self.steps_per_turn)
    }
}
