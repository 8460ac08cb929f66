//! Finding the rate at which the laser answers, and changing to the configured one.
//!
//! At each candidate rate a stop request is sent: it is answered also by a device that was left streaming. Then a second, different
//! question confirms the rate, because an answer may be a late one from the rate tried before.
//!
//! What costs time is waiting for nothing. A device acknowledges within 60 ms, so that a rate without an acknowledge is left soon, and one
//! with it is given the 3 s that a change of mode may take. A device that streams at another rate shows as noise that goes on
//! after the stop request: asking again is of no use. Once all rates were tried, and of a laser that was lost at once, every third poll is
//! at the rate where it likely is (its cable was loose), and every third at 9600 (it is switched on anew); a line that was silent and
//! turns noisy is a device that says so, and is asked there at once.

use biplane_wire::lms::{Baud, Mode, ModeResult, Reply, Request};

use super::machine::{Goal, Machine, State};
use super::stream::SILENT_NS as STREAM_SILENT_NS;
use crate::session::retry::Patience;
use crate::session::{Event, Output, Step};

/// The rate after power-on.
const POWER_ON_RATE: u32 = 9600;
/// All rates, the likelier first.
const RATES: [u32; 4] = [POWER_ON_RATE, 38400, 500_000, 19200];
/// Polls of the first round: every rate once.
const FIRST_ROUND: u32 = RATES.len() as u32;
/// Polls of a later round: each rate, the likely one and 9600 more often.
const LATER_ROUND: u32 = 6;
/// A device that is heard at a rate but has not answered is asked so often in all.
const ATTEMPTS_WHEN_HEARD: u8 = 6;
/// Without an acknowledge a rate is left, milliseconds: in the first round, and later, when adapters that hold bytes back get more.
const FIND_MS: [i64; 2] = [150, 200];
/// Attempts at a rate, by the same.
const FIND_ATTEMPTS: [u8; 2] = [2, 1];
/// A device that has acknowledged a change of mode may take 3 s for it; most take 80 ms.
const MODE_MS: i64 = 3200;
const CONFIRM: Patience = Patience::new(250, 4).acknowledged(600);
const SWITCH: Patience = Patience::new(250, 4).acknowledged(MODE_MS);
/// The device needs a moment between its answer at the old rate and the new rate (20 ms seen; drivers wait 250 to 1000).
const SETTLE_NS: i64 = 100_000_000;
/// A device that says it changes its rate, and is found at the old one so often, keeps it.
const FAILED_SWITCHES: u8 = 2;
/// So many bytes that belong to no telegram are more than a stump or a disturbance ...
const NOISE_BYTES: usize = 20;
/// ... when the last of them came so short a time ago, nanoseconds.
const NOISY_NS: i64 = 60_000_000;
/// No line of a device that streams pauses for so long, nanoseconds.
pub(super) const PAUSE_NS: i64 = 250_000_000;
/// A line was silent when nothing came for so long, nanoseconds.
const SILENT_NS: i64 = 500_000_000;
/// The power-on message takes 30 ms at 9600; after so long the device listens, nanoseconds.
const MESSAGE_NS: i64 = 60_000_000;
/// Bytes of the longest type reply.
const TYPE_BYTES: usize = 64;

/// The round that a poll belongs to, and the rate that is tried.
fn candidate(likely: u32, poll: u32) -> (u32, u32) {
    let mut others = RATES.into_iter().filter(|&rate| rate != likely);
    if poll < FIRST_ROUND {
        return (0, std::iter::once(likely).chain(others).nth(poll as usize).unwrap_or(likely));
    }
    let (round, place) = ((poll - FIRST_ROUND) / LATER_ROUND, (poll - FIRST_ROUND) % LATER_ROUND);
    let mut rest = others.clone().filter(|&rate| rate != POWER_ON_RATE);
    let rate = match (place, likely == POWER_ON_RATE) {
        (0 | 2 | 4, true) => Some(likely),
        (_, true) => others.nth(place as usize / 2),
        (0 | 3, false) => Some(likely),
        (1 | 4, false) => Some(POWER_ON_RATE),
        (_, false) => rest.nth(place as usize / 3),
    };
    (round + 1, rate.unwrap_or(likely))
}

