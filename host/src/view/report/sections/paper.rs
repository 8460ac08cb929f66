//! What the paper says of its two experiments (section 4).

/// One of them; `None` where the paper does not say.
pub(crate) struct Experiment {
    /// What was driven.
    pub name: &'static str,
    /// 3D points.
    pub points: Option<usize>,
    /// Triangles of the raw mesh.
    pub triangles: usize,
    /// Polygons of the model.
    pub polygons: Option<usize>,
    /// Triangles on no plane.
    pub leftovers: Option<usize>,
    /// Polygons and triangles together.
    pub surfaces: usize,
    /// How much smaller the model is, percent.
    pub reduction_percent: f64,
    /// Time to compute it.
    pub time: &'static str,
}

/// A corridor, and a building from outside.
pub(crate) const EXPERIMENTS: [Experiment; 2] = [
    Experiment {
        name: "corridor, 10 m",
        points: Some(82_592),
        triangles: 163_336,
        polygons: Some(868),
        leftovers: Some(24_996),
        surfaces: 868 + 24_996,
        reduction_percent: 84.0,
        time: "6 h, planes alone",
    },
    Experiment {
        name: "building, 40 × 70 m",
        points: None,
        triangles: 800_869,
        polygons: None,
        leftovers: None,
        surfaces: 474_921,
        reduction_percent: 40.7,
        time: "10 h",
    },
];
