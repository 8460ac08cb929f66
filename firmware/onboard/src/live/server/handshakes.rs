//! Connections that are no viewers yet: their handshake is under way, and they get a few seconds and a few
//! places for it.

use std::io::{self, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;

use tungstenite::error::ProtocolError;
use tungstenite::handshake::MidHandshake;
use tungstenite::handshake::server::{Callback, ErrorResponse, Request, Response, ServerHandshake};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::{Error, HandshakeError, WebSocket};

use crate::live::server::admission::{Admission, Refusal};
use crate::live::server::client::socket_config;
use crate::live::server::protocol::SUBPROTOCOLS;

/// Handshakes at once; who comes when all are taken waits outside.
const MAXIMUM: usize = 16;
/// A handshake may take so long, nanoseconds; and only so long while somebody waits outside.
const PATIENCE_NS: i64 = 5_000_000_000;
const HURRY_NS: i64 = 500_000_000;
/// Bytes that the system may hold for a viewer: what it has not taken shall wait where it is counted.
const SEND_BUFFER_BYTES: usize = 256 << 10;
const SUBPROTOCOL_HEADER: &str = "sec-websocket-protocol";

type Handshake = ServerHandshake<TcpStream, Choose>;

/// A handshake under way.
struct Coming {
    handshake: Option<MidHandshake<Handshake>>,
    /// The connection once more, for an answer in words: a handshake that fails takes its own with it.
    answer: Option<TcpStream>,
    name: SocketAddr,
    since_ns: i64,
}

impl Coming {
    /// Tells a browser, or whatever else asks for a page, what there is and what opens it. An answer that
    /// does not fit into an empty send buffer is not waited for.
    fn answer_in_words(&mut self) {
        let Some(stream) = &mut self.answer else { return };
        let address = stream.local_addr().map_or_else(|_| "HOST:PORT".to_owned(), |here| here.to_string());
        let words = format!(
            "This is a live view of biplane-onboard, and no web page.\n\
             Open Foxglove or Lichtblick, choose \"Open connection\", \"Foxglove WebSocket\",\n\
             and give the address ws://{address}\n"
        );
        let _ = write!(
            stream,
            "HTTP/1.1 426 Upgrade Required\r\nUpgrade: websocket\r\nConnection: close, Upgrade\r\n\
             Content-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\n\r\n{words}",
            words.len()
        );
    }
}

/// Whether a whole request came that does not ask for a WebSocket.
fn is_plain_http(error: &Error) -> bool {
    matches!(
        error,
        Error::Protocol(
            ProtocolError::WrongHttpMethod
                | ProtocolError::WrongHttpVersion
                | ProtocolError::MissingConnectionUpgradeHeader
                | ProtocolError::MissingUpgradeWebSocketHeader
                | ProtocolError::MissingSecWebSocketVersionHeader
                | ProtocolError::MissingSecWebSocketKey
        )
    )
}

/// All of them.
pub(crate) struct Handshakes {
    admission: Arc<Admission>,
    coming: Vec<Coming>,
    /// How many were turned away.
    pub refused: u64,
}

/// A viewer that has come in.
pub(crate) type Arrived = (WebSocket<TcpStream>, SocketAddr);

impl Handshakes {
    /// None yet; `admission` says who is let in.
    pub(crate) fn new(admission: Admission) -> Self {
        Self { admission: Arc::new(admission), coming: Vec::new(), refused: 0 }
    }

    /// Takes in who stands at the door, and goes on with all handshakes, at this time in monotonic
    /// nanoseconds. Returns who has come in, and whether the door is in order.
    pub(crate) fn admit(&mut self, listener: &TcpListener, now_ns: i64) -> (Vec<Arrived>, bool) {
        let in_order = self.accept(listener, now_ns);
        let mut arrived = Vec::new();
        let refused = &mut self.refused;
        self.coming.retain_mut(|coming| {
            let Some(handshake) = coming.handshake.take() else { return false };
            match handshake.handshake() {
                Ok(socket) => arrived.push((socket, coming.name)),
                Err(HandshakeError::Interrupted(handshake))
                    if now_ns.saturating_sub(coming.since_ns) < PATIENCE_NS =>
                {
                    coming.handshake = Some(handshake);
                    return true;
                }
                Err(HandshakeError::Interrupted(_)) => {
                    *refused += 1;
                    tracing::debug!("live view: {} connected and said nothing", coming.name);
                }
                Err(HandshakeError::Failure(error)) => {
                    *refused += 1;
                    if is_plain_http(&error) {
                        coming.answer_in_words();
                    }
                    tracing::debug!("live view: {} was turned away: {error}", coming.name);
                }
            }
            false
        });
        (arrived, in_order)
    }

    /// Whether nobody more is taken in for now.
    pub(crate) fn is_full(&self) -> bool {
        self.coming.len() >= MAXIMUM
    }

    /// What is waited for.
    pub(crate) fn fds(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.coming.iter().filter_map(|coming| Some(coming.handshake.as_ref()?.get_ref().get_ref().as_fd()))
    }

    fn accept(&mut self, listener: &TcpListener, now_ns: i64) -> bool {
        if self.is_full() && self.coming.first().is_some_and(|first| now_ns - first.since_ns >= HURRY_NS) {
            self.refused += 1;
            self.coming.remove(0);
        }
        while !self.is_full() {
            match listener.accept() {
                Ok((stream, name)) => {
                    if prepare(&stream).is_err() {
                        self.refused += 1;
                        continue;
                    }
                    let answer = stream.try_clone().ok();
                    let choose = Choose { admission: Arc::clone(&self.admission), name };
                    let handshake = ServerHandshake::start(stream, choose, Some(socket_config()));
                    self.coming.push(Coming { handshake: Some(handshake), answer, name, since_ns: now_ns });
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return true,
                // It went away again before its turn.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                Err(_) => return false,
            }
        }
        true
    }
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    Ok(rustix::net::sockopt::set_socket_send_buffer_size(stream, SEND_BUFFER_BYTES)?)
}

/// Lets in or turns away, and chooses the protocol: the first of ours that the client offers.
#[derive(Clone, Debug)]
struct Choose {
    admission: Arc<Admission>,
    name: SocketAddr,
}

impl Callback for Choose {
    fn on_request(self, request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
        if let Err(Refusal { status, words }) = self.admission.check(request.headers()) {
            tracing::warn!("live view: {} was turned away: {words}", self.name);
            return Err(refusal(status, format!("This is a live view of biplane-onboard: {words}.\n")));
        }
        let headers = request.headers().get_all(SUBPROTOCOL_HEADER);
        let offered: Vec<&str> = headers
            .iter()
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(',').map(str::trim))
            .collect();
        match SUBPROTOCOLS.into_iter().find(|ours| offered.contains(ours)) {
            Some(ours) => {
                response.headers_mut().insert(SUBPROTOCOL_HEADER, HeaderValue::from_static(ours));
                Ok(response)
            }
            None => {
                let words = format!(
                    "This is a live view of biplane-onboard. It speaks the WebSocket subprotocols {}: open it with Foxglove or Lichtblick.\n",
                    SUBPROTOCOLS.join(" and ")
                );
                Err(refusal(StatusCode::BAD_REQUEST, words))
            }
        }
    }
}

fn refusal(status: StatusCode, words: String) -> ErrorResponse {
    let mut refusal = ErrorResponse::new(Some(words));
    *refusal.status_mut() = status;
    refusal
}
