//! The health of devices, matcher and recorder in `biplane info`: the figures of the last diagnostics, and in
//! words what the names among them mean that do not say it themselves.

use std::io::{self, Write};

use biplane_cli::{list, paragraph};

use crate::recordings::info::Health;

/// Letters of a paragraph beside its indentation: the lines then fit into a terminal of 80 columns.
const WIDTH: usize = 76;

/// Explained only where there are some: most runs have none.
const OVERRUNS: &str = "overruns";

/// What a figure is that its name does not explain; the names are those of `/diagnostics`.
const MEANINGS: [(&str, &str); 9] = [
    (
        "latency_ms",
        "longest time from a stamp to the arrival of its measurement (matcher: to the pose of its scan), \
         in the last second",
    ),
    (
        "from_last_byte_",
        "time from the last byte that a pose needed until the pose was in the file; p50: of half of all poses \
         no longer, p99_9: of 999 of 1000",
    ),
    ("from_scan_", "the same from the last byte of the pose's scan, so it includes the wait for odometry"),
    (
        "untold",
        "events that log and status left out, because their reader was too slow; the recording has everything",
    ),
    ("not_kept", "intact telegrams that were not understood and are not in the recording"),
    ("left_out_scans", "scans that the laser measured and did not send, because its line was busy"),
    ("unmatched", "poses that follow the odometry, because no match was found"),
    (
        OVERRUNS,
        "times that a port's buffer was full before this computer read it; what was lost so is in crc_errors, \
         cut_telegrams and skipped_bytes",
    ),
    ("waiting", "scans that waited for odometry when this was written"),
];

/// Prints the health of all, and below it what some names mean.
pub(super) fn print(out: &mut impl Write, health: &[Health]) -> io::Result<()> {
    for one in health {
        let values: Vec<String> = one.values.iter().map(|(key, value)| format!("{key} {value}")).collect();
        writeln!(out, "  health of {}: {}", one.name, one.message)?;
        out.write_all(list(&values.join(", "), WIDTH, "    ").as_bytes())?;
    }
    let is_there = |name: &str| {
        let mut all = health.iter().flat_map(|one| &one.values);
        all.any(|(key, value)| key.starts_with(name) && (name != OVERRUNS || value != "0"))
    };
    let meanings: Vec<_> = MEANINGS.iter().filter(|(name, _)| is_there(name)).collect();
    if !meanings.is_empty() {
        writeln!(out, "  meaning of these names:")?;
    }
    for (name, meaning) in meanings {
        out.write_all(paragraph(&format!("{name}: {meaning}"), WIDTH, "    ").as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_do_not_say_it_themselves_are_explained_once_within_80_columns() {
        let health = |name: &str, keys: &[&str]| Health {
            name: name.to_owned(),
            level: 0,
            message: "streams".to_owned(),
            values: keys.iter().map(|key| ((*key).to_owned(), "1".to_owned())).collect(),
        };
        let printed = |all: &[Health]| {
            let mut out = Vec::new();
            print(&mut out, all).unwrap();
            String::from_utf8(out).unwrap()
        };
        let delays = ["from_last_byte_max_ms", "from_last_byte_p50_ms", "from_scan_p50_ms"];
        let text = printed(&[
            health("laser", &["latency_ms", "restarts"]),
            health("base", &["latency_ms"]),
            health("delays", &delays),
            health("recorder", &["untold"]),
        ]);
        for name in ["latency_ms: ", "from_last_byte_: ", "from_scan_: ", "untold: "] {
            assert_eq!(text.matches(name).count(), 1, "{name} in {text}");
        }
        assert!(!text.contains("not_kept") && text.lines().all(|line| line.len() <= 80), "{text}");
        assert!(!printed(&[health("base", &["restarts"])]).contains("meaning"));
        let laser = health("laser", &["overruns"]);
        assert!(printed(std::slice::from_ref(&laser)).contains("overruns: times that a port's buffer"));
        let without = Health { values: [("overruns".to_owned(), "0".to_owned())].into(), ..laser };
        assert!(!printed(&[without]).contains("meaning"));
    }
}
