//! Frames of the Foxglove WebSocket protocol, version 1 (github.com/foxglove/ws-protocol, its specification):
//! JSON texts, and binary messages with little-endian numbers. What a read-only server needs of it.

use serde::{Deserialize, Serialize};

use crate::live::server::channel::Channel;

/// Names under which clients ask for this protocol, the newer first: Foxglove's; Lichtblick's and that of
/// older clients. The frames here are the same in both.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Opcode of a message.
const MESSAGE_DATA: u8 = 1;
/// Opcode of the server's time.
const TIME: u8 = 2;

/// How serious a [`status`] is.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Level {
    /// To be known.
    Info = 0,
    /// Something is left out.
    Warning = 1,
    /// Something was asked that cannot be done.
    Error = 2,
}

/// What a client asks for.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
pub enum Request {
    /// Messages of these channels.
    Subscribe {
        /// Which.
        subscriptions: Vec<Subscription>,
    },
    /// No more messages of these subscriptions.
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        /// Which.
        subscription_ids: Vec<u32>,
    },
    /// Anything else.
    #[serde(other)]
    Other,
}

/// Messages of a channel, under a number that the client chose.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    /// The client's number.
    pub id: u32,
    /// The channel's.
    pub channel_id: u32,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Advertised<'a> {
    id: u32,
    topic: &'a str,
    encoding: &'a str,
    schema_name: &'a str,
    schema: &'a str,
    schema_encoding: &'a str,
}

/// What the server is; the first text on a connection. The time of messages is the server's own. `session`
/// tells one run from another.
pub(crate) fn server_info(session: &str) -> String {
    serde_json::json!({
        "op": "serverInfo",
        "name": concat!("biplane-onboard ", env!("CARGO_PKG_VERSION")),
        "capabilities": ["time"],
        "supportedEncodings": [],
        "metadata": {},
        "sessionId": session,
    })
    .to_string()
}

/// What can be subscribed to.
pub(crate) fn advertise(channels: &[Channel]) -> String {
    let channels: Vec<_> = channels
        .iter()
        .map(|channel| Advertised {
            id: channel.id.0,
            topic: channel.topic,
            encoding: "cdr",
            schema_name: channel.type_name,
            schema: &channel.schema,
            schema_encoding: "ros2msg",
        })
        .collect();
    serde_json::json!({ "op": "advertise", "channels": channels }).to_string()
}

/// Words for whoever looks at the client.
pub(crate) fn status(level: Level, words: &str) -> String {
    serde_json::json!({ "op": "status", "level": level as u8, "message": words }).to_string()
}

/// A message of a subscription.
pub(crate) fn message_data(subscription: u32, log_time_ns: i64, payload: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(1 + 4 + 8 + payload.len());
    frame.push(MESSAGE_DATA);
    frame.extend_from_slice(&subscription.to_le_bytes());
    frame.extend_from_slice(&u64::try_from(log_time_ns).unwrap_or(0).to_le_bytes());
    frame.extend_from_slice(payload);
    frame
}

/// The server's time.
pub(crate) fn time(now_ns: i64) -> Vec<u8> {
    let mut frame = vec![TIME];
    frame.extend_from_slice(&u64::try_from(now_ns).unwrap_or(0).to_le_bytes());
    frame
}

/// Reads what a client asks for.
pub fn request(text: &str) -> Result<Request, serde_json::Error> {
    serde_json::from_str(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::server::channel::{ChannelId, channels};

    #[test]
    fn binary_frames_are_those_of_the_specification() {
        // Opcode 1, subscription 0x0302, 1 s + 1 ns = 0x3b9aca01, payload.
        let expected = [1, 2, 3, 0, 0, 0x01, 0xca, 0x9a, 0x3b, 0, 0, 0, 0, 0xaa, 0xbb];
        assert_eq!(message_data(0x0302, 1_000_000_001, &[0xaa, 0xbb]), expected);
        assert_eq!(time(1_000_000_001), [2, 0x01, 0xca, 0x9a, 0x3b, 0, 0, 0, 0]);
        assert_eq!(time(-1), [2, 0, 0, 0, 0, 0, 0, 0, 0], "before 1970 there is no time");
    }

    #[test]
    fn texts_are_those_of_the_specification() {
        let channel = Channel {
            id: ChannelId(3),
            topic: "/odom",
            type_name: "nav_msgs/msg/Odometry",
            schema: "float64 x\n".to_owned(),
        };
        let parse = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        let expected = r#"{"op":"advertise","channels":[{"id":3,"topic":"/odom","encoding":"cdr","schemaName":"nav_msgs/msg/Odometry","schema":"float64 x\n","schemaEncoding":"ros2msg"}]}"#;
        assert_eq!(parse(&advertise(&[channel])), parse(expected));
        assert_eq!(
            parse(&status(Level::Warning, "say \"no\"")),
            parse(r#"{"op":"status","level":1,"message":"say \"no\""}"#)
        );
        let info = parse(&server_info("17"));
        assert_eq!((&info["op"], &info["sessionId"]), (&"serverInfo".into(), &"17".into()));
        assert_eq!(info["capabilities"], serde_json::json!(["time"]));
    }

    #[test]
    fn requests_are_read_as_clients_write_them_and_others_are_known_as_others() {
        let subscribe =
            r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]}"#;
        let subscriptions =
            vec![Subscription { id: 0, channel_id: 3 }, Subscription { id: 1, channel_id: 5 }];
        assert_eq!(request(subscribe).unwrap(), Request::Subscribe { subscriptions });
        let unsubscribe = r#"{"op":"unsubscribe","subscriptionIds":[0,1]}"#;
        assert_eq!(request(unsubscribe).unwrap(), Request::Unsubscribe { subscription_ids: vec![0, 1] });
        assert_eq!(request(r#"{"op":"getParameters","parameterNames":[]}"#).unwrap(), Request::Other);
        for garbage in [
            "",
            "{}",
            "[]",
            "null",
            r#"{"op":"subscribe"}"#,
            r#"{"op":"subscribe","subscriptions":[{"id":-1}]}"#,
        ] {
            assert!(request(garbage).is_err(), "{garbage}");
        }
        // Nested without end: refused before the stack is.
        assert!(request(&"[".repeat(60_000)).is_err());
    }

    #[test]
    fn all_channels_fit_into_what_a_client_buffers() {
        assert!(advertise(&channels()).len() < 32 << 10);
    }
}
