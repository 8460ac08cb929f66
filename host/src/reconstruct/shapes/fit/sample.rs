//! Points to fit to, and the places from which they were seen. Meters.

/// Points, and from where each was seen; the latter empty when nobody knows.
#[derive(Clone, Copy)]
pub(crate) struct Sample<'a> {
    /// The points.
    pub points_m: &'a [[f64; 3]],
    /// The places from which they were seen.
    pub origins_m: &'a [[f64; 3]],
}

impl<'a> Sample<'a> {
    /// Points that nobody knows the beams of.
    pub(crate) fn blind(points_m: &'a [[f64; 3]]) -> Self {
        Self { points_m, origins_m: &[] }
    }
}
