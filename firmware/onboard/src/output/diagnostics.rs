//! The state of a run as `diagnostic_msgs/msg/DiagnosticArray`: one status a device, one for the matcher, one
//! for the recorder.

use biplane_matcher::{Estimate, Odometry, OdometryScale, Outcome};
use biplane_recording::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};

use crate::engine::out::health::DamagedShare;
use crate::engine::out::health::Health;
use crate::engine::out::health::LineFault;
use crate::engine::out::health::LineHealth;
use crate::engine::out::health::MatcherHealth;
use crate::session::inertial::health::InertialHealth;
use crate::session::lms::health::LaserHealth;

/// The message of this state.
#[must_use]
pub fn message(now_ns: i64, health: &Health) -> DiagnosticArray {
    let lines = [
        ("laser_horizontal", &health.horizontal),
        ("laser_vertical", &health.vertical),
        ("base", &health.base),
        ("imu", &health.imu),
    ];
    let mut status: Vec<_> =
        lines.into_iter().filter(|(_, line)| line.present).map(|(name, line)| of_line(name, line)).collect();
    if let (Some(last), Some(unit)) = (status.last_mut().filter(|_| health.imu.present), &health.inertial) {
        last.values.extend(of_inertial(unit));
    }
    status.push(of_matcher(&health.matcher));
    status.push(of_recorder(health));
    DiagnosticArray { stamp_ns: now_ns, frame_id: String::new(), status }
}

fn value(key: &str, value: &dyn std::fmt::Display) -> KeyValue {
    KeyValue { key: key.to_owned(), value: value.to_string() }
}

fn status(name: &str, level: u8, message: &str, values: Vec<KeyValue>) -> DiagnosticStatus {
    DiagnosticStatus {
        level,
        name: format!("biplane: {name}"),
        message: message.to_owned(),
        hardware_id: name.to_owned(),
        values,
    }
}

fn of_line(name: &str, line: &LineHealth) -> DiagnosticStatus {
    let (mut level, mut message) = match (line.fault, line.streaming, line.rate_hz > 0.0) {
        (LineFault::Lasts(words), ..) => (DiagnosticStatus::ERROR, words.to_owned()),
        (LineFault::Over(words), ..) => (DiagnosticStatus::WARN, format!("streams again; it was: {words}")),
        (LineFault::None, true, true) => (DiagnosticStatus::OK, "streams".to_owned()),
        (LineFault::None, true, false) => (DiagnosticStatus::WARN, "nothing in the last second".to_owned()),
        (LineFault::None, false, _) => (DiagnosticStatus::ERROR, "does not stream".to_owned()),
    };
    let mut values = vec![
        value("rate_hz", &format_args!("{:.2}", line.rate_hz)),
        value("measurements", &line.measurements),
        value("latency_ms", &format_args!("{:.2}", line.latency_s * 1e3)),
        value("restarts", &line.restarts),
        value("overruns", &line.overruns),
        value("baud", &baud(line.baud)),
    ];
    if let Some(counts) = &line.counts {
        values.extend([
            value("telegrams", &counts.frames),
            value("crc_errors", &counts.bad_checksums),
            value("length_errors", &counts.bad_lengths),
            value("cut_telegrams", &counts.abandoned),
            value("skipped_bytes", &counts.skipped_bytes),
            value("bytes", &counts.bytes()),
        ]);
    }
    values.extend(line.metres_per_tick.map(|meters| value("metres_per_tick", &meters)));
    if let Some(DamagedShare { share, is_overrun }) = line.damaged {
        level = level.max(DiagnosticStatus::WARN);
        let how = if is_overrun { "are cut: read too late" } else { "arrive damaged" };
        message = format!("{message}; {:.0} % of its telegrams {how}", (share * 100.0).max(1.0));
    }
    if let Some(interval_ms) = line.odd_interval_ms {
        level = level.max(DiagnosticStatus::WARN);
        message = format!("{message}; its mirror does not turn at 75 Hz");
        values.push(value("odd_interval_ms", &format_args!("{interval_ms:.3}")));
    }
    if let Some(laser) = &line.laser {
        if laser.differs {
            level = level.max(DiagnosticStatus::WARN);
            message = format!("{message}; is not set as the rig asks");
        }
        if !laser.troubles.is_empty() {
            level = level.max(DiagnosticStatus::WARN);
            message = format!("{message}; complains of {}", laser.troubles);
        }
        values.extend(of_laser(laser));
    }
    if let Some(mounting) = line.mounting {
        if let Some(mount_fault) = mounting.mount_fault() {
            level = level.max(DiagnosticStatus::WARN);
            message = format!("{message}; {}", mount_fault.short());
        }
        values.push(value("mounting", &mounting.words()));
    }
    status(name, level, &message, values)
}

