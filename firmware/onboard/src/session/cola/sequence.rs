//! In which order a laser is asked, and what is written to it of what differs from the rig.

use biplane_wire::cola::{Family, ScanConfig, Telegram};

use crate::session::cola::event::ColaEvent;
use crate::session::cola::machine::Machine;
use crate::session::cola::query::Query;
use crate::session::cola::settings::ColaChange;
use crate::session::event::Event;
use crate::session::machine_session::Goal;

/// Configurations that are written in a run at most: a device that does not keep them shall not wear out.
const MAX_WRITES: u8 = 3;

impl Machine {
    /// The device says what is in force now, which need not be what was asked.
    pub(super) fn check_scan_config(&mut self, telegram: &Telegram<'_>) {
        let answer = ScanConfig::parse_answer(telegram);
        let code = match (answer, self.change.scan) {
            (Ok((0, now)), Some(wanted)) if now.rate_chz == wanted.rate_chz => return,
            (Ok((code, _)), _) => u16::from(code),
            (Err(_), _) => u16::from(u8::MAX),
        };
        self.refuses(ColaEvent::SettingRefused { code });
    }

    /// The device does not let itself be set.
    pub(super) fn refuses(&mut self, event: ColaEvent) {
        self.reported.is_kept |= !self.change.is_empty();
        self.health.differs = self.reported.is_kept;
        self.outputs.say(Event::Cola(event));
    }

    /// Whether the scans are those that the rig asks for. Just after its rate was set a mirror still turns as
    /// it did.
    pub(super) fn check_scan(&mut self, rate_chz: u32, step_e4deg: u32) {
        let is_other = self.settings.is_other(rate_chz, step_e4deg);
        self.health.differs = self.reported.is_kept || is_other;
        if is_other && self.change.scan.is_none() {
            self.keep(ColaEvent::Streams { rate_chz, step_e4deg });
        }
    }

    /// What is asked behind a question that is answered.
    pub(super) fn next(&mut self, query: Query) -> Option<Query> {
        let sets_rate = self.info.family.is_some_and(Family::sets_rate);
        match query {
            Query::Ident if self.goal == Goal::Probe => Some(Query::Firmware),
            Query::Firmware => Some(Query::Serial),
            Query::Serial => Some(Query::State),
            Query::Ident | Query::State if sets_rate => Some(Query::ReadScan),
            Query::Ident | Query::State | Query::ReadScan => Some(Query::ReadData),
            Query::ReadData => Some(Query::ReadRange),
            Query::ReadRange if self.goal == Goal::Probe => None,
            Query::ReadRange => Some(self.what_differs()),
            Query::Unsubscribe => {
                self.outputs.say(Event::Stopped);
                None
            }
            Query::Subscribe => None,
            _ => Some(self.next_write(query)),
        }
    }

    /// The order of writing; what is as it should be is passed over.
    fn next_write(&mut self, query: Query) -> Query {
        let change = self.change;
        let order = [
            (Query::Login, true),
            (Query::SafetyLogin, false),
            (Query::WriteScan, change.scan.is_some()),
            (Query::WriteData, change.data.is_some()),
            (Query::WriteRange, change.range.is_some()),
            (Query::Save, self.settings.save && !change.is_empty()),
            (Query::StartMeasuring, true),
            (Query::Run, true),
        ];
        let behind = order.iter().skip_while(|(step, _)| *step != query).skip(1);
        let next = behind.filter(|(_, is_due)| *is_due).map(|(step, _)| *step).next();
        if next == Some(Query::StartMeasuring) && !change.is_empty() {
            self.health.writes += 1;
            self.outputs.say(Event::Cola(ColaEvent::Written(change)));
        }
        next.unwrap_or(Query::Subscribe)
    }

    /// Whether the device must be written to.
    fn what_differs(&mut self) -> Query {
        self.change = ColaChange::default();
        self.reported.is_kept = false;
        let change = match self.settings.change(self.info.family, &self.info.config) {
            Ok(change) => change,
            Err(offered) => {
                self.keep(ColaEvent::NotOffered(offered));
                return Query::Subscribe;
            }
        };
        self.health.differs = false;
        if change.is_empty() {
            return if self.start_measuring { Query::Login } else { Query::Subscribe };
        }
        if self.settings.login && self.health.writes < MAX_WRITES {
            self.change = change;
            return Query::Login;
        }
        self.keep(ColaEvent::Kept(change));
        Query::Subscribe
    }

    /// Said once a run.
    fn keep(&mut self, event: ColaEvent) {
        (self.reported.is_kept, self.health.differs) = (true, true);
        if !std::mem::replace(&mut self.reported.kept, true) {
            self.outputs.say(Event::Cola(event));
        }
    }
}
