//! Which plane each raw triangle stands for: one, two that meet in a seam, three that meet in a corner, or
//! none.
//!
//! A triangle whose corners are on one plane is a piece of it. One that spans two planes is folded into their
//! common line: the part on each side goes to that side's plane, so that the zig-zag strip between walls
//! disappears and the polygons meet. Frame `map`, meters. Source: the paper, section 3.2, and what it leaves
//! open.

use crate::model::{Cloud, Mesh, Plane};
use crate::reconstruct::polygons::params::PolygonParams;
use crate::reconstruct::polygons::plane_frame::foot;
use crate::reconstruct::polygons::seams::plane_intersection::{corner, foot_on_seam};
use crate::reconstruct::polygons::triangles::jump_edges::JumpEdges;
use biplane_geometry::vec3::distance as distance_m;
use std::collections::BTreeSet;

/// A flat piece: a convex ring of points on one plane.
pub(crate) type Piece = Vec<[f64; 3]>;
/// A triangle whose corners all lie on one plane, as indices of points.
pub(crate) type Corners = [u32; 3];

/// Raw triangles sorted by what they stand for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    /// The triangles of each plane.
    pub triangles: Vec<Vec<Corners>>,
    /// What triangles across a border leave to each plane.
    pub rings: Vec<Vec<Piece>>,
    /// Triangles that stand for no plane.
    pub rest: Vec<usize>,
    /// Triangles that are no surface at all but bridge a gap
    /// ([`crate::reconstruct::polygons::triangles::jump_edges`]).
    pub jump_edges: usize,
    /// Pairs of planes that meet somewhere, the smaller index first.
    pub seams: BTreeSet<(usize, usize)>,
}

/// Sorts triangles to planes.
pub(crate) struct Assigner<'a> {
    /// Limits.
    pub params: &'a PolygonParams,
    /// Where points were seen from.
    pub cloud: &'a Cloud,
    /// The planes.
    pub planes: &'a [Plane],
    /// Plane of each point, or -1.
    pub labels: &'a [i32],
    /// Each point on its plane.
    pub laid_m: Vec<[f64; 3]>,
}

