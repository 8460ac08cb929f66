//! The types of the family, told apart by the text of the type reply, and how each leaves the factory.
//!
//! Sources: SICK telegram listing (3Ah, 35h, 3Bh, 44h, factory settings); S14 ("Fast"): 181 values over 90
//! degrees in one turn, no 3Bh.

use super::settings::{ConfigBlock, Variant};

/// A type of laser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// LMS 200, indoor.
    Lms200,
    /// LMS 211, outdoor, with a window of 100 degrees.
    Lms211,
    /// LMS 220, indoor, in a housing.
    Lms220,
    /// LMS 221, outdoor.
    Lms221,
    /// LMS 291, outdoor optics in an indoor housing.
    Lms291,
    /// The S14 variants of it.
    S14,
    /// Any other text.
    Other,
}

impl Model {
    /// The type that a text names, such as `LMS291;S05;X01.27 `.
    #[must_use]
    pub fn of_text(text: &str) -> Self {
        let mut parts = text.split(';');
        let (name, variant) = (parts.next().unwrap_or(""), parts.next().unwrap_or(""));
        match name.trim() {
            _ if variant.trim() == "S14" => Self::S14,
            "LMS200" => Self::Lms200,
            "LMS211" => Self::Lms211,
            "LMS220" => Self::Lms220,
            "LMS221" => Self::Lms221,
            "LMS291" => Self::Lms291,
            _ => Self::Other,
        }
    }

    /// Names that stand for a type text on the command line.
    pub const NAMES: [&'static str; 6] = ["LMS200", "LMS211", "LMS220", "LMS221", "LMS291", "S14"];

    /// The type text that a name of [`Model::NAMES`] stands for; any other text is one already.
    #[must_use]
    pub fn text_of_name(name: &str) -> &str {
        match name {
            "LMS200" => "LMS200;30106;V02.10 ",
            "LMS211" => "LMS211;30206;V02.30 ",
            "LMS220" => "LMS220;30106;V02.30 ",
            "LMS221" => "LMS221;30206;V02.30 ",
            "LMS291" => "LMS291;S05;X01.27 ",
            "S14" => "LMS291;S14;X01.27 ",
            text => text,
        }
    }

    /// Whether the question for the operating hours (35h) has this data: a zero word for the outdoor types,
    /// none for the others.
    #[must_use]
    pub fn asks_hours_with(self, data: &[u8]) -> bool {
        match self {
            Self::Lms211 | Self::Lms221 | Self::Lms291 | Self::S14 => data == [0, 0],
            Self::Lms200 | Self::Lms220 => data.is_empty(),
            Self::Other => data.is_empty() || data == [0, 0],
        }
    }

    /// Bytes of a scan that go out in one mirror turn at most (listing, figures on data output).
    #[must_use]
    pub fn bytes_per_turn(self) -> usize {
        if self == Self::S14 { 559 } else { 508 }
    }

    /// Variant as delivered.
    #[must_use]
    pub fn variant(self) -> Variant {
        match self {
            Self::S14 => Variant::S14,
            Self::Lms211 => Variant::of(100, 50),
            _ => Variant::of(180, 50),
        }
    }

    /// Configuration as delivered: millimeters and 8 m for the indoor types, centimeters and 80 m for the
    /// others.
    #[must_use]
    pub fn config(self) -> ConfigBlock {
        ConfigBlock::default().with_units(matches!(self, Self::Lms200 | Self::Lms220), 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_told_by_their_text_and_leave_the_factory_as_the_listing_says() {
        for (text, model, fov_deg, resolution_cdeg, mm) in [
            ("LMS200;30106;V02.10 ", Model::Lms200, 180, 50, true),
            ("LMS211;30206;V02.10 ", Model::Lms211, 100, 50, false),
            ("LMS220;30106;V02.10 ", Model::Lms220, 180, 50, true),
            ("LMS221;30206;V02.10 ", Model::Lms221, 180, 50, false),
            ("LMS291;S05;X01.27 ", Model::Lms291, 180, 50, false),
            ("LMS291;S14;X01.27 ", Model::S14, 90, 50, false),
            ("PLS", Model::Other, 180, 50, false),
        ] {
            assert_eq!(Model::of_text(text), model, "{text}");
            assert_eq!(model.variant(), Variant::of(fov_deg, resolution_cdeg), "{text}");
            assert_eq!(model.config().is_mm(), mm, "{text}");
        }
        let models = Model::NAMES.map(|name| Model::of_text(Model::text_of_name(name)));
        let expected =
            [Model::Lms200, Model::Lms211, Model::Lms220, Model::Lms221, Model::Lms291, Model::S14];
        assert_eq!(models, expected);
        assert_eq!((Variant::S14.turns(), Variant::S14.beam_count()), (1, 181));
    }
}
