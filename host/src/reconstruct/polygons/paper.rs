//! The paper's own merging: "two polygons are merged if they share exactly one sequence of edges", repeated
//! until nothing merges.
//!
//! What it makes has no holes: round a window the last two polygons share two sequences of edges and stay
//! two. It starts from the triangles of the finished polygons, so the area, the straight borders and the
//! corners shared with neighbors are those of the default. Source: the paper, section 3.2.

use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::triangulate::triangulate;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// The polygons without holes that the paper's rule makes of these. Those without a hole stay as they are.
pub(crate) fn without_holes(planes: &[Plane], polygons: Vec<PlanarPolygon>) -> Vec<PlanarPolygon> {
    let parts: Vec<Vec<PlanarPolygon>> = polygons
        .into_par_iter()
        .map(|polygon| if polygon.holes_m.is_empty() { vec![polygon] } else { cut(planes, &polygon) })
        .collect();
    parts.into_iter().flatten().collect()
}

fn cut(planes: &[Plane], polygon: &PlanarPolygon) -> Vec<PlanarPolygon> {
    let flat = triangulate(&planes[polygon.plane], polygon);
    let rings = merge(flat.triangles.iter().map(|triangle| triangle.to_vec()).collect());
    let part = |ring: Vec<u32>| PlanarPolygon {
        plane: polygon.plane,
        outer_m: ring.iter().map(|corner| flat.vertices_m[*corner as usize]).collect(),
        holes_m: Vec::new(),
    };
    rings.into_iter().map(part).collect()
}

/// Merges rings of vertex numbers, all going round the same way, until no two share exactly one sequence of
/// edges.
fn merge(mut rings: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let mut owner: HashMap<(u32, u32), usize> = HashMap::new();
    for (index, ring) in rings.iter().enumerate() {
        owner.extend(edges(ring).map(|edge| (edge, index)));
    }
    // What a ring could not be merged with before may become possible: a neighbor that touched in two places
    // has been taken in since.
    let mut changed = true;
    while changed {
        changed = false;
        for index in 0..rings.len() {
            while let Some((other, merged)) = partner(index, &rings, &owner) {
                owner.extend(edges(&merged).map(|edge| (edge, index)));
                rings[index] = merged;
                rings[other].clear();
                changed = true;
            }
        }
    }
    rings.retain(|ring| !ring.is_empty());
    rings
}

fn edges(ring: &[u32]) -> impl Iterator<Item = (u32, u32)> {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

/// The first neighbor of a ring that it may be merged with, and what both become.
fn partner(
    index: usize,
    rings: &[Vec<u32>],
    owner: &HashMap<(u32, u32), usize>,
) -> Option<(usize, Vec<u32>)> {
    let mut tried = vec![index];
    for (a, b) in edges(&rings[index]) {
        let Some(&other) = owner.get(&(b, a)) else { continue };
        if tried.contains(&other) {
            continue;
        }
        tried.push(other);
        if let Some(merged) = merged(&rings[index], &rings[other]) {
            return Some((other, merged));
        }
    }
    None
}

/// Two rings as one, when they share exactly one sequence of edges and touch nowhere else.
fn merged(a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
    let of_b: HashSet<(u32, u32)> = edges(b).collect();
    let shared: Vec<bool> = edges(a).map(|(p, q)| of_b.contains(&(q, p))).collect();
    let count = a.len();
    let starts: Vec<usize> =
        (0..count).filter(|index| shared[*index] && !shared[(index + count - 1) % count]).collect();
    let &[start] = starts.as_slice() else { return None };
    let length = shared.iter().filter(|shared| **shared).count();
    let corners: HashSet<u32> = b.iter().copied().collect();
    if a.iter().filter(|corner| corners.contains(corner)).count() != length + 1 {
        return None;
    }
    // Round `a` from the end of the sequence to its start, then round `b` from there to the end.
    let (first, last) = (a[start], a[(start + length) % count]);
    let mut ring: Vec<u32> = (0..count - length).map(|k| a[(start + length + k) % count]).collect();
    let at = b.iter().position(|corner| *corner == first)?;
    ring.extend((0..b.len()).map(|k| b[(at + k) % b.len()]).take_while(|corner| *corner != last));
    Some(ring)
}

#[cfg(test)]
mod tests {
    use super::{edges, merge, merged, without_holes};
    use crate::model::{PlanarPolygon, Plane};
    use crate::reconstruct::polygons::validate;
    use biplane_geometry::vec3::cross;
    use biplane_geometry::vec3::dot;

    const WALL: Plane = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 3, rms_m: 0.0 };

    fn area_m2(polygon: &PlanarPolygon) -> f64 {
        let first = polygon.outer_m[0];
        let side = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] - first[k]);
        let twice = |pair: &[[f64; 3]]| dot(cross(side(pair[0]), side(pair[1])), WALL.normal);
        0.5 * polygon.outer_m.windows(2).map(twice).sum::<f64>()
    }

    #[test]
    fn a_wall_with_two_windows_becomes_a_few_polygons_without_holes_of_the_same_area() {
        let on_wall = |corners: &[(f64, f64)]| corners.iter().map(|(x, z)| [*x, 1.0, *z]).collect::<Vec<_>>();
        let window = |x: f64| on_wall(&[(x, 1.0), (x, 2.0), (x + 1.0, 2.0), (x + 1.0, 1.0)]);
        let wall = PlanarPolygon {
            plane: 0,
            outer_m: on_wall(&[(0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (0.0, 3.0)]),
            holes_m: vec![window(1.0), window(4.0)],
        };
        let plain = PlanarPolygon { holes_m: Vec::new(), ..wall.clone() };
        let parts = without_holes(&[WALL], vec![wall, plain.clone()]);
        assert_eq!(parts.last(), Some(&plain));
        let parts = &parts[..parts.len() - 1];
        assert!((2..=4).contains(&parts.len()), "{parts:?}");
        for part in parts {
            assert_eq!(validate::check(part, &WALL), Ok(()));
            assert!(part.holes_m.is_empty());
        }
        assert!((parts.iter().map(area_m2).sum::<f64>() - 16.0).abs() < 1e-9);
        // Nothing more may be merged, by trying all pairs.
        let key = |p: &[f64; 3]| (p[0] * 10.0) as u32 * 1000 + (p[2] * 10.0) as u32;
        let rings: Vec<Vec<u32>> = parts.iter().map(|part| part.outer_m.iter().map(key).collect()).collect();
        for (a, b) in rings.iter().flat_map(|a| rings.iter().map(move |b| (a, b))) {
            assert!(a == b || merged(a, b).is_none());
        }
    }

    #[test]
    fn two_sequences_or_a_corner_elsewhere_are_not_merged() {
        // A ring of four quads round the square 4 5 6 7: three of them merge, the last would close the ring.
        let frame = vec![vec![0, 1, 5, 4], vec![1, 2, 6, 5], vec![2, 3, 7, 6], vec![3, 0, 4, 7]];
        let left = merge(frame);
        assert_eq!(left.iter().map(Vec::len).collect::<Vec<_>>(), [8, 4]);
        assert_eq!(merge(vec![vec![0, 1, 2], vec![0, 2, 3]]).len(), 1);
        // Both have corner 9, which is not on the shared edge.
        assert_eq!(merged(&[0, 1, 2, 9], &[2, 1, 5, 9, 6]), None);
        assert_eq!(edges(&[1, 2, 3]).last(), Some((3, 1)));
    }
}