impl Assigner<'_> {
    /// Sorts all triangles of a mesh over the cloud's points.
    pub(crate) fn assign(&self, mesh: &Mesh) -> Pieces {
        let gaps = JumpEdges::new(self.params, self.cloud, mesh, self.labels);
        let count = self.planes.len();
        let (triangles, rings) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        let mut pieces = Pieces { triangles, rings, ..Pieces::default() };
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|corner| corner as usize);
            if corners.iter().any(|corner| *corner >= self.labels.len()) {
                continue;
            }
            if let Some(plane) = self.common_plane(corners) {
                pieces.triangles[plane].push(*triangle);
            } else if gaps.is_jump_edge(corners) {
                pieces.jump_edges += 1;
            } else if let Some(found) = self.pieces_of(corners) {
                let planes = || found.iter().map(|(plane, _)| *plane);
                pieces
                    .seams
                    .extend(planes().flat_map(|a| planes().map(move |b| (a, b))).filter(|(a, b)| a < b));
                for (plane, piece) in found {
                    pieces.rings[plane].push(piece);
                }
            } else if gaps.is_open(corners) {
                pieces.jump_edges += 1;
            } else {
                pieces.rest.push(index);
            }
        }
        pieces
    }

    fn plane_of(&self, point: usize) -> Option<usize> {
        usize::try_from(self.labels[point]).ok().filter(|plane| *plane < self.planes.len())
    }

    fn common_plane(&self, [a, b, c]: [usize; 3]) -> Option<usize> {
        self.plane_of(a).filter(|plane| self.plane_of(b) == Some(*plane) && self.plane_of(c) == Some(*plane))
    }

    /// The pieces of planes that a triangle across a border stands for; `None` when it stands for none.
    fn pieces_of(&self, corners: [usize; 3]) -> Option<Vec<(usize, Piece)>> {
        let planes = corners.map(|corner| self.plane_of(corner));
        let [Some(a), Some(b), Some(c)] = planes else { return self.flatten(corners) };
        let pair = (0..3).find(|k| planes[*k] == planes[(k + 1) % 3]);
        let folded = match pair {
            Some(k) => {
                let (next, single) = ((k + 1) % 3, (k + 2) % 3);
                self.fold([corners[k], corners[next]], corners[single], planes[k]?, planes[single]?)
            }
            None => self.fold_corner(corners, [a, b, c]),
        };
        folded.or_else(|| self.flatten(corners))
    }

    /// Two corners on plane `a`, one on plane `b`: each plane gets the part up to their common line.
    fn fold(&self, pair: [usize; 2], single: usize, a: usize, b: usize) -> Option<Vec<(usize, Piece)>> {
        let [p, q, s] = [pair[0], pair[1], single].map(|corner| self.laid_m[corner]);
        let reach_m = self.reach_m([p, q, s]);
        let near = |point| self.near_seam(a, b, point, reach_m);
        let [fp, fq, fs] = [near(p)?, near(q)?, near(s)?];
        Some(vec![(a, vec![p, q, fs]), (b, vec![fp, fq, s])])
    }

    /// Three corners on three planes: each plane gets the part up to its two seams and the common corner.
    fn fold_corner(&self, corners: [usize; 3], planes: [usize; 3]) -> Option<Vec<(usize, Piece)>> {
        let [a, b, c] = planes.map(|plane| &self.planes[plane]);
        let common = corner(a, b, c)?;
        let reach_m = self.reach_m(corners.map(|corner| self.laid_m[corner]));
        let mut found = Vec::new();
        for k in 0..3 {
            let (own, next, last) = (k, (k + 1) % 3, (k + 2) % 3);
            let p = self.laid_m[corners[own]];
            if distance_m(common, p) > reach_m {
                return None;
            }
            let to_next = self.near_seam(planes[own], planes[next], p, reach_m)?;
            let to_last = self.near_seam(planes[own], planes[last], p, reach_m)?;
            found.push((planes[own], vec![p, to_next, common]));
            found.push((planes[own], vec![p, common, to_last]));
        }
        Some(found)
    }

    /// How far a triangle may be extended: no further than it is long.
    fn reach_m(&self, [a, b, c]: [[f64; 3]; 3]) -> f64 {
        let longest_m = distance_m(a, b).max(distance_m(b, c)).max(distance_m(c, a));
        longest_m.min(self.params.seam_reach_m)
    }

    fn near_seam(&self, a: usize, b: usize, p: [f64; 3], reach_m: f64) -> Option<[f64; 3]> {
        let seam = foot_on_seam(&self.planes[a], &self.planes[b], p)?;
        (distance_m(seam, p) <= reach_m).then_some(seam)
    }

    /// A triangle all of whose corners are near one plane that at least two of them are on: a step too small
    /// to model. When the third is on a plane of its own, the border runs half way to it: through the tips of
    /// triangles it would be a saw.
    fn flatten(&self, corners: [usize; 3]) -> Option<Vec<(usize, Piece)>> {
        let planes = corners.map(|corner| self.plane_of(corner));
        let pair = (0..3).find(|k| planes[*k].is_some() && planes[*k] == planes[(k + 1) % 3])?;
        let (own, other) = (planes[pair]?, planes[(pair + 2) % 3]);
        let [p, q, s] = [0, 1, 2].map(|k| self.laid_m[corners[(pair + k) % 3]]);
        let on = |plane: usize, points: &[[f64; 3]]| {
            (plane, points.iter().map(|p| foot(&self.planes[plane], *p)).collect::<Piece>())
        };
        if self.planes[own].distance_m(s).abs() > self.params.step_m {
            return None;
        }
        let half = |a: [f64; 3]| std::array::from_fn(|k| 0.5 * (a[k] + s[k]));
        Some(match other {
            Some(other) if other != own => {
                vec![on(own, &[p, q, half(q), half(p)]), on(other, &[half(p), half(q), s])]
            }
            _ => vec![on(own, &[p, q, s])],
        })
    }
}
