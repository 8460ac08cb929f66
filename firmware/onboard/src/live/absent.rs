//! In place of the server, in a program that is built without the feature `live`.

use crate::output::tap::Tap;
use crate::types::error::OnboardError;
use crate::types::live_address::LiveAddress;
use crate::types::live_report::LiveReport;
use crate::types::web_origin::WebOrigin;
use biplane_recording::Rig;

/// There is none.
#[derive(Copy, Clone, Debug)]
pub(crate) enum Listener {}

/// There is none.
#[derive(Copy, Clone, Debug)]
pub(crate) enum LiveView {}

impl Listener {
    /// Says that there is none.
    ///
    /// # Errors
    /// Always [`OnboardError::NoLiveView`].
    pub(crate) fn open(_address: LiveAddress, _allowed_origins: &[WebOrigin]) -> Result<Self, OnboardError> {
        Err(OnboardError::NoLiveView)
    }

    /// Cannot be called.
    ///
    /// # Errors
    /// None.
    pub(crate) fn start(self, _rig: &Rig) -> Result<(Tap, LiveView), OnboardError> {
        match self {}
    }
}

impl LiveView {
    /// Cannot be called.
    #[must_use]
    pub(crate) fn finish(self) -> LiveReport {
        match self {}
    }
}
