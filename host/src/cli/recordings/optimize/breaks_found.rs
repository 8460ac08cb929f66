//! What `optimize` and `build` say of places where a recording's way breaks.

use crate::slam::Counts;

/// What is to be said of breaks in the way.
pub(super) fn words(counts: &Counts) -> Option<String> {
    let places = match counts.breaks {
        0 => return None,
        1 => "at one place".to_owned(),
        many => format!("at {many} places"),
    };
    let left = match counts.breaks_left {
        0 => "loops join what came before and after".to_owned(),
        left if left == counts.breaks => {
            "no loop tells where it went on, so the recorded poses go on there".to_owned()
        }
        left => {
            format!("no loop tells where it went on at {left} of them, so the recorded poses go on there")
        }
    };
    Some(format!(
        "biplane: {places} the scans show another place than the ones before (the robot was carried, or its \
         laser was covered); {left}"
    ))
}

#[cfg(test)]
mod tests {
    use super::words;
    use crate::slam::Counts;

    #[test]
    fn breaks_are_counted_and_those_that_nothing_joins_are_told() {
        let of =
            |breaks: usize, breaks_left: usize| words(&Counts { breaks, breaks_left, ..Counts::default() });
        assert_eq!(of(0, 0), None);
        assert!(of(1, 0).unwrap().contains("at one place") && of(1, 0).unwrap().contains("; loops join"));
        assert!(of(3, 3).unwrap().contains("at 3 places") && of(3, 3).unwrap().contains("; no loop tells"));
        assert!(of(3, 1).unwrap().contains("at 1 of them"));
    }
}
