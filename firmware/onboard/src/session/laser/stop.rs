//! The end of a session: the device is left idle, or it is said that nobody knows.
//!
//! A device that is being written to is left alone until that is over. One whose rate is not known yet may be streaming at any of them:
//! the search, which asks each rate to stop, goes on for a while.

use biplane_wire::lms::{Mode, Reply, Request};

use super::machine::{Machine, State};
use crate::session::retry::Patience;
use crate::session::{Event, Step};

/// A mode change takes up to 3 s; most take 80 ms.
const STOP: Patience = Patience::new(250, 4).acknowledged(3200);
/// A search goes on for so long, nanoseconds: more than a round over all rates (1.2 s), less than `record` waits for its devices (3 s).
const SEARCH_NS: i64 = 2_000_000_000;

impl Machine {
    pub(super) fn stop(&mut self) {
        if self.stop_until_ns.is_some() {
            return;
        }
        match self.state {
            State::Stopping | State::Done => {}
            State::Listening => self.finish_stop(),
            State::FindRate { .. } => self.stop_until_ns = Some(self.now_ns.saturating_add(SEARCH_NS)),
            _ if self.is_writing() => self.stop_until_ns = Some(i64::MAX),
            _ => self.enter_stopping(),
        }
    }

    /// Whether the device may be at work on its EEPROM, or what it did there is not read back yet.
    pub(super) fn is_writing(&self) -> bool {
        matches!(self.state, State::WriteConfiguration | State::LeaveInstallation | State::ReadBack)
    }

    pub(super) fn enter_stopping(&mut self) {
        self.ask(State::Stopping, Step::StopStream, Request::Mode(Mode::OnRequest), STOP);
    }

    pub(super) fn stopping_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            self.say(Event::Idle { baud: self.baud });
            self.finish_stop();
        }
    }

    /// A search has found nobody until the run must end.
    pub(super) fn end_search_for_stop(&mut self) {
        let is_over = self.stop_until_ns.is_some_and(|until_ns| until_ns <= self.now_ns);
        if is_over && matches!(self.state, State::FindRate { .. }) {
            self.say(Event::StopUnanswered);
            self.finish_stop();
        }
    }

    pub(super) fn finish_stop(&mut self) {
        self.question = None;
        self.state = State::Done;
    }
}
