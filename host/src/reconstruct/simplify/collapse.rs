//! Edges of a mesh that collapse to a vertex each, those first that cost the least quadric error.
//!
//! In passes: the errors of all edges, in order, and of those that touch no vertex which has moved in this
//! pass the cheapest collapse. Then the edges are found anew. Passes need no queue and count their errors on
//! all threads; the result is that of one. Meters.

use super::quadric::{Quadric, Vec3, minus};
use super::rings::{Edge, Rings};
use crate::model::Mesh;
use biplane_geometry::vec3::{cross, dot};
use rayon::prelude::*;

/// How strongly borders stay where they are, against surfaces of the square of their length. Larger: fewer
/// triangles are left for the surfaces. Smaller: borders fray.
const BORDER_WEIGHT: f64 = 10.0;
/// A triangle that turns by more than this (cosine; 75 degrees) has folded over.
const MIN_COSINE: f64 = 0.25;
/// A pass stops at so many times the error that its count of edges in order would reach: what was skipped is
/// cheaper in the next.
const REACH: f64 = 1.5;

/// How a mesh is simplified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rules {
    /// Vertices go where the error is least, and borders move; otherwise every vertex is an old one and
    /// borders stay.
    pub is_free: bool,
    /// No further than to so many triangles.
    pub triangles: usize,
    /// No collapse with a larger error, meters: root of the mean square over the surfaces that a vertex
    /// stands for.
    pub error_m: f64,
}

/// The mesh with fewer triangles, without those that have no place.
pub(crate) fn collapse(mesh: &Mesh, rules: &Rules) -> Mesh {
    let mut work = Work::new(mesh);
    let mut price = Price::Sound;
    while work.triangles.len() > rules.triangles {
        if work.pass(rules, price) > 0 {
            continue;
        }
        // The count is asked for at any price, a bound on the error is not.
        price = match price {
            Price::Sound if rules.error_m.is_infinite() => Price::Folded,
            Price::Folded => Price::OneTooMany,
            _ => break,
        };
    }
    work.finish()
}

/// What a collapse may cost beside its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Price {
    /// Nothing: no triangle folds over, and no more triangles go than have to.
    Sound,
    /// Triangles may fold over.
    Folded,
    /// One triangle more than has to may go as well, where every edge has two.
    OneTooMany,
}

/// A mesh while edges collapse.
struct Work {
    places_m: Vec<Vec3>,
    quadrics: Vec<Quadric>,
    triangles: Vec<[u32; 3]>,
}

/// An edge that may collapse: the vertex that stays, and the one that goes.
#[derive(Clone, Copy)]
struct Candidate {
    error: f64,
    ends: [u32; 2],
}

impl Work {
    fn new(mesh: &Mesh) -> Self {
        let finite = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
        let has_place = |corner: &u32| mesh.vertices_m.get(*corner as usize).is_some_and(finite);
        let is_sound = |t: &&[u32; 3]| t.iter().all(has_place) && differ(**t);
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(is_sound).copied().collect();
        let places_m: Vec<Vec3> = mesh.vertices_m.iter().map(|p| p.map(f64::from)).collect();
        let mut quadrics = vec![Quadric::default(); places_m.len()];
        let mut add = |corners: &[u32], quadric: &Quadric| {
            for corner in corners {
                let sum = &mut quadrics[*corner as usize];
                *sum = sum.plus(quadric);
            }
        };
        let place = |corner: u32| places_m[corner as usize];
        for triangle in &triangles {
            add(triangle, &Quadric::of_triangle(triangle.map(place)));
        }
        for edge in Rings::new(places_m.len(), &triangles).edges(&triangles) {
            let across = triangles[edge.triangle as usize].into_iter().find(|c| !edge.ends.contains(c));
            if let (1, Some(across)) = (edge.triangles, across) {
                let [one, other] = edge.ends;
                add(&edge.ends, &Quadric::of_border([one, other, across].map(place), BORDER_WEIGHT));
            }
        }
        Self { places_m, quadrics, triangles }
    }

    /// Collapses many edges that do not meet; gives how many.
    fn pass(&mut self, rules: &Rules, price: Price) -> usize {
        let rings = Rings::new(self.places_m.len(), &self.triangles);
        let candidates = self.candidates(&rings.edges(&self.triangles), rules);
        let excess = self.triangles.len() - rules.triangles;
        let mut pass = Pass {
            rings: &rings,
            becomes: (0..self.places_m.len() as u32).collect(),
            is_touched: vec![false; self.places_m.len()],
            is_free: rules.is_free,
            price,
        };
        let (mut collapsed, mut gone) = (0, 0);
        // An edge takes one or two triangles. At the end the cheapest may take one too many: then all are
        // tried.
        let tried = if excess <= 2 { candidates.len() } else { excess.div_ceil(2) };
        for candidate in cheapest(candidates, tried) {
            if gone >= excess {
                break;
            }
            if let Some(triangles) = pass.collapse(self, candidate.ends, excess - gone) {
                collapsed += 1;
                gone += triangles;
            }
        }
        for triangle in &mut self.triangles {
            *triangle = triangle.map(|corner| pass.becomes[corner as usize]);
        }
        self.triangles.retain(|triangle| differ(*triangle));
        collapsed
    }

