//! Surfaces cut at a height: the lines of a plan.

use super::elevation::Elevation;
use crate::building::elevation::crossing;
use crate::model::{Mesh, PlanarPolygon, Plane};

/// A level line from one point to another, x and y in `map`, meters.
pub(crate) type Line = [[f64; 2]; 2];

/// The lines in which a polygon meets a height; openings are gaps. Level planes have none.
pub(crate) fn cut(polygon: &PlanarPolygon, plane: &Plane, z_m: f64) -> Vec<Line> {
    let Some(elevation) = Elevation::new(plane) else { return Vec::new() };
    let intervals = elevation.row(polygon, z_m);
    intervals.iter().map(|[from, to]| [elevation.point(*from, z_m), elevation.point(*to, z_m)]).collect()
}

/// The lines in which the triangles of a mesh meet a height.
pub(crate) fn cut_mesh(mesh: &Mesh, z_m: f64) -> Vec<Line> {
    let corner = |index: u32| mesh.vertices_m.get(index as usize).map(|p| p.map(f64::from));
    let line = |triangle: &[u32; 3]| -> Option<Line> {
        let [a, b, c] = [corner(triangle[0])?, corner(triangle[1])?, corner(triangle[2])?];
        let mut crossings = [(a, b), (b, c), (c, a)].into_iter().filter_map(|(p, q)| crossing(p, q, z_m));
        Some([crossings.next()?, crossings.next()?])
    };
    mesh.triangles.iter().filter_map(line).filter(|[a, b]| a != b).collect()
}
