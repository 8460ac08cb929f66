//! What a file says of a channel.

use crate::topics::Topic;
use std::collections::BTreeMap;

/// What a file says of a channel, besides topic and type.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ChannelInfo {
    /// The topic's name.
    pub topic_name: String,
    /// The type's name; empty when the channel has no schema.
    pub type_name: String,
    /// Encoding of the schema, `ros2msg` in ours.
    pub schema_encoding: String,
    /// The schema's text.
    pub schema: Vec<u8>,
    /// Encoding of the messages, `cdr` in ours.
    pub message_encoding: String,
    /// Further words, for example `offered_qos_profiles`.
    pub metadata: BTreeMap<String, String>,
    /// The topic, when name, type and encoding are those of one of ours.
    pub topic: Option<Topic>,
}
