//! The serial bytes of a recording or capture, or of a stretch of it, as a capture of their own: how a field
//! recording becomes a fixture.
//!
//! Bytes, times and directions are kept as they are; everything but `/serial/...` is left out, the rig stays
//! attached. Times are nanoseconds on the input's clock; a stretch is given in seconds since its first serial
//! byte.

use biplane_recording::capture::SerialBytes;
use biplane_recording::capture::serial;
use biplane_recording::mcap::read::RIG_ATTACHMENT;
use biplane_recording::mcap::write::check_outputs;
use biplane_recording::{ReadError, Reader, WriteError, WriteReport, Writer, WriterOptions};
use std::path::PathBuf;

/// What to take out.
#[derive(Clone, Debug, Default)]
pub struct ExtractOptions {
    /// A recording made with `--raw`, or a capture.
    pub input: PathBuf,
    /// The capture.
    pub output: PathBuf,
    /// Leave out what came earlier, seconds.
    pub from_s: Option<f64>,
    /// Leave out what came later, seconds.
    pub to_s: Option<f64>,
    /// Replace an existing capture.
    pub overwrite: bool,
}

/// Why nothing was taken out.
#[derive(Debug, thiserror::Error)]
pub enum ExtractError {
    /// The input.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// No serial bytes, or none in the stretch.
    #[error(
        "{}: no serial bytes (/serial/...) {}",
        input.display(),
        if *is_range { "in this stretch" } else { "there; a recording has them when it was made with --raw" }
    )]
    Nothing {
        /// The input.
        input: PathBuf,
        /// Whether there are some elsewhere in it.
        is_range: bool,
    },
}

/// Writes the capture.
pub fn extract(options: &ExtractOptions) -> Result<WriteReport, ExtractError> {
    check_outputs(&[&options.output], std::slice::from_ref(&options.input), options.overwrite)?;
    let reader = Reader::open(&options.input)?;
    let Some(first) = serial(&reader).next().transpose()? else {
        return Err(ExtractError::Nothing { input: options.input.clone(), is_range: false });
    };
    let at_ns = |seconds: f64| first.time_ns.saturating_add((seconds * 1e9) as i64);
    let from_ns = options.from_s.map_or(i64::MIN, at_ns);
    let to_ns = options.to_s.map_or(i64::MAX, at_ns);
    let within = |read: &SerialBytes| (from_ns..=to_ns).contains(&read.time_ns);
    // Looked for first: the output is not touched when there is nothing to write.
    let mut found = false;
    for read in serial(&reader) {
        found = within(&read?);
        if found {
            break;
        }
    }
    let number = [options.from_s, options.to_s].into_iter().flatten().all(|seconds| !seconds.is_nan());
    if !found || !number {
        return Err(ExtractError::Nothing { input: options.input.clone(), is_range: true });
    }
    let writer_options = WriterOptions { overwrite: options.overwrite, ..WriterOptions::default() };
    let mut writer = Writer::create(&options.output, &writer_options)?;
    if let Some(rig) = reader.attachment(RIG_ATTACHMENT)? {
        writer.attach(RIG_ATTACHMENT, "application/toml", &rig)?;
    }
    for read in serial(&reader) {
        let read = read?;
        if within(&read) {
            writer.write_serial(read.port, read.direction, read.time_ns, &read.bytes)?;
        }
    }
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use super::{ExtractError, ExtractOptions, extract};
    use std::path::{Path, PathBuf};

    #[test]
    fn a_stretch_without_bytes_is_refused_and_leaves_the_output_alone() {
        let captures = Path::new(env!("CARGO_MANIFEST_DIR")).join("captures");
        let files = std::fs::read_dir(captures).expect("captures").filter_map(|e| e.ok().map(|e| e.path()));
        let input = files.filter(|path| path.extension().is_some_and(|e| e == "mcap")).min().expect("one");
        let folder = std::env::temp_dir().join(format!("biplane-extract-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let output: PathBuf = folder.join("c.mcap");
        std::fs::write(&output, "precious").expect("written");
        for (from_s, to_s) in [(Some(5000.0), None), (Some(5.0), Some(2.0)), (Some(f64::NAN), None)] {
            let (input, output) = (input.clone(), output.clone());
            let error = extract(&ExtractOptions { input, output, from_s, to_s, overwrite: true });
            assert!(matches!(error, Err(ExtractError::Nothing { is_range: true, .. })), "{error:?}");
        }
        assert_eq!(std::fs::read_to_string(&output).ok().as_deref(), Some("precious"));
        assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 1);
        let _ = std::fs::remove_dir_all(&folder);
    }
}
