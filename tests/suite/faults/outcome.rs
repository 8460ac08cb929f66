//! What a run, or many, came to.

use crate::rig::MS;
use crate::rig::truth::Account;

/// What a run, or many, came to.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// How many.
    pub runs: u64,
    /// Slowest notice.
    pub noticed_ns: i64,
    /// Most times that the same thing was said of one outage.
    pub said: u64,
    /// Runs in which it was said that telegrams arrive damaged.
    pub damage_said: u64,
    /// Slowest return.
    pub back_ns: i64,
    /// Telegrams of the lines with the fault, and of the others.
    pub hit: Account,
    /// Those of the others.
    pub others: Account,
    /// What was not as it should be.
    pub wrong: Vec<String>,
}

impl Outcome {
    /// Takes in another.
    pub fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.noticed_ns = self.noticed_ns.max(other.noticed_ns);
        self.said = self.said.max(other.said);
        self.damage_said += other.damage_said;
        self.back_ns = self.back_ns.max(other.back_ns);
        self.hit.add(&other.hit);
        self.others.add(&other.others);
        self.wrong.extend(other.wrong);
    }

    /// A row of the table under [`HEAD`].
    pub fn row(&self, fault: &str, place: &str) -> String {
        let Self { runs, noticed_ns, said, back_ns, hit, others, .. } = self;
        format!(
            "| {fault} | {place} | {runs} | {} | {said} | {} | {} / {} | {} | {} | {} | {} / {} |\n",
            noticed_ns / MS,
            back_ns / MS,
            hit.recorded,
            hit.intact,
            hit.damaged,
            hit.undetected,
            hit.wrongly_kept,
            others.recorded,
            others.intact,
        )
    }
}

/// Head of the table.
pub const HEAD: &str = "| fault | place | runs | noticed, worst ms | said | back, worst ms | recorded / intact | damaged | undetected | wrongly kept | other lines |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
