//! One round of the refinement over a span of knots: planes found anew for the poses as they are, then a few
//! steps of Gauss and Newton.

use crate::slam::refinement::spatial::beams::{BeamHit, Laser, Point};
use crate::slam::refinement::spatial::floor_hits::FloorHits;
use crate::slam::refinement::spatial::knots::{Attitude, Knots, State};
use crate::slam::refinement::spatial::motion::inertial::{Biases, Inertial};
use crate::slam::refinement::spatial::motion::wheels::Wheels;
use crate::slam::refinement::spatial::normal_equations::groups::{Group, let_share_errors};
use crate::slam::refinement::spatial::normal_equations::priors::{start, upright};
use crate::slam::refinement::spatial::normal_equations::rows::Rows;
use crate::slam::refinement::spatial::normal_equations::{Assembly, KERNEL, Layout, by_state, robust};
use crate::slam::refinement::spatial::params::SpatialParams;
use crate::slam::refinement::spatial::surfaces::{Search, Surface, Surfaces};
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, minus};
use rayon::prelude::*;

/// What the poses are held by.
pub(crate) struct Problem<'a> {
    /// In the order of knots.
    pub hits: &'a [BeamHit],
    /// Where the hits of each knot begin; one more than there are knots.
    pub starts: Vec<usize>,
    /// Where the first knot is.
    pub anchor: State,
    pub wheels: &'a Wheels,
    pub inertial: Option<&'a Inertial>,
    pub floor: &'a FloorHits,
    /// The piece of the way of each knot.
    pub pieces: Vec<u32>,
    pub params: &'a SpatialParams,
}

/// Which knots take part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub first: usize,
    /// Knots before this one stay.
    pub first_free: usize,
    pub end: usize,
}

/// How a round is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    pub search: Search,
    pub steps: usize,
    /// One of so many beams is used.
    pub thinning: usize,
    /// Floor hits farther off say little, meters.
    pub floor_kernel_m: f64,
}

/// The largest step of a tilt that is taken at once, radians.
const MAX_TILT_STEP_RAD: f64 = 0.05;

/// A hit that takes part, with its plane.
#[derive(Clone, Copy, Debug)]
struct Seen {
    hit: u32,
    plane: u32,
}

