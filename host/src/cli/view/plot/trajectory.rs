//! `biplane plot trajectory`: paths from above, laid upon a reference and over a floor map where asked.

use std::path::{Path, PathBuf};

use crate::formats::output::check_not_input;
use crate::metrics::evaluate::association::associate;
use crate::metrics::evaluate::pose_error::{absolute, alignment};
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::Run;
use crate::view::floor_map::map_image::MapImage;
use crate::view::floor_map::{self, FloorMapParams};
use crate::view::plot::chart::{Backdrop, Chart};
use crate::view::plot::trajectory;
use anyhow::bail;
use biplane_matcher::Pose2;

use super::{Sheet, name_of};
use crate::cli::recordings::poses;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::values::not_negative;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    biplane plot trajectory office.mcap --map office.mcap -o path.svg\n  \
    biplane plot trajectory office.mcap office.tum --reference truth/poses.tum -o paths.svg")]
pub(super) struct Args {
    /// The paths to draw, named after their files: posed recordings, or texts with "t x y theta" or
    /// "t x y z qx qy qz qw" on each line
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// A trajectory to compare with, in one of the same forms: each path is laid upon it and its RMS distance
    /// stands in the legend
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Draw the floor map of this posed recording below the paths, and everything in its frame
    #[arg(long, value_name = "RUN.mcap")]
    map: Option<PathBuf>,
    /// Poses at most this far apart in time are compared, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.01, value_parser = not_negative)]
    max_dt: f64,
    /// Draw the paths as they are, without laying them upon the reference first
    #[arg(long)]
    no_align: bool,
    #[command(flatten)]
    pub(super) sheet: Sheet,
}

/// Reads the paths and draws them.
pub(super) fn chart(args: &Args, console: &Console) -> anyhow::Result<Chart> {
    for input in args.files.iter().chain(&args.reference).chain(&args.map) {
        check_not_input(&args.sheet.output, ".part", input)?;
    }
    let reference = args.reference.as_deref().map(|file| Reference::read(file, args, console)).transpose()?;
    let (figure_from_reference, backdrop) = match &args.map {
        None => (Pose2::IDENTITY, None),
        Some(recording) => {
            let (map_poses, backdrop) = read_map(recording, console)?;
            let reference_from_map = match &reference {
                Some(reference) => reference.alignment(&map_poses, recording)?.0,
                None => Pose2::IDENTITY,
            };
            (reference_from_map.inverse(), Some(backdrop))
        }
    };
    let mut paths = Vec::new();
    if let Some(Reference { file, poses, .. }) = &reference {
        let (name, poses) = (name_of(file), moved(poses, &figure_from_reference));
        paths.push(trajectory::Path { name, poses, is_reference: true, off_m: None });
    }
    for file in &args.files {
        let poses = poses::read(file, console)?;
        let (reference_from_path, off_m) = match &reference {
            Some(reference) => {
                reference.alignment(&poses, file).map(|(moved, off_m)| (moved, Some(off_m)))?
            }
            None => (Pose2::IDENTITY, None),
        };
        let poses = moved(&poses, &(figure_from_reference * reference_from_path));
        paths.push(trajectory::Path { name: name_of(file), poses, is_reference: false, off_m });
    }
    Ok(trajectory::chart(&paths, backdrop))
}

/// What paths are compared with.
struct Reference<'a> {
    file: &'a Path,
    poses: Vec<StampedPose>,
    max_dt_s: f64,
    no_align: bool,
}

impl<'a> Reference<'a> {
    fn read(file: &'a Path, args: &Args, console: &Console) -> anyhow::Result<Self> {
        let poses = poses::read(file, console)?;
        Ok(Self { file, poses, max_dt_s: args.max_dt, no_align: args.no_align })
    }

    /// What a trajectory is moved by to lie upon the reference, and its RMS distance from it then, meters.
    fn alignment(&self, poses: &[StampedPose], file: &Path) -> anyhow::Result<(Pose2, f64)> {
        let pairs = associate(poses, &self.poses, (self.max_dt_s * 1e9) as u64);
        let moved = if self.no_align { Pose2::IDENTITY } else { alignment(&pairs) };
        match absolute(&pairs, &moved) {
            Some(errors) => Ok((moved, errors.translation_m.rmse)),
            None => {
                bail!("{}", poses::none_nearby([file, self.file], [poses, &self.poses], self.max_dt_s))
            }
        }
    }
}

/// The poses and the floor map of a recording.
fn read_map(recording: &Path, console: &Console) -> anyhow::Result<(Vec<StampedPose>, Backdrop)> {
    poses::check_recording(recording, "--map takes the posed recording itself, and draws the map of it")?;
    let run = Run::open(&[recording.to_owned()])?;
    let _spinner = console.spinner(format!("drawing {}", run.path().display()));
    let poses = run.poses()?;
    let at_scans = poses.at_scans();
    let grid = floor_map::draw(&run, &at_scans, &poses.trajectory(), &FloorMapParams::default())?;
    let known: Vec<StampedPose> = at_scans.into_iter().flatten().collect();
    let (image, coarsened) = MapImage::new(&grid, &known)?;
    console.report_coarsened(coarsened.as_ref());
    let backdrop = trajectory::backdrop(&image.without_spokes(&known));
    Ok((known, backdrop))
}

fn moved(poses: &[StampedPose], by: &Pose2) -> Vec<StampedPose> {
    let one = |pose: &StampedPose| StampedPose::planar(pose.stamp_ns, *by * pose.pose());
    poses.iter().map(one).collect()
}