impl Machine {
    /// Looks for the device: all rates alike at first, and where it likely is when it was there before.
    pub(super) fn restart_search(&mut self) {
        let is_searching = matches!(self.state, State::FindRate { .. } | State::ConfirmRate { .. });
        if self.stop_until_ns.is_some() && !is_searching {
            return self.enter_stopping();
        }
        self.said.not_found = false;
        self.round = None;
        self.enter_search(if self.info.found_baud.is_some() { FIRST_ROUND } else { 0 });
    }

    /// Whether the port has a rate, as far as is known.
    fn port_has(&self, baud: u32) -> bool {
        !self.port_lacks.contains(&baud)
    }

    /// The port does not run at this rate: it is left out from now on.
    pub(super) fn rate_refused(&mut self, baud: u32) {
        if !self.port_has(baud) || self.port_lacks.push(baud).is_err() {
            return;
        }
        self.say(Event::RateRefused { baud });
        if let State::FindRate { poll } = self.state
            && baud == self.baud
        {
            self.enter_search(poll + 1);
        }
    }

    /// The port is there again, with an adapter that may have other rates. A laser that streamed is listened to first; one that was
    /// looked for is asked where it likely is.
    pub(super) fn port_back(&mut self) {
        self.heard_since_ns = self.now_ns;
        self.port_lacks.clear();
        if self.baud != self.settings.baud {
            // Whether it has this rate must be known before the laser is told to change to it.
            self.outputs.push(Output::SetBaud(self.settings.baud));
        }
        self.outputs.push(Output::SetBaud(self.baud));
        match self.state {
            State::FindRate { .. } | State::ConfirmRate { .. } => self.restart_search(),
            State::Streaming => {
                self.last_frame_ns = self.now_ns;
                self.last_sign_ns = self.now_ns;
                self.resumed_ns = self.now_ns;
            }
            _ => {}
        }
    }

    /// Tries the rate of a poll, or of the next one whose rate the port has.
    pub(super) fn enter_search(&mut self, poll: u32) {
        let is_had = |&poll: &u32| self.port_has(candidate(self.likely_baud, poll).1);
        let poll = (poll..).take((FIRST_ROUND + LATER_ROUND) as usize).find(is_had).unwrap_or(poll);
        let (round, baud) = candidate(self.likely_baud, poll);
        if self.round.replace(round).is_some_and(|before| before != round) {
            // A device that was there before is not looked for in round 0.
            self.not_found(round - u32::from(self.info.found_baud.is_some()));
        }
        self.wake_ns = None;
        self.set_baud(baud);
        let later = usize::from(round > 0);
        let patience = Patience::new(FIND_MS[later], FIND_ATTEMPTS[later]).acknowledged(MODE_MS);
        self.ask(State::FindRate { poll }, Step::FindRate, Request::Mode(Mode::OnRequest), patience);
    }

