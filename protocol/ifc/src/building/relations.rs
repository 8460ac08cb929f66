//! Which element is part of what, lies where, is cut or filled by what.

use std::collections::BTreeMap;

use crate::step::value::{Step, Value};

/// Parts of parts deeper than this are a circle.
const MAX_DEPTH: usize = 32;

/// The relations of a file that its geometry and its storeys follow from.
#[derive(Debug, Default)]
pub(crate) struct Relations {
    /// Whole of a part.
    pub whole_of: BTreeMap<u64, u64>,
    /// Structure that an element is contained in.
    pub container_of: BTreeMap<u64, u64>,
    /// Openings of an element.
    pub openings_of: BTreeMap<u64, Vec<u64>>,
    /// What fills an opening.
    pub fillings_of: BTreeMap<u64, Vec<u64>>,
}

impl Relations {
    pub(crate) fn of(step: &Step) -> Self {
        let mut relations = Self::default();
        for (_, rel) in step.all(&["IFCRELAGGREGATES", "IFCRELNESTS"]) {
            let Some(whole) = rel.at(4).reference() else { continue };
            for part in rel.at(5).list().iter().filter_map(Value::reference) {
                relations.whole_of.insert(part, whole);
            }
        }
        for (_, rel) in step.all(&["IFCRELCONTAINEDINSPATIALSTRUCTURE"]) {
            let Some(structure) = rel.at(5).reference() else { continue };
            for element in rel.at(4).list().iter().filter_map(Value::reference) {
                relations.container_of.insert(element, structure);
            }
        }
        for (kind, map) in [
            ("IFCRELVOIDSELEMENT", &mut relations.openings_of),
            ("IFCRELFILLSELEMENT", &mut relations.fillings_of),
        ] {
            for (_, rel) in step.all(&[kind]) {
                if let (Some(whole), Some(part)) = (rel.at(4).reference(), rel.at(5).reference()) {
                    map.entry(whole).or_default().push(part);
                }
            }
        }
        relations
    }

    /// The storey of an element, through its structures and wholes.
    pub(crate) fn storey_of(&self, step: &Step, element: u64) -> Option<u64> {
        let mut at = element;
        for _ in 0..MAX_DEPTH {
            if step.get(at).is_some_and(|entity| entity.kind == "IFCBUILDINGSTOREY") {
                return Some(at);
            }
            at = *self.container_of.get(&at).or_else(|| self.whole_of.get(&at))?;
        }
        None
    }
}