fn of_laser(laser: &LaserHealth) -> [KeyValue; 11] {
    let status = laser.status.map_or_else(|| "-".to_owned(), |status| status.to_string());
    [
        value("status", &status),
        value("faults", &laser.faults),
        value("polluted_scans", &laser.polluted_scans),
        value("implausible_scans", &laser.implausible_scans),
        value("dazzled_values", &laser.dazzled_values),
        value("lost_telegrams", &laser.lost_telegrams),
        value("left_out_scans", &laser.left_out_scans),
        value("rejected_telegrams", &laser.rejected),
        value("not_kept", &laser.not_kept),
        value("configuration_writes", &laser.writes),
        value("set_as_asked", &!laser.differs),
    ]
}

fn of_inertial(unit: &InertialHealth) -> [KeyValue; 5] {
    [
        value("lost_samples", &unit.missing),
        value("rejected_telegrams", &unit.rejected),
        value("incomplete", &unit.incomplete),
        value("not_kept", &unit.not_kept),
        value("clipped", &unit.clipped),
    ]
}

fn of_matcher(matcher: &MatcherHealth) -> DiagnosticStatus {
    let guessed = !matches!(matcher.last_odometry, Odometry::Used | Odometry::Reversed);
    let (mut level, mut message) = match matcher.last_outcome {
        None => (DiagnosticStatus::STALE, "no scan yet".to_owned()),
        Some(outcome) => of_outcome(outcome, guessed),
    };
    if let Some(words) = of_odometry(matcher) {
        level = level.max(DiagnosticStatus::WARN);
        message = format!("{message}; {words}");
    }
    if let Some(words) = of_map(matcher) {
        level = level.max(DiagnosticStatus::WARN);
        message = format!("{message}; {words}");
    }
    if let Some(words) = of_scale(&matcher.odometry_scale) {
        level = level.max(DiagnosticStatus::WARN);
        message = format!("{message}; {words}");
    }
    let OdometryScale { way, turn, drift_rad_per_m } = matcher.odometry_scale;
    let [missing, jumped, stalled, contradicted, reversed] = &matcher.distrusted;
    let values = vec![
        value("poses", &matcher.poses),
        value("unmatched", &matcher.unmatched),
        value("score", &format_args!("{:.3}", matcher.last_score)),
        value("iterations", &matcher.last_iterations),
        value("odometry_missing", missing),
        value("odometry_jumped", jumped),
        value("odometry_stalled", stalled),
        value("odometry_contradicted", contradicted),
        value("odometry_reversed", reversed),
        value("odometry_way_scale", &estimate(way)),
        value("odometry_turn_scale", &estimate(turn)),
        value("odometry_drift_rad_per_m", &estimate(drift_rad_per_m)),
        value("latency_ms", &format_args!("{:.2}", matcher.latency_s * 1e3)),
        value("waiting", &matcher.waiting),
        value("waiting_vertical", &matcher.waiting_vertical),
        value("map_filled_percent", &matcher.map_filled_percent()),
        value("map_megabytes", &format_args!("{:.1}", matcher.map.bytes_used as f64 * 1e-6)),
        value("map_forgotten_tiles", &matcher.map.forgotten),
    ];
    status("matcher", level, &message, values)
}

