//! Whether a cylinder through some points is there: by its arc, its length, its residuals, by what lies
//! beside it, by the side that it was seen from, and against flat faces. Meters, radians.

use super::axis::Tube;
use super::prism::compare;
use super::surface::{Evidence, ON_DEVIATIONS, Rejected, Surface, covered, direction_of, means, off_m, side};
use crate::reconstruct::shapes::params::ShapeParams;

/// Points up to so many deviations off are beside it.
pub(crate) const BESIDE_DEVIATIONS: f64 = 8.0;

/// What the points of a cylinder have to hold.
struct Limits {
    /// Fewest points, in those that a cylinder has.
    points: f64,
    /// Largest share of points beside it, among those on it and beside it: foliage has more.
    beside: f64,
    /// Largest deviation of the points on it, in those of a range. Points that fill the space evenly have
    /// 1.7.
    spread: f64,
    /// Smallest share of the surface between its ends on which there are points.
    covered: f64,
    /// Nothing narrower is round from inside: corners are, where mixed pixels fill them.
    inside_radius_m: f64,
    /// How much better than flat faces a circle is at least.
    evidence: f64,
    /// The same where nobody knows from where the points were seen: neither beams nor sides speak against it.
    blind_evidence: f64,
}

/// Of a cylinder that is there. The evidence is very strong (Kass and Raftery 1995).
const FULL: Limits = Limits {
    points: 1.0,
    beside: 0.3,
    spread: 1.4,
    covered: 0.55,
    inside_radius_m: 0.5,
    evidence: 10.0,
    blind_evidence: 15.0,
};

/// Of a guess that is fitted to some of its points. Of what is accepted in the end, 98 of 100 hold these, and
/// the others are guessed once more; of what is not, one in five does.
const ROUGH: Limits = Limits {
    points: 0.7,
    beside: 0.35,
    spread: 1.5,
    covered: 0.5,
    inside_radius_m: 0.4,
    evidence: 0.0,
    blind_evidence: 0.0,
};

/// A cylinder that is there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Accepted {
    /// Axis and radius.
    pub tube: Tube,
    /// From where to where along the axis.
    pub along_m: [f64; 2],
    /// From where to where round it, radians; a whole turn apart where it is seen all round.
    pub arc_rad: [f64; 2],
    /// Whether it was seen from inside.
    pub inside: bool,
    /// Indices of the points on it.
    pub on: Vec<usize>,
}

/// Whether a cylinder that is roughly fitted to one in `step` of its points may become one: more points and a
/// better fit change by little what they say.
pub(crate) fn may_become(
    params: &ShapeParams,
    tube: &Tube,
    some: &Evidence<'_>,
    step: usize,
) -> Result<(), Rejected> {
    let min_points = (ROUGH.points * params.min_points as f64 / step as f64) as usize;
    let few = ShapeParams { min_points, ..params.clone() };
    stands(tube, some, &Surface::of(&few, tube, some)?, &ROUGH).map(|_| ())
}

/// Judges a cylinder.
pub(crate) fn judge(params: &ShapeParams, tube: &Tube, seen: &Evidence<'_>) -> Result<Accepted, Rejected> {
    let surface = Surface::of(params, tube, seen)?;
    let inside = stands(tube, seen, &surface, &FULL)?;
    let Surface { on, along_m, arc, .. } = surface;
    let on = on.into_iter().map(|p| p.index).collect();
    Ok(Accepted { tube: *tube, along_m, arc_rad: arc.radians(), inside, on })
}

/// Whether the part that was seen holds the limits, and whether it was seen from inside. What costs most is
/// asked last.
fn stands(tube: &Tube, seen: &Evidence<'_>, surface: &Surface, limits: &Limits) -> Result<bool, Rejected> {
    let Surface { all, on, along_m, arc } = surface;
    let squares: f64 = on.iter().map(|p| off_m(tube, all[p.index]).powi(2)).sum();
    if (squares / on.len() as f64).sqrt() > limits.spread * seen.sigma_m {
        return Err(Rejected::Spread);
    }
    let inside = side(on).ok_or(Rejected::Sides)?;
    if inside && tube.radius_m < limits.inside_radius_m {
        return Err(Rejected::Radius);
    }
    if covered(on, arc, *along_m) < limits.covered {
        return Err(Rejected::Covered);
    }
    let within = |p: &[f64; 3]| (along_m[0]..=along_m[1]).contains(&p[2]);
    let beside = all.iter().filter(|p| {
        let off = off_m(tube, **p).abs();
        within(p)
            && off > ON_DEVIATIONS * seen.sigma_m
            && off <= BESIDE_DEVIATIONS * seen.sigma_m
            && arc.is_inner(direction_of(**p))
    });
    let beside = beside.count() as f64;
    if beside > limits.beside * (beside + on.len() as f64) {
        return Err(Rejected::Beside);
    }
    let costs = compare(&means(on, arc, (tube.radius_m, seen.sigma_m)), tube.radius_m);
    let evidence = if seen.origins_m.is_empty() { limits.blind_evidence } else { limits.evidence };
    if costs.flat < costs.round + evidence {
        return Err(Rejected::Flat);
    }
    Ok(inside)
}
