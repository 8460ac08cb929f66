//! Reasons of the system and of libraries, in plain English.

/// What the system adds to its reasons.
const NUMBER: &str = " (os error ";
const NO_FILE: &str = "No such file or directory";

/// An error's text without the system's numbers. What cannot be read because it is not there does not exist.
///
/// ```
/// # use biplane_cli::plain_error;
/// let text = "cannot read a.ply: No such file or directory (os error 2)";
/// assert_eq!(plain_error(text), "a.ply does not exist");
/// assert_eq!(plain_error("cannot read /b: Permission denied (os error 13)"), "cannot read /b: Permission denied");
/// ```
#[must_use]
pub fn plain_error(text: &str) -> String {
    let text = without_numbers(text);
    let Some(rest) = text.strip_prefix("cannot read ") else { return text };
    let Some((path, hint)) = rest.split_once(": ") else { return text };
    match hint.strip_suffix(NO_FILE) {
        Some(hint) => format!("{path} does not exist{}", before(hint.trim_end_matches(": "))),
        None => text,
    }
}

/// A hint behind a colon; none where there is none.
fn before(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!(": {hint}") }
}

fn without_numbers(text: &str) -> String {
    let mut pieces = text.split(NUMBER);
    let mut plain = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        match piece.split_once(')') {
            Some((number, rest)) if number.bytes().all(|byte| byte.is_ascii_digit()) => plain.push_str(rest),
            _ => [NUMBER, piece].iter().for_each(|part| plain.push_str(part)),
        }
    }
    plain
}

/// Why a word is no number, from the reasons of the libraries; `None` for any other reason.
pub(crate) fn plain_number(reason: &str) -> Option<String> {
    let range = reason.split_once(" is not in ").map(|(_, range)| range);
    match (reason, range) {
        (_, Some(range)) => {
            let (from, to) = range.split_once("..=").or_else(|| range.split_once(".."))?;
            Some(match (from, to) {
                (from, "") => format!("expected a whole number, {from} or more"),
                ("", to) => format!("expected a whole number, {to} or less"),
                (from, to) => format!("expected a whole number from {from} to {to}"),
            })
        }
        ("invalid float literal" | "cannot parse float from empty string", _) => {
            Some("expected a number".to_owned())
        }
        ("invalid digit found in string" | "cannot parse integer from empty string", _) => {
            Some("expected a whole number".to_owned())
        }
        ("number too large to fit in target type", _) => {
            Some("expected a whole number, and a smaller one".to_owned())
        }
        ("number too small to fit in target type", _) => {
            Some("expected a whole number, 0 or more".to_owned())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{plain_error, plain_number};

    #[test]
    fn what_is_not_there_does_not_exist_whatever_else_is_said() {
        for (text, plain) in [
            ("cannot read rig r.toml: No such file or directory (os error 2)", "rig r.toml does not exist"),
            (
                "cannot read d/summary.json: is d a folder of `biplane build`?: No such file or directory (os error 2)",
                "d/summary.json does not exist: is d a folder of `biplane build`?",
            ),
            (
                "cannot write d/a: No such file or directory (os error 2)",
                "cannot write d/a: No such file or directory",
            ),
            ("a (os error x) b", "a (os error x) b"),
            ("nothing of it", "nothing of it"),
        ] {
            assert_eq!(plain_error(text), plain);
        }
    }

    #[test]
    fn reasons_of_numbers_say_what_is_expected() {
        for (reason, plain) in [
            ("0 is not in 1..=65535", "expected a whole number from 1 to 65535"),
            ("-1 is not in 0..", "expected a whole number, 0 or more"),
            ("invalid digit found in string", "expected a whole number"),
            ("invalid float literal", "expected a number"),
        ] {
            assert_eq!(plain_number(reason).as_deref(), Some(plain));
        }
        assert_eq!(plain_number("expected meters"), None);
    }
}
