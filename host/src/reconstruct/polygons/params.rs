//! How triangles of one plane become polygons: the parameters.

use serde::Serialize;

/// Which polygons of one plane become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Merging {
    /// All that hang together: one wall, one polygon, its doors and windows holes of it.
    #[default]
    Holes,
    /// Two that share exactly one sequence of edges, as in the paper (`paper`): no holes, more polygons.
    Paper,
}

/// How triangles of one plane become polygons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolygonParams {
    /// Which polygons of one plane become one.
    pub merging: Merging,
    /// A border may move by this much when it is straightened, meters. Larger: fewer corners. Smaller: noisy
    /// borders.
    pub border_tolerance_m: f64,
    /// Openings smaller than this are closed, square meters. Larger: windows close. Smaller: pinholes of
    /// noise stay.
    pub min_hole_m2: f64,
    /// Polygons smaller than this are dropped once pieces that only a slit parts are one, square meters.
    /// Larger: small faces get lost. Smaller: flakes of noise stay.
    pub min_polygon_m2: f64,
    /// Gaps within a plane narrower than this are closed, meters, and corners that turn back are taken off; 0
    /// leaves both as they are. Points at a resolution of one degree are this far apart at 5 m. Larger: gaps
    /// between things that stand side by side vanish. Smaller: combs stay.
    pub slit_m: f64,
    /// Planes are extended to their common line over at most this distance, and no further than the raw
    /// triangle is long, meters. Larger: invented surface. Smaller: cracks where points are far apart.
    pub seam_reach_m: f64,
    /// What stands out of a plane by up to this, and is no plane itself, is laid on it, meters; triangles
    /// across a deeper step between parallel planes are left out. Larger: small things vanish, borders at
    /// steps wander by the points' spacing. Smaller: slits along steps, crumples of far points.
    pub step_m: f64,
    /// Points on no plane that hang together in fewer than so many are spikes. Larger: thin poles get lost.
    /// Smaller: spikes stay.
    pub min_structure_points: usize,
    /// Triangles with an edge of at least this length along the beam are no surface but the gap behind an
    /// edge, meters.
    pub veil_length_m: f64,
    /// How close to the beam's direction such an edge must run, degrees. Larger: grazed surfaces get lost.
    /// Smaller: jump edges stay.
    pub veil_angle_deg: f64,
}

impl PolygonParams {
    /// For surfaces that somebody drew or made a mesh of: no border is taken for noise of points.
    pub(crate) fn as_drawn(&self) -> Self {
        Self { slit_m: 0.0, min_polygon_m2: 0.002, ..self.clone() }
    }
}

impl Default for PolygonParams {
    fn default() -> Self {
        Self {
            merging: Merging::default(),
            border_tolerance_m: 0.03,
            min_hole_m2: 0.02,
            min_polygon_m2: 0.05,
            slit_m: 0.08,
            seam_reach_m: 0.5,
            step_m: 0.1,
            min_structure_points: 4,
            veil_length_m: 0.1,
            veil_angle_deg: 15.0,
        }
    }
}
