//! What a base says of each moment, and what it has to be asked for it: for captures that no client took part
//! in.
//!
//! Emitted by `biplane-wire`.

use super::counters::CountScale;
use crate::devices::telegrams;
use crate::rig::source::OdometrySample;
use biplane_recording::rig::BaseProtocol;
use biplane_wire::roboclaw::{Answer, MAX_ANSWER_BYTES, Question, Request};
use biplane_wire::{Text, WireError, rflex};

/// A question, empty for what a base says by itself, and what the base says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedPacket {
    /// Bytes of the question.
    pub asked: Vec<u8>,
    /// Bytes of the base.
    pub answer: Vec<u8>,
}

/// A base that tells its odometry.
#[derive(Clone, Debug)]
pub struct BaseEncoder {
    protocol: BaseProtocol,
    id: u8,
}

impl BaseEncoder {
    /// A base of this protocol.
    #[must_use]
    pub fn new(protocol: BaseProtocol) -> Self {
        Self { protocol, id: 0 }
    }

    /// Bytes of a question and of what the base says to it, both at most.
    #[must_use]
    pub fn exchange_bytes(&self) -> usize {
        match self.protocol {
            // Without sonar readings.
            BaseProtocol::None => 0,
            BaseProtocol::P2os { .. } => 25,
            BaseProtocol::RoboClaw { .. } => 2 + 10,
            BaseProtocol::Rflex { .. } => 2 * 34,
        }
    }

    /// The odometry of a moment.
    pub fn odometry(&mut self, sample: &OdometrySample, time_ns: i64) -> Result<EncodedPacket, WireError> {
        let [first, second] = CountScale::of(&self.protocol).map_or([0, 0], |scale| scale.counts(sample));
        match self.protocol {
            BaseProtocol::None => unasked(Ok(Vec::new())),
            BaseProtocol::P2os { .. } => unasked(telegrams::odometry(sample)),
            BaseProtocol::RoboClaw { address, .. } => {
                let answer = Answer::Encoders { m1_counts: first, m2_counts: second };
                exchange(address, Question::Encoders, &answer)
            }
            BaseProtocol::Rflex { .. } => {
                let time = time_ns.div_euclid(1000) as u32;
                let report = |axis, position| {
                    let motion = rflex::MotionReport { time, axis, position, ..Default::default() };
                    rflex::Report::Motion(motion)
                };
                let mut answer = self.rflex(&report(rflex::TRANSLATION, first))?;
                answer.extend(self.rflex(&report(rflex::ROTATION, second))?);
                unasked(Ok(answer))
            }
        }
    }

    /// What it says while a session begins.
    pub fn start_up(&mut self) -> Result<Vec<EncodedPacket>, WireError> {
        match self.protocol {
            BaseProtocol::None => Ok(Vec::new()),
            BaseProtocol::P2os { .. } => {
                telegrams::base_start_up()?.into_iter().map(|answer| unasked(Ok(answer))).collect()
            }
            BaseProtocol::RoboClaw { address, .. } => {
                let answer = Answer::Firmware(Text(b"RoboClaw 2x15a v4.1.34\n"));
                Ok(vec![exchange(address, Question::Firmware, &answer)?])
            }
            BaseProtocol::Rflex { .. } => {
                let state = rflex::SystemStatus { time: 0, centivolts: 2460, brake: 0 };
                let answer = self.rflex(&rflex::Report::Status(state))?;
                Ok(vec![EncodedPacket { asked: Vec::new(), answer }])
            }
        }
    }

    fn rflex(&mut self, report: &rflex::Report<'_>) -> Result<Vec<u8>, WireError> {
        self.id = self.id.wrapping_add(1);
        let mut bytes = vec![0; report.encoded_len()];
        report.emit(self.id, &mut bytes)?;
        Ok(bytes)
    }
}

fn unasked(answer: Result<Vec<u8>, WireError>) -> Result<EncodedPacket, WireError> {
    Ok(EncodedPacket { asked: Vec::new(), answer: answer? })
}

fn exchange(address: u8, question: Question, answer: &Answer<'_>) -> Result<EncodedPacket, WireError> {
    let request = Request { address, question };
    let mut asked = vec![0; request.encoded_len()];
    request.emit(&mut asked)?;
    let mut bytes = vec![0; MAX_ANSWER_BYTES];
    let length = answer.emit(request, &mut bytes)?;
    bytes.truncate(length);
    Ok(EncodedPacket { asked, answer: bytes })
}