fn of_outcome(outcome: Outcome, guessed: bool) -> (u8, String) {
    let by = if guessed { "goes on with the last motion" } else { "follows the odometry" };
    match outcome {
        Outcome::First => (DiagnosticStatus::OK, "first scan".to_owned()),
        Outcome::Matched => (DiagnosticStatus::OK, "matched".to_owned()),
        Outcome::Weak => (DiagnosticStatus::OK, "matched, weak in one direction".to_owned()),
        Outcome::Lost => (DiagnosticStatus::WARN, format!("no match, {by}")),
        Outcome::NoReturns => (DiagnosticStatus::WARN, format!("no returns, {by}")),
    }
}

/// What is wrong with the odometry. The first scan needs none.
fn of_odometry(matcher: &MatcherHealth) -> Option<&'static str> {
    match (matcher.last_odometry, matcher.last_outcome?) {
        (Odometry::Used, _) | (Odometry::Missing, Outcome::First) => None,
        (Odometry::Missing, _) => Some("odometry missing"),
        (Odometry::Jumped, _) => Some("odometry jumped, not believed"),
        (Odometry::Stalled, _) => Some("odometry stalled, not believed"),
        (Odometry::Contradicted, _) => Some("odometry contradicted by scans, not believed"),
        (Odometry::Reversed, _) => Some("odometry counts the way back as a way ahead"),
    }
}

/// What a meter and a turn of the odometry truly are, where that is clearly something else.
fn of_scale(scale: &OdometryScale) -> Option<String> {
    let wrong = |estimate: Option<Estimate>| estimate.filter(Estimate::is_wrong_scale);
    let way = wrong(scale.way).map(|way| format!("a meter of the odometry is {:.2} m", way.value));
    let turn =
        || wrong(scale.turn).map(|turn| format!("90 degrees of the odometry are {:.0}", 90.0 * turn.value));
    way.or_else(turn)
}

/// The rate of a serial line; a network has none.
fn baud(baud: u32) -> String {
    if baud == 0 { "-".to_owned() } else { baud.to_string() }
}

/// A number that was learned and its standard deviation; `-` while it is not known.
fn estimate(estimate: Option<Estimate>) -> String {
    estimate.map_or_else(|| "-".to_owned(), |Estimate { value, sigma }| format!("{value:.4} +-{sigma:.4}"))
}

/// A map that is nearly full is said before anything is forgotten.
const MAP_NEARLY_FULL_PERCENT: u32 = 90;

/// What is wrong with the map's memory.
fn of_map(matcher: &MatcherHealth) -> Option<String> {
    let percent = matcher.map_filled_percent();
    let forgotten = matcher.map.forgotten;
    if forgotten > 0 {
        return Some(format!("the map's memory is full, {forgotten} tiles forgotten (--map-memory)"));
    }
    (percent >= MAP_NEARLY_FULL_PERCENT)
        .then(|| format!("{percent} % of the map's memory in use (--map-memory)"))
}

