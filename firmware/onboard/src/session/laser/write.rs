//! Writing the configuration: only what the rig asks for and the device has otherwise, once, and read back.
//!
//! Each write wears the device's EEPROM. So a device that did not take one is not offered another, and a write that was acknowledged is
//! waited for, not repeated; one that was not even acknowledged has not arrived, and is sent once more.

use biplane_wire::lms::{Mode, ModeResult, PASSWORD, Reply, Request};

use super::machine::{Machine, State};
use super::wanted::ConfigChange;
use crate::session::retry::Patience;
use crate::session::{Event, Step};

/// A mode change takes up to 3 s; most take 80 ms.
const MODE: Patience = Patience::new(250, 4).acknowledged(3200);
/// Writing the EEPROM takes 0.4 s, by the manual up to 15 s. Without an acknowledge within the first second the request was not heard.
const WRITE: Patience = Patience::new(1000, 2).acknowledged(15_000);
/// A device that loses what was written to it is not written to more often than this in a run.
const WRITES: u8 = 3;

impl Machine {
    fn change(&self) -> ConfigChange {
        self.info.differs(&self.settings).unwrap_or_default()
    }

    pub(super) fn enter_write(&mut self) {
        let change = self.change();
        self.health.differs = !change.is_empty();
        if change.is_empty() {
            self.compare_variant();
        } else if self.refused_write || self.health.writes >= WRITES {
            self.keep_configuration(change);
        } else {
            let request = Request::Mode(Mode::Install { password: PASSWORD });
            self.ask(State::EnterInstallation, Step::EnterInstallation, request, MODE);
        }
    }

    pub(super) fn enter_installation_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result != ModeResult::Done {
            self.refused();
            return;
        }
        let Some(config) = self.info.config.clone() else {
            self.enter_leave_installation();
            return;
        };
        self.written = self.change();
        let request = Request::WriteConfig(self.written.applied_to(&config));
        self.health.writes = self.health.writes.saturating_add(1);
        self.ask(State::WriteConfiguration, Step::WriteConfiguration, request, WRITE);
    }

    /// Whatever it answers, it is read back.
    pub(super) fn write_configuration_answered(&mut self, reply: &Reply<'_>) {
        let Reply::ConfigWritten { accepted, .. } = reply else { return };
        if !accepted {
            self.say(Event::Refused { step: Step::WriteConfiguration });
        }
        self.enter_leave_installation();
    }

    /// An acknowledged write is not repeated, refused or not: the device may have taken it.
    pub(super) fn write_refused(&mut self) {
        self.say(Event::Refused { step: Step::WriteConfiguration });
        self.write_failed();
    }

    pub(super) fn write_failed(&mut self) {
        self.refused_write = true;
        self.enter_leave_installation();
    }

    fn enter_leave_installation(&mut self) {
        let request = Request::Mode(Mode::OnRequest);
        self.ask(State::LeaveInstallation, Step::LeaveInstallation, request, MODE);
    }

    pub(super) fn leave_installation_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            self.read(State::ReadBack, Step::ReadBack, Request::ReadConfig);
        }
    }

    /// What differs still was not taken.
    pub(super) fn read_back_answered(&mut self, reply: &Reply<'_>) {
        if !matches!(reply, Reply::Config(_)) {
            return;
        }
        let change = self.change();
        self.health.differs = !change.is_empty();
        if self.health.differs {
            self.refused_write = true;
            self.keep_configuration(change);
        } else {
            self.said.kept = None;
            self.say(Event::ConfigurationWritten(self.written));
            self.compare_variant();
        }
    }

    /// Nobody knows what it has taken: it is not written to again.
    pub(super) fn read_back_failed(&mut self) {
        self.refused_write = true;
        self.compare_variant();
    }

    /// Scans come as the device is set; which units those are stands in each.
    fn keep_configuration(&mut self, change: ConfigChange) {
        if self.said.kept.replace(change) != Some(change) {
            self.say(Event::ConfigurationKept(change));
        }
        self.compare_variant();
    }
}
