//! Choices as a person reads them.

use super::placed::Placed;

/// Topics with their numbers of messages.
pub(crate) fn topics<'a>(all: impl Iterator<Item = (&'a str, usize)>) -> String {
    let words: Vec<String> = all.map(|(topic, count)| format!("{topic} ({count} messages)")).collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

/// Lasers with what tells them apart, one a line.
pub(crate) fn lasers(all: &[Placed<'_>]) -> String {
    let line = |laser: &Placed<'_>| {
        let seen = laser.seen;
        let rate = seen.periods(seen.is_unstamped()).map_or(0.0, |(period_ns, ..)| 1e9 / period_ns as f64);
        let mount = match &laser.mount {
            Some(place) => format!(
                "at x {:.3}, y {:.3}, z {:.3} m, roll {:.1}, pitch {:.1}, yaw {:.1} deg: {}",
                place.x,
                place.y,
                place.z,
                place.roll,
                place.pitch,
                place.yaw,
                laser.fan.name()
            ),
            None => "no transform to it".to_owned(),
        };
        let (topic, frame, scans) = (&seen.topic, &seen.frame, seen.scans);
        format!("\n  {topic}@{frame}: {scans} scans of {} beams, {rate:.1} Hz, {mount}", seen.usual_beams())
    };
    all.iter().map(line).collect()
}
