//! The live thread with viewers on sockets of this machine: well-behaved ones, slow ones, too many, and
//! others.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use biplane_recording::Rig;
use biplane_recording::messages::{LaserScan, Message as _, PoseWithCovarianceStamped};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

use super::*;

type Socket = WebSocket<TcpStream>;

fn serve() -> (Tap, LiveView, SocketAddr) {
    let listener =
        Listener::open("127.0.0.1:0".parse().unwrap(), &["https://viewer.example".parse().unwrap()]).unwrap();
    let address = listener.listener.local_addr().unwrap();
    let (tap, view) = listener.start(&Rig::default()).unwrap();
    (tap, view, address)
}

fn stream(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    stream
}

fn connect_as(address: SocketAddr, protocols: &'static str) -> Result<Socket, String> {
    let mut request = format!("ws://{address}").into_client_request().unwrap();
    request.headers_mut().insert("sec-websocket-protocol", HeaderValue::from_static(protocols));
    tungstenite::client(request, stream(address)).map(|(socket, _)| socket).map_err(|error| error.to_string())
}

fn connect(address: SocketAddr) -> Socket {
    connect_as(address, "foxglove.sdk.v1").unwrap()
}

fn subscribe(socket: &mut Socket, channels: &[u32]) {
    // A client's own numbers: the channel's and 100.
    let wishes: Vec<_> =
        channels.iter().map(|id| format!(r#"{{"id":{},"channelId":{id}}}"#, id + 100)).collect();
    let text = format!(r#"{{"op":"subscribe","subscriptions":[{}]}}"#, wishes.join(","));
    socket.send(Message::Text(text.into())).unwrap();
}

/// The next message of a subscription: its number, log time and payload. Texts and times are passed over.
fn data(socket: &mut Socket) -> (u32, u64, Vec<u8>) {
    loop {
        if let Message::Binary(frame) = socket.read().unwrap()
            && frame[0] == 1
        {
            let id = u32::from_le_bytes(frame[1..5].try_into().unwrap());
            return (id, u64::from_le_bytes(frame[5..13].try_into().unwrap()), frame[13..].to_vec());
        }
    }
}

/// The next text that has these words in it.
fn text(socket: &mut Socket, words: &str) -> String {
    loop {
        if let Message::Text(text) = socket.read().unwrap()
            && text.contains(words)
        {
            return text.to_string();
        }
    }
}

/// Why the server closes.
fn close_reason(socket: &mut Socket) -> String {
    loop {
        if let Message::Close(frame) = socket.read().unwrap() {
            let frame = frame.unwrap();
            return format!("{} {}", u16::from(frame.code), frame.reason);
        }
    }
}

/// A vertical scan of `beams` beams over a fan of a radian, and its pose.
fn scan_and_pose(stamp_ns: i64, beams: usize) -> [Vec<u8>; 2] {
    let [mut scan, mut pose] = [Vec::new(), Vec::new()];
    LaserScan {
        stamp_ns,
        angle_increment_rad: 1.0 / beams as f32,
        range_max_m: 80.0,
        ranges_m: vec![60.0; beams],
        ..LaserScan::default()
    }
    .encode(&mut scan);
    PoseWithCovarianceStamped {
        stamp_ns,
        frame_id: "map".to_owned(),
        position_m: [0.0; 3],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        covariance: [0.0; 36],
    }
    .encode(&mut pose);
    [scan, pose]
}

#[test]
fn a_viewer_is_told_what_there_is_and_gets_the_bytes_that_it_asks_for() {
    let (mut tap, view, address) = serve();
    tap.message(Topic::TfStatic, 5, 5, b"mounts");
    let mut socket = connect_as(address, "other.protocol, foxglove.websocket.v1").unwrap();
    text(&mut socket, r#""op":"serverInfo""#);
    let advertised: serde_json::Value =
        serde_json::from_str(&text(&mut socket, r#""op":"advertise""#)).unwrap();
    assert_eq!(advertised["channels"].as_array().unwrap().len(), 10);
    let (odom, tf_static) =
        (ChannelId::of(Topic::Odom).unwrap().0, ChannelId::of(Topic::TfStatic).unwrap().0);
    subscribe(&mut socket, &[odom, tf_static, 99]);
    text(&mut socket, "there is no channel 99");
    // What holds until it is said anew comes at once, with its own time.
    assert_eq!(data(&mut socket), (tf_static + 100, 5, b"mounts".to_vec()));
    tap.message(Topic::Odom, 6, 6, b"first");
    tap.message(Topic::Pose, 7, 7, b"not asked for");
    tap.message(Topic::Odom, 8, 8, b"second");
    assert_eq!(data(&mut socket), (odom + 100, 6, b"first".to_vec()));
    assert_eq!(data(&mut socket), (odom + 100, 8, b"second".to_vec()));
    let unsubscribe = format!(r#"{{"op":"unsubscribe","subscriptionIds":[{}]}}"#, odom + 100);
    socket.send(Message::Text(unsubscribe.into())).unwrap();
    socket.send(Message::Text("what?".into())).unwrap();
    text(&mut socket, "not understood");
    tap.message(Topic::Odom, 9, 9, b"no more");
    drop(tap);
    assert_eq!(close_reason(&mut socket), "1001 the run is over");
    let report = view.finish();
    assert_eq!(report, LiveReport { viewers: 1, sent: 3, ..LiveReport::default() });
}

#[test]
fn a_strangers_web_page_is_turned_away_and_a_named_one_is_not() {
    let (tap, view, address) = serve();
    let connect_from = |host: &str, origin: &str| {
        let mut request = format!("ws://{address}").into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("sec-websocket-protocol", HeaderValue::from_static("foxglove.sdk.v1"));
        headers.insert("host", host.parse().unwrap());
        headers.insert("origin", origin.parse().unwrap());
        tungstenite::client(request, stream(address)).map(|_| ()).map_err(|error| error.to_string())
    };
    let answer = connect_from("localhost:8765", "https://evil.example").unwrap_err();
    assert!(answer.contains("403"), "{answer}");
    let answer = connect_from("rebound.example:8765", "http://localhost").unwrap_err();
    assert!(answer.contains("403"), "{answer}");
    connect_from("localhost:8765", "https://viewer.example").unwrap();
    drop(tap);
    assert_eq!(view.finish().refused, 2);
}

#[test]
fn who_comes_late_gets_all_points_so_far_and_the_map() {
    let (mut tap, view, address) = serve();
    let [scan, pose] = scan_and_pose(1, 1500);
    for topic in [Topic::ScanVertical, Topic::ScanHorizontal] {
        tap.message(topic, 1, 1, &scan);
    }
    for topic in [Topic::PoseVertical, Topic::Pose] {
        tap.message(topic, 2, 1, &pose);
    }
    thread::sleep(Duration::from_millis(200));
    let mut socket = connect(address);
    subscribe(&mut socket, &[MAP.0, POINTS.0]);
    let mut got: Vec<_> = [data(&mut socket), data(&mut socket)].into();
    got.sort_by_key(|(id, ..)| *id);
    // A meter of arc has 1500 points, 4 cm apart: a cube of 5 cm has one or two of them.
    assert_eq!((got[0].0, got[1].0), (MAP.0 + 100, POINTS.0 + 100));
    let points = (got[1].2.len() - 160) / 12;
    assert!((1000..1500).contains(&points), "{points} points");
    drop(tap);
    close_reason(&mut socket);
    assert_eq!(view.finish().sent, 2);
}

#[test]
fn a_viewer_that_takes_nothing_misses_messages_and_nobody_waits_for_it() {
    let (mut tap, view, address) = serve();
    let (mut asleep, mut awake) = (connect(address), connect(address));
    let diagnostics = ChannelId::of(Topic::Diagnostics).unwrap().0;
    for socket in [&mut asleep, &mut awake] {
        text(socket, "advertise");
        subscribe(socket, &[diagnostics]);
        socket.send(Message::Text("{\"op\":\"getParameters\"}".into())).unwrap();
        text(socket, "nothing else"); // the subscription came before
    }
    // Six times what fits. More would take so long on a busy machine that the viewer is given up.
    let payload = vec![7; 1 << 20];
    for round in 0..24_u64 {
        tap.message(Topic::Diagnostics, round as i64, 0, &payload);
        assert_eq!(data(&mut awake).1, round);
    }
    drop(tap);
    let report = view.finish();
    assert_eq!((report.viewers, report.missed), (2, 0));
    assert_eq!(report.sent + report.left_out, 48);
    assert!((10..=24).contains(&report.left_out), "{report:?}");
    // What the system had taken for it is whole, and in order.
    let mut rounds = 0;
    while let Ok(message) = asleep.read() {
        let Message::Binary(frame) = message else { continue };
        if frame[0] == 1 {
            assert_eq!(frame[5..13], u64::to_le_bytes(rounds));
            assert_eq!(frame[13..], payload);
            rounds += 1;
        }
    }
    assert!(rounds <= report.sent - 24, "{rounds}");
}

#[test]
fn what_the_thread_does_not_get_to_is_missed_and_counted_and_the_tap_never_waits() {
    let (messages_in, messages_out) = message_ring(1000);
    let missed = Arc::new(AtomicU64::new(0));
    let mut tap = Tap::new(messages_in, Arc::clone(&missed));
    for time in 0..100 {
        tap.message(Topic::Odom, time, time, &[0; 100]);
    }
    // 21 bytes of head each; eight fit.
    assert_eq!(missed.load(Ordering::Relaxed), 92);
    tap.message(
        Topic::Serial(biplane_recording::Port::Base, biplane_recording::Direction::Rx),
        0,
        0,
        &[0; 100],
    );
    assert_eq!(missed.load(Ordering::Relaxed), 92, "serial bytes are nothing to look at");
    drop(messages_out);
}

#[test]
fn more_than_eight_viewers_are_told_why_they_cannot_come_in() {
    let (tap, view, address) = serve();
    let mut viewers: Vec<Socket> = (0..MAX_VIEWERS).map(|_| connect(address)).collect();
    viewers.iter_mut().for_each(|socket| drop(text(socket, "advertise")));
    for _ in 0..3 {
        assert_eq!(
            close_reason(&mut connect(address)),
            "1013 8 viewers are there already: close one of them"
        );
    }
    // One goes, one comes.
    viewers.pop().unwrap().close(None).unwrap();
    thread::sleep(Duration::from_millis(200));
    text(&mut connect(address), "advertise");
    drop(tap);
    let report = view.finish();
    assert_eq!((report.viewers, report.refused), (9, 3));
}

#[test]
fn strangers_garbage_and_those_who_vanish_harm_nobody() {
    let (mut tap, view, address) = serve();
    let mut good = connect(address);
    text(&mut good, "advertise");
    let odom = ChannelId::of(Topic::Odom).unwrap().0;
    subscribe(&mut good, &[odom]);
    // Of another protocol, or of none: an answer in words.
    let refused = connect_as(address, "mqtt").unwrap_err();
    assert!(refused.contains("400"), "{refused}");
    let mut browser = stream(address);
    browser.write_all(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    let _ = browser.read_to_end(&mut answer);
    let answer = String::from_utf8(answer).unwrap();
    let (head, words) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 426 ") && head.contains(&format!("Content-Length: {}", words.len())));
    assert!(words.contains("Foxglove") && words.contains(&format!("ws://{address}")), "{words}");
    // Fifty that come and go, say nothing, or say nonsense.
    let mut silent = Vec::new();
    for number in 0..50_u8 {
        let mut stream = stream(address);
        match number % 3 {
            0 => drop(stream),
            1 => silent.push(stream),
            _ => drop(stream.write_all(&[number % 9; 3000])),
        }
    }
    // In the protocol, and then nonsense: a frame without mask, one too long, a flood.
    connect(address).get_mut().write_all(&[0x81, 0x05, 1, 2, 3, 4, 5]).unwrap();
    let mut long = connect(address);
    let _ = long.send(Message::Binary(vec![0; 1 << 20].into()));
    let mut flood = connect(address);
    for _ in 0..1000 {
        if flood.send(Message::Text("{}".into())).is_err() {
            break;
        }
    }
    drop((long, flood, connect(address)));
    thread::sleep(Duration::from_millis(300));
    tap.message(Topic::Odom, 1, 1, b"still there");
    assert_eq!(data(&mut good), (odom + 100, 1, b"still there".to_vec()));
    drop(tap);
    close_reason(&mut good);
    let report = view.finish();
    assert!(report.refused >= 30 && report.left_out == 0, "{report:?}");
}

#[test]
fn an_address_that_is_taken_is_refused_in_words_or_left_to_the_other() {
    let (tap, view, address) = serve();
    let taken: LiveAddress = address.to_string().parse().unwrap();
    let refused = super::super::open(Some(taken), &[], false).unwrap_err().to_string();
    assert!(refused.contains(&address.to_string()) && refused.contains("--live 127.0.0.1:PORT"), "{refused}");
    assert!(super::super::open(Some(taken), &[], true).unwrap().is_none());
    assert!(super::super::open(None, &[], false).unwrap().is_none());
    drop(tap);
    assert_eq!(view.finish(), LiveReport::default());
}

#[test]
fn an_address_of_another_machine_is_said_to_be_no_address_of_this_one() {
    // Kept for documentation: no machine has it.
    let foreign: LiveAddress = "192.0.2.1:8765".parse().unwrap();
    let refused = super::super::open(Some(foreign), &[], false).unwrap_err().to_string();
    assert!(refused.contains("192.0.2.1 is no address of this machine"), "{refused}");
    assert!(!refused.contains("another recording"), "{refused}");
}
