//! Votes between two ways to explain what is seen, the latest counting most.

/// How much an older vote counts beside the next one.
const FADING: f32 = 0.92;
/// A verdict needs so many votes (fading ones count less).
const ENOUGH: f32 = 4.0;
/// And so many times as many as the other side has.
const MAJORITY: f32 = 4.0;

/// Votes for and against an explanation.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct VoteCount {
    for_it: f32,
    against: f32,
    won: bool,
    lost: bool,
}

impl VoteCount {
    /// The explanation does better by `lead`, or worse where it is negative; a lead below `least` is no vote.
    pub(crate) fn vote(&mut self, lead: f32, minimum: f32) {
        if lead.abs() < minimum {
            return;
        }
        self.for_it *= FADING;
        self.against *= FADING;
        if lead > 0.0 {
            self.for_it += 1.0;
        } else {
            self.against += 1.0;
        }
        self.won = stands(self.won, self.for_it, self.against);
        self.lost = stands(self.lost, self.against, self.for_it);
    }

    /// Whether the explanation has won; it has until the other side has more votes.
    #[must_use]
    pub(crate) fn is_won(&self) -> bool {
        self.won
    }

    /// Whether it has lost, likewise.
    #[must_use]
    pub(crate) fn is_lost(&self) -> bool {
        self.lost
    }
}

/// Whether a verdict stands that has these votes for it and against it.
fn stands(stood: bool, votes: f32, others: f32) -> bool {
    let is_clear = votes >= ENOUGH && votes >= MAJORITY * others;
    is_clear || (stood && votes > others)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(leads: &[f32]) -> VoteCount {
        let mut vote_count = VoteCount::default();
        leads.iter().for_each(|&lead| vote_count.vote(lead, 0.1));
        vote_count
    }

    #[test]
    fn five_votes_win_unless_the_other_side_has_a_quarter_of_them() {
        assert!(!after(&[0.3; 4]).is_won() && after(&[0.3; 5]).is_won());
        assert!(!after(&[0.05; 50]).is_won(), "no votes");
        assert!(after(&[-0.3; 5]).is_lost() && !after(&[-0.3; 5]).is_won());
        assert!(!after(&[0.3, 0.3, -0.3, 0.3, 0.3, -0.3, 0.3, 0.3]).is_won());
    }

    #[test]
    fn what_was_long_ago_fades() {
        let changed: Vec<f32> = [vec![0.3; 20], vec![-0.3; 40]].concat();
        assert!(after(&changed[..20]).is_won());
        assert!(after(&changed).is_lost());
    }
}
