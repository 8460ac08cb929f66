//! Asking a device a question: how long to wait for the answer, how often to ask again, when to give up.
//!
//! Times are nanoseconds. A question is asked when it is first polled, and again whenever its time is up or the device has
//! refused it, as often as its [`Patience`] allows.

/// How long and how often.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Patience {
    /// Wait for an answer, nanoseconds. Smaller: a slow device is asked twice and answers twice.
    pub timeout_ns: i64,
    /// Times the question is asked in all. Larger: more time is spent before something else is tried.
    pub attempts: u8,
}

impl Patience {
    /// So many attempts of so many milliseconds each.
    #[must_use]
    pub const fn new(timeout_ms: i64, attempts: u8) -> Self {
        Self { timeout_ns: timeout_ms * 1_000_000, attempts }
    }
}

/// What a question wants now.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Due {
    /// Nothing before its next deadline.
    Nothing,
    /// Send it, for the so-many-th time (1 = first).
    Ask(u8),
    /// No answer in all attempts.
    GivenUp,
}

/// A question that is open.
#[derive(Copy, Clone, Debug)]
pub struct Question {
    patience: Patience,
    asked: u8,
    deadline_ns: i64,
}

impl Question {
    /// A question that is due at `from_ns`.
    #[must_use]
    pub fn new(patience: Patience, from_ns: i64) -> Self {
        Self { patience, asked: 0, deadline_ns: from_ns }
    }

    /// What to do now. [`Due::Ask`] counts as asked.
    pub fn poll(&mut self, now_ns: i64) -> Due {
        if now_ns < self.deadline_ns {
            return Due::Nothing;
        }
        if self.asked >= self.patience.attempts {
            return Due::GivenUp;
        }
        self.asked += 1;
        self.deadline_ns = now_ns.saturating_add(self.patience.timeout_ns);
        Due::Ask(self.asked)
    }

    /// The device said no: ask again after a pause, if any attempt is left.
    pub fn refused(&mut self, now_ns: i64, pause_ns: i64) {
        self.deadline_ns = self.deadline_ns.min(now_ns.saturating_add(pause_ns));
    }

    /// The device is there, but has not answered: allow some attempts more, up to a bound.
    pub fn encourage(&mut self, attempts: u8) {
        self.patience.attempts = self.patience.attempts.max(attempts);
    }

    /// When it wants to be polled next.
    #[must_use]
    pub fn deadline_ns(&self) -> i64 {
        self.deadline_ns
    }

    /// How often it was asked.
    #[must_use]
    pub fn asked(&self) -> u8 {
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
