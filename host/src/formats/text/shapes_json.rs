//! `shapes.json`: the round things of a model. Frame `map`, meters, degrees.

use std::io::{self, Write};

use serde_json::{Value, json};

use crate::formats::Shapes;
use crate::formats::input::shift::restored;
use crate::model::cylinder::{CHORD_ERROR_M, Cylinder};

/// Writes the file.
///
/// # Errors
/// When writing fails.
pub(crate) fn write(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    let cylinders: Vec<Value> =
        shapes.model.cylinders.iter().map(|one| figures(one, shapes.shift_m)).collect();
    let document = json!({ "chord_error_m": CHORD_ERROR_M, "cylinders": cylinders });
    serde_json::to_writer_pretty(&mut *out, &document)?;
    writeln!(out)
}

/// The figures of one cylinder, as they stand in files.
pub(crate) fn figures(one: &Cylinder, shift_m: [f64; 3]) -> Value {
    json!({
        "kind": one.kind,
        "axis_point_m": restored(one.axis_point_m, shift_m),
        "axis_direction": one.axis_direction,
        "radius_m": one.radius_m,
        "from_m": one.from_m,
        "to_m": one.to_m,
        "seen_from_m": one.seen_m[0],
        "seen_to_m": one.seen_m[1],
        "arc_deg": one.arc_deg,
        "seen_arc_deg": one.seen_arc_deg,
        "zero_direction": one.zero(),
        "seen_from": one.seen_from,
        "points": one.points,
        "rms_m": one.rms_m,
    })
}

#[cfg(test)]
mod tests {
    use super::write;
    use crate::formats::Shapes;
    use crate::model::{Model, sample};
    use serde_json::Value;

    #[test]
    fn a_column_is_written_with_all_that_the_contract_names() {
        let model = Model { cylinders: vec![sample::column()], ..sample::model() };
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes { shift_m: [10.0, 0.0, 0.0], ..Shapes::new(&model) }).unwrap();
        let document: Value = serde_json::from_slice(&bytes).unwrap();
        let column = &document["cylinders"][0];
        for name in [
            "kind",
            "axis_point_m",
            "axis_direction",
            "radius_m",
            "from_m",
            "to_m",
            "arc_deg",
            "seen_from",
            "points",
            "rms_m",
        ] {
            assert!(!column[name].is_null(), "{name}");
        }
        assert_eq!((&column["kind"], &column["seen_from"]), (&"column".into(), &"outside".into()));
        assert_eq!(column["axis_point_m"][0], 11.0);
    }
}
