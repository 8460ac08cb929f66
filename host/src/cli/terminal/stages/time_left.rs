//! How long a build still takes, as far as what it did so far tells.
//!
//! The stages after the raw mesh take time in proportion to its size, and to each other as [`share`] has it:
//! the first of them, which knows how far it is, tells how fast this machine is with this mesh, and so how
//! long the others will take. On buildings of the paper's size and larger that is right within a factor of
//! two. Before that nothing is said.

/// Less than this of the work done tells nothing yet.
const MIN_DONE: f64 = 0.3;

/// What a stage takes for as long as planes take 1, measured on raw meshes of 0.5 to 3.7 million triangles.
/// Zero: the others do not tell.
fn share(stage: &str) -> f64 {
    match stage {
        "planes" => 1.0,
        "polygons" => 2.5,
        "write" => 0.4,
        "report" => 4.0,
        _ => 0.0,
    }
}

/// What was measured so far.
pub(super) struct Pace {
    steps: Vec<&'static str>,
    done: f64,
    spent_s: f64,
}

impl Pace {
    /// Of the stages in their order, none of which is done.
    pub(super) fn new(steps: &[&'static str]) -> Self {
        Self { steps: steps.to_vec(), done: 0.0, spent_s: 0.0 }
    }

    /// A stage took so long.
    pub(super) fn took(&mut self, stage: &str, wall_s: f64) {
        if share(stage) > 0.0 {
            self.done += share(stage);
            self.spent_s += wall_s;
        }
    }

    /// What is ahead when a stage begins.
    pub(super) fn ahead(&self, stage: &str) -> Ahead {
        let later = self.steps.iter().skip_while(|step| **step != stage).skip(1);
        Ahead {
            done: self.done,
            spent_s: self.spent_s,
            own: share(stage),
            later: later.map(|step| share(step)).sum(),
        }
    }
}

/// What is ahead when a stage begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ahead {
    done: f64,
    spent_s: f64,
    own: f64,
    later: f64,
}

impl Ahead {
    /// Seconds until all is done, when the stage runs for so long and knows, or does not, which share of its
    /// work is done.
    pub(super) fn left_s(&self, elapsed_s: f64, done: Option<f64>) -> Option<f64> {
        let (own_done, spent_s) = match done {
            Some(share) if self.own > 0.0 => (share * self.own, self.spent_s + elapsed_s),
            _ => (0.0, self.spent_s),
        };
        let all_done = self.done + own_done;
        if all_done < MIN_DONE {
            return None;
        }
        let unit_s = spent_s / all_done;
        let own_left_s = match done {
            Some(_) => unit_s * (self.own - own_done),
            None => (unit_s * self.own - elapsed_s).max(0.0),
        };
        Some(own_left_s + unit_s * self.later)
    }
}

#[cfg(test)]
mod tests {
    use super::{Ahead, Pace};

    const STEPS: [&str; 6] = ["map", "mesh", "planes", "polygons", "write", "report"];

    #[test]
    fn nothing_is_said_before_a_third_of_the_planes() {
        let pace = Pace::new(&STEPS);
        assert_eq!(pace.ahead("map").left_s(100.0, Some(0.9)), None);
        assert_eq!(pace.ahead("planes").left_s(3.0, None), None);
        assert_eq!(pace.ahead("planes").left_s(3.0, Some(0.2)), None);
    }

    #[test]
    fn the_stages_to_come_take_as_long_as_those_before_tell() {
        let mut pace = Pace::new(&STEPS);
        // Half of the planes in 5 s: all in 10 s, polygons 25 s, files 4 s, the report 40 s.
        assert_eq!(pace.ahead("planes").left_s(5.0, Some(0.5)), Some(5.0 + 69.0));
        pace.took("map", 1000.0);
        pace.took("planes", 10.0);
        assert_eq!(pace.ahead("polygons").left_s(5.0, None), Some(20.0 + 44.0));
        // What takes longer than it should does not make the rest longer before it is done, and nothing is
        // less than over.
        assert_eq!(pace.ahead("polygons").left_s(60.0, None), Some(44.0));
        assert_eq!(pace.ahead("report").left_s(60.0, None), Some(0.0));
        pace.took("polygons", 60.0);
        // 70 s for 3.5.
        assert_eq!(pace.ahead("report").left_s(0.0, None), Some(80.0));
        assert_eq!(Ahead::default().left_s(1.0, None), None);
    }
}
