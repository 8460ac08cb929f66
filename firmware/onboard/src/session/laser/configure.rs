//! Reading what the laser is and how it is set, and setting its field of view.

use biplane_wire::lms::{Reply, Request, StatusReport, Text};

use super::health::FaultList;
use super::machine::{Goal, Machine, State};
use super::write::Writing;
use crate::session::retry::Patience;
use crate::session::{Event, Step, printable};

/// Most answers take 80 to 110 ms and their transfer.
const READ: Patience = Patience::new(250, 3).acknowledged(600);
const VARIANT: Patience = Patience::new(300, 3).acknowledged(3000);
/// Bytes of a status report, the longest of these answers.
const REPLY_BYTES: usize = 160;

impl Machine {
    /// Keeps what replies tell of the laser, whoever asked for them.
    pub(super) fn learn(&mut self, reply: &Reply<'_>) {
        match reply {
            Reply::Type { text } => self.learn_type(*text),
            Reply::Config(config) | Reply::ConfigWritten { config, .. } => {
                self.info.config = Some(config.clone());
                self.plausibility.restart(self.info.config.as_ref());
            }
            Reply::Variant { angle_deg, resolution_cdeg, .. } => {
                self.info.variant = Some((*angle_deg, *resolution_cdeg));
                self.plausibility.restart(self.info.config.as_ref());
            }
            Reply::Mode(_) => self.plausibility.restart(self.info.config.as_ref()),
            Reply::Status(status) => self.learn_status(status),
            Reply::Errors(list) => self.info.faults = Some(FaultList::of(list.faults())),
            _ => {}
        }
    }

    /// Another type is another device: what the one before refused says nothing of it.
    fn learn_type(&mut self, text: Text<'_>) {
        let kept = printable(text);
        if kept != self.info.type_text {
            self.info.type_text = kept.clone();
            self.writing = Writing::default();
            self.refused_remission = false;
            self.said.forget_device();
            self.say(Event::Identified(kept));
        }
    }

    fn learn_status(&mut self, status: &StatusReport<'_>) {
        self.info.firmware = printable(status.version());
        self.info.has_fault = Some(status.has_fault());
        self.info.variant = Some((status.angle_deg(), status.resolution_cdeg()));
        self.info.status_data = status.data().first_chunk().copied();
    }

    /// A question that is answered by one of these reports.
    pub(super) fn read(&mut self, state: State, step: Step, request: Request) {
        let patience = READ.longer_by(self.transfer_ns(REPLY_BYTES));
        self.ask(state, step, request, patience);
    }

    /// What was read of the device before may be that of another one: until it is read anew, nothing is known, and no scan is decoded.
    pub(super) fn enter_read_configuration(&mut self) {
        self.info.config = None;
        self.info.status_data = None;
        self.has_streamed = false;
        self.read(State::ReadConfiguration, Step::ReadConfiguration, Request::ReadConfig);
    }

    pub(super) fn read_configuration_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Config(_)) {
            self.enter_read_status();
        }
    }

    pub(super) fn enter_read_status(&mut self) {
        self.info.variant = None;
        self.read(State::ReadStatus, Step::ReadStatus, Request::Status);
    }

    pub(super) fn read_status_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Status(_)) {
            self.enter_read_faults();
        }
    }

    pub(super) fn enter_read_faults(&mut self) {
        self.info.faults = None;
        self.read(State::ReadFaults, Step::ReadFaults, Request::Errors);
    }

    pub(super) fn read_faults_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Errors(_)) {
            self.compare_configuration();
        }
    }

    /// Says faults where there are some, and again only when they have changed.
    pub(super) fn say_faults(&mut self) {
        let faults = self.info.faults.unwrap_or_default();
        if faults.count > 0 && faults != self.said.faults {
            self.say(Event::Faults(faults));
        }
        self.said.faults = faults;
        self.health.faults = faults;
        // Where the list says which, that says more.
        let has_fault = self.info.has_fault == Some(true) && faults.count == 0;
        if has_fault && !self.said.has_fault {
            self.say(Event::HasFault);
        }
        self.said.has_fault = has_fault;
    }

    /// All is read: a probe ends here. Otherwise the configuration is written when it differs, then the variant set.
    pub(super) fn compare_configuration(&mut self) {
        self.say_faults();
        if self.info.is_s14(&self.settings) {
            // Whatever its status report says: it has but one.
            self.info.variant = Some((90, 50));
        }
        if self.goal == Goal::Probe {
            self.question = None;
            self.state = State::Done;
            return;
        }
        self.enter_write();
    }

    /// An S14 has but one variant, and no command for it.
    pub(super) fn compare_variant(&mut self) {
        if self.stop_until_ns.is_some() {
            return self.enter_stopping();
        }
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        let has_choice = !self.info.is_s14(&self.settings) && wanted.0 != 90;
        if self.info.variant == Some(wanted) {
            self.said.variant = None;
            self.enter_start_stream();
        } else if has_choice {
            let request = Request::Variant { angle_deg: wanted.0, resolution_cdeg: wanted.1 };
            self.ask(State::SetVariant, Step::SetVariant, request, VARIANT);
        } else {
            self.keep_variant();
        }
    }

    pub(super) fn set_variant_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Variant { accepted, angle_deg, resolution_cdeg } = reply else { return };
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        if *accepted && (*angle_deg, *resolution_cdeg) == wanted {
            self.said.variant = None;
            self.enter_start_stream();
        } else {
            self.refused();
        }
    }

    pub(super) fn keep_variant(&mut self) {
        if let Some((fov_deg, resolution_cdeg)) = self.info.variant
            && self.said.variant != self.info.variant
        {
            self.said.variant = self.info.variant;
            self.say(Event::VariantKept { fov_deg, resolution_cdeg });
        }
        self.enter_start_stream();
    }
}
