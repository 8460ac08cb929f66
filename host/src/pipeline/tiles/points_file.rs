//! What a tile is made of: the points of its blocks, with those in their margins. Frame `map`, meters.

use super::bytes::{Bytes, put_count, seal};
use crate::model::Cloud;
use crate::reconstruct::planes::search::blocks::Block;

const MAGIC: [u8; 8] = *b"bptilep1";
/// Bytes of a point.
const POINT_BYTES: usize = 3 * 4 + 4 + 2;

/// The bytes of some blocks of a cloud.
pub(crate) fn encode(cloud: &Cloud, blocks: &[&Block]) -> Vec<u8> {
    let points: usize = blocks.iter().map(|block| block.points.len()).sum();
    let mut bytes = Vec::with_capacity(MAGIC.len() + 64 * (1 + blocks.len()) + POINT_BYTES * points);
    bytes.extend(MAGIC);
    put_count(&mut bytes, cloud.beams_per_scan);
    put_count(&mut bytes, blocks.len());
    for block in blocks {
        put_count(&mut bytes, block.points.len());
        for point in block.points.iter().map(|point| *point as usize) {
            cloud.points_m[point].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            bytes.extend(cloud.scan.get(point).copied().unwrap_or(0).to_le_bytes());
            bytes.extend(cloud.beam.get(point).copied().unwrap_or(0).to_le_bytes());
        }
    }
    seal(&mut bytes);
    bytes
}

/// The blocks of a file as clouds; `None` for another or a damaged file.
pub(crate) fn decode(file: &[u8]) -> Option<Vec<Cloud>> {
    let mut bytes = Bytes::sealed(file, MAGIC)?;
    let beams_per_scan = bytes.count(0)?;
    let count = bytes.count(size_of::<u64>())?;
    let mut clouds = Vec::with_capacity(count);
    for _ in 0..count {
        let points = bytes.count(POINT_BYTES)?;
        let mut cloud = Cloud { beams_per_scan, ..Cloud::default() };
        cloud.points_m.reserve_exact(points);
        cloud.scan.reserve_exact(points);
        cloud.beam.reserve_exact(points);
        for _ in 0..points {
            cloud.points_m.push([bytes.single()?, bytes.single()?, bytes.single()?]);
            cloud.scan.push(bytes.word()?);
            cloud.beam.push(bytes.short()?);
        }
        clouds.push(cloud);
    }
    bytes.is_done().then_some(clouds)
}

#[cfg(test)]
mod tests {
    use super::{decode, encode};
    use crate::reconstruct::fixture::{corridor, drive};
    use crate::reconstruct::planes::search::blocks::Block;

    #[test]
    fn points_come_back_and_damaged_or_cut_files_do_not() {
        let cloud = drive(&corridor(), 20, 0.02, 5);
        let all = Block { points: (0..cloud.len() as u32).collect(), ..Block::default() };
        let some = Block { points: vec![1, 5, 6], ..Block::default() };
        let file = encode(&cloud, &[&all, &some]);
        assert_eq!(decode(&file), Some(vec![all.cloud(&cloud), some.cloud(&cloud)]));
        for place in [0, 8, 20, file.len() / 2, file.len() - 1] {
            let mut damaged = file.clone();
            damaged[place] ^= 1;
            assert_eq!(decode(&damaged), None, "{place}");
            assert_eq!(decode(&file[..place]), None, "{place}");
        }
    }
}
