//! AriaCoda and Player, as recorded talking to a scripted base (`sessions.txt`): every byte that they sent at
//! its time, and the answers that they accepted.

use super::{BaseParams, Bench, MS, Still};
use crate::devices::device::Device;

const SESSIONS: &str = include_str!("sessions.txt");

fn bytes(text: &str) -> Vec<u8> {
    let digits = |at: usize| text.get(at..at + 2).and_then(|pair| u8::from_str_radix(pair, 16).ok());
    (0..text.len()).step_by(2).map(|at| digits(at).expect("hex in a test")).collect()
}

/// Whole packets heard so far: when the first byte had left, and the packet.
fn packets(bench: &Bench) -> Vec<(i64, Vec<u8>)> {
    let bytes: Vec<u8> = bench.received.iter().map(|&(_, byte)| byte).collect();
    let (mut found, mut at) = (Vec::new(), 0);
    while at + 3 <= bytes.len() {
        assert_eq!(bytes[at..at + 2], [0xFA, 0xFB], "nothing but packets is said");
        let end = at + 3 + usize::from(bytes[at + 2]);
        let Some(packet) = bytes.get(at..end) else { break };
        found.push((bench.received[at].0, packet.to_vec()));
        at = end;
    }
    found
}

fn is_sip(packet: &[u8]) -> bool {
    matches!(packet[3], 0x32 | 0x33)
}

#[test]
fn every_session_of_two_clients_is_answered_with_the_packets_that_they_accepted() {
    for strict in [false, true] {
        play(&BaseParams { strict, ..BaseParams::default() });
    }
}

fn play(params: &BaseParams) {
    let mut played = 0;
    for session in SESSIONS.split("\nsession ").skip(1) {
        let mut bench = Bench::with(params.clone(), Box::new(Still));
        let (name, lines) = session.split_once('\n').expect("a name and lines");
        let mut answers = Vec::new();
        for line in lines.lines().filter(|line| !line.is_empty()) {
            match line.split(' ').collect::<Vec<_>>()[..] {
                ["say", at_ms, reported] => {
                    let at_ms: i64 = at_ms.parse().expect("milliseconds");
                    bench.run_ms((at_ms - bench.now_ns / MS).max(0));
                    bench.device.handle(bench.now_ns, &bytes(reported));
                }
                ["hear", packet] => answers.push(bytes(packet)),
                ["open"] => assert!(bench.device.is_streaming(), "{name}: {line}"),
                ["closed"] => assert!(!bench.device.is_streaming(), "{name}: {line}"),
                _ => panic!("{name}: {line}"),
            }
        }
        bench.run_ms(500);
        let packets = packets(&bench);
        let received: Vec<_> = packets.iter().filter(|(_, packet)| !is_sip(packet)).map(|(_, p)| p).collect();
        assert_eq!(received, answers.iter().collect::<Vec<_>>(), "{name}");
        let sips: Vec<i64> = packets.iter().filter(|(_, packet)| is_sip(packet)).map(|(at, _)| *at).collect();
        assert!(sips.len() > 70, "{name}: {}", sips.len());
        // A reply on the line may hold one up; the pace stays.
        assert!(sips.windows(2).all(|pair| pair[1] - pair[0] <= 200 * MS), "{name}");
        assert_eq!((bench.device.counts().bad_checksums, bench.device.counts().watchdog), (0, 0), "{name}");
        played += 1;
    }
    assert_eq!(played, 2);
}