impl Problem<'_> {
    /// The next state by wheels and inertial unit.
    pub(crate) fn reckoned(&self, state: &State, knot: usize) -> State {
        let mut next = self.wheels.reckoned(state, knot);
        if let Some(inertial) = self.inertial {
            [next[3], next[4]] = inertial.tilted(state, knot);
        }
        next
    }

    /// The hit's point for the search of planes.
    fn point(&self, knots: &Knots, hit: &BeamHit) -> Point {
        let knot = hit.knot as usize;
        Point { at_m: hit.placed(knots), laser: hit.laser, piece: self.pieces[knot] }
    }

    /// Numbers of the hits in a span that walls and ceilings may explain.
    fn chosen(&self, span: Span, thinning: usize, held_out: bool) -> Vec<usize> {
        let range = self.starts[span.first]..self.starts[span.end - 1];
        range
            .filter(|&number| {
                let hit = &self.hits[number];
                hit.is_held_out == held_out
                    && !(hit.laser == Laser::Horizontal && self.floor.is_ground[number])
                    && number % thinning == 0
            })
            .collect()
    }

    /// The planes that these hits lie on, for poses as they are, and the plane of each of the hits.
    fn surfaces(&self, chosen: &[usize], knots: &Knots, search: &Search) -> (Surfaces, Vec<Option<u32>>) {
        let points: Vec<Point> =
            chosen.par_iter().map(|&number| self.point(knots, &self.hits[number])).collect();
        Surfaces::find(&points, search)
    }

    /// One round; `None` when nothing could be solved. `memory` is what one round leaves for the next.
    pub(crate) fn round(
        &self,
        knots: &mut Knots,
        span: Span,
        round: &Round,
        memory: &mut Memory,
    ) -> Option<()> {
        let mut prepared = self.prepare(knots, span, round, std::mem::take(memory));
        for _ in 0..round.steps {
            self.step(&mut prepared, knots, span, round)?;
        }
        memory.groups = prepared.groups;
        Some(())
    }

    fn prepare(&self, knots: &Knots, span: Span, round: &Round, memory: Memory) -> Prepared {
        let chosen = self.chosen(span, round.thinning, false);
        let (surfaces, planes) = self.surfaces(&chosen, knots, &round.search);
        let seen = chosen.iter().zip(planes);
        let mut seen: Vec<Seen> =
            seen.filter_map(|(&hit, plane)| Some(Seen { hit: hit as u32, plane: plane? })).collect();
        let knot_of = |seen: &Seen| self.hits[seen.hit as usize].knot;
        for of_knot in seen.chunk_by_mut(|one, other| knot_of(one) == knot_of(other)) {
            of_knot.sort_unstable_by_key(|seen| (seen.plane, seen.hit));
        }
        let (mut groups, mut ends, mut end) = (memory.groups, vec![0], 0);
        groups.clear();
        for of_group in seen.chunk_by(|one, other| (knot_of(one), one.plane) == (knot_of(other), other.plane))
        {
            let knot = knot_of(&of_group[0]) as usize;
            let is_fixed = knot + 1 < span.first_free;
            groups.push(Group::new(knot - span.first, of_group[0].plane as usize, is_fixed));
            end += of_group.len();
            ends.push(end);
        }
        let fixed = seen.partition_point(|seen| knot_of(seen) as usize + 1 < span.first_free);
        let placed = |seen: &Seen| Placed::of(&self.hits[seen.hit as usize], knots);
        let placed = seen[..fixed].par_iter().map(placed).collect();
        let planes = surfaces.list;
        Prepared { planes, seen, placed, ends, groups, biases: Biases::default(), assembly: None }
    }

    /// The parts of the system for the poses as they are; what beams say is left with what is prepared.
    fn parts(&self, prepared: &mut Prepared, knots: &Knots, span: Span, round: &Round) -> (Layout, Rows) {
        let layout = Layout {
            knots: span.end - span.first,
            planes: prepared.planes.len(),
            extras: if self.inertial.is_some() { prepared.biases.len() } else { 0 },
            first_free: span.first_free - span.first,
        };
        self.look_at_all(prepared, knots, 0.5 * round.search.gate_m);
        let mut rows = Rows::default();
        self.wheels.rows(knots, span.first, layout, &self.params.motion, &mut rows);
        if let Some(inertial) = self.inertial {
            inertial.rows(knots, span.first, layout, &prepared.biases, &mut rows);
        }
        if !self.hits.is_empty() {
            self.floor.rows(self.hits, knots, span.first, layout, round.floor_kernel_m, &mut rows);
        }
        upright(&prepared.planes, layout, self.params.motion.upright_rad, &mut rows);
        if span.first_free == 0 {
            start(layout, &knots.states[0], &self.anchor, &mut rows);
        }
        (layout, rows)
    }

    fn step(&self, prepared: &mut Prepared, knots: &mut Knots, span: Span, round: &Round) -> Option<()> {
        let (layout, rows) = self.parts(prepared, knots, span, round);
        let Prepared { planes, groups, assembly, .. } = &mut *prepared;
        let assembly = assembly.get_or_insert_with(|| assembled(layout, planes, groups, &rows));
        let steps = assembly.solve(groups, &rows)?;
        for (state, step) in knots.states[span.first..span.end].iter_mut().zip(&steps.knots) {
            for part in 0..6 {
                let limit = if part == 3 || part == 4 { MAX_TILT_STEP_RAD } else { f64::INFINITY };
                state[part] += step[part].clamp(-limit, limit);
            }
        }
        for (bias, step) in prepared.biases.iter_mut().zip(&steps.extras) {
            (0..3).for_each(|axis| bias[axis] += step[axis]);
        }
        for (plane, step) in prepared.planes.iter_mut().zip(&steps.planes) {
            *plane = plane.stepped(*step);
        }
        Some(())
    }

    /// The covariances of some knots of a span, for poses as they are.
    pub(crate) fn covariances(
        &self,
        knots: &Knots,
        span: Span,
        round: &Round,
        at: &[usize],
    ) -> Option<Vec<[[f64; 6]; 6]>> {
        let mut prepared = self.prepare(knots, span, round, Memory::default());
        let (layout, rows) = self.parts(&mut prepared, knots, span, round);
        let Prepared { planes, groups, .. } = &prepared;
        assembled(layout, planes, groups, &rows).covariances(groups, &rows, at)
    }

    /// The same with other parameters.
    pub(crate) fn with_params<'b>(&'b self, params: &'b SpatialParams) -> Problem<'b> {
        let Self { hits, anchor, wheels, inertial, floor, .. } = *self;
        let (starts, pieces) = (self.starts.clone(), self.pieces.clone());
        Problem { hits, starts, anchor, wheels, inertial, floor, pieces, params }
    }

    /// The same without beams and inertial unit: what wheels alone tell.
    pub(crate) fn without_beams(&self) -> Problem<'_> {
        let Self { anchor, wheels, floor, params, .. } = *self;
        let starts = vec![0; self.starts.len()];
        let pieces = self.pieces.clone();
        Problem { hits: &[], starts, anchor, wheels, inertial: None, floor, pieces, params }
    }

    /// What the beams say, by knot and plane.
    fn look_at_all(&self, prepared: &mut Prepared, knots: &Knots, kernel_m: f64) {
        let Prepared { planes, seen, placed, ends, groups, .. } = prepared;
        groups.par_iter_mut().zip(ends.par_windows(2)).for_each(|(group, own)| {
            group.clear();
            let plane = &planes[group.plane];
            if group.is_fixed {
                for placed in &placed[own[0]..own[1]] {
                    let Look { residual, weight, of_plane } = self.looked(placed, plane, kernel_m);
                    group.add_fixed(&of_plane, residual, weight);
                }
                return;
            }
            for seen in &seen[own[0]..own[1]] {
                self.look(&self.hits[seen.hit as usize], plane, knots, kernel_m, group);
            }
        });
        let_share_errors(groups, planes.len());
    }

    fn look(&self, hit: &BeamHit, plane: &Surface, knots: &Knots, kernel_m: f64, group: &mut Group) {
        let state = hit.state(knots);
        let attitude = Attitude::of(&state);
        let turned = attitude.rotate(hit.at());
        let placed = Placed::new(hit, &state, &attitude, turned);
        let Look { residual, weight, of_plane } = self.looked(&placed, plane, kernel_m);
        let [flat, tilt] = by_state(&attitude, turned, plane.normal);
        let share = f64::from(hit.share);
        let row = [
            flat.map(|v| (1.0 - share) * v),
            tilt.map(|v| (1.0 - share) * v),
            flat.map(|v| share * v),
            tilt.map(|v| share * v),
            of_plane,
        ];
        group.add(&row, residual, weight);
    }

    /// What a placed beam says of its plane.
    fn looked(&self, placed: &Placed, plane: &Surface, kernel_m: f64) -> Look {
        let residual = plane.distance_m(placed.at_m);
        let across = dot(plane.normal, placed.along);
        let sigma_m = (self.params.sigma_range_m * across).portable_hypot(self.params.sigma_surface_m);
        let weight = robust(residual, f64::max(KERNEL * sigma_m, kernel_m)) / (sigma_m * sigma_m);
        let away = minus(placed.at_m, plane.middle_m);
        let of_plane = [dot(plane.tangents[0], away), dot(plane.tangents[1], away), -1.0];
        Look { residual, weight, of_plane }
    }

    /// How far the beams that were held out are from what explains them, and which of them were sent from the
    /// knots that `is_sloped` marks.
    pub(crate) fn held_out(&self, knots: &Knots, round: &Round, is_sloped: &[bool]) -> HeldOut {
        let span = Span { first: 0, first_free: 0, end: knots.states.len() };
        let (surfaces, _) = self.surfaces(&self.chosen(span, round.thinning, false), knots, &round.search);
        let cost = |&number: &usize| {
            let hit = &self.hits[number];
            let plane = &surfaces.list[surfaces.of(&self.point(knots, hit))? as usize];
            let along = Attitude::of(&hit.state(knots)).rotate(hit.along.map(f64::from));
            let sigma_m = (self.params.sigma_range_m * dot(plane.normal, along))
                .portable_hypot(self.params.sigma_surface_m);
            Some((plane.distance_m(hit.placed(knots)) / sigma_m).powi(2).min(CAP))
        };
        let chosen = self.chosen(span, 1, true);
        let costs: Vec<Option<f64>> = chosen.par_iter().map(cost).collect();
        let costs_of = |laser: Laser, only_sloped: bool| -> Vec<Option<f64>> {
            let is_wanted = |number: usize| {
                let hit = &self.hits[number];
                hit.laser == laser && (is_sloped[hit.knot as usize] || !only_sloped)
            };
            let of = chosen.iter().zip(&costs).filter(|(number, _)| is_wanted(**number));
            of.map(|(_, cost)| *cost).collect()
        };
        let ground = self.floor.held_out(self.hits, knots).map(|squared| Some(squared.min(CAP)));
        HeldOut {
            of_lasers: [Laser::Horizontal, Laser::Vertical].map(|laser| costs_of(laser, false)),
            sloped: [Laser::Horizontal, Laser::Vertical].map(|laser| costs_of(laser, true)),
            ground: ground.collect(),
        }
    }
}

