//! What was searched and found so far, in a file beside the output: a job that was stopped goes on where it
//! was.
//!
//! Searches are pure functions of what they are asked, and asked in the same order each time. So an answer
//! that is kept under its question, bit by bit, makes a resumed run give the very bytes of one that was never
//! stopped. One JSON array a line; a line that was cut off by the stop is left out. The first line says what
//! the answers belong to.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;

use biplane_matcher::Pose2;
use nalgebra::Matrix3;

use crate::slam::loop_closure::agreement::Agreement;
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::loop_closure::verification::Found;

/// Numbers of a question.
const ASKED: usize = 11;

/// What was asked: which submaps, and in which region; numbers by their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Asked([u64; ASKED]);

impl Asked {
    /// The question of a search.
    pub fn new(submap_ids: [usize; 2], region: &SearchRegion) -> Self {
        let &SearchRegion { guess, window, strip, uncertainty_m } = region;
        let [a, b] = submap_ids.map(|number| number as u64);
        let [x, y, t] = [guess.x_m, guess.y_m, guess.theta_rad].map(f64::to_bits);
        let [half_m, half_rad] = [window.half_m, window.half_rad].map(f64::to_bits);
        let [across_x, across_y, across_m] =
            strip.map_or([0; 3], |strip| [strip.across[0], strip.across[1], strip.half_m].map(f64::to_bits));
        Self([a, b, x, y, t, half_m, half_rad, across_x, across_y, across_m, uncertainty_m.to_bits()])
    }
}

/// Numbers of a found loop: pose, information row by row, agreement.
const FOUND: usize = 16;

/// See the module's text.
#[derive(Debug, Default)]
pub struct Checkpoint {
    known: BTreeMap<Asked, Option<Found>>,
    file: Option<BufWriter<File>>,
}

impl Checkpoint {
    /// Goes on with the file when it belongs to the same job, else begins it anew. `job` names inputs and
    /// parameters.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn open(path: &Path, job: &str) -> io::Result<Self> {
        let mut known = BTreeMap::new();
        if let Ok(file) = File::open(path) {
            let mut lines = BufReader::new(file).lines().map_while(Result::ok);
            if lines.next().as_deref() == Some(job) {
                known.extend(lines.filter_map(|line| parse(&line)));
            }
        }
        // Written anew, so that a line that was cut off is gone.
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(path)?;
        let mut checkpoint = Self { known: BTreeMap::new(), file: Some(BufWriter::new(file)) };
        if let Some(file) = &mut checkpoint.file {
            writeln!(file, "{job}")?;
        }
        let answers: Vec<_> = known.into_iter().collect();
        checkpoint.add(&answers);
        checkpoint.known = answers.into_iter().collect();
        Ok(checkpoint)
    }

    /// How many answers are kept from before.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The answer, if it is known: a loop, or that there is none.
    pub fn answer(&self, asked: &Asked) -> Option<Option<Found>> {
        self.known.get(asked).copied()
    }

    /// Keeps answers. A file that cannot be written is given up: the job itself does not need it.
    pub fn add(&mut self, answers: &[(Asked, Option<Found>)]) {
        let Some(file) = &mut self.file else { return };
        let fresh = answers.iter().filter(|(asked, _)| !self.known.contains_key(asked));
        let written = fresh
            .into_iter()
            .try_for_each(|answer| writeln!(file, "{}", line(answer)))
            .and_then(|()| file.flush());
        if written.is_err() {
            self.file = None;
        }
    }
}

fn line((asked, found): &(Asked, Option<Found>)) -> String {
    let mut numbers = asked.0.to_vec();
    if let Some(found) = found {
        let pose = [found.pose.x_m, found.pose.y_m, found.pose.theta_rad];
        let rows = found.information.transpose();
        let all = pose.into_iter().chain(rows.iter().copied()).chain(of_agreement(&found.agreement));
        numbers.extend(all.map(f64::to_bits));
    }
    let texts: Vec<String> = numbers.iter().map(u64::to_string).collect();
    format!("[{}]", texts.join(","))
}

fn of_agreement(agreement: &Agreement) -> [f64; 4] {
    [agreement.share, agreement.along, agreement.along_points as f64, agreement.overlap]
}

fn parse(line: &str) -> Option<(Asked, Option<Found>)> {
    let numbers: Vec<u64> = serde_json::from_str(line).ok()?;
    let (asked, rest) = numbers.split_first_chunk::<ASKED>()?;
    let found = match rest.len() {
        0 => None,
        FOUND => {
            let values: Vec<f64> = rest.iter().copied().map(f64::from_bits).collect();
            Some(Found {
                pose: Pose2::new(values[0], values[1], values[2]),
                information: Matrix3::from_row_slice(&values[3..12]),
                agreement: Agreement {
                    share: values[12],
                    along: values[13],
                    along_points: values[14] as usize,
                    overlap: values[15],
                },
            })
        }
        _ => return None,
    };
    Some((Asked(*asked), found))
}

#[cfg(test)]
mod tests {
    use super::{Agreement, Asked, Checkpoint, Found, SearchRegion};
    use biplane_matcher::{Pose2, Strip, Window};
    use nalgebra::Matrix3;

    fn asked(number: usize) -> Asked {
        let window = Window { half_m: 1.0 / 3.0, half_rad: 0.1 };
        let strip = Some(Strip { across: [0.6, 0.8], half_m: 0.1 });
        Asked::new(
            [number, 7],
            &SearchRegion { guess: Pose2::new(0.1, -0.0, 3.0), window, strip, uncertainty_m: 2.0 },
        )
    }

    fn found() -> Found {
        Found {
            pose: Pose2::new(1.0 / 3.0, -2.0, 0.1),
            information: Matrix3::new(1.0, 0.2, 0.3, 0.2, 5.0, 0.7, 0.3, 0.7, 1e9 / 7.0),
            agreement: Agreement { share: 0.9, along: 0.8, along_points: 40, overlap: 0.7 },
        }
    }

    #[test]
    fn answers_come_back_bit_by_bit_for_the_same_job_only() {
        let path = std::env::temp_dir().join(format!("biplane-loops-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let mut checkpoint = Checkpoint::open(&path, "one").unwrap();
        checkpoint.add(&[(asked(1), None), (asked(2), Some(found()))]);
        drop(checkpoint);
        // The stop came in the middle of a line.
        let mut text = std::fs::read_to_string(&path).unwrap();
        text.push_str("[3,7,12");
        std::fs::write(&path, text).unwrap();
        let mut again = Checkpoint::open(&path, "one").unwrap();
        assert_eq!(again.len(), 2);
        assert_eq!(again.answer(&asked(1)), Some(None));
        assert_eq!(again.answer(&asked(2)), Some(Some(found())));
        assert_eq!(again.answer(&asked(3)), None);
        again.add(&[(asked(3), None)]);
        drop(again);
        assert_eq!(Checkpoint::open(&path, "one").unwrap().len(), 3);
        assert!(Checkpoint::open(&path, "another").unwrap().is_empty());
        std::fs::remove_file(&path).unwrap();
    }
}