    /// So many rounds over all rates were in vain: said once until the device is back.
    fn not_found(&mut self, rounds: u32) {
        if !std::mem::replace(&mut self.said.not_found, true) || self.goal == Goal::Probe {
            self.say(Event::NotFound { rounds });
            self.said.forget_failures();
        }
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

    /// Bytes have come before which the line paused; while a device is looked for, that is one being switched on.
    pub(super) fn heard_after(&mut self, silence_ns: i64) {
        if silence_ns >= PAUSE_NS {
            self.resumed_ns = self.now_ns;
        }
        if self.state == State::Streaming && silence_ns >= STREAM_SILENT_NS {
            // A silence that was listened to would have ended the stream: the host stood still, and telegrams may be on their way.
            self.last_frame_ns = self.now_ns;
            self.last_sign_ns = self.now_ns;
        }
        // What was not listened to was not silent: a port that was gone and is back.
        let heard_ns = self.now_ns.saturating_sub(self.heard_since_ns);
        if matches!(self.state, State::FindRate { .. })
            && self.baud != POWER_ON_RATE
            && silence_ns.min(heard_ns) >= SILENT_NS
        {
            self.wake_ns = Some(self.now_ns.saturating_add(MESSAGE_NS));
        }
    }

    /// Leaves a rate at which noise shows that the device has another one.
    pub(super) fn look_for_another_rate(&mut self) {
        let State::FindRate { poll } = self.state else { return };
        let Some((question, ..)) = &mut self.question else { return };
        if self.wake_ns.is_some_and(|wake_ns| wake_ns <= self.now_ns) {
            self.wake_ns = None;
            let at_power_on = |&poll: &u32| candidate(self.likely_baud, poll).1 == POWER_ON_RATE;
            if !question.is_acknowledged()
                && let Some(next) = (poll.max(FIRST_ROUND) + 1..).take(LATER_ROUND as usize).find(at_power_on)
            {
                return self.enter_search(next);
            }
        }
        // An acknowledge in the midst of noise is part of it.
        let is_noisy = self.noise_bytes >= NOISE_BYTES && self.now_ns - self.last_byte_ns <= NOISY_NS;
        if is_noisy && question.asked() > 0 && question.unacknowledged_deadline_ns() <= self.now_ns {
            question.expire(self.now_ns);
        }
    }

    pub(super) fn find_rate_answered(&mut self, poll: u32, reply: &Reply<'_>) {
        if !matches!(reply, Reply::Mode(_)) {
        } else if self.stop_until_ns.is_some() {
            self.stopping_answered(reply);
        } else {
            let patience = CONFIRM.longer_by(self.transfer_ns(TYPE_BYTES));
            self.ask(State::ConfirmRate { poll }, Step::ConfirmRate, Request::Type, patience);
        }
    }

    pub(super) fn confirm_rate_answered(&mut self, reply: &Reply<'_>) {
        if !matches!(reply, Reply::Type { .. }) {
            return;
        }
        self.info.found_baud = Some(self.baud);
        self.said.not_found = false;
        self.say(Event::Found { baud: self.baud });
        if self.baud == self.settings.baud || self.goal == Goal::Probe || self.refused_rate {
            self.enter_read_configuration();
        } else {
            self.enter_switch_rate();
        }
    }

    fn enter_switch_rate(&mut self) {
        let rate = Baud::from_bits_per_second(self.settings.baud);
        let is_possible = self.failed_switches < FAILED_SWITCHES && self.port_has(self.settings.baud);
        match rate.filter(|_| is_possible) {
            Some(rate) => {
                self.ask(State::SwitchRate, Step::SwitchRate, Request::Mode(Mode::Baud(rate)), SWITCH);
            }
            None => self.keep_rate(),
        }
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
        let patience = CONFIRM.longer_by(self.transfer_ns(TYPE_BYTES));
        self.ask(State::ConfirmSwitch, Step::ConfirmRate, Request::Type, patience);
    }

    pub(super) fn confirm_switch_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Type { .. }) {
            self.failed_switches = 0;
            self.say(Event::RateSet { baud: self.baud });
            self.enter_read_configuration();
        }
    }

    /// It said that it would change, and does not answer at the new rate: it may be at either.
    pub(super) fn switch_failed(&mut self) {
        self.failed_switches = self.failed_switches.saturating_add(1);
        self.restart_search();
    }

    /// The device does not change its rate: better slow than not at all.
    pub(super) fn keep_rate(&mut self) {
        self.refused_rate = true;
        self.say(Event::RateKept { wanted: self.settings.baud, kept: self.baud });
        self.enter_read_configuration();
    }
}

#[cfg(test)]
mod tests {
    use super::{FIRST_ROUND, LATER_ROUND, candidate};

    #[test]
    fn after_every_rate_once_the_likely_one_and_that_of_power_on_come_again_soon() {
        let rates = |likely, from, count| -> Vec<u32> {
            (from..from + count).map(|poll| candidate(likely, poll).1).collect()
        };
        assert_eq!(rates(38400, 0, FIRST_ROUND), [38400, 9600, 500_000, 19200]);
        assert_eq!(rates(9600, 0, FIRST_ROUND), [9600, 38400, 500_000, 19200]);
        for round in 0..3 {
            let from = FIRST_ROUND + round * LATER_ROUND;
            assert_eq!(rates(38400, from, LATER_ROUND), [38400, 9600, 500_000, 38400, 9600, 19200]);
            assert_eq!(rates(9600, from, LATER_ROUND), [9600, 38400, 9600, 500_000, 9600, 19200]);
            assert_eq!(candidate(38400, from).0, round + 1);
        }
        let fast = rates(500_000, FIRST_ROUND, LATER_ROUND);
        assert_eq!(fast, [500_000, 9600, 38400, 500_000, 9600, 19200]);
    }
}