    fn candidates(&self, edges: &[Edge], rules: &Rules) -> Vec<Candidate> {
        let mut stays = vec![false; self.places_m.len()];
        if !rules.is_free {
            for edge in edges.iter().filter(|edge| edge.triangles != 2) {
                edge.ends.iter().for_each(|end| stays[*end as usize] = true);
            }
        }
        let maximum = rules.error_m * rules.error_m;
        let candidate = |edge: &Edge| {
            let [one, other] = edge.ends;
            let sum = self.quadrics[one as usize].plus(&self.quadrics[other as usize]);
            let place = |end: u32| self.places_m[end as usize];
            let found = if rules.is_free {
                Candidate { error: sum.minimum(place(one), place(other)).1, ends: edge.ends }
            } else {
                let to = |keep: u32, drop: u32| {
                    (!stays[drop as usize])
                        .then(|| Candidate { error: sum.at(place(keep)), ends: [keep, drop] })
                };
                let both = [to(one, other), to(other, one)].into_iter().flatten();
                both.min_by(|a, b| a.error.total_cmp(&b.error))?
            };
            (found.error <= maximum * sum.area_m2 || maximum.is_infinite()).then_some(found)
        };
        edges.par_iter().filter_map(candidate).collect()
    }

    /// The triangles that are left, without vertices that none names.
    fn finish(self) -> Mesh {
        without_unused_vertices(&self.places_m, self.triangles)
    }
}

/// The candidates that a pass tries, in the order of their errors, so that it may collapse `count` of them.
fn cheapest(mut candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let order = |a: &Candidate, b: &Candidate| a.error.total_cmp(&b.error).then(a.ends.cmp(&b.ends));
    if count < candidates.len() {
        let reached = candidates.select_nth_unstable_by(count, order).1.error;
        candidates.retain(|candidate| candidate.error <= REACH * reached);
    }
    candidates.par_sort_unstable_by(order);
    candidates
}

/// What a pass has done.
struct Pass<'a> {
    rings: &'a Rings,
    /// The vertex that each one is now.
    becomes: Vec<u32>,
    is_touched: Vec<bool>,
    is_free: bool,
    price: Price,
}

impl Pass<'_> {
    /// Collapses an edge and gives how many triangles that takes; `None` when it cannot, or when that were
    /// more than `most`.
    fn collapse(&mut self, work: &mut Work, [keep, drop]: [u32; 2], maximum: usize) -> Option<usize> {
        if self.is_touched[keep as usize] || self.is_touched[drop as usize] {
            return None;
        }
        let sum = work.quadrics[keep as usize].plus(&work.quadrics[drop as usize]);
        let [from, other] = [keep, drop].map(|end| work.places_m[end as usize]);
        let to = if self.is_free { sum.minimum(from, other).0 } else { from };
        let folds = |end: u32| self.price == Price::Sound && self.folds(work, [keep, drop], end, to);
        if folds(keep) || folds(drop) {
            return None;
        }
        let about = self.rings.of(drop).iter().map(|index| self.now(work, *index));
        let gone = about.filter(|triangle| differ(*triangle) && triangle.contains(&keep)).count();
        if gone > maximum && self.price != Price::OneTooMany {
            return None;
        }
        work.places_m[keep as usize] = to;
        work.quadrics[keep as usize] = sum;
        self.becomes[drop as usize] = keep;
        self.is_touched[keep as usize] = true;
        self.is_touched[drop as usize] = true;
        Some(gone)
    }

    /// A triangle as it is now.
    fn now(&self, work: &Work, index: u32) -> [u32; 3] {
        work.triangles[index as usize].map(|corner| self.becomes[corner as usize])
    }

    /// Whether a triangle that stays folds over when this end of an edge goes to a place.
    fn folds(&self, work: &Work, ends: [u32; 2], end: u32, to: Vec3) -> bool {
        let place = |corner: u32| work.places_m[corner as usize];
        self.rings.of(end).iter().any(|index| {
            let triangle = self.now(work, *index);
            if ends.iter().all(|end| triangle.contains(end)) || !differ(triangle) {
                return false;
            }
            let before = normal(triangle.map(place));
            let after = normal(triangle.map(|corner| if corner == end { to } else { place(corner) }));
            let lengths = (dot(before, before) * dot(after, after)).sqrt();
            dot(before, before) > 0.0 && dot(before, after) <= MIN_COSINE * lengths
        })
    }
}