fn of_recorder(health: &Health) -> DiagnosticStatus {
    let (level, message) = match health.dropped {
        0 => (DiagnosticStatus::OK, "records"),
        _ => (DiagnosticStatus::ERROR, "messages were dropped"),
    };
    let values = vec![
        value("dropped", &health.dropped),
        value("untold", &health.unreported),
        value("backward_stamps", &health.backward_stamps),
        value("clock_steps", &health.clock_steps),
    ];
    status("recorder", level, message, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_matcher::MapSize;

    /// A state in which every figure is there.
    fn all_there() -> Health {
        let line = LineHealth {
            present: true,
            counts: Some(biplane_wire::Counts::default()),
            odd_interval_ms: Some(20.0),
            laser: Some(LaserHealth::default()),
            mounting: Some(crate::types::mount_fault::Mounting::default()),
            ..LineHealth::default()
        };
        let inertial = Some(InertialHealth::default());
        Health { horizontal: line, imu: LineHealth { laser: None, ..line }, inertial, ..Health::default() }
    }

    #[test]
    fn every_figure_is_explained_in_the_docs() {
        let docs = include_str!("../../../../docs/recording.md");
        let values = message(0, &all_there()).status.into_iter().flat_map(|status| status.values);
        let names: Vec<String> = values.map(|value| value.key).collect();
        assert!(names.len() > 50, "{names:?}");
        let table = docs.split("## The figures in `/diagnostics`").nth(1).unwrap_or_default();
        let table = table.split("\n## ").next().unwrap_or_default();
        let missing: Vec<_> = names.iter().filter(|name| !table.contains(&format!("`{name}`"))).collect();
        assert!(missing.is_empty(), "docs/recording.md does not explain {missing:?}");
    }

    #[test]
    fn a_network_has_no_rate_in_bd() {
        let baud_of = |baud| {
            let line = LineHealth { baud, ..LineHealth::default() };
            of_line("laser", &line).values.into_iter().find(|value| value.key == "baud").unwrap().value
        };
        assert_eq!([baud_of(0), baud_of(38400)], ["-", "38400"]);
    }

    #[test]
    fn a_map_that_is_nearly_full_is_said_and_so_is_what_it_forgets() {
        let of = |tiles, forgotten| {
            let map =
                MapSize { tiles, tile_capacity: 200, surface_capacity: 9, forgotten, ..MapSize::default() };
            let matcher =
                MatcherHealth { last_outcome: Some(Outcome::First), map, ..MatcherHealth::default() };
            let status = of_matcher(&matcher);
            (status.level, status.message)
        };
        assert_eq!(of(179, 0), (DiagnosticStatus::OK, "first scan".to_owned()));
        let nearly = "first scan; 90 % of the map's memory in use (--map-memory)";
        assert_eq!(of(180, 0), (DiagnosticStatus::WARN, nearly.to_owned()));
        let full = "first scan; the map's memory is full, 7 tiles forgotten (--map-memory)";
        assert_eq!(of(200, 7), (DiagnosticStatus::WARN, full.to_owned()));
    }

    #[test]
    fn odometry_that_counts_clearly_wrong_is_reported_and_a_scale_that_is_not_known_is_not() {
        let of = |way: Option<[f64; 2]>| {
            let way = way.map(|[value, sigma]| Estimate { value, sigma });
            let odometry_scale = OdometryScale { way, ..OdometryScale::default() };
            let matcher = MatcherHealth {
                last_outcome: Some(Outcome::Matched),
                last_odometry: Odometry::Used,
                odometry_scale,
                ..MatcherHealth::default()
            };
            let status = of_matcher(&matcher);
            let way = status.values.into_iter().find(|value| value.key == "odometry_way_scale").unwrap();
            (status.message, way.value)
        };
        let reported = |message: &str, way: &str| (message.to_owned(), way.to_owned());
        assert_eq!(of(None), reported("matched", "-"));
        assert_eq!(of(Some([0.96, 0.004])), reported("matched", "0.9600 +-0.0040"));
        assert_eq!(
            of(Some([0.945, 0.019])),
            reported("matched", "0.9450 +-0.0190"),
            "three standard deviations"
        );
        let wrong = "matched; a meter of the odometry is 0.80 m";
        assert_eq!(of(Some([0.8, 0.004])), reported(wrong, "0.8000 +-0.0040"));
    }

    #[test]
    fn the_matcher_says_what_became_of_the_scan_and_of_the_odometry() {
        use Odometry::{Jumped, Missing, Stalled, Used};
        for (outcome, odometry, level, words) in [
            (None, Missing, DiagnosticStatus::STALE, "no scan yet"),
            (Some(Outcome::First), Missing, DiagnosticStatus::OK, "first scan"),
            (Some(Outcome::Matched), Used, DiagnosticStatus::OK, "matched"),
            (Some(Outcome::Matched), Missing, DiagnosticStatus::WARN, "matched; odometry missing"),
            (
                Some(Outcome::Weak),
                Stalled,
                DiagnosticStatus::WARN,
                "matched, weak in one direction; odometry stalled, not believed",
            ),
            (Some(Outcome::Lost), Used, DiagnosticStatus::WARN, "no match, follows the odometry"),
            (
                Some(Outcome::NoReturns),
                Jumped,
                DiagnosticStatus::WARN,
                "no returns, goes on with the last motion; odometry jumped, not believed",
            ),
        ] {
            let mut matcher = MatcherHealth { last_outcome: outcome, ..MatcherHealth::default() };
            matcher.note_odometry(odometry);
            let status = of_matcher(&matcher);
            assert_eq!((status.level, status.message.as_str()), (level, words));
        }
    }
}
