//! Numbers as people read them.

use crate::model::turn::Turn;
pub(super) use crate::view::render::sheet::grouped;

/// A smaller turn is not worth a word, degrees.
const TURNED_DEG: f64 = 0.5;

/// That a drawing is turned, and by how much, where that is worth a word.
pub(super) fn turned_words(turn: &Turn) -> Option<String> {
    let turned_deg = turn.angle_rad.to_degrees();
    let way = if turned_deg > 0.0 { "counter-clockwise" } else { "clockwise" };
    let words = format!(
        " Drawn turned by {:.1} degrees {way}, so that walls lie along the page. The files beside this page are not turned.",
        turned_deg.abs()
    );
    (turned_deg.abs() >= TURNED_DEG).then_some(words)
}

/// Seconds as people say them.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", 1000.0 * s),
        s if s < 10.0 => format!("{s:.2} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
        s => format!("{:.0} h {:02.0} min", (s / 3600.0).floor(), (s / 60.0 % 60.0).floor()),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn durations_have_the_unit_that_suits_them() {
        let table = [
            (0.0123, "12 ms"),
            (3.456, "3.46 s"),
            (49.6, "50 s"),
            (150.0, "2 min 30 s"),
            (21_600.0, "6 h 00 min"),
        ];
        for (seconds, expected) in table {
            assert_eq!(duration(seconds), expected);
        }
    }
}
