//! What a P2OS base counts in, by its subclass.

/// Subclass of a base that nobody named: a Pioneer 3-DX with serial sonars, which counts in millimeters.
pub const DEFAULT_SUBCLASS: &str = "p3dx-sh";

/// Length of a unit of position of a subclass, meters, as clients' parameter files have it; 1 mm where they
/// end in `-sh`, and for subclasses that are not known here.
#[must_use]
pub fn metres_per_tick(subclass: &str) -> f64 {
    let millimeters = match subclass {
        "p3dx" | "p2d8" | "p2d8+" | "p2df" | "p2pp" => 0.485,
        "p3at" | "p2at8+" => 0.465,
        "p2at" | "p2at8" => 1.32,
        "p2dx" => 0.84,
        "p2de" => 0.969,
        "p2ce" => 0.826,
        "p2it" => 1.136,
        "p2pb" => 0.424,
        "amigo" => 0.5083,
        _ => 1.0,
    };
    millimeters * 1e-3
}
