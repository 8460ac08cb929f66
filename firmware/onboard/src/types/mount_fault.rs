//! What may be wrong with how the lasers sit, in words.

use std::fmt;

/// How scans can follow from the motion that the odometry tells.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Sense {
    /// As the rig has it.
    AsMounted,
    /// Left and right exchanged: they turn the other way.
    TurnsReversed,
    /// The laser looks backwards.
    Backwards,
    /// Both.
    BothReversed,
    /// The laser is turned a quarter to the left.
    Leftwards,
    /// Or to the right.
    Rightwards,
    /// The scans do not move when the base does.
    Still,
}

impl Sense {
    /// All but [`Sense::AsMounted`].
    pub(crate) const OTHERS: [Self; 6] = [
        Self::TurnsReversed,
        Self::Backwards,
        Self::BothReversed,
        Self::Leftwards,
        Self::Rightwards,
        Self::Still,
    ];
}

/// How the laser may sit.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum MountHypothesis {
    /// As the rig has it.
    AsMounted,
    /// Left and right exchanged.
    Mirrored,
    /// Turned about the vertical by a quarter.
    Quartered,
    /// Its middle points down instead of up.
    Down,
    /// Its middle points up instead of down.
    Up,
    /// It sees points below the floor.
    Under,
}

/// Something about how a laser sits that does not fit what it sees.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum MountFault {
    /// The two lasers are exchanged.
    Swapped,
    /// The localizing laser's scans do not move with the base.
    DoesNotMove,
    /// The localizing laser's scans move otherwise than the rig has it.
    Moves(Sense),
    /// The laser that sees the building moves as a level one does.
    LiesLevel,
    /// The laser that sees the building sits otherwise than the rig has it.
    Sits(MountHypothesis),
}

impl MountFault {
    /// Of the localizing laser, by how its scans move and whether those of the other one move as level ones
    /// do.
    #[must_use]
    pub(crate) fn of_level(sense: Option<Sense>, other_is_level: bool) -> Option<Self> {
        match sense? {
            Sense::AsMounted => None,
            Sense::Still if other_is_level => Some(Self::Swapped),
            Sense::Still => Some(Self::DoesNotMove),
            sense => Some(Self::Moves(sense)),
        }
    }

    /// In a few words, for a state.
    #[must_use]
    pub fn short(self) -> &'static str {
        match self {
            Self::Swapped => "looks swapped with the other laser",
            Self::DoesNotMove => "its scans do not move with the base",
            Self::Moves(Sense::TurnsReversed) => "its scans turn against the odometry",
            Self::Moves(Sense::Backwards) => "its scans drive against the odometry",
            Self::Moves(Sense::BothReversed) => "its scans drive and turn against the odometry",
            Self::Moves(_) => "its scans drive across the odometry",
            Self::LiesLevel => "its scans move as those of a level laser",
            Self::Sits(MountHypothesis::Mirrored) => "left and right look exchanged",
            Self::Sits(MountHypothesis::Quartered) => "looks turned by a quarter",
            Self::Sits(MountHypothesis::Down) => "looks down, not up",
            Self::Sits(MountHypothesis::Up) => "looks up, not down",
            Self::Sits(_) => "sees points below the floor",
        }
    }
}

impl MountFault {
    /// That it comes up, or that it has gone, in words.
    pub(crate) fn say(self, begins: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if begins {
            return fmt::Display::fmt(&self, f);
        }
        write!(f, "what it sees fits the rig again (it was: {})", self.short())
    }
}

impl fmt::Display for MountFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = self.short();
        match self {
            Self::Swapped => {
                write!(f, "{short}: its scans do not move with the base, the other's do (exchange the ports)")
            }
            Self::DoesNotMove => {
                write!(f, "{short}: is it level, is it the laser that the rig says, or do the wheels spin?")
            }
            Self::Moves(Sense::TurnsReversed) => write!(
                f,
                "{short}: does it hang upside down (roll = 180 in its mount), or are the base's wheels exchanged?"
            ),
            Self::Moves(Sense::Backwards) => {
                write!(
                    f,
                    "{short}: does it look backwards (yaw = 180), or has the base's distance the wrong sign?"
                )
            }
            Self::Moves(Sense::BothReversed) => {
                write!(
                    f,
                    "{short}: is it upside down and backwards, or do the base's wheels count backwards?"
                )
            }
            Self::Moves(Sense::Leftwards) => write!(f, "{short}: does it look to the left (yaw = 90)?"),
            Self::Moves(_) => write!(f, "{short}: does it look to the right (yaw = -90)?"),
            Self::LiesLevel => write!(f, "{short}: is it the laser that the rig says, and its mount right?"),
            Self::Sits(MountHypothesis::Mirrored) => {
                write!(
                    f,
                    "{short} beside what the horizontal laser sees: is its mount turned round (yaw = 180)?"
                )
            }
            Self::Sits(MountHypothesis::Quartered) => {
                write!(f, "{short} beside what the horizontal laser sees: is the yaw of its mount right?")
            }
            Self::Sits(MountHypothesis::Down | MountHypothesis::Up) => {
                write!(f, "{short}: has the pitch of its mount the wrong sign?")
            }
            Self::Sits(_) => write!(f, "{short}: are z, roll and pitch of its mount right?"),
        }
    }
}

/// What is known of how a laser sits.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Mounting {
    /// Nothing yet: the base has not driven and turned enough, or there is no odometry.
    #[default]
    Unknown,
    /// What it sees fits the rig.
    Fits,
    /// What it sees does not.
    Suspect(MountFault),
}

impl Mounting {
    /// In a few words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Unknown => "not known yet",
            Self::Fits => "fits",
            Self::Suspect(mount_fault) => mount_fault.short(),
        }
    }

    /// What is suspected.
    #[must_use]
    pub fn mount_fault(self) -> Option<MountFault> {
        match self {
            Self::Suspect(mount_fault) => Some(mount_fault),
            Self::Unknown | Self::Fits => None,
        }
    }
}
