//! Lines for people on stderr, results on stdout. A reader that has gone is no failure of the program.

use std::io::Write;

use textwrap::{Options, WordSplitter};

/// Writes a line to stderr, whoever reads it or not.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Writes a result to stdout, whoever reads it or not.
pub fn print_result(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// A text in lines of at most so many letters, broken at blanks only, each after the same prefix.
#[must_use]
pub fn paragraph(text: &str, width: usize, prefix: &str) -> String {
    // A hyphen belongs to a flag or a name: broken there, nobody could search for it.
    let at_blanks = Options::new(width).word_splitter(WordSplitter::NoHyphenation).break_words(false);
    textwrap::wrap(text, at_blanks).iter().map(|line| format!("{prefix}{line}\n")).collect()
}

/// Breaks a list of `name value` or `name = value` into lines as [`paragraph`] does, but never between a name
/// and its value.
#[must_use]
pub fn list(text: &str, width: usize, prefix: &str) -> String {
    /// A blank at which no line is broken.
    const NO_BREAK: &str = "\u{a0}";
    let joined: Vec<String> = text.split(", ").map(|item| item.replace(' ', NO_BREAK)).collect();
    paragraph(&joined.join(", "), width, prefix).replace(NO_BREAK, " ")
}

#[cfg(test)]
mod tests {
    use super::{list, paragraph};

    #[test]
    fn a_list_breaks_between_its_items_only() {
        assert_eq!(list("a 1, bb = 2, c 3", 10, "  "), "  a 1,\n  bb = 2,\n  c 3\n");
        assert_eq!(paragraph("a 1, bb = 2, c 3", 10, "  "), "  a 1, bb =\n  2, c 3\n");
    }

    #[test]
    fn lines_break_at_blanks_and_never_in_a_flag() {
        assert_eq!(paragraph("aa --min-size bb", 9, "  "), "  aa\n  --min-size\n  bb\n");
        assert_eq!(paragraph("", 9, "# "), "# \n");
    }
}