/// How far beams that were held out are from what explains them, squared, in standard deviations, each at
/// most [`CAP`]; `None` where nothing explains a beam.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldOut {
    /// From planes of the other beams: those of the horizontal laser, those of the vertical one.
    pub of_lasers: [Vec<Option<f64>>; 2],
    /// The same of beams from where the ground slopes.
    pub sloped: [Vec<Option<f64>>; 2],
    /// From the ground that the robot drove over later.
    pub ground: Vec<Option<f64>>,
}

impl HeldOut {
    /// All that tell of slopes: what was seen from there, and ground ahead.
    pub(crate) fn of_slopes(&self) -> Vec<Option<f64>> {
        [&self.sloped[0][..], &self.sloped[1], &self.ground].concat()
    }
}

/// The most that one beam costs.
const CAP: f64 = 9.0;

/// A beam in `map`.
struct Placed {
    at_m: [f64; 3],
    along: [f64; 3],
}

impl Placed {
    fn of(hit: &BeamHit, knots: &Knots) -> Self {
        let state = hit.state(knots);
        let attitude = Attitude::of(&state);
        Self::new(hit, &state, &attitude, attitude.rotate(hit.at()))
    }

    /// From a state, with where it hit turned by it.
    fn new(hit: &BeamHit, state: &State, attitude: &Attitude, turned: [f64; 3]) -> Self {
        let at_m = std::array::from_fn(|axis| turned[axis] + state[axis]);
        Self { at_m, along: attitude.rotate(hit.along.map(f64::from)) }
    }
}

/// What a beam says of its plane: how far it is off, how surely, and the derivative by the plane.
struct Look {
    residual: f64,
    weight: f64,
    of_plane: [f64; 3],
}

/// Memory that rounds use one after the other.
#[derive(Default)]
pub(crate) struct Memory {
    groups: Vec<Group>,
}

/// Planes, and which hits lie on them.
struct Prepared {
    planes: Vec<Surface>,
    /// By knot and plane.
    seen: Vec<Seen>,
    /// Of the first ones, whose knots stay.
    placed: Vec<Placed>,
    /// Where the hits of each group end; a zero first.
    ends: Vec<usize>,
    groups: Vec<Group>,
    biases: Biases,
    assembly: Option<Assembly>,
}

fn assembled(layout: Layout, planes: &[Surface], groups: &[Group], rows: &Rows) -> Assembly {
    let is_line: Vec<bool> = planes.iter().map(|plane| plane.is_line).collect();
    Assembly::new(layout, &is_line, groups, rows)
}
