//! Recordings that overlap in time (two robots, or simulated drives that all begin at the same date) in one
//! file.
//!
//! Who reads a file finds the pose of a scan by its time. So a recording that begins before those ahead of it
//! in the file have ended is moved behind their end, by whole seconds.

use biplane_recording::{ReadError, Topic};

use crate::recordings::run::Run;

/// Between two recordings in one file, nanoseconds: longer than any gap between poses that is bridged.
const APART_NS: i64 = 2 * NS_PER_S;
/// Delays are multiples of this, nanoseconds.
pub(crate) const NS_PER_S: i64 = 1_000_000_000;

/// What is added to the times of each recording; `file_of` says which go into one file, in their order.
///
/// # Errors
/// When one cannot be read.
pub(crate) fn delays_ns(runs: &[Run], file_of: &[usize]) -> Result<Vec<i64>, ReadError> {
    let is_alone = |number: usize| file_of.iter().filter(|file| **file == file_of[number]).count() < 2;
    let spans_ns = runs.iter().enumerate().map(|(number, run)| match is_alone(number) {
        true => Ok(None),
        false => span_ns(run),
    });
    Ok(delays_of(&spans_ns.collect::<Result<Vec<_>, _>>()?, file_of))
}

/// First and last stamp of what is looked up by time, or of the poses that it is looked up in.
fn span_ns(run: &Run) -> Result<Option<[i64; 2]>, ReadError> {
    let mut span_ns: Option<[i64; 2]> = None;
    for entry in run.recording().messages() {
        let entry = entry?;
        let is_stamped = matches!(
            entry.topic,
            Some(
                Topic::ScanHorizontal
                    | Topic::ScanVertical
                    | Topic::Odom
                    | Topic::Imu
                    | Topic::Pose
                    | Topic::PoseVertical
            )
        );
        if is_stamped {
            let at_ns = entry.publish_time_ns;
            let [first_ns, last_ns] = span_ns.unwrap_or([at_ns; 2]);
            span_ns = Some([first_ns.min(at_ns), last_ns.max(at_ns)]);
        }
    }
    Ok(span_ns)
}

fn delays_of(spans_ns: &[Option<[i64; 2]>], file_of: &[usize]) -> Vec<i64> {
    let mut ends_ns = std::collections::BTreeMap::new();
    let mut delay_ns = |span_ns: &Option<[i64; 2]>, file: usize| {
        let Some([first_ns, last_ns]) = *span_ns else { return 0 };
        let end_ns: Option<i64> = ends_ns.get(&file).copied();
        let missing_ns = end_ns.map_or(0, |end_ns| end_ns.saturating_add(APART_NS).saturating_sub(first_ns));
        let delay_ns = if missing_ns > 0 { (missing_ns - 1) / NS_PER_S * NS_PER_S + NS_PER_S } else { 0 };
        let last_ns = last_ns.saturating_add(delay_ns);
        ends_ns.insert(file, end_ns.map_or(last_ns, |end_ns| end_ns.max(last_ns)));
        delay_ns
    };
    spans_ns.iter().zip(file_of).map(|(span_ns, file)| delay_ns(span_ns, *file)).collect()
}

#[cfg(test)]
mod tests {
    use super::{NS_PER_S, delays_of};

    #[test]
    fn what_overlaps_in_one_file_follows_by_whole_seconds_and_all_else_keeps_its_time() {
        let span = |first: f64, last: f64| Some([first, last].map(|s| (s * NS_PER_S as f64) as i64));
        let spans =
            [span(0.0, 10.5), span(0.25, 8.0), None, span(3.0, 4.0), span(3.0, 4.0), span(60.0, 61.0)];
        let files = [0, 0, 0, 1, 0, 0];
        let delays: Vec<i64> = delays_of(&spans, &files).iter().map(|ns| ns / NS_PER_S).collect();
        // 10.5 + 2 - 0.25 is 12.25; the next has to wait for 21 + 2.
        assert_eq!(delays, [0, 13, 0, 0, 20, 0]);
        assert_eq!(delays_of(&[span(0.0, 1.0), span(3.0, 4.0)], &[0, 0]), [0, 0], "apart enough");
    }
}
