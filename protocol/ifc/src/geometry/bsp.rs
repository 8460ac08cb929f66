//! Bodies minus bodies, by trees of planes (Naylor, Amanatides, Thibault 1990).
//!
//! A body is a set of convex faces that look outward. Each face of one is cut by the planes of the other, and
//! what lies in the wrong place is left away.

use crate::geometry::mesh::Triangle;
use crate::geometry::vector::{Vec3, add, cross, dot, scale, sub, unit};

/// Bodies with more faces than this are not cut: a tree of them may be as deep as it has faces.
pub(crate) const MAX_FACES: usize = 3000;

#[derive(Clone, Debug)]
struct Face {
    corners: Vec<Vec3>,
    normal: Vec3,
    offset: f64,
}

impl Face {
    fn new(triangle: &Triangle) -> Option<Self> {
        let [a, b, c] = *triangle;
        let normal = unit(cross(sub(b, a), sub(c, a)))?;
        Some(Self { corners: triangle.to_vec(), normal, offset: dot(normal, a) })
    }

    fn flip(&mut self) {
        self.corners.reverse();
        self.normal = scale(self.normal, -1.0);
        self.offset = -self.offset;
    }
}

/// Where the faces of a set lie to a plane.
#[derive(Default)]
struct Sides {
    same: Vec<Face>,
    opposite: Vec<Face>,
    front: Vec<Face>,
    back: Vec<Face>,
}

#[derive(Default)]
struct Node {
    plane: Option<(Vec3, f64)>,
    front: Option<Box<Node>>,
    back: Option<Box<Node>>,
    faces: Vec<Face>,
}

/// What is cut with what precision: points this near to a plane lie on it.
fn split(plane: (Vec3, f64), face: Face, near: f64, sides: &mut Sides) {
    let (normal, offset) = plane;
    let off: Vec<f64> = face.corners.iter().map(|corner| dot(normal, *corner) - offset).collect();
    let is_front = off.iter().any(|d| *d > near);
    let is_back = off.iter().any(|d| *d < -near);
    match (is_front, is_back) {
        (false, false) if dot(normal, face.normal) > 0.0 => sides.same.push(face),
        (false, false) => sides.opposite.push(face),
        (true, false) => sides.front.push(face),
        (false, true) => sides.back.push(face),
        (true, true) => {
            let (mut front, mut back) = (Vec::new(), Vec::new());
            for k in 0..off.len() {
                let next = (k + 1) % off.len();
                let (a, b) = (face.corners[k], face.corners[next]);
                if off[k] >= -near {
                    front.push(a);
                }
                if off[k] <= near {
                    back.push(a);
                }
                if (off[k] > near && off[next] < -near) || (off[k] < -near && off[next] > near) {
                    let at = add(a, scale(sub(b, a), off[k] / (off[k] - off[next])));
                    front.push(at);
                    back.push(at);
                }
            }
            let piece = |corners: Vec<Vec3>| Face { corners, ..face.clone() };
            let (front, back) = (piece(front), piece(back));
            sides.front.extend(Some(front).filter(|f| f.corners.len() > 2));
            sides.back.extend(Some(back).filter(|f| f.corners.len() > 2));
        }
    }
}

impl Node {
    fn build(&mut self, faces: Vec<Face>, near: f64) {
        let Some(first) = faces.first() else { return };
        let plane = *self.plane.get_or_insert((first.normal, first.offset));
        let mut sides = Sides::default();
        for face in faces {
            split(plane, face, near, &mut sides);
        }
        self.faces.append(&mut sides.same);
        self.faces.append(&mut sides.opposite);
        if !sides.front.is_empty() {
            self.front.get_or_insert_default().build(sides.front, near);
        }
        if !sides.back.is_empty() {
            self.back.get_or_insert_default().build(sides.back, near);
        }
    }

    fn invert(&mut self) {
        self.faces.iter_mut().for_each(Face::flip);
        self.plane = self.plane.map(|(normal, offset)| (scale(normal, -1.0), -offset));
        std::mem::swap(&mut self.front, &mut self.back);
        for child in [&mut self.front, &mut self.back].into_iter().flatten() {
            child.invert();
        }
    }

    /// The parts of faces outside of this body.
    fn outside(&self, faces: Vec<Face>, near: f64) -> Vec<Face> {
        let Some(plane) = self.plane else { return faces };
        let mut sides = Sides::default();
        for face in faces {
            split(plane, face, near, &mut sides);
        }
        sides.front.append(&mut sides.same);
        sides.back.append(&mut sides.opposite);
        let mut kept = match &self.front {
            Some(front) => front.outside(sides.front, near),
            None => sides.front,
        };
        if let Some(back) = &self.back {
            kept.extend(back.outside(sides.back, near));
        }
        kept
    }

