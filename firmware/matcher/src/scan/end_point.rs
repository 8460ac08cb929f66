//! The end point of a beam, and what its scan alone says of the surface there.
//!
//! Frame: the base at the scan's stamp. Units: meters.

use crate::placement::Placement;

/// What a scan alone can say about the surface at an end point.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Kind {
    /// It lies on a line with its neighbors.
    Line,
    /// It stands out from its neighbors: a leg, a pole, clutter.
    Point,
    /// Too few neighbors, or struck too flatly to tell a wall from the jump between two.
    #[default]
    Unsure,
}

/// Whether what an end point lies on moves by itself.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Mobility {
    /// It stands.
    #[default]
    Static,
    /// Not known yet: it is no part of the map until it is.
    Unknown,
    /// It moves: it says nothing of the pose and is no part of the map.
    Dynamic,
}

/// One end point.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct EndPoint {
    /// Position in the base's frame, meters.
    pub at_m: [f32; 2],
    /// Unit normal of the surface towards the laser, in the base's frame; zero unless it is a line.
    pub normal: [f32; 2],
    /// What it seems to lie on.
    pub kind: Kind,
    /// Weight in (0, 1]: less where the beams are crowded.
    pub weight: f32,
    /// It stands alone off what its neighbors on both sides lie on: a leg before a wall, or a beam that fell
    /// short.
    pub alone: bool,
    /// Whether what it lies on moves by itself.
    pub mobility: Mobility,
}

impl EndPoint {
    /// Whether it knows the direction of the surface it lies on.
    #[must_use]
    pub fn has_normal(&self) -> bool {
        self.normal != [0.0; 2]
    }

    /// Says whether what it lies on moves. What does has no weight.
    pub(super) fn set_mobility(&mut self, mobility: Mobility) {
        self.mobility = mobility;
        if mobility == Mobility::Dynamic {
            self.weight = 0.0;
        }
    }

    /// The same end point in the frame of a placement.
    #[inline]
    #[must_use]
    pub fn placed(&self, placement: &Placement) -> Self {
        Self { at_m: placement.place(self.at_m), normal: placement.turn(self.normal), ..*self }
    }
}
