//! Reading what the laser is set to, and changing only what differs: each written configuration wears its EEPROM.

use biplane_wire::lms::{Mode, ModeResult, PASSWORD, Reply, Request, StatusReport, Text};

use super::machine::{Goal, Machine, State};
use crate::session::retry::Patience;
use crate::session::{Event, Step, printable};

const READ: Patience = Patience::new(600, 3);
/// A mode change takes up to 3 s; most take 80 ms.
const MODE: Patience = Patience::new(600, 6);
/// Writing the EEPROM takes 0.4 s, by the manual up to 15 s; asked twice at most, it must not wear out.
const WRITE: Patience = Patience::new(15_000, 2);
const VARIANT: Patience = Patience::new(600, 3);

impl Machine {
    pub(super) fn learn_type(&mut self, text: Text<'_>) {
        let kept = printable(text);
        if kept != self.info.type_text {
            self.info.type_text = kept.clone();
            self.say(Event::Identified(kept));
        }
    }

    pub(super) fn learn_status(&mut self, status: &StatusReport<'_>) {
        self.info.firmware = printable(status.version());
        self.info.has_fault = Some(status.has_fault());
        self.info.variant = Some((status.angle_deg(), status.resolution_cdeg()));
    }

    pub(super) fn enter_read_configuration(&mut self) {
        self.info.config = None;
        self.ask(State::ReadConfiguration, Step::ReadConfiguration, Request::ReadConfig, READ);
    }

    pub(super) fn read_configuration_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Config(_)) {
            self.enter_read_status();
        }
    }

    pub(super) fn configuration_unknown(&mut self) {
        self.enter_read_status();
    }

    fn enter_read_status(&mut self) {
        self.info.variant = None;
        self.ask(State::ReadStatus, Step::ReadStatus, Request::Status, READ);
    }

    pub(super) fn read_status_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Status(_)) {
            self.compare_units();
        }
    }

    /// Without a status the variant is set in any case: that costs no EEPROM.
    pub(super) fn status_unknown(&mut self) {
        self.compare_units();
    }

    fn compare_units(&mut self) {
        if self.goal == Goal::Probe {
            self.question = None;
            self.state = State::Done;
            return;
        }
        match &self.info.config {
            Some(config) if config.unit().is_some_and(|unit| unit != self.settings.unit) => {
                let request = Request::Mode(Mode::Install { password: PASSWORD });
                self.ask(State::EnterInstallation, Step::EnterInstallation, request, MODE);
            }
            _ => self.compare_variant(),
        }
    }

    pub(super) fn enter_installation_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result != ModeResult::Done {
            self.refused();
            return;
        }
        let Some(mut config) = self.info.config.clone() else {
            self.enter_leave_installation();
            return;
        };
        config.set_unit(self.settings.unit);
        let request = Request::WriteConfig(config);
        self.ask(State::WriteConfiguration, Step::WriteConfiguration, request, WRITE);
    }

    pub(super) fn write_configuration_answered(&mut self, reply: &Reply<'_>) {
        let Reply::ConfigWritten { accepted, config } = reply else { return };
        if *accepted && config.unit() == Some(self.settings.unit) {
            self.say(Event::UnitsWritten);
            self.enter_leave_installation();
        } else {
            self.say(Event::Refused { step: Step::WriteConfiguration });
            self.keep_units();
        }
    }

    pub(super) fn keep_units(&mut self) {
        self.say(Event::UnitsKept);
        self.enter_leave_installation();
    }

    fn enter_leave_installation(&mut self) {
        let request = Request::Mode(Mode::OnRequest);
        self.ask(State::LeaveInstallation, Step::LeaveInstallation, request, MODE);
    }

    pub(super) fn leave_installation_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            self.compare_variant();
        }
    }

    fn compare_variant(&mut self) {
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        if self.info.variant == Some(wanted) {
            self.enter_start_stream();
            return;
        }
        let request = Request::Variant { angle_deg: wanted.0, resolution_cdeg: wanted.1 };
        self.ask(State::SetVariant, Step::SetVariant, request, VARIANT);
    }

    pub(super) fn set_variant_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Variant { accepted, angle_deg, resolution_cdeg } = reply else { return };
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        if *accepted && (*angle_deg, *resolution_cdeg) == wanted {
            self.enter_start_stream();
        } else {
            self.refused();
        }
    }

    pub(super) fn keep_variant(&mut self) {
        if let Some((fov_deg, resolution_cdeg)) = self.info.variant {
            self.say(Event::VariantKept { fov_deg, resolution_cdeg });
        }
        self.enter_start_stream();
    }
}
