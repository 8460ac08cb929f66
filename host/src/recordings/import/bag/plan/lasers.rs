//! Which laser lies flat and which stands: by where they sit.

use super::placed::{Fan, Placed};
use super::{listing, preset};
use crate::recordings::import::bag::error::BagError;
use crate::recordings::import::bag::frames::bare;
use crate::recordings::import::bag::options::{BagOptions, TopicChoice};
use crate::recordings::import::bag::survey::{LaserSeen, Survey};
use crate::recordings::mounts::mount_of;

/// The lasers that are taken.
#[derive(Clone, Debug)]
pub(crate) struct Chosen<'a> {
    pub horizontal: &'a Placed<'a>,
    pub vertical: Option<&'a Placed<'a>>,
}

/// All lasers with scans, placed by what was said of them, by the bag's frames, or as on a robot that is
/// known.
pub(crate) fn placed<'a>(
    survey: &'a Survey,
    base: Option<&str>,
    options: &BagOptions,
    notes: &mut Vec<String>,
) -> Vec<Placed<'a>> {
    let mut is_preset = false;
    let mut place = |seen: &'a LaserSeen| {
        let given = [&options.horizontal, &options.vertical]
            .into_iter()
            .find(|given| matches!(&given.topic, TopicChoice::Named(name) if names(seen, name)))
            .and_then(|given| given.mount);
        let by_frames = || base.and_then(|base| survey.frames.between(base, &seen.frame));
        let mount = given.or_else(|| by_frames().map(|transform| mount_of(&transform))).or_else(|| {
            let known = preset::cartographer_mount(bare(&seen.topic), &seen.frame);
            is_preset |= known.is_some();
            known
        });
        Placed { seen, fan: Fan::of(mount.as_ref()), mount }
    };
    let all: Vec<Placed<'a>> = survey.lasers.values().filter(|seen| seen.scans > 0).map(&mut place).collect();
    if is_preset {
        notes.push(preset::CARTOGRAPHER.to_owned());
    }
    all
}

fn names(seen: &LaserSeen, name: &str) -> bool {
    Placed { seen, mount: None, fan: Fan::Unknown }.is_named(name)
}

/// The laser that localizes and the one that sees the building.
pub(crate) fn choose<'a>(
    all: &'a [Placed<'a>],
    options: &BagOptions,
    notes: &mut Vec<String>,
) -> Result<Chosen<'a>, BagError> {
    let horizontal = horizontal(all, &options.horizontal.topic)?;
    let vertical = match &options.vertical.topic {
        TopicChoice::Without => None,
        TopicChoice::Named(name) => Some(named(all, name, "--vertical")?),
        TopicChoice::Any => only_standing(all, horizontal, notes)?,
    };
    if let Some(vertical) = vertical {
        if vertical.key() == horizontal.key() {
            let text =
                format!("{} cannot be both lasers; there are:{}", vertical.seen.topic, listing::lasers(all));
            return Err(BagError::Choice(text));
        }
        if vertical.mount.is_none() && options.vertical.mount.is_none() {
            return Err(BagError::Choice(format!(
                "where {} sits is not known (no transform leads to its frame {}): say --mount-vertical \
                 x,y,z,roll,pitch,yaw in m and degrees, or --vertical none",
                vertical.seen.topic, vertical.seen.frame
            )));
        }
    }
    Ok(Chosen { horizontal, vertical })
}

fn horizontal<'a>(all: &'a [Placed<'a>], choice: &TopicChoice) -> Result<&'a Placed<'a>, BagError> {
    let ask = |why: &str| {
        BagError::Choice(format!("{why}; choose with --horizontal TOPIC[@FRAME]:{}", listing::lasers(all)))
    };
    if let TopicChoice::Named(name) = choice {
        return named(all, name, "--horizontal");
    }
    let flat: Vec<&Placed> = all.iter().filter(|laser| laser.fan == Fan::Flat).collect();
    match (&flat[..], all) {
        ([only], _) => Ok(only),
        // One laser alone that nobody placed: it localizes, as if at the base's origin.
        ([], [only]) if only.fan == Fan::Unknown => Ok(only),
        ([], _) => Err(ask("no laser is known to lie flat")),
        _ => Err(ask("several lasers lie flat")),
    }
}

fn only_standing<'a>(
    all: &'a [Placed<'a>],
    horizontal: &Placed<'_>,
    notes: &mut Vec<String>,
) -> Result<Option<&'a Placed<'a>>, BagError> {
    let others: Vec<&Placed> = all.iter().filter(|laser| laser.key() != horizontal.key()).collect();
    let standing: Vec<&Placed> = others.iter().copied().filter(|laser| laser.fan == Fan::Standing).collect();
    match standing[..] {
        [only] => Ok(Some(only)),
        [] => {
            notes.push("no vertical laser: a map can be made, a building not".to_owned());
            for laser in others {
                notes.push(format!("{} is not taken: its fan is {}", laser.seen.topic, laser.fan.name()));
            }
            Ok(None)
        }
        _ => Err(BagError::Choice(format!(
            "several lasers stand; choose with --vertical TOPIC[@FRAME], or --vertical none:{}",
            listing::lasers(all)
        ))),
    }
}

fn named<'a>(all: &'a [Placed<'a>], name: &str, flag: &str) -> Result<&'a Placed<'a>, BagError> {
    let found: Vec<&Placed> = all.iter().filter(|laser| laser.is_named(name)).collect();
    match found[..] {
        [only] => Ok(only),
        [] => Err(BagError::Choice(format!(
            "{flag} {name}: no scans there; there are:{}",
            listing::lasers(all)
        ))),
        _ => Err(BagError::Choice(format!(
            "{flag} {name}: several frames there, choose with {flag} {name}@FRAME:{}",
            listing::lasers(all)
        ))),
    }
}