    fn clip_to(&mut self, other: &Self, near: f64) {
        self.faces = other.outside(std::mem::take(&mut self.faces), near);
        for child in [&mut self.front, &mut self.back].into_iter().flatten() {
            child.clip_to(other, near);
        }
    }

    fn collect(&mut self, faces: &mut Vec<Face>) {
        faces.append(&mut self.faces);
        for child in [&mut self.front, &mut self.back].into_iter().flatten() {
            child.collect(faces);
        }
    }
}

fn tree(body: &[Triangle], near: f64) -> Node {
    let mut node = Node::default();
    node.build(body.iter().filter_map(Face::new).collect(), near);
    node
}

/// What of a body is not in another; the body itself when one of them is too large.
pub(crate) fn difference(body: &[Triangle], other: &[Triangle], near: f64) -> Vec<Triangle> {
    if other.is_empty() || body.len().max(other.len()) > MAX_FACES || !meet(body, other) {
        return body.to_vec();
    }
    let (mut a, mut b) = (tree(body, near), tree(other, near));
    a.invert();
    a.clip_to(&b, near);
    b.clip_to(&a, near);
    b.invert();
    b.clip_to(&a, near);
    b.invert();
    let mut faces = Vec::new();
    b.collect(&mut faces);
    a.collect(&mut faces);
    faces.iter_mut().for_each(Face::flip);
    faces.iter().flat_map(triangles).collect()
}

/// What two bodies share.
pub(crate) fn intersection(body: &[Triangle], other: &[Triangle], near: f64) -> Vec<Triangle> {
    if body.is_empty() || other.is_empty() || body.len().max(other.len()) > MAX_FACES {
        return Vec::new();
    }
    let (mut a, mut b) = (tree(body, near), tree(other, near));
    a.invert();
    b.clip_to(&a, near);
    b.invert();
    a.clip_to(&b, near);
    b.clip_to(&a, near);
    let mut faces = Vec::new();
    a.collect(&mut faces);
    b.collect(&mut faces);
    faces.iter_mut().for_each(Face::flip);
    faces.iter().flat_map(triangles).collect()
}

fn triangles(face: &Face) -> impl Iterator<Item = Triangle> + '_ {
    face.corners.windows(2).skip(1).map(|pair| [face.corners[0], pair[0], pair[1]])
}

fn meet(body: &[Triangle], other: &[Triangle]) -> bool {
    let bound = |body: &[Triangle], axis: usize| {
        let values = body.iter().flatten().map(|corner| corner[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    (0..3).all(|axis| {
        let ([low, high], [other_low, other_high]) = (bound(body, axis), bound(other, axis));
        low <= other_high && other_low <= high
    })
}

#[cfg(test)]
mod tests {
    use super::{Triangle, difference, intersection};
    use crate::geometry::mesh::face;
    use crate::geometry::swept::{extrude, volume};
    use crate::geometry::vector::Placement;

    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
        let ring = vec![
            [low[0], low[1], low[2]],
            [high[0], low[1], low[2]],
            [high[0], high[1], low[2]],
            [low[0], high[1], low[2]],
        ];
        extrude(&[ring], &Placement::IDENTITY, [0.0, 0.0, high[2] - low[2]])
    }

    #[test]
    fn an_opening_flush_with_both_faces_of_its_wall_takes_its_volume_away() {
        let wall = cuboid([0.0, 0.0, 0.0], [4.0, 0.3, 2.5]);
        let door = cuboid([1.0, 0.0, 0.0], [2.0, 0.3, 2.0]);
        assert!((volume(&wall) - 3.0).abs() < 1e-9);
        let cut = difference(&wall, &door, 1e-5);
        assert!((volume(&cut) - 2.4).abs() < 1e-9, "{}", volume(&cut));
        let window = cuboid([2.5, -0.1, 0.9], [3.5, 0.5, 2.1]);
        let cut = difference(&cut, &window, 1e-5);
        assert!((volume(&cut) - (2.4 - 0.3 * 1.2)).abs() < 1e-9, "{}", volume(&cut));
        assert!((volume(&intersection(&wall, &window, 1e-5)) - 0.36).abs() < 1e-9);
        assert!(face(&[]).is_empty());
    }

    #[test]
    fn bodies_that_do_not_meet_stay_as_they_are() {
        let (a, b) = (cuboid([0.0; 3], [1.0; 3]), cuboid([2.0; 3], [3.0; 3]));
        assert_eq!(difference(&a, &b, 1e-5), a);
        assert!(volume(&intersection(&a, &b, 1e-5)).abs() < 1e-12);
    }
}
