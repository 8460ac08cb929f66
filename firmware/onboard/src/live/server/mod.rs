//! The live thread: messages in from the tap, viewers in by the door, frames out to them. One thread, no
//! lock, nothing that blocks.

use std::net::TcpListener;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use biplane_recording::messages::shown;
use biplane_recording::topics::FRAME_MAP;
use biplane_recording::{Rig, Topic};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tungstenite::protocol::frame::coding::CloseCode;

use crate::live::scene::Scene;
use crate::live::server::admission::Admission;
use crate::live::server::channel::{Channel, ChannelId, MAP, POINTS, channels};
use crate::live::server::client::{Client, Gone};
use crate::live::server::handshakes::{Arrived, Handshakes};
use crate::output::message_ring::{MessagesOut, message_ring};
use crate::output::tap::Tap;
use crate::types::error::OnboardError;
use crate::types::live_address::LiveAddress;
use crate::types::live_report::LiveReport;
use crate::types::web_origin::WebOrigin;
use biplane_cli::counted;

/// Bytes of messages that may wait for the live thread: some 20 s of both lasers at full rate.
const RING_BYTES: usize = 4 << 20;
/// Messages that are taken before viewers are served.
const MESSAGES_PER_TURN: usize = 500;
/// Viewers at once. Each may hold a few megabytes.
const MAX_VIEWERS: usize = 8;
/// The thread looks for messages so often while there are viewers, and while there are none, nanoseconds.
const LOOK_NS: i64 = 10_000_000;
const LOOK_ALONE_NS: i64 = 50_000_000;
/// The time is told at most so often, nanoseconds of log time.
const TIME_NS: i64 = 50_000_000;
/// A viewer gets the floor map at most so often, nanoseconds; a map of twice as many cells than these half as
/// often.
const MAP_NS: i64 = 2_000_000_000;
const MAP_CELLS: usize = 1 << 18;
/// A viewer gets points at most so often, nanoseconds, unless so many wait for it; and so many at once.
const POINTS_NS: i64 = 500_000_000;
const POINTS_PER_MESSAGE: usize = 20_000;
/// At the end viewers get so long to take what is left, nanoseconds.
const CLOSING_NS: i64 = 1_000_000_000;
/// How nice the thread is to all others: the nicest.
const NICE: i32 = 19;

/// The address, taken: nobody else can have it, and nobody is served yet.
#[derive(Debug)]
pub(crate) struct Listener {
    listener: TcpListener,
    address: LiveAddress,
    allowed_origins: Vec<WebOrigin>,
}

/// The live thread, seen from the run.
#[derive(Debug)]
pub(crate) struct LiveView {
    thread: JoinHandle<LiveReport>,
}

impl Listener {
    /// Takes an address. Web pages from `allowed_origins` are let in, beside those of the viewer's own
    /// machine.
    ///
    /// # Errors
    /// [`OnboardError::LiveView`] when somebody else has it, or this machine has not.
    pub(crate) fn open(address: LiveAddress, allowed_origins: &[WebOrigin]) -> Result<Self, OnboardError> {
        let refused = |source| OnboardError::LiveView { address, source };
        let listener = TcpListener::bind(address.socket()).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Self { listener, address, allowed_origins: allowed_origins.to_vec() })
    }

    /// Starts to serve what goes in at the tap, of a robot with this rig.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(crate) fn start(self, rig: &Rig) -> Result<(Tap, LiveView), OnboardError> {
        let Self { listener, address, allowed_origins } = self;
        let (messages_in, source) = message_ring(RING_BYTES);
        let missed = Arc::new(AtomicU64::new(0));
        let tap = Tap::new(messages_in, Arc::clone(&missed));
        tracing::info!("live view at ws://{address} (Foxglove, Lichtblick)");
        if !address.is_private() {
            tracing::warn!(
                "whoever reaches {address} can watch this run, without a password (nobody can change anything): see docs/live.md"
            );
        }
        let admission = Admission { allowed_origins, is_private: address.is_private() };
        let server = Server::new(listener, Handshakes::new(admission), Stream { source, missed }, rig);
        let thread = thread::Builder::new()
            .name("live".to_owned())
            .spawn(move || server.run())
            .map_err(|source| OnboardError::System { what: "start the live thread", source })?;
        Ok((tap, LiveView { thread }))
    }
}

impl LiveView {
    /// Waits until viewers were told that the run is over; the tap must have gone before. Says what was done.
    #[must_use]
    pub(crate) fn finish(self) -> LiveReport {
        self.thread.join().unwrap_or_else(|_| {
            tracing::error!("the live view failed; the recording is whole");
            LiveReport::default()
        })
    }
}

/// A topic whose last message holds until the next, and that message with its log time.
struct Lasting {
    topic: Topic,
    last: Option<(i64, Vec<u8>)>,
}

