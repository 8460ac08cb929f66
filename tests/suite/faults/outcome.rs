//! What a run, or many, came to.

use crate::rig::MS;
use crate::rig::verdict::truth::Account;

/// What a run, or many, came to.
#[derive(Clone, Debug, Default)]
pub(super) struct Outcome {
    /// How many.
    pub runs: u64,
    /// Slowest notice.
    pub noticed_ns: i64,
    /// Most times that the same thing was said of one outage.
    pub reported: u64,
    /// Runs in which it was said that telegrams arrive damaged.
    pub damage_reported: u64,
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
    pub(super) fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.noticed_ns = self.noticed_ns.max(other.noticed_ns);
        self.reported = self.reported.max(other.reported);
        self.damage_reported += other.damage_reported;
        self.back_ns = self.back_ns.max(other.back_ns);
        self.hit.add(&other.hit);
        self.others.add(&other.others);
        self.wrong.extend(other.wrong);
    }

    /// A row of the table under [`HEAD`].
    pub(super) fn row(&self, fault: &str, place: &str) -> String {
        let Self { runs, noticed_ns, reported, back_ns, hit, others, .. } = self;
        format!(
            "| {fault} | {place} | {runs} | {} | {reported} | {} | {} / {} | {} | {} | {} | {} / {} |\n",
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
pub(super) const HEAD: &str = "| fault | place | runs | noticed, worst ms | said | back, worst ms | recorded / intact | damaged | undetected | wrongly kept | other lines |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
