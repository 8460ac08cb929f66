//! Finding the rate at which the laser answers, and changing to the configured one.
//!
//! At each candidate rate a stop request is sent: it is answered also by a device that was left streaming.
//! Then a second, different question confirms the rate, because an answer may be a late one from the rate
//! tried before.
//!
//! What costs time is waiting for nothing. A device acknowledges within 60 ms, so that a rate without an
//! acknowledge is left soon, and one with it is given the 3 s that a change of mode may take. A device that
//! streams at another rate shows as noise that goes on after the stop request: asking again is of no use.
//! Once all rates were tried, and of a laser that was lost at once, every third poll is at the rate where it
//! likely is (its cable was loose), and every third at 9600 (it is switched on anew); a line that was silent
//! and turns noisy is a device that says so, and is asked there at once.

use biplane_wire::lms::{Baud, Mode, ModeResult, Request};

use crate::session::device_session::Output;
use crate::session::event::{Event, Step};
use crate::session::lms::device::{Device, Goal};
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::timing::retry::Patience;

/// Rates that a session may ask its port for: all of a laser's, and one of the rig's own.
const MAX_RATES: usize = 8;
/// The rate after power-on.
const POWER_ON_RATE: u32 = 9600;
/// All rates, the likelier first.
const RATES: [u32; 4] = [POWER_ON_RATE, 38400, 500_000, 19200];
/// Polls of the first round: every rate once.
const FIRST_ROUND: u32 = RATES.len() as u32;
/// Polls of a later round: each rate, the likely one and 9600 more often.
const LATER_ROUND: u32 = 6;
/// A device that is heard at a rate but has not answered is asked so often in all.
const ATTEMPTS_WHEN_ANSWERED: u8 = 6;
/// Without an acknowledge a rate is left, milliseconds: in the first round, and later, when adapters that
/// hold bytes back get more.
const FIND_MS: [i64; 2] = [150, 200];
/// Attempts at a rate, by the same.
const FIND_ATTEMPTS: [u8; 2] = [2, 1];
/// A device that has acknowledged a change of mode may take 3 s for it; most take 80 ms.
const MODE_MS: i64 = 3200;
const CONFIRM: Patience = Patience::new(250, 4).acknowledged(600);
const SWITCH: Patience = Patience::new(250, 4).acknowledged(MODE_MS);
/// The device needs a moment between its answer at the old rate and the new rate (20 ms seen; drivers wait
/// 250 to 1000).
const SETTLE_NS: i64 = 100_000_000;
/// A device that says it changes its rate, and is found at the old one so often, keeps it.
const FAILED_SWITCHES: u8 = 2;
/// So many bytes that belong to no telegram are more than a partial frame or a disturbance ...
const NOISE_BYTES: usize = 20;
/// ... when the last of them came so short a time ago, nanoseconds.
const NOISY_NS: i64 = 60_000_000;
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

/// What is known of the rate at which the laser is to be found.
#[derive(Clone, Debug)]
pub(crate) struct BaudSearch {
    /// Where the laser most likely is: the configured rate, then the one at which it was last heard for sure.
    likely_baud: u32,
    /// The round of a search.
    round: Option<u32>,
    /// Rates that the port does not have.
    port_lacks: heapless::Vec<u32, MAX_RATES>,
    /// When a line that was silent and now is noisy is listened to at the rate of power-on.
    wake_ns: Option<i64>,
    /// The device keeps a rate that is not the configured one.
    refused_rate: bool,
    failed_switches: u8,
}

impl BaudSearch {
    pub(crate) fn new(likely_baud: u32) -> Self {
        Self {
            likely_baud,
            round: None,
            port_lacks: heapless::Vec::new(),
            wake_ns: None,
            refused_rate: false,
            failed_switches: 0,
        }
    }

    /// The laser is surely at this rate.
    pub(crate) fn is_at(&mut self, baud: u32) {
        self.likely_baud = baud;
    }

    /// The laser may have been switched on anew: what it did not take before it may take now.
    pub(crate) fn forget_refusal(&mut self) {
        self.refused_rate = false;
    }

    /// The same of one that says so.
    pub(crate) fn powered_on(&mut self) {
        self.refused_rate = false;
        self.failed_switches = 0;
    }