/// What comes in at the tap, and how much found no room there.
struct Stream {
    source: MessagesOut,
    missed: Arc<AtomicU64>,
}

struct Server {
    listener: TcpListener,
    source: MessagesOut,
    missed: Arc<AtomicU64>,
    channels: Vec<Channel>,
    scene: Scene,
    handshakes: Handshakes,
    clients: Vec<Client>,
    /// What who comes late is told at once.
    lasting: [Lasting; 2],
    /// The floor map as it was last sent to anybody.
    map: (u64, Vec<u8>),
    cdr: Vec<u8>,
    session: String,
    log_time_ns: i64,
    sent_time_ns: i64,
    report: LiveReport,
}

impl Server {
    fn new(listener: TcpListener, handshakes: Handshakes, stream: Stream, rig: &Rig) -> Self {
        let Stream { source, missed } = stream;
        Self {
            listener,
            source,
            missed,
            channels: channels(),
            scene: Scene::new(rig),
            handshakes,
            clients: Vec::new(),
            lasting: [Topic::TfStatic, Topic::Diagnostics].map(|topic| Lasting { topic, last: None }),
            map: (0, Vec::new()),
            cdr: Vec::new(),
            session: biplane_clock::utc_ns().to_string(),
            log_time_ns: 0,
            sent_time_ns: 0,
            report: LiveReport::default(),
        }
    }

    fn run(mut self) -> LiveReport {
        // Without the right to it, it is as nice as the others.
        let _ = rustix::process::setpriority_process(None, NICE);
        loop {
            // Asked before the ring is emptied: what was added before the tap went is then still sent.
            let is_over = self.source.is_over();
            let now_ns = biplane_clock::monotonic_ns();
            let is_busy = self.take_messages();
            let (arrived, in_order) = self.handshakes.admit(&self.listener, now_ns);
            arrived.into_iter().for_each(|arrived| self.welcome(arrived, now_ns));
            self.each(|server, client| server.serve(client, now_ns));
            if is_over {
                return self.close();
            }
            if !is_busy {
                self.wait(in_order);
            }
        }
    }

    /// Takes messages from the ring to whoever wants them; whether there are more.
    fn take_messages(&mut self) -> bool {
        let mut cdr = std::mem::take(&mut self.cdr);
        let mut taken = 0;
        while taken < MESSAGES_PER_TURN
            && let Some(head) = self.source.pop(&mut cdr)
        {
            taken += 1;
            self.log_time_ns = self.log_time_ns.max(head.log_time_ns);
            self.scene.take(&head, &cdr);
            if let Some(lasting) = self.lasting.iter_mut().find(|lasting| lasting.topic == head.topic) {
                lasting.last = Some((head.log_time_ns, cdr.clone()));
            }
            let Some(channel) = ChannelId::of(head.topic) else { continue };
            self.each(|_, client| client.send(channel, head.log_time_ns, &cdr).map(|_| ()));
        }
        self.cdr = cdr;
        if self.scene.point_accumulator.is_full() {
            self.scene.point_accumulator.thin(self.clients.iter_mut().map(|client| &mut client.points));
        }
        if self.log_time_ns.saturating_sub(self.sent_time_ns) >= TIME_NS {
            self.sent_time_ns = self.log_time_ns;
            let log_time_ns = self.log_time_ns;
            self.each(|_, client| client.send_time(log_time_ns));
        }
        taken == MESSAGES_PER_TURN
    }

    /// Does something for every viewer; those that are gone go.
    fn each(&mut self, mut action: impl FnMut(&mut Self, &mut Client) -> Result<(), Gone>) {
        let mut clients = std::mem::take(&mut self.clients);
        clients.retain_mut(|client| match action(self, client) {
            Ok(()) => true,
            Err(why) => {
                self.let_go(client, &why);
                false
            }
        });
        self.clients = clients;
    }

    fn welcome(&mut self, (socket, name): Arrived, now_ns: i64) {
        let mut client = Client::new(socket, name, now_ns);
        if self.clients.len() >= MAX_VIEWERS {
            self.handshakes.refused += 1;
            tracing::debug!("live view: {name} was turned away: {MAX_VIEWERS} viewers are there already");
            let reason = format!("{MAX_VIEWERS} viewers are there already: close one of them");
            client.close(CloseCode::Again, reason);
            return;
        }
        let mut texts =
            [protocol::server_info(&self.session), protocol::advertise(&self.channels)].into_iter();
        let info = texts.next().unwrap_or_default();
        let reported = client
            .say(info)
            .and_then(|()| client.send_time(self.log_time_ns))
            .and_then(|()| texts.try_for_each(|text| client.say(text)));
        match reported {
            Ok(()) => {
                self.report.viewers += 1;
                tracing::info!("live view: {name} watches");
                self.clients.push(client);
            }
            Err(why) => tracing::debug!("live view: {name} {why}"),
        }
    }

