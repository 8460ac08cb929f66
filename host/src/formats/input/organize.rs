//! Organized clouds: points that say which beam of which scan they are.
//!
//! Properties `scan` and `beam` of the points make a cloud organized. Where a scan was taken from stands in
//! an element `scan` (`x y z`, a row a scan number), or at each point (`origin_x origin_y origin_z`); without
//! it normals have no side and mixed-pixel planes of mixed pixels cannot be told.

use crate::formats::input::cloud_file::CloudFile;
use crate::formats::ply::read::Ply;
use crate::model::Cloud;

/// The properties of points that are used.
pub(crate) const COLUMNS: [&str; 5] = ["scan", "beam", "origin_x", "origin_y", "origin_z"];

/// The points with their scans and beams, if these are such; in the order scan, then beam.
pub(crate) fn organized(points_m: Vec<[f32; 3]>, ply: &Ply) -> CloudFile {
    let mut file = CloudFile { shift_m: ply.shift_m, ..CloudFile::default() };
    let (Some(scans), Some(beams)) = (ply.vertex_column("scan"), ply.vertex_column("beam")) else {
        file.cloud.points_m = points_m;
        return file;
    };
    match numbers(scans, beams) {
        Ok(numbers) => arrange(points_m, &numbers, ply, &mut file),
        Err(why) => {
            file.cloud.points_m = points_m;
            file.notes.extend(why);
        }
    }
    file
}

/// Scan and beam of every point; why there are none when there are none (nothing to say when every point says
/// -1).
fn numbers(scans: &[f64], beams: &[f64]) -> Result<Vec<(u32, u16)>, Option<String>> {
    let whole = |v: f64, maximum: f64| v.fract() == 0.0 && (0.0..=maximum).contains(&v);
    let odd = scans.iter().zip(beams).position(|(scan, beam)| {
        !whole(*scan, f64::from(u32::MAX - 1)) || !whole(*beam, f64::from(u16::MAX - 1))
    });
    match odd {
        None => Ok(scans.iter().zip(beams).map(|(scan, beam)| (*scan as u32, *beam as u16)).collect()),
        Some(_) if scans.iter().chain(beams).all(|v| *v == -1.0) => Err(None),
        Some(index) => Err(Some(format!(
            "taken as unorganized: point {index} is beam {} of scan {}, expected whole numbers from 0 (beams below {})",
            beams[index],
            scans[index],
            u16::MAX
        ))),
    }
}

fn arrange(points_m: Vec<[f32; 3]>, numbers: &[(u32, u16)], ply: &Ply, file: &mut CloudFile) {
    let sorted = numbers.is_sorted();
    let mut order: Vec<u32> = (0..points_m.len() as u32).collect();
    if !sorted {
        order.sort_by_key(|index| numbers[*index as usize]);
    }
    let cloud = &mut file.cloud;
    for &index in &order {
        let (number, beam) = numbers[index as usize];
        if file.scan_numbers.last() != Some(&number) {
            file.scan_numbers.push(number);
        }
        cloud.scan.push(file.scan_numbers.len() as u32 - 1);
        cloud.beam.push(beam);
    }
    cloud.beams_per_scan = cloud.beam.iter().max().map_or(0, |last| usize::from(*last) + 1);
    cloud.points_m = if sorted { points_m } else { order.iter().map(|k| points_m[*k as usize]).collect() };
    match origins(cloud, &order, &file.scan_numbers, ply) {
        Ok(origins_m) => cloud.origins_m = origins_m,
        Err(why) => file.notes.push(why),
    }
    file.order = (!sorted).then_some(order);
}

/// Where each scan was taken from; empty when the file does not say.
fn origins(cloud: &Cloud, order: &[u32], scan_numbers: &[u32], ply: &Ply) -> Result<Vec<[f32; 3]>, String> {
    let near = |p: [f64; 3]| -> [f32; 3] { std::array::from_fn(|k| (p[k] - ply.shift_m[k]) as f32) };
    let rows = &ply.scan_origins_m;
    let of_points = ["origin_x", "origin_y", "origin_z"].map(|name| ply.vertex_column(name));
    let found: Vec<[f32; 3]> = if let [Some(x), Some(y), Some(z)] = of_points {
        // A scan's origin is that of its first point.
        let first = (0..cloud.len()).filter(|k| *k == 0 || cloud.scan[*k] != cloud.scan[k - 1]);
        first.map(|k| order[k] as usize).map(|k| near([x[k], y[k], z[k]])).collect()
    } else if rows.is_empty() {
        return Ok(Vec::new());
    } else {
        let row_of = |number: &u32| {
            let lack =
                || format!("origins are left out: there are {} of them and a scan {number}", rows.len());
            rows.get(*number as usize).copied().map(near).ok_or_else(lack)
        };
        scan_numbers.iter().map(row_of).collect::<Result<_, _>>()?
    };
    match found.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        Some(scan) => Err(format!("origins are left out: that of scan {} is not finite", scan_numbers[scan])),
        None => Ok(found),
    }
}
