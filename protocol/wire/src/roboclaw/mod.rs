//! RoboClaw motor controllers in packet serial mode: the base of home-made robots.
//!
//! A host asks `address | command` (commands that write carry data and a CRC), and the controller answers
//! with bare data and a CRC-16 over address, command and data. An answer has no header, no length and no
//! address: it can only be read as the answer to the question that was asked. So there is no deframer here; a
//! [`Collector`] takes as many bytes as the open [`Question`] has, and drops everything else. All fields are
//! big-endian. Only questions are known: nothing here can turn a motor. Source: Basicmicro RoboClaw user
//! manual, "packet serial".

mod answer;
mod checksum;
mod collector;
mod question;
mod status;

pub use answer::{Answer, EncoderFlags};
pub use checksum::checksum;
pub use collector::{Collected, Collector};
pub use question::{
    FIRST_ADDRESS, LAST_ADDRESS, MAX_ANSWER_BYTES, MAX_REQUEST_BYTES, Motor, Question, Request,
};
pub use status::{StatusBits, StatusWidth};
