//! What a Hokuyo laser answers.

use biplane_wire::scip::{
    BAUDS, Command, Delivery, KeyValue, Request, ScanRequest, TimeStep, emit_clock, emit_key_values, sum,
};

use super::model::{ScipLink, ScipParams, ScipState};
use super::stream::ScipScans;

/// Longest line that is taken from a client.
const MAX_LINE_BYTES: usize = 64;

/// Cuts requests out of bytes: they end with a line feed, a carriage return, or both.
#[derive(Clone, Debug, Default)]
pub(super) struct RequestLines {
    line: Vec<u8>,
    was_return: bool,
}

impl RequestLines {
    /// Takes bytes; whole lines go to `each`.
    pub(super) fn feed(&mut self, bytes: &[u8], mut each: impl FnMut(&[u8])) {
        for &byte in bytes {
            match byte {
                b'\n' if std::mem::take(&mut self.was_return) => {}
                b'\n' | b'\r' => {
                    self.was_return = byte == b'\r';
                    each(&self.line);
                    self.line.clear();
                }
                byte if self.line.len() < MAX_LINE_BYTES => {
                    self.was_return = false;
                    self.line.push(byte);
                }
                _ => {}
            }
        }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

/// What follows from a request beside its reply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Effect {
    /// Nothing.
    #[default]
    None,
    /// The laser streams so from now on.
    Stream(ScanRequest),
    /// It sends one scan, instead of the reply.
    Once(ScanRequest),
    /// It is quiet from now on.
    Stop,
    /// Its clock begins anew, and it is quiet.
    Reset,
    /// It starts up anew.
    Reboot,
    /// Its line gets this rate behind the reply.
    Baud(u32),
}

/// What a laser remembers.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    pub(super) state: ScipState,
    pub(super) baud: u32,
    is_on: bool,
    reboot_asked_ns: Option<i64>,
}

/// A reply and what follows.
pub(super) struct Answer {
    pub(super) bytes: Vec<u8>,
    pub(super) effect: Effect,
    pub(super) is_refused: bool,
}

fn answer(line: &[u8], status: &[u8; 2], lines: &[u8], effect: Effect) -> Answer {
    let status = [status[0], status[1], sum(status)];
    let bytes = [line, b"\n", &status, b"\n", lines, b"\n"].concat();
    Answer { bytes, effect, is_refused: status[..2] != *b"00" }
}

impl Memory {
    pub(super) fn of(params: &ScipParams) -> Self {
        let baud = match params.link {
            ScipLink::Serial(baud) => baud,
            ScipLink::Usb | ScipLink::Network => 0,
        };
        Self { state: params.state, baud, is_on: false, reboot_asked_ns: None }
    }

    /// As after power-on; an old laser then speaks SCIP 1.1.
    pub(super) fn power_on(&mut self, params: &ScipParams) {
        let is_old = params.state == ScipState::Scip1;
        let state = if is_old { ScipState::Scip1 } else { ScipState::Idle };
        *self = Self { state, baud: params.power_on_baud(), is_on: false, reboot_asked_ns: None };
    }

    /// The reply to a line at a time; `None` to one that hangs an old laser.
    pub(super) fn answer(
        &mut self,
        params: &ScipParams,
        scans: &dyn ScipScans,
        line: &[u8],
        now_ns: i64,
    ) -> Option<Answer> {
        if self.state == ScipState::Scip1 {
            return Some(self.old_answer(line));
        }
        let Ok(request) = Request::parse(line) else {
            return Some(answer(line, b"0E", b"", Effect::None));
        };
        let plain = |status: &[u8; 2], effect| answer(line, status, b"", effect);
        let clock_ms = scans.clock_ms(now_ns);
        Some(match request.command {
            Command::Time(step) => self.clock_answer(line, step, clock_ms),
            _ if self.state == ScipState::Clock => plain(b"0E", Effect::None),
            Command::Version => answer(line, b"00", &version(params), Effect::None),
            Command::Parameters => answer(line, b"00", &parameters(params), Effect::None),
            Command::Information => answer(line, b"00", &self.information(params, clock_ms), Effect::None),
            Command::LaserOn => {
                let was_on = std::mem::replace(&mut self.is_on, true);
                plain(if was_on { b"02" } else { b"00" }, Effect::None)
            }
            Command::Quit => {
                self.is_on = false;
                self.state = ScipState::Idle;
                plain(b"00", Effect::Stop)
            }
            Command::Reset | Command::PartialReset => {
                self.is_on = false;
                self.state = ScipState::Idle;
                plain(b"00", Effect::Reset)
            }
            Command::Reboot => {
                let is_second = self.reboot_asked_ns.is_some_and(|asked| now_ns - asked < 1_000_000_000);
                self.reboot_asked_ns = Some(now_ns);
                if is_second { plain(b"00", Effect::Reboot) } else { plain(b"01", Effect::None) }
            }
            Command::Scip2 => plain(b"0E", Effect::None),
            Command::Baud(baud) => self.baud_answer(params, line, baud),
            Command::Motor(_) | Command::Sensitivity(_) => plain(b"04", Effect::None),
            Command::Scans(request) => return self.scan_answer(params, scans, line, &request),
        })
    }

