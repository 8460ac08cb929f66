//! Values taken out of a TOML table. What is wrong is noted with its key and line, and reading goes on with
//! the default, so that a person is told of all faults at once.

use super::RigError;
use std::cell::RefCell;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

type Value<'a> = Spanned<DeValue<'a>>;

/// What was found wrong so far.
#[derive(Default)]
pub(crate) struct Faults(RefCell<Vec<RigError>>);

impl Faults {
    pub(crate) fn note(&self, fault: RigError) {
        self.0.borrow_mut().push(fault);
    }

    /// All that was noted.
    pub(crate) fn into_vec(self) -> Vec<RigError> {
        self.0.into_inner()
    }
}

/// A table of the text: its name with a dot behind it (empty for the whole text), where it begins, its keys.
pub(crate) struct Table<'a> {
    text: &'a str,
    prefix: String,
    line: Option<usize>,
    keys: &'a DeTable<'a>,
    faults: &'a Faults,
}

/// The line of a byte, counted from 1.
pub(crate) fn line_at(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|byte| *byte == b'\n').count() + 1
}

fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

fn as_number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|number| number as f64)
        }
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}

impl<'a> Table<'a> {
    pub(crate) fn whole(text: &'a str, keys: &'a DeTable<'a>, faults: &'a Faults) -> Self {
        Self { text, prefix: String::new(), line: None, keys, faults }
    }

    fn get(&self, key: &str) -> Option<&'a Value<'a>> {
        self.keys.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    fn path(&self, key: &str) -> String {
        format!("{}{key}", self.prefix)
    }

    /// Notes that a key's value is not allowed, or that it is missing.
    pub(crate) fn refuse(&self, key: &str, allowed: &str) {
        self.faults.note(match self.get(key) {
            Some(value) => RigError::Value {
                line: line_at(self.text, value.span().start),
                key: self.path(key),
                found: describe(value.get_ref()),
                allowed: allowed.to_owned(),
            },
            None => RigError::MissingKey { line: self.line, key: self.path(key) },
        });
    }

    /// Whether nothing was noted about these keys: what depends on them can be judged.
    pub(crate) fn are_sound(&self, keys: &[&str]) -> bool {
        let paths: Vec<String> = keys.iter().map(|key| self.path(key)).collect();
        !self
            .faults
            .0
            .borrow()
            .iter()
            .any(|fault| fault.key().is_some_and(|refused| paths.iter().any(|path| path.as_str() == refused)))
    }

    /// Refuses every key that is not among `known`.
    pub(crate) fn only(&self, known: &[&str]) {
        self.only_but(known, "");
    }

    /// The same but for one key, which is judged elsewhere.
    pub(crate) fn only_but(&self, known: &[&str], other: &str) {
        let is_known = |key: &str| key == other || known.contains(&key);
        for (key, _) in self.keys.iter().filter(|(key, _)| !is_known(key.get_ref())) {
            self.faults.note(RigError::UnknownKey {
                line: line_at(self.text, key.span().start),
                key: self.path(key.get_ref()),
                known: known.join(", "),
            });
        }
    }

    /// The table inside under a key; `None` when the key is not there.
    pub(crate) fn table(&self, key: &str) -> Option<Table<'a>> {
        if self.has(key) && self.inner(key).is_none() {
            self.refuse(key, "a table");
        }
        self.inner(key)
    }

    /// The same, where nothing else under the key is noted again.
    pub(crate) fn inner(&self, key: &str) -> Option<Table<'a>> {
        let value = self.get(key)?;
        let keys = value.get_ref().as_table()?;
        let line = Some(line_at(self.text, value.span().start));
        let prefix = format!("{}.", self.path(key));
        Some(Table { text: self.text, prefix, line, keys, faults: self.faults })
    }

    /// A number within bounds, inclusive; integers are numbers.
    pub(crate) fn number(&self, key: &str, default: f64, (low, high): (f64, f64)) -> f64 {
        let Some(value) = self.get(key) else { return default };
        let number = as_number(value.get_ref()).filter(|number| *number >= low && *number <= high);
        number.unwrap_or_else(|| {
            self.refuse(key, &format!("a number from {low} to {high}"));
            default
        })
    }

    /// One of a few numbers.
    pub(crate) fn one_of(&self, key: &str, default: f64, allowed: &[f64]) -> f64 {
        self.one_of_or(key, default, allowed, &[])
    }

    /// The same, with numbers that are other words for one of them: taken, and not listed.
    pub(crate) fn one_of_or(&self, key: &str, default: f64, allowed: &[f64], also: &[f64]) -> f64 {
        let Some(value) = self.get(key) else { return default };
        let is_allowed = |number: &f64| allowed.contains(number) || also.contains(number);
        as_number(value.get_ref()).filter(is_allowed).unwrap_or_else(|| {
            let words: Vec<String> = allowed.iter().map(f64::to_string).collect();
            self.refuse(key, &words.join(", "));
            default
        })
    }

    /// A text with its key and its line, where there is one.
    pub(crate) fn placed_text(&self, key: &str) -> Option<(String, usize, &'a str)> {
        let value = self.get(key)?;
        Some((self.path(key), line_at(self.text, value.span().start), value.get_ref().as_str()?))
    }

    /// Whether a key is there.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Yes or no; `None` when the key is not there.
    pub(crate) fn flag(&self, key: &str) -> Option<bool> {
        let value = self.get(key)?.get_ref().as_bool();
        if value.is_none() {
            self.refuse(key, "true, false");
        }
        value
    }

    /// One of a few words; `None` when it is another one.
    pub(crate) fn word(
        &self,
        key: &str,
        default: &'static str,
        allowed: &[&'static str],
    ) -> Option<&'static str> {
        let Some(value) = self.get(key) else { return Some(default) };
        let text = value.get_ref().as_str();
        let word = allowed.iter().copied().find(|word| Some(*word) == text);
        if word.is_none() {
            let words: Vec<String> = allowed.iter().map(|word| format!("{word:?}")).collect();
            self.refuse(key, &words.join(", "));
        }
        word
    }

    /// What a device speaks, one of a few words. A word that is none of these is answered with whose device
    /// each is, as nobody knows protocols by heart.
    pub(crate) fn protocol(
        &self,
        default: &'static str,
        known: &[(&'static str, &str)],
    ) -> Option<&'static str> {
        const KEY: &str = "protocol";
        let Some(value) = self.get(KEY) else { return Some(default) };
        let text = value.get_ref().as_str();
        let word = known.iter().map(|(word, _)| *word).find(|word| Some(*word) == text);
        if word.is_none() {
            let words: Vec<String> =
                known.iter().map(|(word, whose)| format!("{word:?} ({whose})")).collect();
            self.refuse(KEY, &words.join(", "));
        }
        word
    }

    /// A text that must be there and is not empty; empty when it is refused.
    pub(crate) fn text(&self, key: &str) -> String {
        let text = self.get(key).and_then(|value| value.get_ref().as_str()).unwrap_or_default();
        if text.is_empty() {
            self.refuse(key, "a text, for example \"/dev/ttyUSB0\"");
        }
        text.to_owned()
    }
}
