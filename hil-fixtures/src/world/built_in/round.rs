//! Round things of a world, as its truth: upright and lying cylinders, seen from outside or from inside.
//! Meters; the frame is the owner's.

use crate::world::pose::Pose;
use crate::world::vec3::Vec3;

/// What a round thing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoundKind {
    /// Carries a ceiling or a roof.
    Column,
    /// Lies along a ceiling or a wall.
    Pipe,
    /// Stands free: lamp posts, trunks, bollards.
    Pole,
    /// A curved wall.
    Wall,
}

/// From which side a round thing can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoundSide {
    /// Columns, pipes, poles.
    Outside,
    /// An apse.
    Inside,
}

/// A cylinder, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundThing {
    /// What it is.
    pub kind: RoundKind,
    /// Where the axis begins.
    pub axis_from_m: Vec3,
    /// Where it ends.
    pub axis_to_m: Vec3,
    /// Its radius.
    pub radius_m: f64,
    /// How much of the way round is there, degrees.
    pub arc_deg: f64,
    /// From where it can be seen.
    pub seen_from: RoundSide,
}

impl RoundThing {
    /// The same thing in another frame.
    #[must_use]
    pub fn moved(&self, a_from_b: &Pose) -> Self {
        let [axis_from_m, axis_to_m] = [self.axis_from_m, self.axis_to_m].map(|p| a_from_b.apply(p));
        Self { axis_from_m, axis_to_m, ..self.clone() }
    }

    /// One JSON object, in one line.
    #[must_use]
    pub fn json(&self) -> String {
        let kind = match self.kind {
            RoundKind::Column => "column",
            RoundKind::Pipe => "pipe",
            RoundKind::Pole => "pole",
            RoundKind::Wall => "wall",
        };
        let side = match self.seen_from {
            RoundSide::Outside => "outside",
            RoundSide::Inside => "inside",
        };
        let point = |[x, y, z]: Vec3| format!("[{x:.6}, {y:.6}, {z:.6}]");
        format!(
            "{{\"kind\": \"{kind}\", \"axis_from_m\": {}, \"axis_to_m\": {}, \"radius_m\": {:.6}, \
             \"arc_deg\": {:.3}, \"seen_from\": \"{side}\"}}",
            point(self.axis_from_m),
            point(self.axis_to_m),
            self.radius_m,
            self.arc_deg
        )
    }
}

/// Sides of a drawn cylinder, so that no side is further than this from the true surface, meters: far below
/// what any laser of this kind measures. Things up to 20 cm have the fewest sides with it, as they always
/// had: drives through the corridor, the office and the building stay as they were.
const CHORD_ERROR_M: f64 = 5e-4;
/// Fewest sides all the way round.
const MIN_SIDES: u32 = 48;

/// Sides all the way round a cylinder of that radius.
#[must_use]
pub fn sides(radius_m: f64) -> u32 {
    let half_angle = (1.0 - CHORD_ERROR_M / radius_m.max(CHORD_ERROR_M)).acos();
    ((std::f64::consts::PI / half_angle).ceil() as u32).max(MIN_SIDES)
}

#[cfg(test)]
mod tests {
    use super::sides;

    #[test]
    fn sides_follow_the_radius() {
        assert_eq!(sides(0.03), 48);
        let many = sides(3.0);
        let off_m = 3.0 * (1.0 - (std::f64::consts::PI / f64::from(many)).cos());
        assert!(many > 100 && off_m <= 5e-4, "{many} {off_m}");
    }
}
