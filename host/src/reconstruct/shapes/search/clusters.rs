//! Candidates that hang together: what stands or hangs by itself is one cluster. Meters.

use super::cells::{key_at, pairs};
use crate::model::Cloud;
use crate::model::voxels::Voxels;
use biplane_geometry::UnionFind;

/// Edge of the cells over which points hang together: beams of one degree are 7 cm apart at 4 m.
const CELL_M: f64 = 0.12;

/// The clusters of at least `min_points` points, in the order of their first points.
pub(crate) fn of(cloud: &Cloud, points: &[u32], min_points: usize) -> Vec<Vec<u32>> {
    let mut cells: Vec<(u64, u32)> = Vec::new();
    let mut by_key: Voxels<u32> = Voxels::default();
    let mut cell_at: Vec<u32> = Vec::with_capacity(points.len());
    let mut last = (None, u32::MAX);
    for point in points {
        let key = key_at(cloud.points_m[*point as usize], CELL_M);
        if key != last.0 {
            let next = cells.len() as u32;
            let cell = key.map(|key| *by_key.entry(key).or_insert(next));
            cells.extend(key.filter(|_| cell == Some(next)).map(|key| (key, next)));
            last = (key, cell.unwrap_or(u32::MAX));
        }
        cell_at.push(last.1);
    }
    let mut sets = UnionFind::new(cells.len());
    pairs(&mut cells, |a, b| sets.join(a, b));
    let mut number = vec![u32::MAX; cells.len()];
    let mut clusters: Vec<Vec<u32>> = Vec::new();
    for (point, cell) in points.iter().zip(cell_at) {
        if cell == u32::MAX {
            continue;
        }
        let root = sets.root(cell) as usize;
        if number[root] == u32::MAX {
            number[root] = clusters.len() as u32;
            clusters.push(Vec::new());
        }
        clusters[number[root] as usize].push(*point);
    }
    clusters.retain(|cluster| cluster.len() >= min_points);
    clusters
}
