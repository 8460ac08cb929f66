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

#[cfg(test)]
mod tests {
    use super::paragraph;

    #[test]
    fn lines_break_at_blanks_and_never_in_a_flag() {
        assert_eq!(paragraph("aa --min-size bb", 9, "  "), "  aa\n  --min-size\n  bb\n");
        assert_eq!(paragraph("", 9, "# "), "# \n");
    }
}
