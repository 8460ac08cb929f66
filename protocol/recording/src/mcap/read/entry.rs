//! One message as it stands in a file.

use super::channel_info::ChannelInfo;
use super::error::ReadError;
use crate::messages::AnyMessage;
use crate::topics::Topic;
use std::sync::Arc;

/// One message of a file.
#[derive(Clone, PartialEq, Debug)]
pub struct Entry {
    /// The topic's name.
    pub topic_name: String,
    /// The topic, when name, type and encoding are those of one of ours.
    pub topic: Option<Topic>,
    /// The type, `package/msg/Type`.
    pub type_name: String,
    /// When the message was received or made, in ns.
    pub log_time_ns: i64,
    /// The message's own time, in ns; its header's stamp where it has one.
    pub publish_time_ns: i64,
    /// Its number on its topic.
    pub sequence: u32,
    /// The message as it stands in the file, with its CDR header.
    pub bytes: Vec<u8>,
    /// What the file says of the channel.
    pub channel: Arc<ChannelInfo>,
}

impl Entry {
    /// How the message is encoded, `cdr` in ROS 2.
    #[must_use]
    pub fn encoding(&self) -> &str {
        &self.channel.message_encoding
    }

    /// The message as a struct; [`AnyMessage::Other`] for a type or encoding that Biplane does not know.
    ///
    /// # Errors
    /// [`ReadError::Message`] when the bytes are not of that type.
    pub fn decode(&self) -> Result<AnyMessage, ReadError> {
        if self.encoding() != "cdr" {
            return Ok(AnyMessage::Other);
        }
        AnyMessage::decode(&self.type_name, &self.bytes).map_err(|source| ReadError::Message {
            path: None,
            topic: self.topic_name.clone(),
            log_time_ns: self.log_time_ns,
            source,
        })
    }

    /// The same message so much later: its times in the file, and the stamps inside of a message of a type
    /// that Biplane knows. The bytes of others stay.
    #[must_use]
    pub fn later(mut self, by_ns: i64) -> Self {
        if by_ns == 0 {
            return self;
        }
        self.log_time_ns = self.log_time_ns.saturating_add(by_ns);
        self.publish_time_ns = self.publish_time_ns.saturating_add(by_ns);
        if let Ok(mut message) = self.decode() {
            message.delay(by_ns);
            self.bytes = message.encode_stamped().unwrap_or(self.bytes);
        }
        self
    }
}
