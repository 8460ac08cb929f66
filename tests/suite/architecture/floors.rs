//! The floors of each crate: a module takes names only from its own floor and from those before it in the
//! list.

/// A crate's sources and its floors, lowest first. Modules of one floor stand side by side.
pub(super) struct Crate {
    pub(super) source: &'static str,
    pub(super) floors: &'static [&'static [&'static str]],
}

/// Folders that hold state machines: bytes and times in, commands out.
pub(super) const WITHOUT_IO: [&str; 2] = ["firmware/onboard/src/session", "firmware/onboard/src/engine"];

pub(super) const CRATES: &[Crate] = &[
    Crate { source: "protocol/clock/src", floors: &[&["date"]] },
    Crate {
        source: "protocol/cli/src",
        floors: &[
            &["counted", "outcome", "output", "manual", "examples", "words", "plain"],
            &["ending"],
            &["memory"],
            &["thread"],
            &["interrupt"],
        ],
    },
    Crate {
        source: "protocol/wire/src",
        floors: &[
            &["error"],
            &["text", "cursor"],
            &["framing"],
            &["cola", "lms", "p2os", "rflex", "roboclaw", "scip", "xsens"],
        ],
    },
    Crate {
        source: "protocol/recording/src",
        floors: &[&["file_kind", "rig"], &["messages"], &["topics"], &["mcap"], &["capture"]],
    },
    Crate { source: "protocol/ifc/src", floors: &[&["step"], &["geometry"], &["building"]] },
    Crate {
        source: "firmware/matcher/src",
        floors: &[
            &["parameter_group"],
            &["placement", "lanes"],
            &["scan"],
            &["map"],
            &["moving", "registration"],
            &["motion"],
            &["pose_covariance"],
            &["params"],
            &["tracker"],
        ],
    },
    Crate {
        source: "firmware/onboard/src",
        floors: &[
            &["types"],
            &["session"],
            &["stamping"],
            &["engine"],
            &["output"],
            &["live"],
            &["io"],
            &["record"],
            &["replay"],
            &["cli"],
        ],
    },
    Crate {
        source: "host/src",
        floors: &[
            &["model"],
            &["recordings"],
            &["slam"],
            &["calibrate"],
            &["metrics"],
            &["reconstruct"],
            &["building"],
            &["formats"],
            &["pipeline"],
            &["view"],
            &["cli"],
        ],
    },
    Crate {
        source: "hil-fixtures/src",
        floors: &[
            &["rng"],
            &["world"],
            &["rig"],
            &["line"],
            &["devices"],
            &["faults"],
            &["capture"],
            &["simulate"],
            &["serve"],
            &["cli"],
        ],
    },
];
