//! PCD files of the Point Cloud Library, version 0.7 and older: ASCII, binary and compressed. Only
//! coordinates are taken.
//!
//! The header's counts are checked against what the file holds before anyone believes them. Source: the PCD
//! file format (pointclouds.org); compressed points are LZF, one field after the other.

pub(crate) mod lzf;

use crate::formats::input::cloud_file::{CloudFile, CloudFileError, ScanStart};
use crate::formats::input::lines::xyz;
use crate::formats::text::short::short;

/// The cloud in a PCD file's bytes.
pub(crate) fn read(bytes: &[u8]) -> Result<CloudFile, CloudFileError> {
    let (header, body) = Header::parse(bytes)?;
    let found = match header.data.as_str() {
        "ascii" => header.ascii(body),
        "binary" => header.binary(body),
        "binary_compressed" => header.compressed(body),
        other => Err(broken(format!(
            "has data of the kind `{other}`: expected ascii, binary or binary_compressed"
        ))),
    }?;
    let scan = |position_m| ScanStart { first_point: 0, position_m: Some(position_m) };
    Ok(CloudFile { scans: header.viewpoint_m.map(scan).into_iter().collect(), ..found })
}

fn broken(what: impl Into<String>) -> CloudFileError {
    CloudFileError::Pcd { what: what.into() }
}

