//! The localizing laser's ranges as beams in the base's frame, projected to the floor.
//!
//! `direction_in_base` is the unit beam turned by the mount (`base_from_laser`, yaw then pitch then roll)
//! without its height, so that an inclined laser or one on its back needs no special case in the matcher.

use biplane_geometry::PortableMath;
use biplane_matcher::Beam;
use biplane_recording::rig::Mount;

use crate::engine::scan_data::{MAX_BEAMS, ScanData};

/// Makes beams; directions and times are computed anew only when the scans' layout changes.
#[derive(Debug)]
pub(crate) struct BeamMaker {
    rotation: [[f64; 3]; 3],
    layout: Option<Layout>,
    beams: Vec<Beam>,
}

#[derive(Copy, Clone, PartialEq, Debug)]
struct Layout {
    angle_min_rad: f64,
    angle_increment_rad: f64,
    time_increment_s: f64,
    turns: u8,
    count: usize,
}

impl BeamMaker {
    /// For a laser with this mount.
    #[must_use]
    pub(crate) fn new(mount: &Mount) -> Self {
        Self { rotation: mount.matrix(), layout: None, beams: Vec::with_capacity(MAX_BEAMS) }
    }

    /// The beams of a scan.
    pub(crate) fn beams(&mut self, scan: &ScanData) -> &[Beam] {
        let layout = Layout {
            angle_min_rad: scan.angle_min_rad,
            angle_increment_rad: scan.angle_increment_rad,
            time_increment_s: scan.time_increment_s,
            turns: scan.turns,
            count: scan.ranges_m.len(),
        };
        if self.layout != Some(layout) {
            self.layout = Some(layout);
            self.beams.clear();
            for beam in 0..layout.count {
                let angle_rad = layout.angle_min_rad + beam as f64 * layout.angle_increment_rad;
                let (sin, cos) = angle_rad.portable_sin_cos();
                let axis = |row: [f64; 3]| (row[0] * cos + row[1] * sin) as f32;
                self.beams.push(Beam {
                    direction_in_base: [axis(self.rotation[0]), axis(self.rotation[1])],
                    range_m: f32::NAN,
                    delay_s: scan.beam_delay_s(beam) as f32,
                });
            }
        }
        for (beam, &range_m) in self.beams.iter_mut().zip(&scan.ranges_m) {
            let is_hit = range_m >= scan.range_min_m && range_m <= scan.range_max_m;
            beam.range_m = if is_hit || range_m == f32::INFINITY { range_m } else { f32::NAN };
        }
        &self.beams
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::Rig;
    use biplane_recording::messages::LaserScan;

    fn scan(ranges_m: &[f32]) -> ScanData {
        let message = LaserScan {
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: std::f32::consts::FRAC_PI_2,
            range_min_m: 0.01,
            range_max_m: 80.0,
            ranges_m: ranges_m.to_vec(),
            ..LaserScan::default()
        };
        ScanData::of_message(&message, None)
    }

    fn directions(mount: &Mount) -> Vec<[i32; 2]> {
        let mut maker = BeamMaker::new(mount);
        let beams = maker.beams(&scan(&[1.0, 1.0, 1.0]));
        beams.iter().map(|beam| beam.direction_in_base.map(|v| (v * 1000.0).round() as i32)).collect()
    }

    #[test]
    fn beams_turn_with_the_mount() {
        let flat = Rig::default().horizontal.mount;
        assert_eq!(directions(&flat), [[0, -1000], [1000, 0], [0, 1000]]);
        let turned = Mount { yaw: 90.0, ..flat };
        assert_eq!(directions(&turned), [[1000, 0], [0, 1000], [-1000, 0]]);
        let on_its_back = Mount { roll: 180.0, ..flat };
        assert_eq!(directions(&on_its_back), [[0, 1000], [1000, 0], [0, -1000]]);
        let inclined = Mount { pitch: 60.0, ..flat };
        assert_eq!(directions(&inclined), [[0, -1000], [500, 0], [0, 1000]]);
    }

    #[test]
    fn what_is_no_range_stays_infinite_or_becomes_invalid() {
        let mut maker = BeamMaker::new(&Rig::default().horizontal.mount);
        let first = maker.beams(&scan(&[1.0, 2.0, 3.0])).to_vec();
        assert_eq!(first.iter().map(|beam| beam.range_m).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
        let beams = maker.beams(&scan(&[f32::INFINITY, 0.0, 81.0]));
        assert_eq!(beams[0].range_m, f32::INFINITY);
        assert!(beams[1].range_m.is_nan() && beams[2].range_m.is_nan());
    }
}
