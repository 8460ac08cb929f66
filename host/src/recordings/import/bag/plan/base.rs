//! Which frame is the base, and whose motion the odometry tells.

use nalgebra::Isometry3;

use super::OdometrySource;
use super::listing;
use crate::recordings::import::bag::error::BagError;
use crate::recordings::import::bag::frames::bare;
use crate::recordings::import::bag::options::TopicChoice;
use crate::recordings::import::bag::survey::Survey;

/// Frames that lie on the floor below a robot, by the names that people give them (REP 120).
const FOOTPRINT: &str = "base_footprint";
const BASE: &str = "base_link";

/// Where odometry comes from, and the frame whose motion it is.
pub(crate) fn odometry_source(
    survey: &Survey,
    choice: &TopicChoice,
    notes: &mut Vec<String>,
) -> Result<(OdometrySource, Option<String>), BagError> {
    let topics = || listing::topics(survey.odometry.values().map(|seen| (seen.topic.as_str(), seen.count)));
    let of_topic = |key: &str| {
        let child = survey.odometry.get(key).map(|seen| seen.child.clone());
        (OdometrySource::Topic(key.to_owned()), child.filter(|child| !child.is_empty()))
    };
    match choice {
        TopicChoice::Without => Ok((OdometrySource::None, None)),
        TopicChoice::Named(name) if survey.odometry.contains_key(bare(name)) => Ok(of_topic(bare(name))),
        // A topic of transforms, by name.
        TopicChoice::Named(name) if bare(name) == "tf" => of_transforms(survey, notes),
        TopicChoice::Named(name) => {
            let text = format!("no nav_msgs/Odometry on {name}; on others: {}", topics());
            Err(BagError::Choice(text))
        }
        TopicChoice::Any => match survey.odometry.len() {
            0 => of_transforms(survey, notes),
            1 => Ok(of_topic(survey.odometry.keys().next().map_or("", String::as_str))),
            _ => {
                let text =
                    format!("several odometries: {}; choose with --odom TOPIC or --odom none", topics());
                Err(BagError::Choice(text))
            }
        },
    }
}

fn of_transforms(
    survey: &Survey,
    notes: &mut Vec<String>,
) -> Result<(OdometrySource, Option<String>), BagError> {
    let driven = survey.frames.driven();
    match driven[..] {
        [] => {
            notes.push("no odometry, neither on a topic nor in /tf: scans are matched without".to_owned());
            Ok((OdometrySource::None, None))
        }
        [(parent, child)] => {
            notes.push(format!("odometry from /tf, {parent} to {child}; speeds by difference"));
            let (parent, child) = (parent.to_owned(), child.to_owned());
            Ok((OdometrySource::Transforms { parent, child: child.clone() }, Some(child)))
        }
        _ => {
            let words: Vec<String> =
                driven.iter().map(|(parent, child)| format!("{parent} to {child}")).collect();
            let text = format!("several odometries in /tf: {}; --odom none goes without", words.join(", "));
            Err(BagError::Choice(text))
        }
    }
}

/// The frame that becomes `base_link`: on the floor, if the bag has such a frame.
pub(crate) fn frame(
    survey: &Survey,
    given: Option<&str>,
    child: Option<&str>,
    notes: &mut Vec<String>,
) -> Result<Option<String>, BagError> {
    let frames = &survey.frames;
    if let Some(given) = given {
        let given = bare(given);
        return match frames.knows(given) || child == Some(given) {
            true => Ok(Some(given.to_owned())),
            false => Err(BagError::Choice(format!("--base-frame {given}: no transform names it"))),
        };
    }
    let found = match child {
        Some(child) if frames.between(child, FOOTPRINT).is_some() => Some(FOOTPRINT),
        Some(child) => Some(child),
        None => [FOOTPRINT, BASE].into_iter().find(|name| frames.knows(name)),
    };
    if let Some(found) = found.filter(|name| *name != BASE) {
        notes.push(format!("base_link is the bag's {found}"));
    }
    Ok(found.map(str::to_owned))
}

/// Takes points of the base into the frame whose odometry there is.
pub(crate) fn child_from_base(
    survey: &Survey,
    child: Option<&str>,
    base: Option<&str>,
) -> Result<Isometry3<f64>, BagError> {
    match (child, base) {
        (Some(child), Some(base)) if child != base => survey.frames.between(child, base).ok_or_else(|| {
            BagError::Choice(format!(
                "the odometry is that of frame {child}, and no transform that stays leads from it to {base}: choose \
                 with --base-frame, or go without by --odom none"
            ))
        }),
        _ => Ok(Isometry3::identity()),
    }
}
