//! Values taken out of a TOML table, each with its key and line for the case that it is wrong.

use super::RigError;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

type Value<'a> = Spanned<DeValue<'a>>;

/// A table of the text: its name with a dot behind it (empty for the whole text), its keys.
pub(crate) struct Table<'a> {
    text: &'a str,
    prefix: String,
    keys: &'a DeTable<'a>,
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
    pub(crate) fn whole(text: &'a str, keys: &'a DeTable<'a>) -> Self {
        Self { text, prefix: String::new(), keys }
    }

    fn get(&self, key: &str) -> Option<&'a Value<'a>> {
        self.keys.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    /// The error that a key's value is not allowed.
    pub(crate) fn refuse(&self, key: &str, allowed: &str) -> RigError {
        let key_path = format!("{}{key}", self.prefix);
        match self.get(key) {
            Some(value) => RigError::Value {
                line: line_at(self.text, value.span().start),
                key: key_path,
                found: describe(value.get_ref()),
                allowed: allowed.to_owned(),
            },
            None => RigError::MissingKey { key: key_path },
        }
    }

    /// Refuses every key that is not among `known`.
    pub(crate) fn only(&self, known: &[&str]) -> Result<(), RigError> {
        for (key, _) in self.keys {
            if !known.contains(&key.get_ref().as_ref()) {
                return Err(RigError::UnknownKey {
                    line: line_at(self.text, key.span().start),
                    key: format!("{}{}", self.prefix, key.get_ref()),
                    known: known.join(", "),
                });
            }
        }
        Ok(())
    }

    /// The table inside under a key; `None` when the key is not there.
    pub(crate) fn table(&self, key: &str) -> Result<Option<Table<'a>>, RigError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let keys = value.get_ref().as_table().ok_or_else(|| self.refuse(key, "a table"))?;
        Ok(Some(Table { text: self.text, prefix: format!("{}{key}.", self.prefix), keys }))
    }

    /// A number within bounds, inclusive; integers are numbers.
    pub(crate) fn number(&self, key: &str, default: f64, (low, high): (f64, f64)) -> Result<f64, RigError> {
        let Some(value) = self.get(key) else { return Ok(default) };
        as_number(value.get_ref())
            .filter(|number| *number >= low && *number <= high)
            .ok_or_else(|| self.refuse(key, &format!("a number from {low} to {high}")))
    }

    /// One of a few numbers.
    pub(crate) fn one_of(&self, key: &str, default: f64, allowed: &[f64]) -> Result<f64, RigError> {
        let Some(value) = self.get(key) else { return Ok(default) };
        as_number(value.get_ref()).filter(|number| allowed.contains(number)).ok_or_else(|| {
            let words: Vec<String> = allowed.iter().map(f64::to_string).collect();
            self.refuse(key, &words.join(", "))
        })
    }

    /// Whether a key is there.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Yes or no; `None` when the key is not there.
    pub(crate) fn flag(&self, key: &str) -> Result<Option<bool>, RigError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        value.get_ref().as_bool().map(Some).ok_or_else(|| self.refuse(key, "true, false"))
    }

    /// One of a few words.
    pub(crate) fn word(
        &self,
        key: &str,
        default: &'static str,
        allowed: &[&'static str],
    ) -> Result<&'static str, RigError> {
        let Some(value) = self.get(key) else { return Ok(default) };
        let text = value.get_ref().as_str();
        allowed.iter().copied().find(|word| Some(*word) == text).ok_or_else(|| {
            let words: Vec<String> = allowed.iter().map(|word| format!("{word:?}")).collect();
            self.refuse(key, &words.join(", "))
        })
    }

    /// A text that must be there and is not empty.
    pub(crate) fn text(&self, key: &str) -> Result<String, RigError> {
        let text = self.get(key).and_then(|value| value.get_ref().as_str()).filter(|text| !text.is_empty());
        text.map(str::to_owned).ok_or_else(|| self.refuse(key, "a text, for example \"/dev/ttyUSB0\""))
    }
}
