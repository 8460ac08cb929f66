//! No dead knobs: every parameter changes some result of one troubled drive.

use biplane_matcher::{Beam, Method, Pose2, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// Another value for each parameter, far enough from the default to matter in a small room.
const OTHER: &[(&str, f64)] = &[
    ("motion.position_m_per_m", 0.5),
    ("motion.position_m_per_rad", 0.5),
    ("motion.heading_rad_per_rad", 0.5),
    ("motion.heading_rad_per_m", 0.5),
    ("motion.jump_m", 100.0),
    ("motion.unmeasured_m", 0.3),
    ("motion.unmeasured_rad", 0.3),
    ("points.max_beams", 50.0),
    ("points.range_min_m", 1.5),
    ("points.range_max_m", 3.0),
    ("points.spacing_m", 0.2),
    ("points.line_tolerance_m", 0.001),
    ("gradient.cell_m", 0.2),
    ("gradient.half_window_m", 2.0),
    ("map.cell_m", 0.1),
    ("map.reach_m", 0.1),
    ("map.tiles", 3.0),
    ("map.surfaces", 60.0),
    ("map.merge_across_m", 0.0),
    ("align.outlier_m", 0.02),
    ("align.range_noise_m", 0.1),
    ("search.min_half_m", 0.0),
    ("search.min_half_rad", 0.0),
    ("search.max_looks", 1000.0),
    ("search.patience_scans", 1.0),
    ("belief.scale_share", 0.3),
    ("belief.turn_share", 0.3),
    ("belief.drift_rad_per_m", 0.3),
    ("belief.way_m_per_root_m", 0.3),
    ("belief.heading_rad_per_root_m", 0.3),
];

/// Round a room with a person in it; the odometry fails, jumps and comes late in turns, and the base is
/// carried away.
fn troubled_drive(params: TrackerParams) -> String {
    let (room, mut noise) = (World::room(), Noise(9));
    let elsewhere = World::new(World::rectangle([-0.6, -0.7], [0.9, 0.8]));
    let mut tracker = Tracker::new(params);
    let mut results = String::new();
    for i in 0..70 {
        let at = f64::from(i);
        let mut truth = Pose2::new(0.04 * at, 0.01 * at, 0.02 * at);
        let odom = match i {
            15..18 => None,
            30 => Some(Pose2::new(90.0, 0.0, 0.0)),
            35 => Some(truth * Pose2::new(0.0, 0.0, 0.25)),
            62..68 => Some(Pose2::new(0.04 * 61.0, 0.61, 1.22)), // a wheel's encoder comes loose
            _ => Some(truth * Pose2::new(0.01 * (at * 0.7).sin(), 0.0, 0.01 * at.sin())),
        };
        if i == 10 {
            truth = truth * Pose2::new(0.4, -0.35, 0.6); // pushed aside, and back again
        }
        if i == 40 {
            truth = truth * Pose2::new(0.7, -0.5, 0.9); // so far that it has to be searched for
        }
        if i == 56 {
            truth.x_m += 0.35; // one scan that only the walls along x can tell from the others
        }
        let mut beams = look(if (45..52).contains(&i) { &elsewhere } else { &room }, &truth, &mut noise);
        for beam in beams.iter_mut().skip(20 + i as usize).take(8) {
            beam.range_m = beam.range_m.min(0.8);
        }
        if (24..27).contains(&i) {
            beams.iter_mut().skip(120).take(30).for_each(|beam| beam.range_m *= 0.6); // somebody comes by
        }
        if i == 60 {
            beams.iter_mut().skip(20).for_each(|beam: &mut Beam| beam.range_m = f32::NAN);
        }
        results += &format!("{:?}\n", track(&mut tracker, i64::from(i) * 200_000_000, &beams, odom));
    }
    results
}

#[test]
fn every_parameter_does_something() {
    let defaults = TrackerParams::for_method;
    let plain = Method::ALL.map(|method| (method, troubled_drive(defaults(method))));
    let mut names: Vec<&str> = OTHER.iter().map(|(name, _)| *name).collect();
    assert!(names.iter().copied().eq(TrackerParams::parameters().map(|parameter| parameter.name)));
    names.retain(|name| {
        let value = OTHER.iter().find(|(other, _)| other == name).unwrap().1;
        plain.iter().all(|(method, before)| {
            let mut params = defaults(*method);
            params.set(name, value).unwrap();
            troubled_drive(params) == *before
        })
    });
    assert!(names.is_empty(), "without effect: {names:?}");
}
