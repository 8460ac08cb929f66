//! What a laser's session says once, and not again for every scan or start.

use super::health::FaultList;
use super::reading::Unpublished;
use super::wanted::ConfigChange;

/// What is said once.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Said {
    pub(super) mode: bool,
    pub(super) variant: Option<(u16, u16)>,
    pub(super) faults: FaultList,
    pub(super) has_fault: bool,
    pub(super) unpublished: heapless::Vec<Unpublished, 8>,
    pub(super) rejected: bool,
    pub(super) not_found: bool,
    pub(super) kept: Option<ConfigChange>,
}
