//! What an alignment asks of a map, and what an end point meets there.
//!
//! Frame: map. Units: meters.

use crate::map::LocalMap;
use crate::map::point_map::{MappedPoint, PointMap};
use crate::map::surfel::Surfel;
use crate::placement::Placement;
use crate::scan::end_points::EndPoint;
use biplane_geometry::vec2::{dot, minus};

/// A map that can be asked for the surface nearest to an end point.
pub(crate) trait SurfaceMap {
    /// Whether an end point that may as well be a jump between two walls ([`Kind::Unsure`](crate::Kind)) is
    /// laid on spots.
    const UNSURE_ON_SPOTS: bool;

    /// What tells a surface of the map: looked up for many end points first, so that they wait for their
    /// cells together, and for their surfaces.
    type Met: Copy + Default;

    /// The surface nearest to a place of the map. A map may leave out what lies farther than `reach_m`, and
    /// what faces another way than the end point's own normal; that normal is zero where it is not known.
    fn met_at(&self, at_m: [f32; 2], normal: [f32; 2], reach_m: f32) -> Option<Self::Met>;

    /// The surface that was met.
    fn surfel(&self, met: Self::Met) -> Option<Surfel>;

    /// Whether a surface is a line; if not it is a spot: a leg, a corner, clutter.
    fn is_line(&self, surfel: &Surfel) -> bool;

    /// Whether beams have passed through the surroundings of a place.
    fn seen_through(&self, at_m: [f32; 2]) -> bool;
}

impl SurfaceMap for LocalMap {
    /// Spots are what stood out from its surroundings scan after scan; a jump's end would only draw the pose
    /// towards one.
    const UNSURE_ON_SPOTS: bool = false;

    type Met = u32;

    /// As far as the cells name surfaces, whichever way they face.
    #[inline]
    fn met_at(&self, at_m: [f32; 2], _: [f32; 2], _: f32) -> Option<u32> {
        self.nearest_index(at_m)
    }

    #[inline]
    fn surfel(&self, met: u32) -> Option<Surfel> {
        self.surfels().get(met as usize).copied()
    }

    #[inline]
    fn is_line(&self, surfel: &Surfel) -> bool {
        self.is_line(surfel)
    }

    #[inline]
    fn seen_through(&self, at_m: [f32; 2]) -> bool {
        self.seen_through(at_m)
    }
}

impl SurfaceMap for PointMap {
    /// There are fewer end points than in a map that grew, and each counts: without them the mean error of
    /// the thin Edmonton drive rises by half a per cent.
    const UNSURE_ON_SPOTS: bool = true;

    type Met = Surfel;

    /// Where the point here has no direction, the end point's own is taken: one of the two is enough to tell
    /// a wall.
    fn met_at(&self, at_m: [f32; 2], normal: [f32; 2], reach_m: f32) -> Option<Surfel> {
        let MappedPoint { at_m, normal: own } = *self.nearest(at_m, normal, reach_m)?;
        let normal = if own == [0.0; 2] { normal } else { own };
        Some(Surfel { at_m, normal, hits: 1.0, ..Surfel::default() })
    }

    #[inline]
    fn surfel(&self, met: Surfel) -> Option<Surfel> {
        Some(met)
    }

    fn is_line(&self, surfel: &Surfel) -> bool {
        surfel.normal != [0.0; 2]
    }

    fn seen_through(&self, _: [f32; 2]) -> bool {
        false
    }
}

/// An end point laid on a map, and the surface that it meets there.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Correspondence {
    /// From the base to the end point, in the map's axes, meters.
    pub arm: [f32; 2],
    /// From the surface's mean to the end point, meters.
    pub offset: [f32; 2],
    /// The surface.
    pub surfel: Surfel,
    /// Whether the surface is a line.
    pub is_line: bool,
    /// Squared length of the surface's mean normal: 1 where all directions seen on it agree.
    pub strength: f32,
    /// It is a line, and the end point lies on another face or on a wall that turns away.
    pub is_other_face: bool,
}

/// An end point whose direction is more than 60 degrees off a line's belongs to another face: the cosine.
pub(crate) const OTHER_FACE_COSINE: f32 = 0.5;

impl Correspondence {
    /// What an end point meets; `Err` holds where it lies when it meets nothing.
    #[inline(always)]
    pub(crate) fn find<M: SurfaceMap>(
        map: &M,
        point: &EndPoint,
        placement: &Placement,
        reach_m: f32,
    ) -> Result<Self, [f32; 2]> {
        let arm = placement.turn(point.at_m);
        let at_m = [arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]];
        let normal = placement.turn(point.normal);
        let met = map.met_at(at_m, normal, reach_m).and_then(|met| map.surfel(met));
        met.map(|surfel| Self::with(map, point, placement, surfel)).ok_or(at_m)
    }

    /// An end point that meets this surface.
    #[inline(always)]
    pub(crate) fn with<M: SurfaceMap>(
        map: &M,
        point: &EndPoint,
        placement: &Placement,
        surfel: Surfel,
    ) -> Self {
        let arm = placement.turn(point.at_m);
        let at_m = [arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]];
        let normal = placement.turn(point.normal);
        let strength = dot(surfel.normal, surfel.normal);
        let is_line = map.is_line(&surfel);
        let faces_away = dot(normal, surfel.normal) < OTHER_FACE_COSINE * strength;
        Self {
            arm,
            offset: minus(at_m, surfel.at_m),
            surfel,
            is_line,
            strength,
            is_other_face: is_line && faces_away && dot(point.normal, point.normal) > 0.5,
        }
    }

    /// Squared distance of the end point from the line, or from the spot, square meters.
    #[inline]
    pub(crate) fn squared_m2(&self) -> f32 {
        if self.is_line {
            let across = dot(self.offset, self.surfel.normal);
            across * across / self.strength
        } else {
            dot(self.offset, self.offset)
        }
    }
}
