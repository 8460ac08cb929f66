//! What the robot said of itself in `/diagnostics`.

use biplane_recording::messages::{DiagnosticArray, KeyValue};

/// All figures, each with the device that it is of.
fn values(state: &DiagnosticArray) -> impl Iterator<Item = (&str, &KeyValue)> {
    state.status.iter().flat_map(|status| status.values.iter().map(|value| (status.name.as_str(), value)))
}

/// What a state of the robot says against how its lasers sit.
pub(crate) fn mountings(state: &DiagnosticArray) -> Vec<String> {
    values(state)
        .filter(|(_, value)| {
            value.key == "mounting" && !["fits", "not known yet"].contains(&value.value.as_str())
        })
        .map(|(name, value)| format!("{}: {}", name.trim_start_matches("biplane: "), value.value))
        .collect()
}

/// What a unit of the base's position was taken as, meters: by the rig, or by the base's subclass.
pub(crate) fn metres_per_tick(state: &DiagnosticArray) -> Option<f64> {
    let (_, value) = values(state).find(|(_, value)| value.key == "metres_per_tick")?;
    value.value.parse().ok().filter(|meters: &f64| meters.is_finite() && *meters > 0.0)
}
