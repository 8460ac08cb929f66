//! `model.json`: a finished model without loss, so that other formats can be written later.
//!
//! It holds what every format is made of, but for the raw points: those stay in `points.ply`, and here is
//! only what that file does not say of them. Coordinates are the program's own: frame `map` (z up), meters,
//! less `shift_m`. Numbers have as many digits as bring the same bits back, so a file that is written later
//! is the same as one that the build writes, byte for byte. A file of another layout is refused.

mod check;
mod error;

use std::borrow::Cow;
use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use crate::building::Building;
use crate::building::elements::Elements;
use crate::formats::{Shapes, generator};
use crate::model::Model;

pub use error::ModelFileError;

/// Its name in a folder of a build.
pub(crate) const NAME: &str = "model.json";
/// What the file says it is.
const FORMAT: &str = "biplane-model";
/// The layout of the file. Whoever adds or changes a field counts on.
const VERSION: u64 = 3;
/// The layout of a model without inferred surfaces, which older programs read.
const MEASURED_VERSION: u64 = 2;
/// The layout of a model without round things, which still older ones read.
const FLAT_VERSION: u64 = 1;

/// Everything in the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile<'a> {
    format: Cow<'a, str>,
    version: u64,
    generator: Cow<'a, str>,
    /// What the model was made of: names of files, without folders.
    pub source: Cow<'a, str>,
    /// What other formats add to every coordinate, meters.
    pub shift_m: [f64; 3],
    /// Height of a floor that is known to be there, seen or not, meters before the shift.
    pub floor_m: Option<f64>,
    /// What `points.ply` does not say of its points.
    pub points: PointsOf<'a>,
    /// The model.
    pub model: Cow<'a, Model>,
    /// Rooms, walls, doors and windows; absent where nobody drove.
    #[serde(default, skip_serializing_if = "Elements::is_empty")]
    elements: Elements,
}

/// What is known of the raw points besides their places, planes, scans and beams.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointsOf<'a> {
    /// How many there are.
    pub count: usize,
    /// When they were measured; `None` where points have no scans, as the vertices of a mesh.
    pub times: Option<ScanTimes<'a>>,
}

/// When the points of scans were measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanTimes<'a> {
    /// Stamp of each scan, nanoseconds of Unix time.
    pub scans_ns: Cow<'a, [i64]>,
    /// Time of each beam after its scan's stamp, nanoseconds.
    pub beams_ns: Cow<'a, [i64]>,
}

impl ScanTimes<'_> {
    /// When a beam of a scan was measured, nanoseconds of Unix time; `None` where that is not known.
    pub(crate) fn stamp_ns(&self, scan: i32, beam: i32) -> Option<i64> {
        let scan_ns = self.scans_ns.get(usize::try_from(scan).ok()?)?;
        Some(scan_ns.saturating_add(*self.beams_ns.get(usize::try_from(beam).ok()?)?))
    }
}

/// `building.json`.
#[derive(Serialize)]
struct ElementsFile<'a> {
    #[serde(flatten)]
    about: About<'a>,
    #[serde(flatten)]
    elements: &'a Elements,
}

/// Its first lines.
#[derive(Serialize)]
struct About<'a> {
    generator: &'a str,
    source: &'a str,
    frame: &'a str,
    unit: &'a str,
}

/// What a file says of itself, whatever else is in it.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    format: String,
    #[serde(default)]
    version: u64,
}

impl<'a> ModelFile<'a> {
    /// What other formats of a model need. `floor_m` is the height of a floor that is known to be there, in
    /// meters and the model's own coordinates.
    pub fn new(shapes: &'a Shapes<'_>, floor_m: Option<f64>, points: PointsOf<'a>) -> Self {
        Self {
            format: FORMAT.into(),
            version: match shapes.model {
                model if !model.inferred.is_empty() => VERSION,
                model if !model.cylinders.is_empty() => MEASURED_VERSION,
                _ => FLAT_VERSION,
            },
            generator: generator().into(),
            source: shapes.source.as_str().into(),
            shift_m: shapes.shift_m,
            floor_m,
            points,
            model: Cow::Borrowed(shapes.model),
            elements: Elements::default(),
        }
    }

    /// With rooms, walls, doors and windows, as they were found from the drive.
    pub(crate) fn with_elements(self, elements: Elements) -> Self {
        let version = if elements.is_empty() { self.version } else { self.version.max(MEASURED_VERSION) };
        Self { version, elements, ..self }
    }

    /// Rooms, walls, doors and windows.
    pub(crate) fn elements(&self) -> &Elements {
        &self.elements
    }

    /// The model read as a building.
    pub(crate) fn building(&self) -> Building {
        let elements = self.elements.clone();
        let of_storeys: Vec<f64> = elements.storeys.iter().map(|storey| storey.floor_z_m).collect();
        let floors_m = if of_storeys.is_empty() { self.floor_m.as_slice() } else { &of_storeys };
        Building { elements, ..Building::read_on(&self.model, floors_m) }
    }

    /// Writes rooms, walls, doors and windows alone, for other programs.
    ///
    /// # Errors
    /// When writing fails.
    pub(crate) fn write_elements(&self, out: &mut impl Write) -> io::Result<()> {
        let about = About { generator: &self.generator, source: &self.source, frame: "map", unit: "metre" };
        serde_json::to_writer_pretty(&mut *out, &ElementsFile { about, elements: &self.elements })?;
        writeln!(out)
    }

