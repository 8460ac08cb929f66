//! Which plane each raw triangle stands for: one, two that meet in a seam, three that meet in a corner, or none.
//!
//! A triangle whose corners are on one plane is a piece of it. One that spans two planes is folded into their common line: the part
//! on each side goes to that side's plane, so that the zig-zag strip between walls disappears and the polygons meet. Frame `map`,
//! metres. Source: the paper, section 3.2, and what it leaves open.

use super::PolygonParams;
use super::frame::foot;
use super::gaps::Gaps;
use super::seam::{corner, distance_m, foot_on_seam};
use crate::model::{Cloud, Mesh, Plane};

/// A flat piece: a convex ring of points on one plane.
pub type Piece = Vec<[f64; 3]>;

/// Raw triangles sorted by what they stand for.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    /// The pieces of each plane.
    pub by_plane: Vec<Vec<Piece>>,
    /// Triangles that stand for no plane.
    pub rest: Vec<usize>,
    /// Triangles that are no surface at all but bridge a gap ([`super::gaps`]).
    pub veils: usize,
}

/// Sorts triangles to planes.
pub struct Assigner<'a> {
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
    pub fn assign(&mut self, mesh: &Mesh) -> Pieces {
        self.snap_to_seams(mesh);
        let gaps = Gaps::new(self.params, self.cloud, mesh, self.labels);
        let mut pieces = Pieces { by_plane: vec![Vec::new(); self.planes.len()], ..Pieces::default() };
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|corner| corner as usize);
            if corners.iter().any(|corner| *corner >= self.labels.len()) {
                continue;
            }
            if let Some(plane) = self.common_plane(corners) {
                pieces.by_plane[plane].push(corners.map(|corner| self.laid_m[corner]).to_vec());
            } else if gaps.is_veil(corners) {
                pieces.veils += 1;
            } else if let Some(found) = self.pieces_of(corners) {
                for (plane, piece) in found {
                    pieces.by_plane[plane].push(piece);
                }
            } else if gaps.is_open(corners) {
                pieces.veils += 1;
            } else {
                pieces.rest.push(index);
            }
        }
        pieces
    }

    fn plane_of(&self, point: usize) -> Option<usize> {
        usize::try_from(self.labels[point]).ok().filter(|plane| *plane < self.planes.len())
    }

    /// Moves points next to a seam, and nearer to it than noise, onto it; those next to two seams onto their corner.
    fn snap_to_seams(&mut self, mesh: &Mesh) {
        let mut near: Vec<[Option<(usize, f64)>; 2]> = vec![[None; 2]; self.labels.len()];
        for triangle in &mesh.triangles {
            let corners = triangle.map(|corner| corner as usize);
            for (from, to) in
                [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)].map(|(i, j)| (corners[i], corners[j]))
            {
                let (Some(a), Some(b)) = (self.plane_of(from), self.plane_of(to)) else { continue };
                if a == b {
                    continue;
                }
                let Some(seam) = foot_on_seam(&self.planes[a], &self.planes[b], self.laid_m[from]) else {
                    continue;
                };
                let off_m = distance_m(seam, self.laid_m[from]);
                if off_m <= self.params.seam_snap_m {
                    remember(&mut near[from], b, off_m);
                }
            }
        }
        for (point, seams) in near.iter().enumerate() {
            let (Some(own), Some((first, _))) = (self.plane_of(point), seams[0]) else { continue };
            let p = self.laid_m[point];
            let line = foot_on_seam(&self.planes[own], &self.planes[first], p);
            let three = seams[1]
                .and_then(|(second, _)| corner(&self.planes[own], &self.planes[first], &self.planes[second]));
            let snapped = three.filter(|x| distance_m(*x, p) <= 2.0 * self.params.seam_snap_m).or(line);
            self.laid_m[point] = snapped.unwrap_or(p);
        }
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

    /// A triangle all of whose corners are near one plane that at least two of them are on: a step too small to model.
    fn flatten(&self, corners: [usize; 3]) -> Option<Vec<(usize, Piece)>> {
        let planes = corners.map(|corner| self.plane_of(corner));
        let plane = (0..3).find_map(|k| planes[k].filter(|_| planes[k] == planes[(k + 1) % 3]))?;
        let points = corners.map(|corner| self.laid_m[corner]);
        let near = points.iter().all(|p| self.planes[plane].distance_m(*p).abs() <= self.params.step_m);
        near.then(|| vec![(plane, points.map(|p| foot(&self.planes[plane], p)).to_vec())])
    }
}

/// Keeps the two nearest different planes.
fn remember(nearest: &mut [Option<(usize, f64)>; 2], plane: usize, off_m: f64) {
    if let Some(known) = nearest.iter_mut().flatten().find(|known| known.0 == plane) {
        known.1 = known.1.min(off_m);
    } else if nearest[0].is_none_or(|first| off_m < first.1) {
        *nearest = [Some((plane, off_m)), nearest[0]];
        return;
    } else if nearest[1].is_none_or(|second| off_m < second.1) {
        nearest[1] = Some((plane, off_m));
    }
    if let [Some(first), Some(second)] = *nearest
        && second.1 < first.1
    {
        *nearest = [Some(second), Some(first)];
    }
}
