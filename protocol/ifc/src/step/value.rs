//! Values of a STEP file (ISO 10303-21), and what readers ask them for.

use std::collections::BTreeMap;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// `$`, and `*` for what follows from other attributes.
    None,
    /// A whole or a real number.
    Number(f64),
    /// A text, or digits of a binary.
    Text(String),
    /// `.NAME.`, without the dots.
    Enum(String),
    /// `#123`.
    Reference(u64),
    /// `( ... )`.
    List(Vec<Value>),
    /// `NAME( ... )`, such as a measure.
    Typed(String, Vec<Value>),
}

static NOTHING: Value = Value::None;

impl Value {
    /// The number, also of a measure.
    #[must_use]
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            Self::Typed(_, values) => values.first().and_then(Self::number),
            _ => None,
        }
    }

    /// The text, also of a label.
    #[must_use]
    pub(crate) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            Self::Typed(_, values) => values.first().and_then(Self::text),
            _ => None,
        }
    }

    /// The number of the entity that is meant.
    #[must_use]
    pub(crate) fn reference(&self) -> Option<u64> {
        if let Self::Reference(id) = self { Some(*id) } else { None }
    }

    /// Whether it is this word between dots.
    #[must_use]
    pub(crate) fn is(&self, word: &str) -> bool {
        matches!(self, Self::Enum(own) if own == word)
    }

    /// The members of a list; nothing for anything else.
    #[must_use]
    pub(crate) fn list(&self) -> &[Value] {
        match self {
            Self::List(values) => values,
            _ => &[],
        }
    }

    /// The numbers of a list.
    #[must_use]
    pub(crate) fn numbers(&self) -> Vec<f64> {
        self.list().iter().filter_map(Self::number).collect()
    }
}

/// An instance: its type in upper case and its attributes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entity {
    /// Type, such as `IFCWALL`; empty for one of several types at once.
    pub kind: String,
    /// Attributes, those of supertypes first.
    pub attributes: Vec<Value>,
}

impl Entity {
    /// An attribute by its place; nothing where there are fewer.
    #[must_use]
    pub(crate) fn at(&self, index: usize) -> &Value {
        self.attributes.get(index).unwrap_or(&NOTHING)
    }
}

/// All instances of a file by their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Step {
    /// Of the header, such as `IFC4`; empty when it names none.
    pub schema: String,
    pub(crate) entities: BTreeMap<u64, Entity>,
}

impl Step {
    /// An instance by its number.
    #[must_use]
    pub(crate) fn get(&self, id: u64) -> Option<&Entity> {
        self.entities.get(&id)
    }

    /// The instance that a value refers to.
    #[must_use]
    pub(crate) fn follow(&self, value: &Value) -> Option<&Entity> {
        self.get(value.reference()?)
    }

    /// All instances of one of these types, by number.
    pub(crate) fn all<'a>(&'a self, kinds: &'a [&str]) -> impl Iterator<Item = (u64, &'a Entity)> + 'a {
        let wanted = move |entity: &&Entity| kinds.contains(&entity.kind.as_str());
        self.entities.iter().filter(move |(_, entity)| wanted(entity)).map(|(id, entity)| (*id, entity))
    }
}
