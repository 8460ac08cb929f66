//! Text inside HTML and SVG that cannot end what it stands in.

/// Text for an element or an attribute.
pub(crate) fn escaped(text: &str) -> String {
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
pub(crate) fn inline_json(json: &str) -> String {
    json.replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::{escaped, inline_json};

    #[test]
    fn nothing_in_a_text_is_markup() {
        assert_eq!(escaped("a<b>&'\"</script>"), "a&lt;b&gt;&amp;&#39;&quot;&lt;/script&gt;");
        assert_eq!(inline_json("{\"a\":\"</script><!--\"}"), "{\"a\":\"\\u003c/script>\\u003c!--\"}");
    }
}
