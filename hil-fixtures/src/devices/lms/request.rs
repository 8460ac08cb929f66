//! What a mock laser does on each request: its reply, how long it takes, and what changes.
//!
//! Source: SICK telegram listing sections 6 and 7; latencies are medians of a real LMS 200 (18 logs of a
//! Python driver: mode change 68..81 ms, type 79, configuration 93, status 114, configuration write 128, each
//! from request to reply, transfer included). The twelve writes of those logs changed nothing.

use super::model::Model;
use super::settings::{ConfigBlock, SECOND_CONFIG_BYTES, StatusFacts, Variant, status_report};
use crate::devices::lms::scans::stream::{Content, Output};

const MS: i64 = 1_000_000;

/// Password of installation mode.
const PASSWORD: &[u8] = b"SICK_LMS";

/// Sub-command 25h: scans only on request.
pub const MODE_ON_REQUEST: u8 = 0x25;

/// How long a device thinks before it replies, counted from the request's last byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latency {
    /// Until the ACK or NAK.
    pub acknowledge_ns: i64,
    /// Mode change.
    pub mode_ns: i64,
    /// Type, errors and other short questions.
    pub type_ns: i64,
    /// Status report.
    pub status_ns: i64,
    /// Reading the configuration.
    pub config_ns: i64,
    /// Writing the configuration to the EEPROM. Only writes of what was there already have been measured;
    /// CARMEN allows 250 ms for any other, on real devices too.
    pub config_write_ns: i64,
    /// Changing the variant.
    pub variant_ns: i64,
    /// Confirming a reset.
    pub reset_ns: i64,
}

impl Default for Latency {
    fn default() -> Self {
        Self {
            acknowledge_ns: 35 * MS / 10,
            mode_ns: 65 * MS,
            type_ns: 68 * MS,
            status_ns: 70 * MS,
            config_ns: 78 * MS,
            config_write_ns: 106 * MS,
            variant_ns: 97 * MS,
            reset_ns: 10 * MS,
        }
    }
}

/// Settings that requests read and change.
#[derive(Clone, Debug)]
pub struct State {
    /// Type text of 3Ah, such as `LMS291;S05;X01.27 `.
    pub type_text: String,
    /// Own address.
    pub address: u8,
    /// Rate of the line in Bd.
    pub baud: u32,
    /// Highest rate that it changes to, in Bd.
    pub max_baud: u32,
    /// Rate at power-on in Bd.
    pub power_on_baud: u32,
    /// Whether installation mode is in force.
    pub installation: bool,
    /// What is being sent, and unasked or once.
    pub output: Output,
    /// Sub-command of 20h in force.
    pub mode: u8,
    /// Variant in force.
    pub variant: Variant,
    /// Configuration in force.
    pub config: ConfigBlock,
    /// Bytes of it that this firmware has.
    pub config_bytes: usize,
    /// The second block. What its bytes mean no source tells: they are kept.
    pub second_config: [u8; SECOND_CONFIG_BYTES],
    /// Faults: type and number.
    pub errors: Vec<(u8, u8)>,
    /// Writes to the EEPROM so far; it wears out after some thousands.
    pub eeprom_writes: u64,
}

/// What follows a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Then {
    /// Nothing.
    Nothing,
    /// Work at another rate, in Bd.
    Baud(u32),
    /// Start afresh.
    Reset,
}

/// A reply: code, data, delay, consequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Code byte.
    pub code: u8,
    /// Data without status byte.
    pub data: Vec<u8>,
    /// Delay from the request's end.
    pub after_ns: i64,
    /// What happens when it has gone out.
    pub then: Then,
}

impl Reply {
    fn new(code: u8, data: &[u8], after_ns: i64) -> Self {
        Self { code, data: data.to_vec(), after_ns, then: Then::Nothing }
    }

    fn refused(latency: &Latency) -> Self {
        Self::new(0x92, &[], latency.type_ns)
    }
}

impl State {
    /// The type.
    #[must_use]
    pub fn model(&self) -> Model {
        Model::of_text(&self.type_text)
    }

    /// How bad the worst current fault is: bits 0 to 2 of the status byte.
    #[must_use]
    pub fn severity(&self) -> u8 {
        self.errors.iter().filter(|(kind, _)| kind & 0x80 == 0).map(|(kind, _)| kind & 7).max().unwrap_or(0)
    }

