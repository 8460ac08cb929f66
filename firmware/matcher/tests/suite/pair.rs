//! One scan found in another alone: pairs of scans of known rooms, whose true poses are known exactly.

use biplane_matcher::{Beam, Guess, Method, PairMatch, PairMatcher, Pose2, Scan, TrackerParams};

use crate::world::{Noise, World, error, look};

fn scan(beams: &[Beam]) -> Scan<'_> {
    Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams, twist_in_base: [0.0; 3] }
}

/// A guess known to 10 cm and 30 degrees.
fn guess(reference_from_base: Pose2) -> Guess {
    Guess { reference_from_base, half_m: 0.1, half_rad: 30_f64.to_radians() }
}

/// Where the reference scan is taken, and the second one seen from there.
const PLACES: [(Pose2, Pose2); 4] = [
    (Pose2::IDENTITY, Pose2::new(0.6, 0.2, 0.3)),
    (Pose2::new(2.0, 0.5, 1.9), Pose2::new(0.4, -0.3, -0.5)),
    (Pose2::new(-1.5, 1.0, -0.7), Pose2::new(1.0, 0.0, 0.05)),
    (Pose2::new(3.0, 2.0, -2.6), Pose2::new(0.0, 0.1, 0.6)),
];

/// All pairs from random starts within 10 cm and 30 degrees: the worst errors in meters and degrees.
fn worst(method: Method) -> (f64, f64) {
    let (room, mut noise) = (World::room(), Noise(11));
    let mut matcher = PairMatcher::new(TrackerParams::for_method(method));
    let (mut meters, mut degrees) = (0.0_f64, 0.0_f64);
    for (map_from_reference, truth) in PLACES {
        let beams = look(&room, &map_from_reference, &mut noise);
        matcher.set_reference(&scan(&beams));
        let beams = look(&room, &(map_from_reference * truth), &mut noise);
        for _ in 0..20 {
            let [x, y, turn] = [0.1, 0.1, 30_f64.to_radians()].map(|maximum| maximum * noise.even());
            let start = Pose2::new(truth.x_m + x, truth.y_m + y, truth.theta_rad + turn);
            let found = matcher.find(&scan(&beams), &guess(start));
            assert!(found.found, "{found:?} from {start:?}");
            let (away_m, away_deg) = error(&found.reference_from_base, &truth);
            meters = meters.max(away_m);
            degrees = degrees.max(away_deg);
        }
    }
    (meters, degrees)
}

#[test]
fn from_anywhere_within_10_cm_and_30_degrees_the_map_method_finds_the_scan_to_2_cm() {
    let (meters, degrees) = worst(Method::Map);
    assert!(meters < 0.02 && degrees < 0.5, "{meters} m, {degrees} deg");
}

fn in_corridor(method: Method) -> PairMatch {
    let (corridor, mut noise) = (World::corridor(), Noise(12));
    let mut matcher = PairMatcher::new(TrackerParams::for_method(method));
    matcher.set_reference(&scan(&look(&corridor, &Pose2::IDENTITY, &mut noise)));
    let beams = look(&corridor, &Pose2::new(0.5, 0.1, 0.1), &mut noise);
    matcher.find(&scan(&beams), &guess(Pose2::new(0.4, 0.15, 0.2)))
}

#[test]
fn a_pair_in_a_bare_corridor_knows_the_way_across_and_the_heading_but_not_the_way_along() {
    let found = in_corridor(Method::Map);
    let [[along, ..], [_, across, _], [.., heading]] = found.information;
    assert!(across > 1.0 / 0.01_f64.powi(2) && heading > 1.0 / 0.01_f64.powi(2), "{found:?}");
    assert!(along < 1.0 / 0.1_f64.powi(2), "{found:?}");
    let Pose2 { x_m, y_m, theta_rad } = found.reference_from_base;
    assert!((y_m - 0.1).abs() < 0.02 && (theta_rad - 0.1).abs() < 0.009, "{found:?}");
    assert!((x_m - 0.4).abs() < 0.12, "along the axis the guess stands: {found:?}");
}

#[test]
fn another_rooms_scan_an_empty_one_and_one_without_reference_are_not_found() {
    for method in Method::ALL {
        let mut noise = Noise(13);
        let mut matcher = PairMatcher::new(TrackerParams::for_method(method));
        let room = look(&World::room(), &Pose2::IDENTITY, &mut noise);
        assert!(!matcher.find(&scan(&room), &guess(Pose2::IDENTITY)).found, "{method}: no reference");
        matcher.set_reference(&scan(&room));
        let hall = World::new(World::rectangle([-0.9, -1.1], [0.8, 0.7]));
        let elsewhere = look(&hall, &Pose2::IDENTITY, &mut noise);
        assert!(!matcher.find(&scan(&elsewhere), &guess(Pose2::IDENTITY)).found, "{method}: elsewhere");
        let start = Pose2::new(0.1, 0.2, 0.3);
        let nothing = matcher.find(&scan(&[]), &guess(start));
        assert!(!nothing.found && nothing.reference_from_base == start, "{method}: {nothing:?}");
        assert!(matcher.find(&scan(&room), &guess(start)).found || method == Method::Gradient);
    }
}

#[test]
fn a_reference_leaves_nothing_behind_for_the_next_one() {
    for method in Method::ALL {
        let mut noise = Noise(14);
        let rooms = [World::room(), World::new(World::rectangle([-2.0, -1.4], [1.7, 2.2]))];
        let [room, other] = rooms.map(|world| look(&world, &Pose2::IDENTITY, &mut noise));
        let start = guess(Pose2::new(0.05, -0.03, 0.1));
        let mut fresh = PairMatcher::new(TrackerParams::for_method(method));
        fresh.set_reference(&scan(&other));
        let mut used = PairMatcher::new(TrackerParams::for_method(method));
        used.set_reference(&scan(&room));
        used.find(&scan(&room), &start);
        used.set_reference(&scan(&other));
        assert_eq!(used.find(&scan(&other), &start), fresh.find(&scan(&other), &start), "{method}");
    }
}

#[test]
fn guesses_that_are_no_numbers_are_not_found_and_guesses_without_bounds_are_searched_for() {
    for method in Method::ALL {
        let mut noise = Noise(15);
        let mut matcher = PairMatcher::new(TrackerParams::for_method(method));
        let room = look(&World::room(), &Pose2::IDENTITY, &mut noise);
        matcher.set_reference(&scan(&room));
        for odd in [f64::NAN, f64::INFINITY] {
            let nowhere = matcher.find(&scan(&room), &guess(Pose2::new(odd, 0.0, 0.0)));
            assert!(!nowhere.found, "{method}: {nowhere:?}");
        }
        let start = Pose2::new(0.05, -0.04, 0.1);
        let anywhere = Guess { reference_from_base: start, half_m: f64::INFINITY, half_rad: f64::INFINITY };
        let found = matcher.find(&scan(&room), &anywhere);
        let (meters, degrees) = error(&found.reference_from_base, &Pose2::IDENTITY);
        assert!(found.found && meters < 0.05 && degrees < 1.5, "{method}: {found:?}");
    }
}
