//! What a telegram is for: the three letters that its body begins with.

/// Letters of a kind; the shortest body is one of them alone.
pub(crate) const KIND_BYTES: usize = 3;

/// What a telegram asks or answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `sRN`: read a variable.
    Read,
    /// `sRA`: its value.
    ReadAnswer,
    /// `sWN`: write a variable.
    Write,
    /// `sWA`: written.
    WriteAnswer,
    /// `sMN`: call a method.
    Method,
    /// `sAN`: its result.
    MethodAnswer,
    /// `sEN`: subscribe to an event.
    Subscribe,
    /// `sEA`: subscribed.
    SubscribeAnswer,
    /// `sSN`: an event.
    Event,
    /// `sFA`: refused. Only a code follows, no name.
    Error,
    /// `sRI`: read by number.
    ReadByNumber,
    /// `sWI`: write by number.
    WriteByNumber,
    /// `sMI`: call by number.
    MethodByNumber,
    /// `sSI`: an event by number, of old devices.
    EventByNumber,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Read,
        Self::ReadAnswer,
        Self::Write,
        Self::WriteAnswer,
        Self::Method,
        Self::MethodAnswer,
        Self::Subscribe,
        Self::SubscribeAnswer,
        Self::Event,
        Self::Error,
        Self::ReadByNumber,
        Self::WriteByNumber,
        Self::MethodByNumber,
        Self::EventByNumber,
    ];

    /// The three letters that a body begins with.
    #[must_use]
    pub const fn bytes(self) -> &'static [u8; KIND_BYTES] {
        match self {
            Self::Read => b"sRN",
            Self::ReadAnswer => b"sRA",
            Self::Write => b"sWN",
            Self::WriteAnswer => b"sWA",
            Self::Method => b"sMN",
            Self::MethodAnswer => b"sAN",
            Self::Subscribe => b"sEN",
            Self::SubscribeAnswer => b"sEA",
            Self::Event => b"sSN",
            Self::Error => b"sFA",
            Self::ReadByNumber => b"sRI",
            Self::WriteByNumber => b"sWI",
            Self::MethodByNumber => b"sMI",
            Self::EventByNumber => b"sSI",
        }
    }
}
