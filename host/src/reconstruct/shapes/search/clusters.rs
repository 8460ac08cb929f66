//! Candidates that hang together: what stands or hangs by itself is one cluster. Meters.

use super::patches::{cell_of, cells_after, key_of};
use crate::model::Cloud;
use crate::reconstruct::voxels::Voxels;
use biplane_geometry::UnionFind;

/// Edge of the cells over which points hang together: beams of one degree are 7 cm apart at 4 m.
const CELL_M: f64 = 0.12;

/// The clusters of at least `min_points` points, in the order of their first points.
pub(crate) fn of(cloud: &Cloud, points: &[u32], min_points: usize) -> Vec<Vec<u32>> {
    let mut cells: Vec<[i32; 3]> = Vec::new();
    let mut by_key: Voxels<u32> = Voxels::default();
    let mut cell_at: Vec<u32> = Vec::with_capacity(points.len());
    for point in points {
        let cell = cell_of(cloud.points_m[*point as usize], CELL_M);
        let found = cell.and_then(|cell| Some((cell, key_of(cell)?)));
        cell_at.push(found.map_or(u32::MAX, |(cell, key)| {
            *by_key.entry(key).or_insert_with(|| {
                cells.push(cell);
                cells.len() as u32 - 1
            })
        }));
    }
    let mut sets = UnionFind::new(cells.len());
    for (index, cell) in (0..).zip(&cells) {
        let after = cells_after(*cell).filter_map(key_of);
        after.filter_map(|key| by_key.get(&key)).for_each(|other| sets.join(index, *other));
    }
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
