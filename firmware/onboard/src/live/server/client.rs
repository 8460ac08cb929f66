//! One viewer: what it has subscribed to, what it was sent, and when it is given up.
//!
//! Everything that a viewer has not taken yet waits in its socket's buffer, which is bounded. What does not
//! fit is left out and counted; floor map and points are sent only when the buffer is empty, so that a slow
//! viewer gets them later and none is left out.

use std::io;
use std::net::{SocketAddr, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};

use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use crate::live::server::channel::ChannelId;
use crate::live::server::protocol;
use crate::live::server::protocol::{Level, Request, Subscription};
use biplane_cli::counted;

/// Bytes that may wait for a viewer: the largest map and a second of everything else.
const WAITING_BYTES: usize = 4 << 20;
/// The largest message that a viewer may send: a subscription to every channel, ten times over.
const REQUEST_BYTES: usize = 64 << 10;
/// Requests that are read before it is somebody else's turn.
const REQUESTS_PER_TURN: usize = 16;
/// Requests a second; who has more to ask is no viewer.
const MAX_REQUESTS: u32 = 200;
/// A viewer that takes nothing for so long is given up, nanoseconds.
const STALLED_NS: i64 = 20_000_000_000;
/// A viewer is asked whether it is there so often, and is given up when nothing has come from it for so long,
/// nanoseconds.
const PING_NS: i64 = 10_000_000_000;
const SILENT_NS: i64 = 45_000_000_000;
/// A viewer is told what was left out at most so often, nanoseconds.
const REPORT_NS: i64 = 5_000_000_000;

/// Why a viewer is one no more.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Gone {
    /// It said so, or its connection ended.
    #[error("closed its connection")]
    Closed,
    /// It takes nothing.
    #[error("took nothing for {} s", STALLED_NS / 1_000_000_000)]
    Stalled,
    /// It answers nothing.
    #[error("gave no sign of life for {} s", SILENT_NS / 1_000_000_000)]
    Silent,
    /// It asks without end.
    #[error("asked more than {MAX_REQUESTS} times a second")]
    Floods,
    /// The run is over.
    #[error("watched until the end")]
    Over,
    /// What it sends is no WebSocket.
    #[error("broke the connection: {0}")]
    Broken(Box<Error>),
}

/// A viewer.
#[derive(Debug)]
pub(crate) struct Client {
    socket: WebSocket<TcpStream>,
    name: SocketAddr,
    subscriptions: Vec<(u32, ChannelId)>,
    /// Points of the sheet that it has been sent.
    pub points: usize,
    /// When it was sent points last, and the floor map; which version of the map. Nanoseconds.
    pub points_ns: i64,
    /// When it was sent the floor map last, nanoseconds.
    pub map_ns: i64,
    /// Which version of the floor map.
    pub map_version: u64,
    /// Messages that it was sent.
    pub sent: u64,
    /// Messages that were left out because it is too slow.
    pub left_out: u64,
    reported: (u64, i64),
    flushed: bool,
    flushed_ns: i64,
    received_ns: i64,
    pinged_ns: i64,
    /// Requests in the second that began then.
    requests: (u32, i64),
}

/// How sockets of viewers are set.
pub(crate) fn socket_config() -> WebSocketConfig {
    WebSocketConfig::default()
        .read_buffer_size(4 << 10)
        .write_buffer_size(64 << 10)
        .max_write_buffer_size(WAITING_BYTES)
        .max_message_size(Some(REQUEST_BYTES))
        .max_frame_size(Some(REQUEST_BYTES))
}

impl Client {
    /// A viewer that has just come in, monotonic nanoseconds.
    pub(crate) fn new(socket: WebSocket<TcpStream>, name: SocketAddr, now_ns: i64) -> Self {
        Self {
            socket,
            name,
            subscriptions: Vec::new(),
            points: 0,
            points_ns: i64::MIN,
            map_ns: i64::MIN,
            map_version: 0,
            sent: 0,
            left_out: 0,
            reported: (0, now_ns),
            flushed: true,
            flushed_ns: now_ns,
            received_ns: now_ns,
            pinged_ns: now_ns,
            requests: (0, now_ns),
        }
    }

    /// Where it comes from.
    pub(crate) fn name(&self) -> SocketAddr {
        self.name
    }

    /// Whether it has taken all that it was sent.
    pub(crate) fn is_flushed(&self) -> bool {
        self.flushed
    }

    /// Whether it wants messages of a channel.
    pub(crate) fn wants(&self, channel: ChannelId) -> bool {
        self.subscriptions.iter().any(|(_, other)| *other == channel)
    }

    /// Says something in the protocol's words.
    pub(crate) fn say(&mut self, text: String) -> Result<(), Gone> {
        self.put(Message::Text(text.into())).map(|_| ())
    }

    /// Tells the server's time, log time in nanoseconds.
    pub(crate) fn send_time(&mut self, log_time_ns: i64) -> Result<(), Gone> {
        self.put(Message::Binary(protocol::time(log_time_ns).into())).map(|_| ())
    }