    /// Answers a viewer and sends it what is due.
    fn serve(&mut self, client: &mut Client, now_ns: i64) -> Result<(), Gone> {
        for channel in client.hear(now_ns)? {
            let lasting = self.lasting.iter().find(|lasting| ChannelId::of(lasting.topic) == Some(channel));
            if let Some((log_time_ns, cdr)) = lasting.and_then(|lasting| lasting.last.as_ref()) {
                client.send(channel, *log_time_ns, cdr)?;
            }
        }
        client.serve(now_ns)?;
        if client.is_flushed() && client.wants(MAP) {
            self.send_map(client, now_ns)?;
        }
        if client.is_flushed() && client.wants(POINTS) {
            self.send_points(client, now_ns)?;
        }
        Ok(())
    }

    fn send_map(&mut self, client: &mut Client, now_ns: i64) -> Result<(), Gone> {
        let grid = &self.scene.grid;
        let pause_ns = MAP_NS * (1 + (grid.cells() / MAP_CELLS) as i64);
        if client.map_version == grid.version() || now_ns.saturating_sub(client.map_ns) < pause_ns {
            return Ok(());
        }
        if self.map.0 != grid.version() {
            self.map = (grid.version(), shown::floor_map(self.log_time_ns, FRAME_MAP, &grid.message()));
        }
        client.send(MAP, self.log_time_ns, &self.map.1)?;
        (client.map_version, client.map_ns) = (grid.version(), now_ns);
        Ok(())
    }

    fn send_points(&mut self, client: &mut Client, now_ns: i64) -> Result<(), Gone> {
        let points_m = self.scene.point_accumulator.from(client.points, POINTS_PER_MESSAGE);
        let is_due =
            now_ns.saturating_sub(client.points_ns) >= POINTS_NS || points_m.len() == POINTS_PER_MESSAGE;
        if points_m.is_empty() || !is_due {
            return Ok(());
        }
        client.send(POINTS, self.log_time_ns, &shown::points(self.log_time_ns, FRAME_MAP, points_m))?;
        (client.points, client.points_ns) = (client.points + points_m.len(), now_ns);
        Ok(())
    }

    fn let_go(&mut self, client: &Client, why: &Gone) {
        self.report.sent += client.sent;
        self.report.left_out += client.left_out;
        let (name, sent, left_out) = (client.name(), client.sent, client.left_out);
        tracing::info!("live view: {name} {why}; {} sent, {left_out} left out", counted(sent, "message"));
    }

    /// Until a viewer says something or can take more, or messages may have come.
    fn wait(&self, in_order: bool) {
        let look_ns = if self.clients.is_empty() { LOOK_ALONE_NS } else { LOOK_NS };
        if !in_order {
            biplane_clock::sleep_ns(LOOK_ALONE_NS);
            return;
        }
        let at_listener = if self.handshakes.is_full() { PollFlags::empty() } else { PollFlags::IN };
        let mut fds = vec![PollFd::new(&self.listener, at_listener)];
        fds.extend(self.handshakes.fds().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN)));
        fds.extend(self.clients.iter().map(|client| {
            let more = if client.is_flushed() { PollFlags::empty() } else { PollFlags::OUT };
            PollFd::from_borrowed_fd(client.as_fd(), PollFlags::IN | more)
        }));
        if poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: look_ns })).is_err() {
            biplane_clock::sleep_ns(look_ns);
        }
    }

    /// Viewers take what is left, and are told that the run is over.
    fn close(mut self) -> LiveReport {
        let end_ns = biplane_clock::monotonic_ns() + CLOSING_NS;
        loop {
            let now_ns = biplane_clock::monotonic_ns();
            // What it has not been shown of the scene is due now.
            self.each(|server, client| {
                (client.map_ns, client.points_ns) = (i64::MIN, i64::MIN);
                server.serve(client, now_ns)
            });
            let points = self.scene.point_accumulator.len();
            let is_done =
                |client: &Client| client.is_flushed() && (!client.wants(POINTS) || client.points == points);
            if self.clients.iter().all(is_done) || now_ns >= end_ns {
                break;
            }
            biplane_clock::sleep_ns(LOOK_NS);
        }
        for mut client in std::mem::take(&mut self.clients) {
            client.close(CloseCode::Away, "the run is over".to_owned());
            self.let_go(&client, &Gone::Over);
        }
        LiveReport {
            refused: self.handshakes.refused,
            missed: self.missed.load(Ordering::Relaxed),
            ..self.report
        }
    }
}

#[cfg(feature = "live")]
pub(crate) mod admission;
#[cfg(feature = "live")]
pub(crate) mod channel;
#[cfg(feature = "live")]
pub(crate) mod client;
#[cfg(feature = "live")]
pub(crate) mod handshakes;
#[cfg(feature = "live")]
pub(crate) mod protocol;
#[cfg(test)]
mod tests;
