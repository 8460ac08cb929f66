//! In place of the server, in a program that is built without the feature `live`.

use super::{LiveAddress, LiveReport, Tap};
use crate::error::OnboardError;
use biplane_recording::Rig;

/// There is none.
#[derive(Copy, Clone, Debug)]
pub enum Door {}

/// There is none.
#[derive(Copy, Clone, Debug)]
pub enum LiveView {}

impl Door {
    /// Says that there is none.
    ///
    /// # Errors
    /// Always [`OnboardError::NoLiveView`].
    pub fn open(_address: LiveAddress) -> Result<Self, OnboardError> {
        Err(OnboardError::NoLiveView)
    }

    /// Cannot be called.
    ///
    /// # Errors
    /// None.
    pub fn start(self, _rig: &Rig) -> Result<(Tap, LiveView), OnboardError> {
        match self {}
    }
}

impl LiveView {
    /// Cannot be called.
    #[must_use]
    pub fn finish(self) -> LiveReport {
        match self {}
    }
}
