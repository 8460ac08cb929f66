//! What a Pioneer's units are worth, by the subclass that it tells in the answer to SYNC2 (parameter files of
//! AriaCoda and Player). Bases of ARCOS, whose subclass ends in `-sh`, count millimeters.

use std::f64::consts::TAU;

/// Length of a position unit where nothing is known, meters.
pub(crate) const UNKNOWN_METRES_PER_TICK: f64 = 0.001;

/// Units of a base.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Parameters {
    /// Length of a unit of x and y, meters.
    pub metres_per_tick: f64,
    /// Angle of a unit of heading, radians.
    pub radians_per_unit: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { metres_per_tick: UNKNOWN_METRES_PER_TICK, radians_per_unit: TAU / 4096.0 }
    }
}

/// Millimeters a unit of position, for subclasses that divide a turn into 4096.
const BY_SUBCLASS: [(&str, f64); 15] = [
    ("p3dx", 0.485),
    ("p2d8", 0.485),
    ("p2d8+", 0.485),
    ("p2df", 0.485),
    ("p2pp", 0.485),
    ("p3at", 0.465),
    ("p2at8+", 0.465),
    ("p2at", 1.32),
    ("p2at8", 1.32),
    ("p2dx", 0.84),
    ("p2de", 0.969),
    ("p2ce", 0.826),
    ("p2it", 1.136),
    ("p2pb", 0.424),
    ("amigo", 0.5083),
];

/// The oldest bases: 0.05066 mm, and 1024 units a turn.
const OLDEST: [&str; 4] = ["pion1m", "pion1x", "pionat", "psos1"];

impl Parameters {
    /// What is known of a subclass.
    #[must_use]
    pub(crate) fn of_subclass(subclass: &str) -> Option<Self> {
        let subclass = subclass.trim();
        let of_mm = |mm: f64| Self { metres_per_tick: mm * 1e-3, ..Self::default() };
        if subclass.len() > 3 && ends_with(subclass, "-sh") {
            return Some(of_mm(1.0));
        }
        if OLDEST.iter().any(|oldest| starts_with(subclass, oldest)) {
            return Some(Self { metres_per_tick: 0.05066e-3, radians_per_unit: TAU / 1024.0 });
        }
        let known = BY_SUBCLASS.iter().find(|(name, _)| name.eq_ignore_ascii_case(subclass));
        known.map(|&(_, mm)| of_mm(mm))
    }
}

fn starts_with(text: &str, start: &str) -> bool {
    text.get(..start.len()).is_some_and(|head| head.eq_ignore_ascii_case(start))
}

fn ends_with(text: &str, end: &str) -> bool {
    let at = text.len().checked_sub(end.len());
    at.and_then(|at| text.get(at..)).is_some_and(|tail| tail.eq_ignore_ascii_case(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subclasses_of_the_table_have_their_units() {
        // Subclass, millimeters a unit, units a turn.
        let table = [
            ("p3dx-sh", 1.0, 4096.0),
            ("PeopleBot-SH", 1.0, 4096.0),
            ("p3dx", 0.485, 4096.0),
            ("p2d8+", 0.485, 4096.0),
            ("p3at", 0.465, 4096.0),
            ("p2at8", 1.32, 4096.0),
            ("amigo", 0.5083, 4096.0),
            ("pion1m", 0.05066, 1024.0),
            ("psos1x", 0.05066, 1024.0),
        ];
        for (subclass, mm, units) in table {
            let parameters = Parameters::of_subclass(subclass).expect(subclass);
            assert!((parameters.metres_per_tick * 1e3 - mm).abs() < 1e-12, "{subclass}");
            assert!((parameters.radians_per_unit * units - TAU).abs() < 1e-12, "{subclass}");
        }
        for unknown in ["", "-sh", "p4dx", "p3", "robot"] {
            assert_eq!(Parameters::of_subclass(unknown), None, "{unknown}");
        }
    }
}
