//! LZF, as PCD files are compressed: runs of bytes as they are, and copies of what came before. Source:
//! liblzf (Lehmann).

/// Runs as they are have a first byte below this.
const FIRST_COPY: u8 = 1 << 5;
/// Copies of this length say their length in one byte more.
const LONG_COPY: usize = 7;

/// The bytes that were packed, `None` unless they are exactly so many. Memory grows with what is unpacked.
pub(crate) fn unpack(packed: &[u8], bytes: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut rest = packed;
    while let Some((control, behind)) = rest.split_first() {
        rest = behind;
        if *control < FIRST_COPY {
            let (run, behind) = rest.split_at_checked(usize::from(*control) + 1)?;
            out.extend_from_slice(run);
            rest = behind;
        } else {
            let mut length = usize::from(control >> 5);
            if length == LONG_COPY {
                let (more, behind) = rest.split_first()?;
                length += usize::from(*more);
                rest = behind;
            }
            let (low, behind) = rest.split_first()?;
            rest = behind;
            let back = usize::from(control & (FIRST_COPY - 1)) << 8 | usize::from(*low);
            let start = out.len().checked_sub(back + 1)?;
            // A copy may go on into what it writes itself.
            for place in start..start + length + 2 {
                out.push(out[place]);
            }
        }
        if out.len() > bytes {
            return None;
        }
    }
    (out.len() == bytes).then_some(out)
}
