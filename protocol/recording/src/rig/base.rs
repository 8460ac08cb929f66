//! The mobile base in `rig.toml`: its line, what it speaks, and what its counts are worth.

use super::table::Table;

/// Rates that a base may run at, in Bd.
const BAUDS: [f64; 9] = [2400.0, 4800.0, 9600.0, 19200.0, 38400.0, 57600.0, 115_200.0, 230_400.0, 460_800.0];
/// Lengths of one odometry unit, in m.
const TICK_M: (f64, f64) = (1e-9, 10.0);
const COUNT_M: (f64, f64) = (-10.0, 10.0);
/// Stand-ins for what only the builder of a RoboClaw base knows, in m.
const DEFAULT_COUNT_M: f64 = 0.0001;
const DEFAULT_WHEEL_BASE_M: f64 = 0.3;
const WHEEL_BASE_M: (f64, f64) = (0.01, 10.0);
/// Counts of a meter or a radian.
const COUNTS: (f64, f64) = (-1e9, 1e9);

/// What bases speak, and whose they are.
const PROTOCOLS: [(&str, &str); 4] = [
    ("p2os", "Pioneer and kin"),
    ("roboclaw", "a base of one's own on a RoboClaw"),
    ("rflex", "B21r, ATRV, Magellan"),
    ("none", "no base; bags of ROS: biplane import bag"),
];

const P2OS_KEYS: [&str; 4] = ["protocol", "port", "baud", "metres_per_tick"];
const ROBOCLAW_KEYS: [&str; 7] = [
    "protocol",
    "port",
    "baud",
    "address",
    "wheel_base_m",
    "metres_per_count_left",
    "metres_per_count_right",
];
const RFLEX_KEYS: [&str; 6] = ["protocol", "port", "baud", "model", "counts_per_m", "counts_per_rad"];

/// The mobile base: its line and its odometry.
#[derive(Clone, PartialEq, Debug)]
pub struct Base {
    /// What it speaks.
    pub protocol: BaseProtocol,
    /// The serial port.
    pub port: String,
    /// The line's rate, in Bd.
    pub baud: u32,
}

/// What a base speaks, with what only that protocol needs.
#[derive(Copy, Clone, PartialEq, Debug)]
pub enum BaseProtocol {
    /// There is none, or none that reports: scans are matched without odometry.
    None,
    /// P2OS and ARCOS: Pioneer and its kin.
    P2os {
        /// Distance of one odometry unit, in m. Too large makes the robot seem to drive too far. `None`: what
        /// is known of the subclass that the base tells. The unit of its angle always goes by the subclass.
        metres_per_tick: Option<f64>,
    },
    /// RoboClaw packet serial: home-made bases with two driven wheels, motor 1 on the left.
    RoboClaw {
        /// The controller's address, 128 to 135.
        address: u8,
        /// Between the wheels' tracks, in m. Too large makes the robot seem to turn too little.
        wheel_base_m: f64,
        /// Distance of one encoder count of the left wheel (motor 1), in m; negative when it counts
        /// backwards.
        metres_per_count_left: f64,
        /// The same of the right wheel (motor 2).
        metres_per_count_right: f64,
    },
    /// rFLEX: B21r, ATRV, Magellan. Written after other drivers, never tried on hardware.
    Rflex {
        /// Counts of a meter of way; negative when it counts backwards. Too small makes the robot seem to
        /// drive too far.
        counts_per_m: f64,
        /// Counts of a radian of bearing; negative when it counts clockwise. Too small makes it seem to turn
        /// too much.
        counts_per_rad: f64,
    },
}

/// A model of rFLEX base, for what its counts are worth (CARMEN's table; robots of one model differ by some
/// per cent).
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum RflexModel {
    /// ATRV.
    Atrv,
    /// ATRV-2.
    Atrv2,
    /// ATRV-Jr.
    AtrvJr,
    /// ATRV-mini.
    AtrvMini,
    /// B14r.
    B14r,
    /// B21r.
    B21r,
    /// Magellan.
    Magellan,
    /// Magellan Pro.
    MagellanPro,
}

impl RflexModel {
    /// All models.
    pub const ALL: [Self; 8] = [
        Self::Atrv,
        Self::Atrv2,
        Self::AtrvJr,
        Self::AtrvMini,
        Self::B14r,
        Self::B21r,
        Self::Magellan,
        Self::MagellanPro,
    ];

    /// The word in `rig.toml`, for example `b21r`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Atrv => "atrv",
            Self::Atrv2 => "atrv-2",
            Self::AtrvJr => "atrv-jr",
            Self::AtrvMini => "atrv-mini",
            Self::B14r => "b14r",
            Self::B21r => "b21r",
            Self::Magellan => "magellan",
            Self::MagellanPro => "magellan-pro",
        }
    }

    /// Counts of a meter, and of a radian.
    #[must_use]
    pub const fn counts(self) -> (f64, f64) {
        match self {
            Self::Atrv => (146_685.14, 72_640.107),
            Self::Atrv2 => (161_353.50, 79_904.12),
            Self::AtrvJr => (87_462.73, 36_277.67),
            Self::AtrvMini => (139_654.7, 49_784.5),
            Self::B14r => (84_157.1, 75_055.859),
            Self::B21r => (101_230.0, 35_343.888),
            Self::Magellan => (44_509.7, 5_818.02),
            Self::MagellanPro => (31_271.8, 4_752.6),
        }
    }
}

