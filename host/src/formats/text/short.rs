//! The start of a line, as errors show it.

/// Characters that are shown.
const SHOWN_CHARS: usize = 60;

/// The start of a text, without blanks around it.
pub(crate) fn short(text: &str) -> String {
    text.trim().chars().take(SHOWN_CHARS).collect()
}
