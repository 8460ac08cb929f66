//! Asking a device a question: how long to wait for the answer, how often to ask again, when to give up.
//!
//! Times are nanoseconds. A question is asked when it is first polled, and again whenever its time is up or
//! the device has refused it, as often as its [`Patience`] allows.

/// How long and how often.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Patience {
    /// Wait for an answer, nanoseconds. Smaller: a slow device is asked twice and answers twice.
    pub timeout_ns: i64,
    /// The same once the device has acknowledged the question, nanoseconds, from when it was asked. Smaller:
    /// a device that works on it is asked again for nothing.
    pub acknowledged_ns: i64,
    /// Times the question is asked in all. Larger: more time is spent before something else is tried.
    pub attempts: u8,
}

impl Patience {
    /// So many attempts of so many milliseconds each.
    #[must_use]
    pub(crate) const fn new(timeout_ms: i64, attempts: u8) -> Self {
        let timeout_ns = timeout_ms * 1_000_000;
        Self { timeout_ns, acknowledged_ns: timeout_ns, attempts }
    }

    /// So many milliseconds for a question that the device has acknowledged.
    #[must_use]
    pub(crate) const fn acknowledged(self, timeout_ms: i64) -> Self {
        Self { acknowledged_ns: timeout_ms * 1_000_000, ..self }
    }

    /// So much longer for each answer: the time that it is on the line.
    #[must_use]
    pub(crate) const fn longer_by(self, transfer_ns: i64) -> Self {
        let Self { timeout_ns, acknowledged_ns, attempts } = self;
        Self {
            timeout_ns: timeout_ns.saturating_add(transfer_ns),
            acknowledged_ns: acknowledged_ns.saturating_add(transfer_ns),
            attempts,
        }
    }
}

/// What a question wants now.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Due {
    /// Nothing before its next deadline.
    Nothing,
    /// Send it, for the so-many-th time (1 = first).
    Ask(u8),
    /// No answer in all attempts.
    GivenUp,
}

/// A question that is open.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Question {
    patience: Patience,
    asked: u8,
    asked_ns: i64,
    deadline_ns: i64,
    is_acknowledged: bool,
}

impl Question {
    /// A question that is due at `from_ns`.
    #[must_use]
    pub(crate) fn new(patience: Patience, from_ns: i64) -> Self {
        Self { patience, asked: 0, asked_ns: from_ns, deadline_ns: from_ns, is_acknowledged: false }
    }

    /// What to do now. [`Due::Ask`] counts as asked.
    pub(crate) fn poll(&mut self, now_ns: i64) -> Due {
        if now_ns < self.deadline_ns {
            return Due::Nothing;
        }
        if self.asked >= self.patience.attempts {
            return Due::GivenUp;
        }
        self.asked += 1;
        self.asked_ns = now_ns;
        self.is_acknowledged = false;
        self.deadline_ns = now_ns.saturating_add(self.patience.timeout_ns);
        Due::Ask(self.asked)
    }

    /// The device said no: ask again after a pause, if any attempt is left.
    pub(crate) fn refused(&mut self, now_ns: i64, pause_ns: i64) {
        self.deadline_ns = self.deadline_ns.min(now_ns.saturating_add(pause_ns));
    }

    /// The device has said that it got the question: give it the time that it may take.
    pub(crate) fn acknowledge(&mut self) {
        if self.asked > 0 {
            self.is_acknowledged = true;
            let until_ns = self.asked_ns.saturating_add(self.patience.acknowledged_ns);
            self.deadline_ns = self.deadline_ns.max(until_ns);
        }
    }

    /// What looked like an acknowledge was none: the attempt under way ends when it would have ended without
    /// it.
    pub(crate) fn question_again(&mut self, now_ns: i64) {
        if self.is_acknowledged {
            self.is_acknowledged = false;
            self.deadline_ns = self.unacknowledged_deadline_ns().max(now_ns);
        }
    }

    /// Whether the device has said so since it was asked last.
    #[must_use]
    pub(crate) fn is_acknowledged(&self) -> bool {
        self.is_acknowledged
    }

    /// Until when the attempt under way would last without an acknowledge.
    #[must_use]
    pub(crate) fn unacknowledged_deadline_ns(&self) -> i64 {
        self.asked_ns.saturating_add(self.patience.timeout_ns)
    }

    /// Do not ask again: the attempt under way is the last.
    pub(crate) fn last_attempt(&mut self) {
        self.patience.attempts = self.asked;
    }

    /// It is of no use: the attempt under way ends now, and is the last.
    pub(crate) fn expire(&mut self, now_ns: i64) {
        self.last_attempt();
        self.deadline_ns = now_ns;
    }

    /// The device is there, but has not answered: allow some attempts more, up to a bound.
    pub(crate) fn encourage(&mut self, attempts: u8) {
        self.patience.attempts = self.patience.attempts.max(attempts);
    }

    /// When it wants to be polled next.
    #[must_use]
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.deadline_ns
    }

    /// How often it was asked.
    #[must_use]
    pub(crate) fn asked(&self) -> u8 {
        self.asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_is_asked_at_once_then_at_each_timeout_then_given_up() {
        let mut question = Question::new(Patience::new(100, 2), 5);
        assert_eq!(question.poll(4), Due::Nothing);
        assert_eq!(question.poll(5), Due::Ask(1));
        assert_eq!(question.poll(100_000_004), Due::Nothing);
        assert_eq!(question.poll(100_000_005), Due::Ask(2));
        assert_eq!(question.poll(200_000_005), Due::GivenUp);
    }

    #[test]
    fn an_acknowledged_question_has_its_own_time_from_when_it_was_asked() {
        let mut question = Question::new(Patience::new(100, 2).acknowledged(500).longer_by(1_000_000), 0);
        assert_eq!(question.poll(0), Due::Ask(1));
        question.acknowledge();
        assert!(question.is_acknowledged());
        assert_eq!(question.deadline_ns(), 501_000_000);
        assert_eq!(question.poll(501_000_000), Due::Ask(2));
        assert!(!question.is_acknowledged());
        assert_eq!(question.deadline_ns(), 602_000_000);
        question.last_attempt();
        assert_eq!(question.poll(602_000_000), Due::GivenUp);
    }

    #[test]
    fn a_refused_question_is_asked_again_after_the_pause_and_not_more_often_than_allowed() {
        let mut question = Question::new(Patience::new(100, 2), 0);
        assert_eq!(question.poll(0), Due::Ask(1));
        question.refused(10, 30);
        assert_eq!(question.poll(39), Due::Nothing);
        assert_eq!(question.poll(40), Due::Ask(2));
        question.refused(50, 30);
        assert_eq!(question.poll(80), Due::GivenUp);
    }
}
