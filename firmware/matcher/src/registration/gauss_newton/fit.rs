//! How well a pose explains a scan.
//!
//! Frame: map. Units: meters.

use crate::placement::Placement;
use crate::registration::gauss_newton::params::{AlignParams, REACH_SCALES};
use crate::registration::surface_map::{Correspondence, SurfaceMap};
use crate::scan::end_points::EndPoint;
use biplane_geometry::Pose2;

/// How well a pose explains a scan.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct Fit {
    /// Weight of the end points on mapped surfaces.
    pub explained: f64,
    /// Weight of the end points that say anything: near a surface, or where the map knows free space.
    pub informative: f64,
    /// Weight of all end points.
    pub total: f64,
    /// Weight of the explained ones on lines.
    pub on_lines: f64,
    /// Sum of their squared distances from these, as if the map were exact, square meters.
    pub squares_m2: f64,
}

impl Fit {
    /// Share of the informative end points that are explained, 0 to 1.
    pub(crate) fn score(&self) -> f64 {
        if self.informative > 0.0 { self.explained / self.informative } else { 0.0 }
    }
}

/// How well a pose explains end points.
pub(crate) fn fit<M: SurfaceMap>(map: &M, points: &[EndPoint], pose: &Pose2, params: &AlignParams) -> Fit {
    let placement = Placement::new(pose);
    let mut fit = Fit::default();
    let (near_m, reach_m) = (params.explained_m as f32, REACH_SCALES * params.outlier_m as f32);
    for point in points {
        let weight = f64::from(point.weight);
        fit.total += weight;
        match Correspondence::find(map, point, &placement, reach_m) {
            Ok(met) => {
                fit.informative += weight;
                let squared_m2 = met.squared_m2();
                if !met.is_other_face && squared_m2 < near_m * near_m {
                    fit.explained += weight;
                    if met.is_line {
                        let hits = met.surfel.hits;
                        fit.on_lines += weight;
                        fit.squares_m2 += weight * f64::from(squared_m2 * hits / (1.0 + hits));
                    }
                }
            }
            Err(at_m) if map.seen_through(at_m) => fit.informative += weight,
            Err(_) => {}
        }
    }
    fit
}