    /// Looks for the device: all rates alike at first, and where it likely is when it was there before.
    pub(crate) fn restart(&mut self, talk: &mut Dialogue, device: &Device, is_stopping: bool) -> Next {
        if is_stopping && !talk.state.is_searching() {
            return Next::Stop;
        }
        talk.event_dedup.not_found = false;
        self.round = None;
        Next::Search { poll: if device.info.found_baud.is_some() { FIRST_ROUND } else { 0 } }
    }

    /// Whether the port has a rate, as far as is known.
    fn port_has(&self, baud: u32) -> bool {
        !self.port_lacks.contains(&baud)
    }

    /// The port does not run at this rate: it is left out from now on.
    pub(crate) fn rate_refused(&mut self, talk: &mut Dialogue, baud: u32) -> Next {
        if !self.port_has(baud) || self.port_lacks.push(baud).is_err() {
            return Next::Stay;
        }
        talk.say(Event::RateRefused { baud });
        match talk.state {
            State::FindRate { poll } if baud == talk.baud => Next::Search { poll: poll + 1 },
            _ => Next::Stay,
        }
    }

    /// The port is there again, with an adapter that may have other rates.
    pub(crate) fn port_back(&mut self, talk: &mut Dialogue, configured_baud: u32) {
        self.port_lacks.clear();
        if talk.baud != configured_baud {
            // Whether it has this rate must be known before the laser is told to change to it.
            talk.outputs.push(Output::SetBaud(configured_baud));
        }
        talk.outputs.push(Output::SetBaud(talk.baud));
    }

    /// Tries the rate of a poll, or of the next one whose rate the port has.
    pub(crate) fn enter(&mut self, talk: &mut Dialogue, device: &Device, poll: u32) -> Next {
        let is_had = |&poll: &u32| self.port_has(candidate(self.likely_baud, poll).1);
        let poll = (poll..).take((FIRST_ROUND + LATER_ROUND) as usize).find(is_had).unwrap_or(poll);
        let (round, baud) = candidate(self.likely_baud, poll);
        if self.round.replace(round).is_some_and(|before| before != round) {
            // A device that was there before is not looked for in round 0.
            not_found(talk, device, round - u32::from(device.info.found_baud.is_some()));
        }
        self.wake_ns = None;
        talk.set_baud(baud);
        let later = usize::from(round > 0);
        let patience = Patience::new(FIND_MS[later], FIND_ATTEMPTS[later]).acknowledged(MODE_MS);
        talk.ask(State::FindRate { poll }, Step::FindRate, Request::Mode(Mode::OnRequest), patience)
    }

    /// Bytes have come after a silence that was listened to; while a device is looked for, that is one being
    /// switched on.
    pub(crate) fn received_after(&mut self, talk: &Dialogue, silence_ns: i64) {
        if matches!(talk.state, State::FindRate { .. })
            && talk.baud != POWER_ON_RATE
            && silence_ns >= SILENT_NS
        {
            self.wake_ns = Some(talk.now_ns.saturating_add(MESSAGE_NS));
        }
    }

    /// When the line is listened to at the rate of power-on.
    pub(crate) fn wake_ns(&self) -> i64 {
        self.wake_ns.unwrap_or(i64::MAX)
    }

    /// Leaves a rate at which noise shows that the device has another one.
    pub(crate) fn look_for_another_rate(&mut self, talk: &mut Dialogue, last_byte_ns: i64) -> Next {
        let State::FindRate { poll } = talk.state else { return Next::Stay };
        let Some(open) = &mut talk.open else { return Next::Stay };
        if self.wake_ns.is_some_and(|wake_ns| wake_ns <= talk.now_ns) {
            self.wake_ns = None;
            let at_power_on = |&poll: &u32| candidate(self.likely_baud, poll).1 == POWER_ON_RATE;
            if !open.question.is_acknowledged()
                && let Some(next) = (poll.max(FIRST_ROUND) + 1..).take(LATER_ROUND as usize).find(at_power_on)
            {
                return Next::Search { poll: next };
            }
        }
        // An acknowledge in the midst of noise is part of it.
        let is_noisy = talk.noise_bytes >= NOISE_BYTES && talk.now_ns - last_byte_ns <= NOISY_NS;
        let question = &mut open.question;
        if is_noisy && question.asked() > 0 && question.unacknowledged_deadline_ns() <= talk.now_ns {
            question.expire(talk.now_ns);
        }
        Next::Stay
    }