    /// Carries a request out. `holds` tells which variants can be had. `None`: the answer is the scan that
    /// was asked for.
    pub fn carry_out(
        &mut self,
        body: &[u8],
        latency: &Latency,
        holds: &dyn Fn(Variant) -> bool,
    ) -> Option<Reply> {
        let Some((&code, data)) = body.split_first() else { return Some(Reply::refused(latency)) };
        let model = self.model();
        if !self.installation
            && let Some(content) = Content::of_request(code, data, model, self.variant)
        {
            self.output = Output::once(content, self.output);
            return None;
        }
        let reply = match (code, data) {
            (0x10, []) => Reply { then: Then::Reset, ..Reply::new(0x91, &[], latency.reset_ns) },
            (0x20, [sub, arguments @ ..]) => self.change_mode(*sub, arguments, latency),
            (0x31, []) => Reply::new(0xB1, &self.status(), latency.status_ns),
            (0x32, []) => {
                let pairs: Vec<u8> = self.errors.iter().flat_map(|&(kind, number)| [kind, number]).collect();
                Reply::new(0xB2, &pairs, latency.type_ns)
            }
            (0x35, data) if model.asks_hours_with(data) => {
                Reply::new(0xB5, &[0x10, 0x27, 0x2A, 0x00], latency.type_ns)
            }
            (0x3A, []) => Reply::new(0xBA, self.type_text.as_bytes(), latency.type_ns),
            (0x3B, &[a, b, c, d]) if model != Model::S14 => self.change_variant([a, b, c, d], latency, holds),
            (0x66, [choice @ 0..=2]) => self.keep_baud(*choice, latency),
            (0x74, []) => Reply::new(0xF4, self.config_block(), latency.config_ns),
            (0x77, block) if self.installation => self.write_config(block, latency),
            (0x7B, []) => Reply::new(0xFB, &self.second_config, latency.config_ns),
            (0x7C, block) if self.installation => self.write_second_config(block, latency),
            _ => Reply::refused(latency),
        };
        Some(reply)
    }

    /// Back to the state after power-on; what the EEPROM holds stays, the list of faults does not.
    pub fn power_on(&mut self) {
        self.baud = self.power_on_baud;
        self.installation = false;
        self.output = Output::OnRequest;
        self.mode = MODE_ON_REQUEST;
        self.errors.clear();
    }

    /// The configuration as this firmware sends it.
    fn config_block(&self) -> &[u8] {
        &self.config.0[..self.config_bytes.min(self.config.0.len())]
    }

    fn change_mode(&mut self, sub: u8, arguments: &[u8], latency: &Latency) -> Reply {
        let done = |result: u8| Reply::new(0xA0, &[result], latency.mode_ns);
        match (sub, arguments) {
            (0x00 | 0x10, password) => {
                if password != PASSWORD {
                    return done(1);
                }
                self.installation = sub == 0;
                self.output = Output::OnRequest;
                self.mode = sub;
                return done(0);
            }
            (0x30, password) => return done(u8::from(password != PASSWORD)),
            (0x40..=0x42 | 0x48, []) => {
                let baud = [38_400, 19_200, 9600].get(usize::from(sub & 0x0F)).copied().unwrap_or(500_000);
                if baud > self.max_baud {
                    return Reply::refused(latency);
                }
                return Reply { then: Then::Baud(baud), ..done(0) };
            }
            _ => {}
        }
        let content = Content::of_mode(sub, arguments, self.model(), self.variant);
        if content.is_none() && (sub, arguments) != (MODE_ON_REQUEST, &[]) {
            return Reply::refused(latency);
        }
        self.installation = false;
        self.output = content.map_or(Output::OnRequest, Output::Stream);
        self.mode = sub;
        done(0)
    }

    fn change_variant(&mut self, data: [u8; 4], latency: &Latency, holds: &dyn Fn(Variant) -> bool) -> Reply {
        let [a, b, c, d] = data;
        let asked = Variant::of(u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        let accepted = Variant::ALL.contains(&asked) && holds(asked);
        if accepted {
            self.variant = asked;
        }
        let [a, b] = self.variant.fov_deg.to_le_bytes();
        let [c, d] = self.variant.resolution_cdeg.to_le_bytes();
        Reply::new(0xBB, &[u8::from(accepted), a, b, c, d], latency.variant_ns)
    }

    fn keep_baud(&mut self, choice: u8, latency: &Latency) -> Reply {
        match choice {
            0 => self.power_on_baud = 9600,
            1 => self.power_on_baud = self.baud,
            _ => {}
        }
        Reply::new(0xE6, &[1], latency.mode_ns)
    }

    fn write_config(&mut self, block: &[u8], latency: &Latency) -> Reply {
        let written = self.config.written(block, self.config_bytes);
        if let Some(config) = written {
            self.config = config;
            self.eeprom_writes += 1;
        }
        let mut data = vec![u8::from(written.is_some())];
        data.extend_from_slice(self.config_block());
        Reply::new(0xF7, &data, latency.config_write_ns)
    }

    /// Shorter writes leave the rest alone, as with the first block.
    fn write_second_config(&mut self, block: &[u8], latency: &Latency) -> Reply {
        let fits = !block.is_empty() && block.len() <= SECOND_CONFIG_BYTES;
        if fits {
            self.second_config[..block.len()].copy_from_slice(block);
            self.eeprom_writes += 1;
        }
        let mut data = vec![u8::from(fits)];
        data.extend_from_slice(&self.second_config);
        Reply::new(0xFC, &data, latency.config_write_ns)
    }

    fn status(&self) -> [u8; super::settings::STATUS_BYTES] {
        let firmware = self.type_text.rsplit(';').next().unwrap_or("");
        status_report(&StatusFacts {
            firmware,
            mode: self.mode,
            faulty: self.severity() > 0,
            variant: self.variant,
            config: &self.config,
            baud: self.baud,
            baud_is_permanent: self.power_on_baud != 9600,
            address: self.address,
        })
    }
}
