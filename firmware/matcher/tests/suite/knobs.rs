//! No dead knobs: every parameter changes some result of one troubled drive.

use biplane_matcher::{Beam, Method, Pose2, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// Another value for each parameter, far enough from the default to matter in a small room.
const OTHER: &[(&str, f64)] = &[
    ("motion.position_m_per_m", 0.5),
    ("motion.position_m_per_rad", 0.5),
    ("motion.heading_rad_per_rad", 0.5),
    ("motion.heading_rad_per_m", 0.5),
    ("motion.position_floor_m", 0.1),
    ("motion.heading_floor_rad", 0.1),
    ("motion.jump_m", 100.0),
    ("motion.jump_rad", 0.01),
    ("motion.stall_m", 10.0),
    ("motion.unmeasured_m", 0.3),
    ("motion.unmeasured_rad", 0.3),
    ("points.max_beams", 50.0),
    ("points.min_points", 30.0),
    ("points.range_min_m", 1.5),
    ("points.range_max_m", 3.0),
    ("points.spacing_m", 0.2),
    ("points.normal_reach_m", 0.05),
    ("points.line_length_m", 0.3),
    ("points.line_tolerance_m", 0.001),
    ("points.grazing_sine", 0.6),
    ("gradient.cell_m", 0.2),
    ("gradient.half_window_m", 2.0),
    ("gradient.cutoff_m", 0.2),
    ("gradient.occlusion_margin_m", 0.1),
    ("gradient.gap_rad", 0.001),
    ("gradient.reference_scans", 1.0),
    ("gradient.reference_every_m", 0.05),
    ("gradient.reference_every_rad", 0.05),
    ("gradient.max_iterations", 3.0),
    ("gradient.first_step_m", 0.03),
    ("gradient.step_growth", 2.0),
    ("gradient.step_shrink", 0.7),
    ("gradient.rest_m", 0.01),
    ("gradient.noise_m", 0.1),
    ("gradient.direction_noise_rad", 0.5),
    ("gradient.explained_m", 0.02),
    ("map.cell_m", 0.1),
    ("map.reach_m", 0.1),
    ("map.tiles", 3.0),
    ("map.surfaces", 60.0),
    ("map.memory_hits", 2.0),
    ("map.merge_across_m", 0.0),
    ("map.line_spread_rad", 0.02),
    ("map.evidence_per_hit", 1.0),
    ("map.evidence_max", 3.0),
    ("map.carve_every_beams", 100.0),
    ("map.carve_margin_m", 1.0),
    ("map.learn_every_m", 1.0),
    ("map.learn_every_rad", 0.001),
    ("align.max_iterations", 2.0),
    ("align.capture_m", 0.06),
    ("align.outlier_m", 0.02),
    ("align.range_noise_m", 0.1),
    ("align.point_noise_m", 0.005),
    ("align.direction_noise_rad", 0.4),
    ("align.beams_per_independent_one", 50.0),
    ("align.rest_m", 0.1),
    ("align.rest_rad", 0.1),
    ("align.explained_m", 0.01),
    ("align.weak_m", 0.0001),
    ("search.glance_rad", 0.0),
    ("search.glance_below_share", 0.0),
    ("search.below_score", 0.3),
    ("search.lost_below_score", 0.99),
    ("search.min_informative", 0.9),
    ("search.least_half_m", 0.0),
    ("search.least_half_rad", 0.0),
    ("search.step_m", 0.03),
    ("search.step_rad", 0.1),
    ("search.max_shifts", 1.0),
    ("search.max_turns", 1.0),
    ("search.rival_share", 0.0),
    ("search.beams", 10.0),
    ("search.most_looks", 1000.0),
    ("search.blur_m", 0.3),
    ("search.free_space_cost", 3.0),
    ("search.patience_scans", 1.0),
    ("search.confirm_scans", 1.0),
    ("belief.scale_share", 0.3),
    ("belief.turn_share", 0.3),
    ("belief.drift_rad_per_m", 0.3),
    ("belief.way_m_per_root_m", 0.3),
    ("belief.heading_rad_per_root_m", 0.3),
    ("belief.wall_m", 0.02),
    ("belief.face_m", 0.05),
    ("belief.chapter_every_m", 0.2),
];

/// Round a room with a person in it; the odometry fails, jumps and comes late in turns, and the base is carried away.
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
        if i == 40 {
            truth = truth * Pose2::new(0.4, -0.35, 0.6);
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
    let defaults = |method| {
        let mut params = TrackerParams::for_method(method);
        params.search.below_score = 0.95; // so that the search works often
        params.search.glance_below_share = 2.0; // and the glance always
        params
    };
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
