//! The end of a session: the device is left idle, or it is said that nobody knows.
//!
//! A device that is being written to is left alone until that is over. One whose rate is not known yet may be
//! streaming at any of them: the search, which asks each rate to stop, goes on for a while.

use biplane_wire::lms::{Mode, Reply, Request};

use crate::session::event::{Event, Step};
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::timing::retry::Patience;

/// A mode change takes up to 3 s; most take 80 ms.
const STOP: Patience = Patience::new(250, 4).acknowledged(3200);
/// A search goes on for so long, nanoseconds: more than a round over all rates (1.2 s), less than `record`
/// waits for its devices (3 s).
const SEARCH_NS: i64 = 2_000_000_000;

/// Whether the session shall end.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Stop {
    /// It shall stop as soon as what it does now is done, and of a search not later than this.
    until_ns: Option<i64>,
}

impl Stop {
    /// Whether it shall.
    pub(crate) fn is_asked(self) -> bool {
        self.until_ns.is_some()
    }

    /// Until when a search goes on.
    pub(crate) fn deadline_ns(self) -> i64 {
        self.until_ns.unwrap_or(i64::MAX)
    }

    /// The session shall end.
    pub(crate) fn ask(&mut self, talk: &Dialogue) -> Next {
        if self.is_asked() {
            return Next::Stay;
        }
        match talk.state {
            State::Stopping | State::Done => Next::Stay,
            State::Listening => Next::Done,
            State::FindRate { .. } => {
                self.until_ns = Some(talk.now_ns.saturating_add(SEARCH_NS));
                Next::Stay
            }
            state if state.is_writing() => {
                self.until_ns = Some(i64::MAX);
                Next::Stay
            }
            _ => Next::Stop,
        }
    }

    /// A search has found nobody until the run must end.
    pub(crate) fn end_search(self, talk: &mut Dialogue) {
        let is_over = self.until_ns.is_some_and(|until_ns| until_ns <= talk.now_ns);
        if is_over && matches!(talk.state, State::FindRate { .. }) {
            talk.say(Event::StopUnanswered);
            talk.finish();
        }
    }
}

/// Asks the device to stop.
pub(crate) fn enter(talk: &mut Dialogue) -> Next {
    talk.ask(State::Stopping, Step::StopStream, Request::Mode(Mode::OnRequest), STOP)
}

/// Whatever mode it tells, it no longer streams.
pub(crate) fn answered(talk: &mut Dialogue, reply: &Reply<'_>) -> Next {
    if !matches!(reply, Reply::Mode(_)) {
        return Next::Stay;
    }
    talk.say(Event::Idle { baud: talk.baud });
    Next::Done
}