    /// The model as the formats take it, its polygons cut into triangles.
    pub fn shapes(&self) -> Shapes<'_> {
        let source = self.source.clone().into_owned();
        Shapes { shift_m: self.shift_m, source, ..Shapes::new(&self.model) }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        serde_json::to_writer(&mut *out, self)?;
        writeln!(out)
    }
}

/// Reads a file's bytes, all of it. It takes memory by what is in it and by no number that it names.
///
/// # Errors
/// When it is no such file, of another layout, not whole, or contradicts itself.
pub fn read(bytes: &[u8]) -> Result<ModelFile<'static>, ModelFileError> {
    let head: Head = serde_json::from_slice(bytes)?;
    if head.format != FORMAT {
        return Err(ModelFileError::NotOurs { found: head.format.chars().take(MAX_SHOWN).collect() });
    }
    if !(FLAT_VERSION..=VERSION).contains(&head.version) {
        return Err(ModelFileError::Version { found: head.version, known: VERSION });
    }
    let file: ModelFile<'static> = serde_json::from_slice(bytes)?;
    check::model(&file.model)?;
    Ok(file)
}

/// Characters of a foreign word that an error shows.
const MAX_SHOWN: usize = 40;

#[cfg(test)]
mod tests {
    use super::{ModelFile, ModelFileError, PointsOf, ScanTimes, read};
    use crate::formats::Shapes;
    use crate::model::sample;

    fn written() -> Vec<u8> {
        let mut model = sample::model();
        // The first corner has numbers that serde_json without its feature `float_roundtrip` does not bring
        // back.
        model.polygons[0].outer_m[0] = [9.791541501641081, 0.023737564524234714, -0.00038081771444516707];
        model.polygons[0].outer_m[1] = [1.0 / 3.0, f64::from_bits(0x3ff0_0000_0000_0001), -0.0];
        model.planes[1].rms_m = 5e-324;
        model.cylinders.push(sample::column());
        model.inferred.push(sample::inferred());
        model.leftovers.vertices_m[0] = [0.1, f32::MIN_POSITIVE, 16_777_217.0];
        let shapes = Shapes { source: "a \"b\".mcap".to_owned(), ..Shapes::new(&model) };
        let times = ScanTimes { scans_ns: vec![i64::MAX, -5].into(), beams_ns: vec![0, 7].into() };
        let points = PointsOf { count: 3, times: Some(times) };
        let mut bytes = Vec::new();
        ModelFile::new(&shapes, Some(0.0), points).write(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_model_comes_back_with_the_same_bits() {
        let bytes = written();
        let file = read(&bytes).unwrap();
        let mut again = Vec::new();
        file.write(&mut again).unwrap();
        assert_eq!(bytes, again);
        let bits = |p: [f64; 3]| p.map(f64::to_bits);
        let corners = &file.model.polygons[0].outer_m;
        assert_eq!(bits(corners[1]), bits([1.0 / 3.0, 1.0 + f64::EPSILON, -0.0]));
        assert_eq!(
            bits(corners[0]),
            bits([9.791541501641081, 0.023737564524234714, -0.00038081771444516707])
        );
        assert_eq!(file.model.leftovers.vertices_m[0], [0.1, f32::MIN_POSITIVE, 16_777_216.0]);
        assert_eq!((file.floor_m, file.shapes().source.as_str()), (Some(0.0), "a \"b\".mcap"));
        let times = file.points.times.unwrap();
        assert_eq!(times.stamp_ns(1, 1), Some(2));
        assert_eq!(times.stamp_ns(0, 1), Some(i64::MAX));
        assert_eq!((times.stamp_ns(2, 0), times.stamp_ns(0, 2), times.stamp_ns(-1, 0)), (None, None, None));
    }

    #[test]
    fn every_cut_of_a_file_is_an_error() {
        let bytes = written();
        // The last two bytes are a brace and a newline.
        for end in 0..bytes.len() - 1 {
            assert!(matches!(read(&bytes[..end]), Err(ModelFileError::Json(_))), "cut at {end}");
        }
    }

    #[test]
    fn errors_say_what_and_where() {
        let text = String::from_utf8(written()).unwrap();
        let broken = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            read(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
        };
        assert_eq!(
            broken("biplane-model", "tileset"),
            "expected a file of the format \"biplane-model\", found \"tileset\""
        );
        assert_eq!(
            broken("\"version\":3", "\"version\":7"),
            "expected a file of version 3, found version 7, which another version of this program wrote"
        );
        assert_eq!(broken("\"plane\":1", "\"plane\":2"), "polygon 1 lies on plane 2, there are 2");
        assert_eq!(broken("[[0,1,2]]", "[[0,1,3]]"), "leftover triangle 0 refers to vertex 3, there are 3");
        assert_eq!(
            broken("\"normal\":[0.0,-1.0,0.0]", "\"normal\":[0.0,-1.0,1.0]"),
            "plane 0: expected a normal of length 1, found one of length 1.4142135623730951"
        );
        let round = broken("\"radius_m\":0.2", "\"radius_m\":-0.2");
        assert!(round.contains("cylinder 0"), "{round}");
        assert_eq!(
            broken("\"normal\":[-1.0,0.0,0.0]", "\"normal\":[-2.0,0.0,0.0]"),
            "inferred surface 0: expected a normal of length 1, found one of length 2"
        );
        let strange = broken("\"shift_m\"", "\"shift\"");
        assert!(strange.contains("unknown field `shift`") && strange.contains("line 1 column"), "{strange}");
        let word = broken("\"count\":3", "\"count\":true");
        assert!(word.contains("invalid type: boolean `true`, expected usize at line 1"), "{word}");
    }
}
