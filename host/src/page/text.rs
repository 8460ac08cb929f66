//! Words and numbers as HTML and JSON that cannot end what they stand in.

pub use crate::render::sheet::grouped;

/// Text for an element or an attribute.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

/// JSON for a `<script>` element: no `<` can end it.
pub fn inline_json(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// Seconds as people say them.
pub fn duration(seconds: f64) -> String {
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
    use super::{duration, escaped, inline_json};

    #[test]
    fn nothing_in_a_text_is_markup() {
        assert_eq!(escaped("a<b>&'\"</script>"), "a&lt;b&gt;&amp;&#39;&quot;&lt;/script&gt;");
        assert_eq!(inline_json("{\"a\":\"</script><!--\"}"), "{\"a\":\"\\u003c/script>\\u003c!--\"}");
    }

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
