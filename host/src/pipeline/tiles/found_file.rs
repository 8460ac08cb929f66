//! What was found in a tile: the planes of its blocks. Frame `map`, meters.

use super::bytes::{Bytes, put_count, seal};
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::reconstruct::planes::search::searched::{Searched, Setting};

const MAGIC: [u8; 8] = *b"bptilef1";
/// Kinds of planes: given up, fitted, with the normal of another.
const KINDS: [u8; 3] = [0, 1, 2];
/// Sources of the noise, by number.
const SOURCES: [SigmaSource; 3] = [SigmaSource::Given, SigmaSource::Estimated, SigmaSource::Assumed];

/// The bytes of what was found; `key` says in what, and how it was searched.
pub(crate) fn encode(key: u32, found: &[Searched]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(key.to_le_bytes());
    put_count(&mut bytes, found.len());
    for Searched { setting, labels, fits, .. } in found {
        let Setting { cell_m, sigma_m, sigma_source } = setting;
        bytes.extend([cell_m, sigma_m].map(|v| v.to_le_bytes()).concat());
        bytes.extend(SOURCES.iter().position(|source| source == sigma_source).map(|at| at as u8));
        put_count(&mut bytes, labels.len());
        labels.iter().for_each(|label| bytes.extend(label.to_le_bytes()));
        put_count(&mut bytes, fits.len());
        fits.iter().for_each(|fit| put_fit(&mut bytes, fit.as_ref()));
    }
    seal(&mut bytes);
    bytes
}

fn put_fit(bytes: &mut Vec<u8>, fit: Option<&Fit>) {
    let Some(Fit { normal, offset_m, variances_m2, count, held }) = fit else {
        bytes.push(KINDS[0]);
        return;
    };
    bytes.push(KINDS[if *held { 2 } else { 1 }]);
    let numbers = normal.iter().chain([offset_m]).chain(variances_m2).chain([count]);
    numbers.for_each(|v| bytes.extend(v.to_le_bytes()));
}

/// What a file says was found; `None` for another or a damaged file, and for one with another key.
pub(crate) fn decode(file: &[u8], key: u32) -> Option<Vec<Searched>> {
    let mut bytes = Bytes::sealed(file, MAGIC)?;
    if bytes.word()? != key {
        return None;
    }
    let count = bytes.count(size_of::<u64>())?;
    let found = (0..count).map(|_| block(&mut bytes)).collect::<Option<Vec<Searched>>>()?;
    bytes.is_done().then_some(found)
}

fn block(bytes: &mut Bytes<'_>) -> Option<Searched> {
    let (cell_m, sigma_m) = (bytes.double()?, bytes.double()?);
    let sigma_source = *SOURCES.get(usize::from(bytes.byte()?))?;
    let count = bytes.count(size_of::<i32>())?;
    let labels = (0..count).map(|_| bytes.word().map(|word| word as i32)).collect::<Option<Vec<i32>>>()?;
    let count = bytes.count(1)?;
    let fits = (0..count).map(|_| fit(bytes)).collect::<Option<Vec<Option<Fit>>>>()?;
    let known = |label: &i32| *label < fits.len() as i32;
    let setting = Setting { cell_m, sigma_m, sigma_source };
    labels.iter().all(known).then_some(Searched { setting, labels, fits, blocks: 1 })
}

fn fit(bytes: &mut Bytes<'_>) -> Option<Option<Fit>> {
    let kind = bytes.byte()?;
    if kind == KINDS[0] {
        return Some(None);
    }
    let mut three = || Some([bytes.double()?, bytes.double()?, bytes.double()?]);
    let normal = three()?;
    let offset_m = bytes.double()?;
    let variances_m2 = [bytes.double()?, bytes.double()?, bytes.double()?];
    let count = bytes.double()?;
    KINDS.contains(&kind).then_some(Some(Fit {
        normal,
        offset_m,
        variances_m2,
        count,
        held: kind == KINDS[2],
    }))
}

#[cfg(test)]
mod tests {
    use super::{decode, encode};
    use crate::reconstruct::fixture::{corridor, drive};
    use crate::reconstruct::planes::PlaneParams;
    use crate::reconstruct::planes::search;

    #[test]
    fn what_was_found_comes_back_bit_by_bit_under_its_key_only() {
        let cloud = drive(&corridor(), 60, 0.02, 5);
        let mut found = search(&PlaneParams::default(), &cloud, &mut |_| ());
        found.fits.push(None);
        assert!(found.fits.len() > 3, "{}", found.fits.len());
        let file =
            encode(7, &[found.clone(), search::searched::Searched { blocks: 1, ..Default::default() }]);
        let read = decode(&file, 7).unwrap();
        assert_eq!((read.len(), &read[0]), (2, &found));
        assert_eq!(decode(&file, 8), None);
        for place in [0, 9, 40, file.len() / 2, file.len() - 1] {
            let mut damaged = file.clone();
            damaged[place] ^= 4;
            assert_eq!(decode(&damaged, 7), None, "{place}");
            assert_eq!(decode(&file[..place], 7), None, "{place}");
        }
    }
}
