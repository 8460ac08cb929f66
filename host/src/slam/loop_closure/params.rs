//! How far, how widely and how often loops are looked for.

/// How loops are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CandidateParams {
    /// Middles of two submaps may be this far apart to see the same place, meters. Larger: more pairs, of
    /// which fewer fit.
    pub near_m: f64,
    /// Standard deviations of the window. Larger: surer to hold the loop, slower.
    pub sigmas: f64,
    /// Share of the drift that steps may have with which is looked first. A matcher that works as it should
    /// drifts by so little; loops found in such windows make the others narrow, so that corridors which look
    /// alike are never compared from afar. Larger: more look alike. Smaller: more is left to the wide
    /// windows.
    pub first_share: f64,
    /// Lengths may all be off by this share, so much of the way wider is the window. Larger: the same.
    pub scale_share: f64,
    /// Windows wider than this are not searched, meters each way.
    pub widest_m: f64,
    /// Pairs tried for each submap in a round.
    pub pairs_per_round: usize,
    /// A loop found in a window wider than this needs support, meters.
    pub alone_up_to_m: f64,
    /// Pairs known better than this already are not searched (standard deviation, meters; the heading's at a
    /// lever of 5 m). Smaller: more loops, slower.
    pub known_m: f64,
    /// When a submap knows so many others of its place so well, the place is known: it is compared with no
    /// more of them, so that the hundredth visit costs what the third one does. Larger: more loops, slower.
    pub known_enough: usize,
}

impl Default for CandidateParams {
    fn default() -> Self {
        Self {
            near_m: 7.0,
            sigmas: 3.0,
            first_share: 0.2,
            scale_share: 0.01,
            widest_m: 64.0,
            pairs_per_round: 4,
            alone_up_to_m: 1.5,
            known_m: 0.15,
            known_enough: 16,
        }
    }
}