fn normal([p, q, r]: [Vec3; 3]) -> Vec3 {
    cross(minus(q, p), minus(r, p))
}

/// Whether a triangle has three corners.
fn differ([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Leaves out the vertices that no triangle names.
fn without_unused_vertices(vertices_m: &[[f64; 3]], mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut new_of = vec![u32::MAX; vertices_m.len()];
    let mut kept_m = Vec::new();
    for corner in triangles.as_flattened_mut() {
        let new = &mut new_of[*corner as usize];
        if *new == u32::MAX {
            *new = kept_m.len() as u32;
            kept_m.push(vertices_m[*corner as usize].map(|v| v as f32));
        }
        *corner = *new;
    }
    Mesh { vertices_m: kept_m, triangles }
}

#[cfg(test)]
mod tests {
    use super::{Rules, collapse};
    use crate::metrics::surface_distance::Surface;
    use crate::model::Mesh;
    use crate::reconstruct::planes::paper::random::Random;
    use std::collections::BTreeMap;

    const TO_TWELVE: Rules = Rules { is_free: true, triangles: 12, error_m: f64::INFINITY };

    /// A box with edges of 1 m, each side cut into `side` x `side` squares, moved by up to `noise_m`.
    fn cube(side: u32, noise_m: f32) -> Mesh {
        let mut mesh = Mesh::default();
        let mut known: BTreeMap<[u32; 3], u32> = BTreeMap::new();
        let mut random = Random::new(7);
        for (axis, far) in (0..3).flat_map(|axis| [(axis, 0), (axis, side)]) {
            let mut corner = |u: u32, v: u32| {
                let mut at = [far, u, v];
                at.rotate_right(axis);
                *known.entry(at).or_insert_with(|| {
                    let place = at.map(|v| v as f32 / side as f32 + noise_m * (random.unit() as f32 - 0.5));
                    mesh.vertices_m.push(place);
                    mesh.vertices_m.len() as u32 - 1
                })
            };
            for (u, v) in (0..side).flat_map(|u| (0..side).map(move |v| (u, v))) {
                let [a, b, c, d] = [corner(u, v), corner(u + 1, v), corner(u + 1, v + 1), corner(u, v + 1)];
                let both = [[a, b, c], [a, c, d]];
                mesh.triangles.extend(both.map(|[p, q, r]| if far == 0 { [p, r, q] } else { [p, q, r] }));
            }
        }
        mesh
    }

    #[test]
    fn a_box_of_many_triangles_becomes_the_twelve_of_its_corners() {
        let simple = collapse(&cube(16, 0.0), &TO_TWELVE);
        assert_eq!((simple.triangles.len(), simple.vertices_m.len()), (12, 8));
        for v in simple.vertices_m.as_flattened() {
            assert!(v.abs().min((v - 1.0).abs()) < 1e-4, "{:?}", simple.vertices_m);
        }
    }

    #[test]
    fn a_rough_box_keeps_its_sides_within_twice_the_roughness() {
        let rough = cube(16, 0.02);
        let simple = collapse(&rough, &Rules { triangles: 40, ..TO_TWELVE });
        let surface = Surface::new(&simple);
        let squared = |p: &[f32; 3]| surface.distance_m(p.map(f64::from)).powi(2);
        let mean = rough.vertices_m.iter().map(squared).sum::<f64>() / rough.vertices_m.len() as f64;
        // Even noise of this width deviates by a twelfth's root of it.
        let deviation_m = 0.02 / 12.0_f64.sqrt();
        assert!(mean.sqrt() < 2.0 * deviation_m, "{}", mean.sqrt());
    }

    #[test]
    fn any_number_of_threads_gives_the_same_mesh() {
        let rough = cube(40, 0.03);
        let rules = Rules { triangles: 700, ..TO_TWELVE };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| collapse(&rough, &rules))
        };
        let alone = on(1);
        assert_eq!(alone.triangles.len(), rules.triangles);
        assert_eq!(alone, on(3));
    }

    #[test]
    fn no_triangle_of_a_rough_box_is_turned_inside_out() {
        let simple = collapse(&cube(24, 0.02), &Rules { triangles: 300, ..TO_TWELVE });
        assert!(simple.triangles.len() <= 300 && simple.triangles.len() > 290);
        for t in &simple.triangles {
            let [a, b, c] = t.map(|k| simple.vertices_m[k as usize].map(|v| f64::from(v) - 0.5));
            let outward = super::dot(super::normal([a, b, c]), a);
            assert!(outward > 0.0, "{:?}", [a, b, c]);
        }
    }
}
