//! Writing the configuration: only what the rig asks for and the device has otherwise, and only said to be
//! written when the whole block reads back as it was sent.
//!
//! Each write wears the device's EEPROM, and puts back a block of which the rig knows a few bytes only. So a
//! block is written that was read twice alike (the checksum misses some errors), one telegram is sent and
//! waited for, and silence is answered by reading the block back, not by writing again: only of a device that
//! holds what it held before, and has not answered, is it known that the telegram did not arrive.

use biplane_wire::lms::{Config, Mode, ModeResult, PASSWORD, Request};

use crate::session::event::{Event, Step};
use crate::session::lms::device::Device;
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::lms::setup::configure::read;
use crate::session::lms::setup::difference::BlockDifference;
use crate::session::lms::setup::requested::ConfigChange;
use crate::session::timing::retry::Patience;

/// A mode change takes up to 3 s; most take 80 ms.
const MODE: Patience = Patience::new(250, 4).acknowledged(3200);
/// Writing the EEPROM takes 0.4 s; drivers in the field allow up to 15 s. An acknowledge says nothing, since
/// it may be lost.
const WRITE: Patience = Patience::new(15_000, 1);
/// A device is not written to more often than this in a run.
const WRITES: u8 = 2;
/// A block is read so often at most until two reads in a row are alike.
const READS: u8 = 4;

/// What is known of writing to the device.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Writing {
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

    /// Begins to write what differs, if anything does and the device may take it.
    pub(crate) fn enter(&mut self, talk: &mut Dialogue, device: &mut Device) -> Next {
        self.read = device.info.config.clone();
        self.reads = 1;
        self.before = None;
        self.sent = None;
        if device.change().is_empty() || self.is_refused || self.count >= WRITES {
            keep_configuration(talk, device)
        } else {
            read_again(talk)
        }
    }

    /// A read that was damaged must not come back as the device's configuration.
    pub(crate) fn read_again_answered(
        &mut self,
        talk: &mut Dialogue,
        device: &mut Device,
        config: &Config,
    ) -> Next {
        if self.reads_alike(config) {
            self.before = Some(config.clone());
            if device.change().is_empty() {
                keep_configuration(talk, device)
            } else {
                enter_installation(talk)
            }
        } else if self.reads < READS {
            read_again(talk)
        } else {
            talk.say(Event::GivenUp { step: Step::ReadConfiguration });
            keep_configuration(talk, device)
        }
    }

    pub(crate) fn installation_answered(
        &mut self,
        talk: &mut Dialogue,
        device: &mut Device,
        result: ModeResult,
    ) -> Next {
        if result != ModeResult::Done {
            return Next::Refused;
        }
        let Some(before) = &self.before else { return leave_installation(talk) };
        let change = ConfigChange::between(before, &device.settings, device.is_s14());
        let sent = change.applied_to(before);
        self.change = change;
        self.sent = Some(sent.clone());
        self.is_answered = false;
        self.read = None;
        self.reads = 0;
        self.count += 1;
        device.health.writes = device.health.writes.saturating_add(1);
        talk.ask(State::WriteConfiguration, Step::WriteConfiguration, Request::WriteConfig(sent), WRITE)
    }

    pub(crate) fn installation_failed(&mut self, talk: &mut Dialogue) -> Next {
        self.is_refused = true;
        leave_installation(talk)
    }

    /// Whatever it answers, it is read back.
    pub(crate) fn write_answered(&mut self, talk: &mut Dialogue, accepted: bool) -> Next {
        if !accepted {
            return self.write_refused(talk);
        }
        self.is_answered = true;
        leave_installation(talk)
    }

    pub(crate) fn write_refused(&mut self, talk: &mut Dialogue) -> Next {
        talk.say(Event::Refused { step: Step::WriteConfiguration });
        self.is_answered = true;
        leave_installation(talk)
    }

    /// A block that is not as it was sent may be one that was damaged on its way: that takes two reads alike.
    pub(crate) fn read_back_answered(
        &mut self,
        talk: &mut Dialogue,
        device: &mut Device,
        held: &Config,
        is_stopping: bool,
    ) -> Next {
        if self.sent.as_ref() == Some(held) {
            talk.say(Event::ConfigurationWritten(self.change));
            keep_configuration(talk, device)
        } else if self.reads_alike(held) {
            self.not_as_sent(talk, device, held, is_stopping)
        } else if self.reads < READS {
            read_back(talk)
        } else {
            talk.say(Event::GivenUp { step: Step::ReadBack });
            self.read_back_failed(is_stopping)
        }
    }

    fn not_as_sent(
        &mut self,
        talk: &mut Dialogue,
        device: &mut Device,
        held: &Config,
        is_stopping: bool,
    ) -> Next {
        let is_as_before = self.before.as_ref() == Some(held);
        if let Some(sent) = &self.sent {
            if is_as_before && !self.is_answered && self.count < WRITES && !is_stopping {
                return enter_installation(talk);
            }
            if !is_as_before {
                let difference = BlockDifference::between(held, sent);
                talk.say(Event::ConfigurationNotAsSent(difference));
            }
        }
        self.is_refused = true;
        keep_configuration(talk, device)
    }

    /// Nobody knows what it has taken: it is not written to again, and what it is set to is read anew.
    pub(crate) fn read_back_failed(&mut self, is_stopping: bool) -> Next {
        self.is_refused = true;
        if is_stopping { Next::Stop } else { Next::ReadConfiguration }
    }
}

fn read_again(talk: &mut Dialogue) -> Next {
    read(talk, State::ReadAgain, Step::ReadConfiguration, Request::ReadConfig)
}

fn enter_installation(talk: &mut Dialogue) -> Next {
    let request = Request::Mode(Mode::Install { password: PASSWORD });
    talk.ask(State::EnterInstallation, Step::EnterInstallation, request, MODE)
}

/// Leaves the installation mode, in which the device does not measure.
pub(crate) fn leave_installation(talk: &mut Dialogue) -> Next {
    let request = Request::Mode(Mode::OnRequest);
    talk.ask(State::LeaveInstallation, Step::LeaveInstallation, request, MODE)
}

/// Reads what the device holds behind a write.
pub(crate) fn read_back(talk: &mut Dialogue) -> Next {
    read(talk, State::ReadBack, Step::ReadBack, Request::ReadConfig)
}

/// Goes on with the configuration as it is. Scans come as the device is set; which units those are stands in
/// each.
pub(crate) fn keep_configuration(talk: &mut Dialogue, device: &mut Device) -> Next {
    let change = device.change();
    device.health.differs = !change.is_empty();
    if change.is_empty() {
        talk.event_dedup.kept = None;
    } else if talk.event_dedup.kept.replace(change) != Some(change) {
        talk.say(Event::ConfigurationKept(change));
    }
    Next::SetVariant
}