impl BaseProtocol {
    /// The word in `rig.toml`: `p2os`, `roboclaw`, `rflex` or `none`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::P2os { .. } => "p2os",
            Self::RoboClaw { .. } => "roboclaw",
            Self::Rflex { .. } => "rflex",
        }
    }

    /// The keys of a home-made base's geometry that have the values of the defaults, which are nobody's
    /// robot.
    #[must_use]
    pub fn unmeasured(self) -> Vec<&'static str> {
        let Self::RoboClaw { wheel_base_m, metres_per_count_left, metres_per_count_right, .. } = self else {
            return Vec::new();
        };
        let keys = [
            ("wheel_base_m", wheel_base_m, DEFAULT_WHEEL_BASE_M),
            ("metres_per_count_left", metres_per_count_left, DEFAULT_COUNT_M),
            ("metres_per_count_right", metres_per_count_right, DEFAULT_COUNT_M),
        ];
        let is_default = |value: f64, default: f64| (value - default).abs() < f64::EPSILON;
        keys.into_iter()
            .filter(|&(_, value, default)| is_default(value, default))
            .map(|(key, ..)| key)
            .collect()
    }

    /// The rate that such a base runs at unless told otherwise, in Bd.
    #[must_use]
    pub const fn default_baud(self) -> u32 {
        match self {
            Self::None => 0,
            Self::P2os { .. } => 9600,
            Self::RoboClaw { .. } => 38400,
            Self::Rflex { .. } => 115_200,
        }
    }
}

impl Default for Base {
    /// A Pioneer, whatever its subclass.
    fn default() -> Self {
        let protocol = BaseProtocol::P2os { metres_per_tick: None };
        Self { protocol, port: "/dev/base".to_owned(), baud: protocol.default_baud() }
    }
}

impl Base {
    /// No base: a rig that is carried, or whose wheels do not tell.
    #[must_use]
    pub fn none() -> Self {
        Self { protocol: BaseProtocol::None, port: String::new(), baud: 0 }
    }

    /// Whether there is a base on a port.
    #[must_use]
    pub fn is_present(&self) -> bool {
        self.protocol != BaseProtocol::None
    }

    pub(crate) fn parse(table: &Table) -> Self {
        let template = Self::default();
        let protocol = match table.protocol(template.protocol.name(), &PROTOCOLS) {
            Some("roboclaw") => roboclaw(table),
            Some("rflex") => rflex(table),
            Some("none") => return none(table),
            Some(_) => p2os(table),
            // Which other keys it has depends on what it speaks.
            None => return template,
        };
        Self {
            protocol,
            port: table.text("port"),
            baud: table.one_of("baud", f64::from(protocol.default_baud()), &BAUDS) as u32,
        }
    }
}

/// Without a base there is no port.
fn none(table: &Table) -> Base {
    table.only(&["protocol"]);
    Base::none()
}

fn p2os(table: &Table) -> BaseProtocol {
    table.only(&P2OS_KEYS);
    let key = "metres_per_tick";
    BaseProtocol::P2os { metres_per_tick: table.has(key).then(|| table.number(key, 0.001, TICK_M)) }
}

fn roboclaw(table: &Table) -> BaseProtocol {
    table.only(&ROBOCLAW_KEYS);
    let addresses = [128.0, 129.0, 130.0, 131.0, 132.0, 133.0, 134.0, 135.0];
    let metres_per_count = |key| {
        let meters = table.number(key, DEFAULT_COUNT_M, COUNT_M);
        if meters == 0.0 {
            table.refuse(key, "a number that is not 0, negative when the wheel counts backwards");
        }
        meters
    };
    BaseProtocol::RoboClaw {
        address: table.one_of("address", 128.0, &addresses) as u8,
        wheel_base_m: table.number("wheel_base_m", DEFAULT_WHEEL_BASE_M, WHEEL_BASE_M),
        metres_per_count_left: metres_per_count("metres_per_count_left"),
        metres_per_count_right: metres_per_count("metres_per_count_right"),
    }
}

/// The model's counts, each replaced by the robot's own where it is given. Without a model, one alone says
/// too little.
fn rflex(table: &Table) -> BaseProtocol {
    table.only(&RFLEX_KEYS);
    let (own_m, own_rad) = (table.has("counts_per_m"), table.has("counts_per_rad"));
    if !table.has("model") && own_m != own_rad {
        let key = if own_m { "counts_per_rad" } else { "counts_per_m" };
        table.refuse(key, "the other of counts_per_m and counts_per_rad, or a model");
    }
    let words = RflexModel::ALL.map(RflexModel::name);
    let word = table.word("model", RflexModel::B21r.name(), &words);
    let model =
        RflexModel::ALL.into_iter().find(|model| Some(model.name()) == word).unwrap_or(RflexModel::B21r);
    let counts = |key, default| {
        let counts = table.number(key, default, COUNTS);
        if counts.abs() < 1.0 {
            table.refuse(key, "1 or more, negative when it counts the other way");
        }
        counts
    };
    let (per_m, per_rad) = model.counts();
    BaseProtocol::Rflex {
        counts_per_m: counts("counts_per_m", per_m),
        counts_per_rad: counts("counts_per_rad", per_rad),
    }
}