    /// The device has told its type, so that its rate is sure.
    pub(crate) fn confirmed(&mut self, talk: &mut Dialogue, device: &mut Device) -> Next {
        device.info.found_baud = Some(talk.baud);
        talk.event_dedup.not_found = false;
        talk.say(Event::Found { baud: talk.baud });
        if talk.baud == device.settings.baud || device.goal == Goal::Probe || self.refused_rate {
            Next::ReadConfiguration
        } else {
            self.switch_rate(talk, device.settings.baud)
        }
    }

    fn switch_rate(&mut self, talk: &mut Dialogue, configured_baud: u32) -> Next {
        let rate = Baud::from_bits_per_second(configured_baud);
        let is_possible = self.failed_switches < FAILED_SWITCHES && self.port_has(configured_baud);
        match rate.filter(|_| is_possible) {
            Some(rate) => {
                talk.ask(State::SwitchRate, Step::SwitchRate, Request::Mode(Mode::Baud(rate)), SWITCH)
            }
            None => self.keep_rate(talk, configured_baud),
        }
    }

    /// The device answers at the new rate.
    pub(crate) fn switched(&mut self, talk: &mut Dialogue) -> Next {
        self.failed_switches = 0;
        talk.say(Event::RateSet { baud: talk.baud });
        Next::ReadConfiguration
    }

    /// It said that it would change, and does not answer at the new rate: it may be at either.
    pub(crate) fn switch_failed(&mut self) -> Next {
        self.failed_switches = self.failed_switches.saturating_add(1);
        Next::SearchAgain
    }

    /// The device does not change its rate: better slow than not at all.
    pub(crate) fn keep_rate(&mut self, talk: &mut Dialogue, configured_baud: u32) -> Next {
        self.refused_rate = true;
        talk.say(Event::RateKept { wanted: configured_baud, kept: talk.baud });
        Next::ReadConfiguration
    }
}

/// So many rounds over all rates were in vain: said once until the device is back.
fn not_found(talk: &mut Dialogue, device: &Device, rounds: u32) {
    if !std::mem::replace(&mut talk.event_dedup.not_found, true) || device.goal == Goal::Probe {
        talk.say(Event::NotFound { rounds });
        talk.event_dedup.forget_failures();
    }
}

/// A telegram at this rate that is no answer: the device is there, so it is asked a few times more.
pub(crate) fn received_while_searching(talk: &mut Dialogue) {
    if let Some(open) = &mut talk.open
        && matches!(open.step, Step::FindRate | Step::ConfirmRate)
    {
        open.question.encourage(ATTEMPTS_WHEN_ANSWERED);
    }
}

/// A device has answered at this rate: a second question makes sure of it.
pub(crate) fn confirm(talk: &mut Dialogue, poll: u32) -> Next {
    let patience = CONFIRM.longer_by(talk.transfer_ns(TYPE_BYTES));
    talk.ask(State::ConfirmRate { poll }, Step::ConfirmRate, Request::Type, patience)
}

/// The answer to a change of rate still comes at the old rate.
pub(crate) fn switch_answered(talk: &mut Dialogue, result: ModeResult, configured_baud: u32) -> Next {
    if result != ModeResult::Done {
        return Next::Refused;
    }
    talk.open = None;
    talk.set_baud(configured_baud);
    talk.state = State::Settle { until_ns: talk.now_ns + SETTLE_NS };
    Next::Stay
}

/// The device has had its moment: a question makes sure that it has changed its rate.
pub(crate) fn settled(talk: &mut Dialogue) -> Next {
    let patience = CONFIRM.longer_by(talk.transfer_ns(TYPE_BYTES));
    talk.ask(State::ConfirmSwitch, Step::ConfirmRate, Request::Type, patience)
}

#[cfg(test)]
mod tests {
    use super::FIRST_ROUND;
    use super::LATER_ROUND;
    use super::candidate;

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
