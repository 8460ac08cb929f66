//! What is known of an element, and how: the property set `Biplane_Evidence`.

use super::Architecture;
use crate::formats::ifc::step::{Id, Ids, Text};

/// A value of a property.
pub(super) enum Value<'a> {
    /// A word.
    Word(&'a str),
    /// A share from 0 to 1.
    Share(f64),
    /// A length, meters.
    Length(f64),
    /// An area, square meters.
    Area(f64),
    /// Yes or no.
    Flag(bool),
}

impl Value<'_> {
    fn text(&self) -> String {
        match self {
            Self::Word(word) => format!("IFCLABEL({})", Text(word)),
            Self::Share(share) => format!("IFCREAL({share:.4})"),
            Self::Length(length_m) => format!("IFCLENGTHMEASURE({length_m:.4})"),
            Self::Area(area_m2) => format!("IFCAREAMEASURE({area_m2:.4})"),
            Self::Flag(true) => "IFCBOOLEAN(.T.)".to_owned(),
            Self::Flag(false) => "IFCBOOLEAN(.F.)".to_owned(),
        }
    }
}

impl Architecture<'_> {
    /// Gives an element a set of properties.
    pub(super) fn properties(&mut self, element: Id, name: &str, set: &str, values: &[(&str, Value<'_>)]) {
        let values: Vec<Id> = values
            .iter()
            .map(|(property, value)| {
                self.step.add(format_args!("IFCPROPERTYSINGLEVALUE('{property}',$,{},$)", value.text()))
            })
            .collect();
        let owner = self.project.owner;
        let [own, has] = ["", "has "].map(|word| self.id(format_args!("{word}{set} of {name}")));
        let set = self.step.add(format_args!("IFCPROPERTYSET('{own}',{owner},'{set}',$,{})", Ids(&values)));
        self.step.add(format_args!("IFCRELDEFINESBYPROPERTIES('{has}',{owner},$,$,({element}),{set})"));
    }

    /// Says how an element is known.
    pub(super) fn evidence(&mut self, element: Id, name: &str, values: &[(&str, Value<'_>)]) {
        self.properties(element, name, "Biplane_Evidence", values);
    }
}
