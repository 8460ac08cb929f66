//! Writing the configuration: only what the rig asks for and the device has otherwise, and only said to be written when the whole block
//! reads back as it was sent.
//!
//! Each write wears the device's EEPROM, and puts back a block of which the rig knows a few bytes only. So a block is written that was
//! read twice alike (the checksum misses some errors), one telegram is sent and waited for, and silence is answered by reading the block
//! back, not by writing again: only of a device that holds what it held before, and has not answered, is it known that the telegram did
//! not arrive.

use biplane_wire::lms::{Config, Mode, ModeResult, PASSWORD, Reply, Request};

use super::difference::BlockDifference;
use super::machine::{Machine, State};
use super::wanted::ConfigChange;
use crate::session::retry::Patience;
use crate::session::{Event, Step};

/// A mode change takes up to 3 s; most take 80 ms.
const MODE: Patience = Patience::new(250, 4).acknowledged(3200);
/// Writing the EEPROM takes 0.4 s; drivers in the field allow up to 15 s. An acknowledge says nothing, since it may be lost.
const WRITE: Patience = Patience::new(15_000, 1);
/// A device is not written to more often than this in a run.
const WRITES: u8 = 2;
/// A block is read so often at most until two reads in a row are alike.
const READS: u8 = 4;

/// What is known of writing to the device.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Writing {
    /// The block as it was read last.
    read: Option<Config>,
    /// How often it was read to make sure of it.
    reads: u8,
    /// The block before the write, read twice alike.
    before: Option<Config>,
    /// The block that was sent.
    sent: Option<Config>,
    /// What it was sent for.
    change: ConfigChange,
    /// The device has answered the write, in whatever way.
    is_answered: bool,
    /// Writes sent to this device.
    count: u8,
    /// The device did not take a configuration: it is not offered one again.
    is_refused: bool,
}

impl Writing {
    /// Takes a read of the block; says whether it is like the one before.
    fn reads_alike(&mut self, config: &Config) -> bool {
        self.reads = self.reads.saturating_add(1);
        self.read.replace(config.clone()).as_ref() == Some(config)
    }
}

impl Machine {
    fn change(&self) -> ConfigChange {
        self.info.differs(&self.settings).unwrap_or_default()
    }

    pub(super) fn enter_write(&mut self) {
        self.writing = Writing {
            read: self.info.config.clone(),
            reads: 1,
            before: None,
            sent: None,
            ..std::mem::take(&mut self.writing)
        };
        if self.change().is_empty() || self.writing.is_refused || self.writing.count >= WRITES {
            self.keep_configuration();
        } else {
            self.read_again();
        }
    }

    fn read_again(&mut self) {
        self.read(State::ReadAgain, Step::ReadConfiguration, Request::ReadConfig);
    }

    /// A read that was damaged must not come back as the device's configuration.
    pub(super) fn read_again_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Config(config) = reply else { return };
        if self.writing.reads_alike(config) {
            self.writing.before = Some(config.clone());
            if self.change().is_empty() {
                self.keep_configuration();
            } else {
                self.enter_installation();
            }
        } else if self.writing.reads < READS {
            self.read_again();
        } else {
            self.say(Event::GivenUp { step: Step::ReadConfiguration });
            self.keep_configuration();
        }
    }

    fn enter_installation(&mut self) {
        let request = Request::Mode(Mode::Install { password: PASSWORD });
        self.ask(State::EnterInstallation, Step::EnterInstallation, request, MODE);
    }

    pub(super) fn enter_installation_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result != ModeResult::Done {
            self.refused();
            return;
        }
        let Some(before) = &self.writing.before else { return self.enter_leave_installation() };
        let change = ConfigChange::between(before, &self.settings, self.info.is_s14(&self.settings));
        let sent = change.applied_to(before);
        self.writing.change = change;
        self.writing.sent = Some(sent.clone());
        self.writing.is_answered = false;
        self.writing.read = None;
        self.writing.reads = 0;
        self.writing.count += 1;
        self.health.writes = self.health.writes.saturating_add(1);
        self.ask(State::WriteConfiguration, Step::WriteConfiguration, Request::WriteConfig(sent), WRITE);
    }

    pub(super) fn installation_failed(&mut self) {
        self.writing.is_refused = true;
        self.enter_leave_installation();
    }

    /// Whatever it answers, it is read back.
    pub(super) fn write_configuration_answered(&mut self, reply: &Reply<'_>) {
        let Reply::ConfigWritten { accepted, .. } = reply else { return };
        if *accepted {
            self.writing.is_answered = true;
            self.enter_leave_installation();
        } else {
            self.write_refused();
        }
    }

    pub(super) fn write_refused(&mut self) {
        self.say(Event::Refused { step: Step::WriteConfiguration });
        self.writing.is_answered = true;
        self.enter_leave_installation();
    }

    pub(super) fn enter_leave_installation(&mut self) {
        let request = Request::Mode(Mode::OnRequest);
        self.ask(State::LeaveInstallation, Step::LeaveInstallation, request, MODE);
    }

    pub(super) fn leave_installation_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            self.read_back();
        }
    }

    fn read_back(&mut self) {
        self.read(State::ReadBack, Step::ReadBack, Request::ReadConfig);
    }

    /// A block that is not as it was sent may be one that was damaged on its way: that takes two reads alike.
    pub(super) fn read_back_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Config(held) = reply else { return };
        if self.writing.sent.as_ref() == Some(held) {
            self.say(Event::ConfigurationWritten(self.writing.change));
            self.keep_configuration();
        } else if self.writing.reads_alike(held) {
            self.not_as_sent(held);
        } else if self.writing.reads < READS {
            self.read_back();
        } else {
            self.say(Event::GivenUp { step: Step::ReadBack });
            self.read_back_failed();
        }
    }

    fn not_as_sent(&mut self, held: &Config) {
        let is_as_before = self.writing.before.as_ref() == Some(held);
        let is_stopping = self.stop_until_ns.is_some();
        if let Some(sent) = &self.writing.sent {
            if is_as_before && !self.writing.is_answered && self.writing.count < WRITES && !is_stopping {
                return self.enter_installation();
            }
            if !is_as_before {
                let difference = BlockDifference::between(held, sent);
                self.say(Event::ConfigurationNotAsSent(difference));
            }
        }
        self.writing.is_refused = true;
        self.keep_configuration();
    }

    /// Nobody knows what it has taken: it is not written to again, and what it is set to is read anew.
    pub(super) fn read_back_failed(&mut self) {
        self.writing.is_refused = true;
        if self.stop_until_ns.is_some() {
            self.enter_stopping();
        } else {
            self.enter_read_configuration();
        }
    }

    /// Goes on with the configuration as it is. Scans come as the device is set; which units those are stands in each.
    pub(super) fn keep_configuration(&mut self) {
        let change = self.change();
        self.health.differs = !change.is_empty();
        if change.is_empty() {
            self.said.kept = None;
        } else if self.said.kept.replace(change) != Some(change) {
            self.say(Event::ConfigurationKept(change));
        }
        self.compare_variant();
    }
}
