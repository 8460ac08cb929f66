//! What a session has said already: a device that fails in the same way again and again is told of once, until something changes.

use super::health::FaultList;
use super::machine::Machine;
use super::reading::Unpublished;
use super::wanted::ConfigChange;
use crate::session::{Event, Step};

/// Steps that are remembered as given up: all that a laser's session gives up.
const STEPS: usize = 12;

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
    /// Steps that the device does not do, as was said when they were given up last.
    given_up: heapless::Vec<Step, STEPS>,
}

impl Said {
    /// The device has done this step: its next failure is news.
    pub(super) fn succeeded(&mut self, step: Step) {
        self.given_up.retain(|failed| *failed != step);
    }

    /// The device was away or is switched on anew: whatever it does not do is news.
    pub(super) fn forget_failures(&mut self) {
        self.given_up.clear();
    }

    /// Another device: also how it is set is news.
    pub(super) fn forget_device(&mut self) {
        self.forget_failures();
        self.kept = None;
        self.variant = None;
    }

    /// Whether this only repeats what was said. A device that does not start is looked for and asked for ever, so that also the way
    /// to that failure repeats.
    fn repeats(&mut self, event: &Event) -> bool {
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

impl Machine {
    pub(super) fn say(&mut self, event: Event) {
        if !self.said.repeats(&event) {
            self.outputs.say(event);
        }
    }
}