    /// One character of status, and no sum.
    fn old_answer(&mut self, line: &[u8]) -> Answer {
        let is_known = line == b"SCIP2.0";
        if is_known {
            self.state = ScipState::Idle;
        }
        let status: &[u8] = if is_known { b"\n0\n\n" } else { b"\nE\n\n" };
        Answer { bytes: [line, status].concat(), effect: Effect::None, is_refused: !is_known }
    }

    fn clock_answer(&mut self, line: &[u8], step: TimeStep, clock_ms: u32) -> Answer {
        let is_in = self.state == ScipState::Clock;
        let status = match (step, is_in, self.state) {
            (_, _, ScipState::Streaming) => b"10",
            (TimeStep::Enter, true, _) => b"02",
            (TimeStep::Leave, false, _) => b"03",
            (TimeStep::Read, false, _) => b"04",
            _ => b"00",
        };
        let mut lines = [0; 8];
        let length = match (step, status) {
            // Four characters fit.
            (TimeStep::Read, b"00") => emit_clock(clock_ms, &mut lines).unwrap_or_default(),
            _ => 0,
        };
        if status == b"00" {
            self.state = if step == TimeStep::Leave { ScipState::Idle } else { ScipState::Clock };
        }
        answer(line, status, &lines[..length], Effect::None)
    }

    fn baud_answer(&mut self, params: &ScipParams, line: &[u8], baud: u32) -> Answer {
        let (status, effect) = match params.link {
            ScipLink::Network => (b"0F", Effect::None),
            _ if !BAUDS.contains(&baud) => (b"02", Effect::None),
            ScipLink::Usb => (b"00", Effect::None),
            ScipLink::Serial(_) if baud == self.baud => (b"03", Effect::None),
            ScipLink::Serial(_) => (b"00", Effect::Baud(baud)),
        };
        answer(line, status, b"", effect)
    }

    fn scan_answer(
        &mut self,
        params: &ScipParams,
        scans: &dyn ScipScans,
        line: &[u8],
        request: &ScanRequest,
    ) -> Option<Answer> {
        if !params.has_intensity && (request.with_intensity || request.all_echoes) {
            return None;
        }
        let plain = |status: &[u8; 2], effect| Some(answer(line, status, b"", effect));
        if request.last_step > params.parameters.last_step || !scans.has(request) {
            return plain(b"04", Effect::None);
        }
        if request.last_step < request.first_step {
            return plain(b"05", Effect::None);
        }
        match request.delivery {
            Delivery::Once if !self.is_on => plain(b"10", Effect::None),
            Delivery::Once => {
                Some(Answer { bytes: Vec::new(), effect: Effect::Once(*request), is_refused: false })
            }
            Delivery::Stream { .. } => {
                self.is_on = true;
                self.state = ScipState::Streaming;
                plain(b"00", Effect::Stream(*request))
            }
        }
    }

    fn information(&self, params: &ScipParams, clock_ms: u32) -> Vec<u8> {
        let rate = format!("Initial({}[rpm])<-Default setting by user", params.parameters.rpm);
        let line = match params.link {
            ScipLink::Serial(_) => format!("{}[bps]<-Default setting by user", self.baud),
            ScipLink::Usb => "USB Full Speed".to_owned(),
            ScipLink::Network => "Ethernet 100 [Mbps]".to_owned(),
        };
        let time = format!("{clock_ms:06X}");
        key_values(&[
            ("MODL", &params.model),
            ("LASR", if self.is_on { "ON" } else { "OFF" }),
            ("SCSP", &rate),
            ("MESM", "Idle"),
            ("SBPS", &line),
            ("TIME", &time),
            ("STAT", "Sensor works well."),
        ])
    }
}

fn version(params: &ScipParams) -> Vec<u8> {
    let product = format!("SOKUIKI Sensor {}", params.model.split('(').next().unwrap_or_default());
    key_values(&[
        ("VEND", "Hokuyo Automatic Co.,Ltd."),
        ("PROD", &product),
        ("FIRM", &params.firmware),
        ("PROT", "SCIP 2.0"),
        ("SERI", &params.serial),
    ])
}

fn parameters(params: &ScipParams) -> Vec<u8> {
    let of = &params.parameters;
    let numbers = [
        of.min_mm,
        of.max_mm,
        of.steps_per_turn,
        u32::from(of.first_step),
        u32::from(of.last_step),
        u32::from(of.front_step),
        of.rpm,
    ]
    .map(|number| number.to_string());
    let keys = ["DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN"];
    let mut lines = vec![("MODL", params.model.as_str())];
    lines.extend(keys.into_iter().zip(numbers.iter().map(String::as_str)));
    key_values(&lines)
}

fn key_values(lines: &[(&str, &str)]) -> Vec<u8> {
    let lines: Vec<KeyValue<'_>> =
        lines.iter().map(|(key, value)| KeyValue { key: key.as_bytes(), value: value.as_bytes() }).collect();
    let mut out = vec![0; 1024];
    // Names are shorter.
    let length = emit_key_values(&lines, &mut out).unwrap_or_default();
    out.truncate(length);
    out
}
