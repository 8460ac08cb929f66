//! Vectors and placements. Units of the file.

/// A point or vector.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: Vec3, by: f64) -> Vec3 {
    a.map(|value| value * by)
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Of length 1; none for a vector without length.
pub(crate) fn unit(a: Vec3) -> Option<Vec3> {
    let length = norm(a);
    (length > 1e-12 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// Axes and an origin: takes coordinates in it to those around it. Axes may be scaled or mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    /// Its axes.
    pub axes: [Vec3; 3],
    /// Its origin.
    pub origin: Vec3,
}

impl Placement {
    pub(crate) const IDENTITY: Self =
        Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin: [0.0; 3] };

    /// Of an origin, a z axis and a direction near the x axis, as IFC states them.
    pub(crate) fn new(origin: Vec3, axis: Vec3, reference: Vec3) -> Self {
        let z = unit(axis).unwrap_or([0.0, 0.0, 1.0]);
        let along = |near: Vec3| unit(sub(near, scale(z, dot(near, z))));
        let x = along(reference).or_else(|| along([1.0, 0.0, 0.0])).or_else(|| along([0.0, 1.0, 0.0]));
        let x = x.unwrap_or([1.0, 0.0, 0.0]);
        Self { axes: [x, cross(z, x), z], origin }
    }

    pub(crate) fn vector(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        add(add(scale(x, v[0]), scale(y, v[1])), scale(z, v[2]))
    }

    pub(crate) fn point(&self, p: Vec3) -> Vec3 {
        add(self.vector(p), self.origin)
    }

    /// First the inner placement, then this one.
    pub(crate) fn after(&self, inner: &Self) -> Self {
        Self { axes: inner.axes.map(|axis| self.vector(axis)), origin: self.point(inner.origin) }
    }

    /// Whether it turns bodies inside out.
    pub(crate) fn is_mirrored(&self) -> bool {
        dot(cross(self.axes[0], self.axes[1]), self.axes[2]) < 0.0
    }
}