/// What a header says of a field.
#[derive(Clone, Debug, PartialEq)]
struct Field {
    name: String,
    /// Bytes of one value.
    size: usize,
    /// `F`, `I` or `U`.
    kind: char,
    /// Values a point.
    count: usize,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Header {
    fields: Vec<Field>,
    points: usize,
    /// From where all points were seen, in their own coordinates.
    viewpoint_m: Option<[f64; 3]>,
    data: String,
}

/// `VIEWPOINT` where nobody has said from where points were seen: place and quaternion.
const NO_VIEWPOINT: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

impl Header {
    /// The header, and the bytes behind it.
    fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), CloudFileError> {
        let mut header = Self::default();
        let mut rest = bytes;
        while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
            let line = String::from_utf8_lossy(&rest[..end]);
            rest = &rest[end + 1..];
            let mut words = line.split_whitespace();
            let key = words.next().unwrap_or("#");
            let words: Vec<&str> = words.collect();
            if key == "DATA" {
                header.data = words.first().unwrap_or(&"").to_string();
                return Ok((header, rest));
            }
            header.take(key, &words).ok_or_else(|| {
                broken(format!("has a header line that cannot be read: `{}`", short(&line)))
            })?;
        }
        Err(broken("has a header without the line DATA"))
    }

    fn take(&mut self, key: &str, words: &[&str]) -> Option<()> {
        match key {
            // COLUMNS was the name in older versions.
            "FIELDS" | "COLUMNS" => {
                let field = |name: &&str| Field { name: name.to_string(), size: 4, kind: 'F', count: 1 };
                self.fields = words.iter().map(field).collect();
            }
            "SIZE" => self.each(words, |field, word| {
                field.size = word.parse().ok().filter(|size| [1, 2, 4, 8].contains(size))?;
                Some(())
            })?,
            "TYPE" => self.each(words, |field, word| {
                field.kind = word.chars().next().filter(|kind| "FIU".contains(*kind))?;
                Some(())
            })?,
            "COUNT" => self.each(words, |field, word| {
                field.count = word.parse().ok()?;
                Some(())
            })?,
            "POINTS" => self.points = words.first()?.parse().ok()?,
            // Older files have no POINTS.
            "WIDTH" => self.points = words.first()?.parse().ok()?,
            "HEIGHT" => self.points = self.points.checked_mul(words.first()?.parse().ok()?)?,
            "VIEWPOINT" => self.viewpoint_m = viewpoint_m(words),
            _ => {}
        }
        Some(())
    }

    fn each(&mut self, words: &[&str], mut set: impl FnMut(&mut Field, &str) -> Option<()>) -> Option<()> {
        if words.len() != self.fields.len() {
            return None;
        }
        self.fields.iter_mut().zip(words).try_for_each(|(field, word)| set(field, word))
    }

    /// Where x, y and z stand: values before each, and bytes before each.
    fn coordinates(&self) -> Result<[(usize, usize, &Field); 3], CloudFileError> {
        let find = |name: &str| {
            let (mut values, mut bytes) = (0_usize, 0_usize);
            for field in &self.fields {
                if field.name.eq_ignore_ascii_case(name) && field.count == 1 {
                    return Ok((values, bytes, field));
                }
                values = values.saturating_add(field.count);
                bytes = bytes.saturating_add(field.size.saturating_mul(field.count));
            }
            Err(broken(format!("has no field {name}")))
        };
        Ok([find("x")?, find("y")?, find("z")?])
    }

    /// Bytes of a point, at least one.
    fn stride(&self) -> Result<usize, CloudFileError> {
        let bytes = self
            .fields
            .iter()
            .try_fold(0_usize, |sum, field| sum.checked_add(field.size.checked_mul(field.count)?));
        bytes.filter(|bytes| *bytes > 0).ok_or_else(|| broken("has points of no or of endless length"))
    }

    fn ascii(&self, body: &[u8]) -> Result<CloudFile, CloudFileError> {
        let columns = self.coordinates()?.map(|(values, ..)| values);
        let mut positions_m = Vec::new();
        let rows = String::from_utf8_lossy(body);
        let rows = rows.lines().filter(|row| !row.trim().is_empty());
        for (index, row) in rows.take(self.points).enumerate() {
            let point_m = xyz::position(row, columns)
                .ok_or_else(|| broken(format!("has no coordinates in point {index}: `{}`", short(row))))?;
            positions_m.push(point_m);
        }
        self.whole(positions_m.len())?;
        Ok(CloudFile::of_positions(&positions_m))
    }

    fn binary(&self, body: &[u8]) -> Result<CloudFile, CloudFileError> {
        let coordinates = self.coordinates()?;
        let stride = self.stride()?;
        self.whole(body.len() / stride)?;
        let position = |point: &[u8]| coordinates.map(|(_, start, field)| value(point, start, field));
        let positions_m: Vec<_> = body.chunks_exact(stride).take(self.points).map(position).collect();
        Ok(CloudFile::of_positions(&positions_m))
    }

    fn compressed(&self, body: &[u8]) -> Result<CloudFile, CloudFileError> {
        let coordinates = self.coordinates()?;
        let stride = self.stride()?;
        let (sizes, packed) = body.split_at_checked(8).ok_or_else(|| broken("ends before its points"))?;
        let packed_bytes = u32::from_le_bytes([sizes[0], sizes[1], sizes[2], sizes[3]]) as usize;
        let bytes = u32::from_le_bytes([sizes[4], sizes[5], sizes[6], sizes[7]]) as usize;
        let Some(packed) = packed.get(..packed_bytes) else {
            return Err(broken(format!(
                "ends after {} of {packed_bytes} bytes of compressed points",
                packed.len()
            )));
        };
        let unpacked = lzf::unpack(packed, bytes)
            .ok_or_else(|| broken("is damaged: its points cannot be decompressed"))?;
        self.whole(unpacked.len() / stride)?;
        // All values of the first field, then all of the second.
        let position = |index: usize| {
            coordinates
                .map(|(_, before, field)| value(&unpacked, before * self.points + index * field.size, field))
        };
        let positions_m: Vec<_> = (0..self.points).map(position).collect();
        Ok(CloudFile::of_positions(&positions_m))
    }

    fn whole(&self, found: usize) -> Result<(), CloudFileError> {
        if found < self.points {
            return Err(broken(format!("ends after point {found} of {}", self.points)));
        }
        Ok(())
    }
}

/// The place in a viewpoint. Points stand where they were seen already, and are not moved by it: that is how
/// the Point Cloud Library turns normals.
fn viewpoint_m(words: &[&str]) -> Option<[f64; 3]> {
    let values: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let is_given = values.len() == 7 && values.iter().all(|v| v.is_finite()) && values != NO_VIEWPOINT;
    is_given.then(|| [values[0], values[1], values[2]])
}

/// A value in little endian; NaN where it does not stand.
fn value(bytes: &[u8], start: usize, field: &Field) -> f64 {
    let Some(bytes) = bytes.get(start..start.saturating_add(field.size)) else { return f64::NAN };
    let mut word = [0; 8];
    word[..bytes.len()].copy_from_slice(bytes);
    let unsigned = u64::from_le_bytes(word);
    match (field.kind, field.size) {
        ('F', 4) => f64::from(f32::from_bits(unsigned as u32)),
        ('F', 8) => f64::from_bits(unsigned),
        ('I', size) => {
            let unused = 64 - 8 * size as u32;
            ((unsigned << unused) as i64 >> unused) as f64
        }
        ('U', _) => unsigned as f64,
        _ => f64::NAN,
    }
}
