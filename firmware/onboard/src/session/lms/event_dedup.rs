//! What a session has said already: a device that fails in the same way again and again is told of once,
//! until something changes.

use crate::session::event::Event;
use crate::session::event::Step;
use crate::session::lms::health::FaultList;
use crate::session::lms::scan::ranges::Unpublished;
use crate::session::lms::setup::requested::ConfigChange;

/// Steps that are remembered as given up: all that a laser's session gives up.
const STEPS: usize = 12;

/// What is said once.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct EventDedup {
    pub(crate) mode: bool,
    pub(crate) variant: Option<(u16, u16)>,
    pub(crate) faults: FaultList,
    pub(crate) has_fault: bool,
    pub(crate) unpublished: heapless::Vec<Unpublished, 8>,
    pub(crate) rejected: bool,
    pub(crate) not_found: bool,
    pub(crate) kept: Option<ConfigChange>,
    /// Steps that the device does not do, as was said when they were given up last.
    given_up: heapless::Vec<Step, STEPS>,
}

impl EventDedup {
    /// The device has done this step: its next failure is news.
    pub(crate) fn succeeded(&mut self, step: Step) {
        self.given_up.retain(|failed| *failed != step);
    }

    /// The device was away or is switched on anew: whatever it does not do is news.
    pub(crate) fn forget_failures(&mut self) {
        self.given_up.clear();
    }

    /// Another device: also how it is set is news.
    pub(crate) fn forget_device(&mut self) {
        self.forget_failures();
        self.kept = None;
        self.variant = None;
    }

    /// Whether this only repeats what was said. A device that does not start is looked for and asked for
    /// ever, so that also the way to that failure repeats.
    pub(crate) fn repeats(&mut self, event: &Event) -> bool {
        let never_starts = self.given_up.contains(&Step::StartStream);
        match event {
            Event::Found { .. } => never_starts,
            Event::Retried { step, .. } | Event::Refused { step } => {
                never_starts || self.given_up.contains(step)
            }
            Event::GivenUp { step } => {
                let is_known = self.given_up.contains(step);
                if !is_known {
                    let _ = self.given_up.push(*step);
                }
                is_known
            }
            _ => false,
        }
    }
}
