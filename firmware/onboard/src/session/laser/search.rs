//! Finding the rate at which the laser answers, and changing to the configured one.
//!
//! At each candidate rate a stop request is sent: it is answered also by a device that was left streaming. Then a second, different
//! question confirms the rate, because an answer may be a late one from the rate tried before.
//!
//! A laser that streamed before and was lost is most likely where it was: an adapter was unplugged, a cable was loose. Its rate is
//! asked before each other one, and with the patience that found it, so that it is back within two seconds.

use biplane_wire::lms::{Baud, Mode, ModeResult, Reply, Request};

use super::machine::{Goal, Machine, State};
use crate::session::retry::Patience;
use crate::session::{Event, Output, Step};

/// After the configured rate these are tried in turn; 9600 is what a device has at power-on.
const OTHER_RATES: [u32; 4] = [9600, 38400, 19200, 500_000];
/// A device that is heard at a rate but has not answered is asked so often in all.
const ATTEMPTS_WHEN_HEARD: u8 = 6;
const FIND: [Patience; 3] = [Patience::new(250, 2), Patience::new(500, 2), Patience::new(1000, 2)];
/// A device that has answered once is there, even if it is still busy with the change of mode.
const CONFIRM: Patience = Patience::new(300, 11);
/// A mode change may take 3 s.
const SWITCH: Patience = Patience::new(500, 7);
/// The device needs a moment between its answer at the old rate and the new rate (20 ms seen; drivers wait 250 to 1000).
const SETTLE_NS: i64 = 100_000_000;

/// Each so-many-th round of a search for a lost laser is more patient than the one that found it.
const PATIENT_ROUND: u32 = 4;

/// The so-many-th rate to try, the likely one first; of a laser that was lost (`again`) it is asked before each other one.
fn candidate_rate(likely: u32, candidate: usize, again: bool) -> Option<u32> {
    let mut others = OTHER_RATES.into_iter().filter(|&rate| rate != likely);
    match (candidate, again) {
        (0, _) => Some(likely),
        (_, false) => others.nth(candidate - 1),
        (_, true) => {
            let other = others.nth(candidate / 2)?;
            Some(if candidate.is_multiple_of(2) { likely } else { other })
        }
    }
}

impl Machine {
    /// Tries a candidate rate.
    pub(super) fn enter_search(&mut self, candidate: usize, rounds: u32) {
        let Some(baud) = candidate_rate(self.likely_baud, candidate, self.found_in_round.is_some()) else {
            // Once is enough: who waits for hours need not read it every few seconds.
            if rounds == 0 {
                self.say(Event::NotFound { rounds: 1 });
            }
            self.enter_search(0, rounds + 1);
            return;
        };
        self.set_baud(baud);
        let state = State::FindRate { candidate, rounds };
        self.ask(state, Step::FindRate, Request::Mode(Mode::OnRequest), self.patience(rounds));
    }

    fn patience(&self, rounds: u32) -> Patience {
        let index = match self.found_in_round {
            None => rounds,
            Some(found) => found + u32::from(rounds % PATIENT_ROUND == PATIENT_ROUND - 1),
        };
        FIND[(index as usize).min(FIND.len() - 1)]
    }

    pub(super) fn next_candidate(&mut self, candidate: usize, rounds: u32) {
        self.enter_search(candidate + 1, rounds);
    }

    fn set_baud(&mut self, baud: u32) {
        self.baud = baud;
        self.outputs.push(Output::SetBaud(baud));
    }

    /// A telegram at this rate that is no answer: the device is there, so it is asked a few times more.
    pub(super) fn heard_while_searching(&mut self) {
        if let Some((question, _, Step::FindRate | Step::ConfirmRate)) = &mut self.question {
            question.encourage(ATTEMPTS_WHEN_HEARD);
        }
    }

    pub(super) fn find_rate_answered(&mut self, candidate: usize, rounds: u32, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            let state = State::ConfirmRate { candidate, rounds };
            self.ask(state, Step::ConfirmRate, Request::Type, CONFIRM);
        }
    }

    pub(super) fn confirm_rate_answered(&mut self, reply: &Reply<'_>) {
        if !matches!(reply, Reply::Type { .. }) {
            return;
        }
        if let (None, State::ConfirmRate { rounds, .. }) = (self.found_in_round, self.state) {
            self.found_in_round = Some(rounds);
        }
        self.info.found_baud = Some(self.baud);
        self.say(Event::Found { baud: self.baud });
        if self.baud == self.settings.baud || self.goal == Goal::Probe || self.refused_rate {
            self.enter_read_configuration();
        } else {
            self.enter_switch_rate();
        }
    }

    fn enter_switch_rate(&mut self) {
        let Some(rate) = Baud::from_bits_per_second(self.settings.baud) else {
            self.keep_rate();
            return;
        };
        self.ask(State::SwitchRate, Step::SwitchRate, Request::Mode(Mode::Baud(rate)), SWITCH);
    }

    /// The answer still comes at the old rate.
    pub(super) fn switch_rate_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result != ModeResult::Done {
            self.refused();
            return;
        }
        self.question = None;
        self.set_baud(self.settings.baud);
        self.state = State::Settle { until_ns: self.now_ns + SETTLE_NS };
    }

    pub(super) fn settled(&mut self) {
        self.ask(State::ConfirmSwitch, Step::ConfirmRate, Request::Type, CONFIRM);
    }

    pub(super) fn confirm_switch_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Type { .. }) {
            self.say(Event::RateSet { baud: self.baud });
            self.enter_read_configuration();
        }
    }

    /// The device does not change its rate: better slow than not at all.
    pub(super) fn keep_rate(&mut self) {
        self.refused_rate = true;
        self.say(Event::RateKept { wanted: self.settings.baud, kept: self.baud });
        self.enter_read_configuration();
    }
}