    /// Sends a message of a channel, if it wants it; whether it went.
    pub(crate) fn send(
        &mut self,
        channel: ChannelId,
        log_time_ns: i64,
        payload: &[u8],
    ) -> Result<bool, Gone> {
        let Some((id, _)) = self.subscriptions.iter().find(|(_, other)| *other == channel) else {
            return Ok(false);
        };
        let frame = protocol::message_data(*id, log_time_ns, payload);
        let went = self.put(Message::Binary(frame.into()))?;
        self.sent += u64::from(went);
        self.left_out += u64::from(!went);
        Ok(went)
    }

    /// Reads what it asks for. Returns the channels that it has newly subscribed to.
    pub(crate) fn hear(&mut self, now_ns: i64) -> Result<Vec<ChannelId>, Gone> {
        let mut new = Vec::new();
        if now_ns.saturating_sub(self.requests.1) >= 1_000_000_000 {
            self.requests = (0, now_ns);
        }
        for _ in 0..REQUESTS_PER_TURN {
            let message = match self.socket.read() {
                Ok(message) => message,
                Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => return Err(gone(error)),
            };
            self.received_ns = now_ns;
            self.requests.0 += 1;
            if self.requests.0 > MAX_REQUESTS {
                self.close(CloseCode::Policy, Gone::Floods.to_string());
                return Err(Gone::Floods);
            }
            if let Message::Text(text) = message {
                self.answer(text.as_str(), &mut new)?;
            }
        }
        Ok(new)
    }

    fn answer(&mut self, text: &str, new: &mut Vec<ChannelId>) -> Result<(), Gone> {
        match protocol::request(text) {
            Ok(Request::Subscribe { subscriptions }) => {
                for wish in subscriptions {
                    match self.subscribe(wish) {
                        Ok(channel) => new.push(channel),
                        Err(why) => self.say(protocol::status(Level::Error, &why))?,
                    }
                }
            }
            Ok(Request::Unsubscribe { subscription_ids }) => {
                self.subscriptions.retain(|(id, _)| !subscription_ids.contains(id));
            }
            Ok(Request::Other) => {
                self.say(protocol::status(Level::Info, "this server can be looked at, and nothing else"))?;
            }
            Err(error) => self.say(protocol::status(Level::Error, &format!("not understood: {error}")))?,
        }
        Ok(())
    }

    fn subscribe(&mut self, Subscription { id, channel_id }: Subscription) -> Result<ChannelId, String> {
        let channel = ChannelId(channel_id);
        if !channel.exists() {
            return Err(format!("there is no channel {channel_id}"));
        }
        // One a channel, so there are never more than channels.
        if self.subscriptions.iter().any(|&(other, at)| other == id || at == channel) {
            return Err(format!("subscription {id} to channel {channel_id} is there already"));
        }
        self.subscriptions.push((id, channel));
        match channel {
            super::channel::MAP => (self.map_version, self.map_ns) = (0, i64::MIN),
            super::channel::POINTS => (self.points, self.points_ns) = (0, i64::MIN),
            _ => {}
        }
        Ok(channel)
    }

    /// Sends on what waits, asks whether it is still there, tells what was left out. It is given up when it
    /// takes or says nothing.
    pub(crate) fn serve(&mut self, now_ns: i64) -> Result<(), Gone> {
        if self.left_out > self.reported.0 && now_ns.saturating_sub(self.reported.1) >= REPORT_NS {
            let words =
                format!("{} left out: this connection is too slow", counted(self.left_out, "message"));
            self.reported = (self.left_out, now_ns);
            self.say(protocol::status(Level::Warning, &words))?;
        }
        if now_ns.saturating_sub(self.pinged_ns) >= PING_NS {
            self.pinged_ns = now_ns;
            self.put(Message::Ping(tungstenite::Bytes::new()))?;
        }
        match self.socket.flush() {
            Ok(()) => (self.flushed, self.flushed_ns) = (true, now_ns),
            Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => self.flushed = false,
            Err(error) => return Err(gone(error)),
        }
        if now_ns.saturating_sub(self.flushed_ns) >= STALLED_NS {
            return Err(Gone::Stalled);
        }
        if now_ns.saturating_sub(self.received_ns) >= SILENT_NS {
            return Err(Gone::Silent);
        }
        Ok(())
    }

    /// Says good-bye, as far as that goes without waiting.
    pub(crate) fn close(&mut self, code: CloseCode, reason: String) {
        let _ = self.socket.close(Some(CloseFrame { code, reason: reason.into() }));
    }

    /// Adds a message to what waits; whether there was room.
    fn put(&mut self, message: Message) -> Result<bool, Gone> {
        match self.socket.write(message) {
            Ok(()) => Ok(true),
            // It waits in the buffer.
            Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => {
                self.flushed = false;
                Ok(true)
            }
            Err(Error::WriteBufferFull(_)) => Ok(false),
            Err(error) => Err(gone(error)),
        }
    }
}

impl AsFd for Client {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.get_ref().as_fd()
    }
}

fn gone(error: Error) -> Gone {
    match error {
        Error::ConnectionClosed | Error::AlreadyClosed => Gone::Closed,
        Error::Protocol(
            tungstenite::error::ProtocolError::ResetWithoutClosingHandshake
            | tungstenite::error::ProtocolError::SendAfterClosing,
        ) => Gone::Closed,
        Error::Io(error)
            if matches!(error.kind(), io::ErrorKind::ConnectionReset | io::ErrorKind::BrokenPipe) =>
        {
            Gone::Closed
        }
        other => Gone::Broken(Box::new(other)),
    }
}
