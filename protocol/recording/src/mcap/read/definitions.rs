//! Which channels and schemas a file has defined so far, and messages made complete with them.

use super::channel_info::ChannelInfo;
use super::entry::Entry;
use crate::mcap::records;
use crate::mcap::records::{CHANNEL, MESSAGE, SCHEMA};
use crate::topics::Topic;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is wrong with a record.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("a {0} record that cannot be read")]
    Unreadable(&'static str),
    #[error("a message of channel {0}, which is not defined")]
    UnknownChannel(u16),
    #[error("channel {topic:?} of schema {schema}, which is not defined")]
    UnknownSchema { topic: String, schema: u16 },
}

struct Schema {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

#[derive(Default)]
pub(crate) struct Definitions {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Arc<ChannelInfo>>,
}

impl Definitions {
    /// Takes a record of a data section or chunk: a definition is kept, a message given back complete.
    pub(crate) fn take(&mut self, opcode: u8, body: &[u8]) -> Result<Option<Entry>, Problem> {
        match opcode {
            SCHEMA => self.schema(body).map(|()| None),
            CHANNEL => self.channel(body).map(|()| None),
            MESSAGE => self.message(body).map(Some),
            _ => Ok(None),
        }
    }

    fn schema(&mut self, body: &[u8]) -> Result<(), Problem> {
        let schema = records::Schema::parse(body).ok_or(Problem::Unreadable("schema"))?;
        let own =
            Schema { name: schema.name.into(), encoding: schema.encoding.into(), data: schema.data.into() };
        self.schemas.insert(schema.id, own);
        Ok(())
    }

    fn channel(&mut self, body: &[u8]) -> Result<(), Problem> {
        let channel = records::Channel::parse(body).ok_or(Problem::Unreadable("channel"))?;
        let (type_name, schema_encoding, schema) = match self.schemas.get(&channel.schema_id) {
            Some(schema) => (schema.name.clone(), schema.encoding.clone(), schema.data.clone()),
            None if channel.schema_id == 0 => Default::default(),
            None => {
                return Err(Problem::UnknownSchema {
                    topic: channel.topic.into(),
                    schema: channel.schema_id,
                });
            }
        };
        let ours = |topic: &Topic| topic.type_name() == type_name && channel.message_encoding == "cdr";
        let info = ChannelInfo {
            topic: Topic::from_name(channel.topic).filter(ours),
            topic_name: channel.topic.into(),
            type_name,
            schema_encoding,
            schema,
            message_encoding: channel.message_encoding.into(),
            metadata: channel.metadata,
        };
        self.channels.insert(channel.id, Arc::new(info));
        Ok(())
    }

    fn message(&self, body: &[u8]) -> Result<Entry, Problem> {
        let message = records::Message::parse(body).ok_or(Problem::Unreadable("message"))?;
        let id = message.channel_id;
        let channel = self.channels.get(&id).ok_or(Problem::UnknownChannel(id))?;
        let time_ns = |time: u64| i64::try_from(time).unwrap_or(i64::MAX);
        Ok(Entry {
            topic_name: channel.topic_name.clone(),
            topic: channel.topic,
            type_name: channel.type_name.clone(),
            log_time_ns: time_ns(message.log_time),
            publish_time_ns: time_ns(message.publish_time),
            sequence: message.sequence,
            bytes: message.data.to_vec(),
            channel: Arc::clone(channel),
        })
    }
}
