//! The rigs of `hil-fixtures/rigs`, part of the program: no file has to be found to use one.

/// Name and text of every rig.
pub const RIGS: [(&str, &str); 11] = [
    ("paper", include_str!("../../rigs/paper.toml")),
    ("outdoor", include_str!("../../rigs/outdoor.toml")),
    ("fast", include_str!("../../rigs/fast.toml")),
    ("millimetre", include_str!("../../rigs/millimetre.toml")),
    ("narrow", include_str!("../../rigs/narrow.toml")),
    ("planar", include_str!("../../rigs/planar.toml")),
    ("inertial", include_str!("../../rigs/inertial.toml")),
    ("lms111", include_str!("../../rigs/lms111.toml")),
    ("tim781", include_str!("../../rigs/tim781.toml")),
    ("ust20lx", include_str!("../../rigs/ust20lx.toml")),
    ("mixed", include_str!("../../rigs/mixed.toml")),
];

/// The text of the rig of that name.
#[must_use]
pub fn text(name: &str) -> Option<&'static str> {
    RIGS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::{RIGS, text};
    use crate::rig::simulated::variant_of;
    use biplane_recording::Rig;
    use biplane_recording::rig::{BaseProtocol, Laser};

    #[test]
    fn every_rig_parses_and_has_variants_that_exist() {
        for (name, text) in RIGS {
            let rig = Rig::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            let can_be = |laser: &Laser| !laser.is_lms2xx() || variant_of(laser).is_some();
            assert!(can_be(&rig.horizontal), "{name}");
            assert!(rig.vertical.iter().all(can_be), "{name}");
        }
    }

    #[test]
    fn the_papers_rig_is_the_template() {
        let mut template = Rig::default();
        template.base.protocol = BaseProtocol::P2os { metres_per_tick: Some(0.001) };
        assert_eq!(text("paper").map(|text| Rig::parse(text).ok()), Some(Some(template)));
        assert_eq!(text("castle"), None);
    }
}
