//! Five client programs, as recorded talking to a scripted laser: every request that they send, in their order and with their
//! pauses, and the reply that they accepted byte for byte.

use super::{Bench, hex};
use crate::device::Device;
use crate::lms_device::LmsParams;

/// One step of a client.
enum Step {
    /// Say the first, hear an ACK and the second.
    Ask(&'static str, &'static str),
    /// Wait for so many milliseconds.
    Pause(i64),
    /// For three seconds, hear telegrams of this length that begin so (behind the length).
    Stream(usize, &'static str),
    /// Say it at a rate that the device does not have: silence.
    Deaf(&'static str),
    /// The device's rate is now this.
    Rate(u32),
}
use Step::{Ask, Deaf, Pause, Rate, Stream};

const STOP: &str = "02 00 02 00 20 25 35 08";
const ALL: &str = "02 00 02 00 20 24 34 08";
const TYPE: &str = "02 00 01 00 3a 1e 12";
const STATUS: &str = "02 00 01 00 31 15 12";
const ERRORS: &str = "02 00 01 00 32 16 12";
const READ: &str = "02 00 01 00 74 50 12";
const INSTALL: &str = "02 00 0a 00 20 00 53 49 43 4b 5f 4c 4d 53 be c5";
const TO_9600: &str = "02 00 02 00 20 42 52 08";
const TO_19200: &str = "02 00 02 00 20 41 51 08";
const TO_38400: &str = "02 00 02 00 20 40 50 08";
const TO_500000: &str = "02 00 02 00 20 48 58 08";
const DONE: &str = "02 80 03 00 a0 00 10 16 0a";
const TYPE_291: &str = "02 80 14 00 ba 4c 4d 53 32 39 31 3b 53 30 35 3b 58 30 31 2e 32 37 20 10 3d 00";
const TYPE_200: &str = "02 80 16 00 ba 4c 4d 53 32 30 30 3b 33 30 31 30 36 3b 56 30 32 2e 31 30 20 10 99 ab";
const CONFIG: &str = "02 80 24 00 f4 00 00 46 00 00 00 00 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 \
     00 00 00 00 02 00 10 aa 4f";

/// Status replies of the transcripts differ in few places: head, field, step and rate, checksum.
const STATUS_291_38400: &str = "02 80 9a 00 b1 58 30 31 2e 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 00 67 00 68 00 69 00 \
     6a 00 6b 00 6c 00 6d 00 6e 00 6f 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 00 79 00 7a 00 7b 00 94 00 00 00 50 \
     00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 00 00 00 00 00 00 b4 00 32 00 02 02 \
     00 00 00 19 80 02 00 00 01 00 01 56 30 32 2e 31 30 20 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 10 \
     43 ff";
const STATUS_291_9600: &str = "02 80 9a 00 b1 58 30 31 2e 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 00 67 00 68 00 69 00 \
     6a 00 6b 00 6c 00 6d 00 6e 00 6f 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 00 79 00 7a 00 7b 00 94 00 00 00 50 \
     00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 00 00 00 00 00 00 b4 00 32 00 02 02 \
     00 00 00 67 80 02 00 00 01 00 01 56 30 32 2e 31 30 20 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 10 \
     06 3d";
const STATUS_291_500000: &str = "02 80 9a 00 b1 58 30 31 2e 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 00 67 00 68 00 69 \
     00 6a 00 6b 00 6c 00 6d 00 6e 00 6f 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 00 79 00 7a 00 7b 00 94 00 00 00 \
     50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 00 00 00 00 00 00 b4 00 32 00 02 \
     02 00 00 00 01 80 02 00 00 01 00 01 56 30 32 2e 31 30 20 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 \
     10 07 c3";

fn play(params: LmsParams, steps: &[Step]) -> Bench {
    let mut bench = Bench::new(params);
    for (number, step) in steps.iter().enumerate() {
        match *step {
            Ask(request, reply) => {
                let mut expected = vec![0x06];
                expected.extend(hex(reply));
                bench.say(request);
                let asked_ns = bench.now_ns;
                while bench.heard.len() < expected.len() {
                    bench.run_ms(1);
                    let waited_ms = (bench.now_ns - asked_ns) / 1_000_000;
                    assert!(waited_ms < 700, "step {number}: {:02x?} after {waited_ms} ms", bench.bytes());
                }
                assert_eq!(bench.bytes()[..expected.len()], expected, "step {number}");
                assert!(bench.heard[0].0 - asked_ns < 60_000_000, "step {number}: a late ACK");
            }
            Pause(duration_ms) => bench.run_ms(duration_ms),
            Stream(length, head) => {
                bench.heard.clear();
                bench.run_ms(3000);
                let telegrams = bench.telegrams();
                assert!(telegrams.len() > 3, "step {number}: {} telegrams", telegrams.len());
                for (_, telegram) in &telegrams {
                    let head = hex(head);
                    assert_eq!(telegram.len(), length, "step {number}");
                    assert_eq!(telegram[4..4 + head.len()], head, "step {number}");
                }
            }
            Deaf(request) => {
                bench.heard.clear();
                bench.device.handle_noise(bench.now_ns, hex(request).len());
                bench.run_ms(1000);
                assert_eq!(bench.bytes(), [], "step {number}");
            }
            Rate(baud) => assert_eq!(bench.device.baud(), baud, "step {number}"),
        }
    }
    bench
}

fn lms200() -> LmsParams {
    LmsParams { type_text: "LMS200;30106;V02.10 ".to_owned(), ..LmsParams::default() }
}

#[test]
fn sicktoolbox_streams_half_degrees_at_38400() {
    let steps = [
        Pause(525),
        Ask(TO_38400, DONE),
        Pause(250),
        Rate(38_400),
        Ask(STOP, DONE),
        Ask(TYPE, TYPE_291),
        Ask(STATUS, STATUS_291_38400),
        Ask(READ, CONFIG),
        Ask(ALL, DONE),
        Stream(732, "b0 69 01 2c 01"),
        Ask(STOP, DONE),
        Ask(TO_9600, DONE),
        Pause(250),
        Rate(9600),
    ];
    play(LmsParams::default(), &steps);
}

#[test]
fn sicktoolbox_runs_at_19200_and_500000() {
    let steps = [
        Ask(TO_19200, DONE),
        Pause(250),
        Rate(19_200),
        Ask(ALL, DONE),
        Stream(732, "b0 69 01"),
        Ask(TO_500000, DONE),
        Pause(250),
        Rate(500_000),
        Ask(STOP, DONE),
        Ask(STATUS, STATUS_291_500000),
    ];
    play(LmsParams::default(), &steps);
}

#[test]
fn sicktoolbox_configures_and_resets() {
    const WRITE: &str = "02 00 23 00 77 00 00 46 00 02 06 01 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 02 \
         00 4a 23";
    const WRITTEN: &str = "02 80 25 00 f7 01 00 00 46 00 02 06 01 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 \
         02 00 10 76 ac";
    let steps = [
        Ask(TO_500000, DONE),
        Pause(250),
        Ask(INSTALL, DONE),
        Ask(WRITE, WRITTEN),
        Ask(STOP, DONE),
        Ask("02 00 05 00 3b b4 00 64 00 97 49", "02 80 07 00 bb 01 b4 00 64 00 10 5b 30"),
        Ask(ALL, DONE),
        Stream(374, "b0 b5 40 b8 0b"),
        Ask("02 00 01 00 10 34 12", "02 80 02 00 91 10 79 30"),
        Pause(2500),
        Rate(9600),
    ];
    let bench = play(LmsParams::default(), &steps);
    let power_on = "02 80 14 00 90 4c 4d 53 32 39 31 3b 53 30 35 3b 58 30 31 2e 32 37 20 10 d7 f7";
    assert_eq!(bench.telegrams().last().map(|(_, telegram)| telegram.clone()), Some(hex(power_on)));
    assert_eq!(bench.device.eeprom_writes(), 1);
}

#[test]
fn sicktoolbox_searches_a_laser_that_was_left_at_38400() {
    let steps = [
        Deaf(TO_38400),
        Deaf(TO_38400),
        Deaf(TO_38400),
        Deaf(ERRORS),
        Deaf(ERRORS),
        Deaf(ERRORS),
        Ask(ERRORS, "02 80 02 00 b2 10 3f 13"),
        Ask(STOP, DONE),
        Ask(ALL, DONE),
        Stream(732, "b0 69 01"),
    ];
    play(LmsParams { baud: 38_400, ..LmsParams::default() }, &steps);
}

#[test]
fn sicktoolbox_asks_for_parts_means_sub_ranges_and_variants() {
    let steps = [
        Ask(TO_38400, DONE),
        Pause(250),
        Ask("02 00 03 00 20 26 05 79 3e", DONE),
        Stream(733, "b6 05 69 01 2c 01"),
        Ask(STOP, DONE),
        Ask("02 00 06 00 20 27 01 00 0a 00 6c b7", DONE),
        Stream(34, "b7 01 00 0a 00 0a 00 2c 01"),
        Ask(STOP, DONE),
        Ask("02 00 05 00 3b 64 00 19 00 e7 72", "02 80 07 00 bb 01 64 00 19 00 10 bb 46"),
        Ask(ALL, DONE),
        Stream(812, "b0 91 01"),
        Ask(STOP, DONE),
        Ask("02 00 05 00 3b b4 00 32 00 3b 1f", "02 80 07 00 bb 01 b4 00 32 00 10 03 9d"),
    ];
    play(LmsParams::default(), &steps);
}

#[test]
fn mrpt_finds_9600_and_streams_millimetres_at_500000() {
    const WRITE: &str = "02 00 23 00 77 00 00 46 00 00 06 01 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 02 \
         00 cf 21";
    const WRITTEN: &str = "02 80 25 00 f7 01 00 00 46 00 00 06 01 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 \
         02 00 10 7c a9";
    let steps = [
        Deaf(STOP),
        Deaf(STATUS),
        Ask(STOP, DONE),
        Pause(83),
        Ask(STATUS, STATUS_291_9600),
        Pause(190),
        Ask(TO_500000, DONE),
        Pause(500),
        Ask(STATUS, STATUS_291_500000),
        Ask(INSTALL, DONE),
        Ask(READ, CONFIG),
        Ask(WRITE, WRITTEN),
        Ask(STOP, DONE),
        Ask("02 00 05 00 3b b4 00 64 00 97 49", "02 80 07 00 bb 01 b4 00 64 00 10 5b 30"),
        Ask(ALL, DONE),
        Stream(372, "b0 b5 40 b8 0b"),
        Ask(STOP, DONE),
    ];
    play(LmsParams::default(), &steps);
}

#[test]
fn carmen_takes_single_turns_in_quarter_degrees() {
    const WRITE: &str = "02 00 21 00 77 00 00 46 00 01 01 00 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 cd 8c";
    const WRITTEN: &str = "02 80 25 00 f7 01 00 00 46 00 01 01 00 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 \
         02 00 10 96 0d";
    let steps = [
        Deaf(STOP),
        Ask(STOP, DONE),
        Ask(STOP, DONE),
        Ask(READ, CONFIG),
        Pause(1000),
        Ask(INSTALL, DONE),
        Pause(1000),
        Ask(WRITE, WRITTEN),
        Pause(1000),
        Ask("02 00 05 00 3b 64 00 19 00 e7 72", "02 80 07 00 bb 01 64 00 19 00 10 bb 46"),
        Ask(STOP, DONE),
        Ask("02 00 02 00 20 2a 3a 08", DONE),
    ];
    let mut bench = play(LmsParams { baud: 500_000, ..LmsParams::default() }, &steps);
    bench.heard.clear();
    bench.run_ms(1000);
    let heads: Vec<[u8; 3]> = bench.telegrams().iter().map(|(_, t)| [t[4], t[5], t[6]]).collect();
    assert!(heads.len() > 70);
    let first = heads.iter().position(|head| head[2] == 0x20).expect("a turn of whole degrees");
    let quarters = [[0xB0, 0xB5, 0x20], [0xB0, 0xB4, 0x28], [0xB0, 0xB4, 0x30], [0xB0, 0xB4, 0x38]];
    assert_eq!(heads[first..first + 4], quarters);
}

#[test]
fn carmen_asks_for_the_status_right_behind_the_rate_and_gets_both() {
    let mut bench = Bench::new(LmsParams::default());
    bench.run_ms(100);
    bench.say(&format!("{TO_500000} {STATUS}"));
    bench.run_ms(1000);
    let codes: Vec<u8> = bench.telegrams().iter().map(|(_, telegram)| telegram[4]).collect();
    assert_eq!(codes, [0xA0, 0xB1]);
    assert_eq!(bench.device.baud(), 500_000);
}

#[test]
fn ariacoda_sets_its_own_short_configuration() {
    const WRITE: &str = "02 00 21 00 77 00 00 46 00 00 05 01 00 00 02 02 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 5b 51";
    const WRITTEN: &str = "02 80 25 00 f7 01 00 00 46 00 00 05 01 00 00 02 02 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 \
         02 00 10 32 e1";
    let steps = [
        Ask(TO_38400, DONE),
        Pause(340),
        Ask("02 00 05 00 3b b4 00 64 00 97 49", "02 80 07 00 bb 01 b4 00 64 00 10 5b 30"),
        Pause(340),
        Ask(INSTALL, DONE),
        Pause(330),
        Ask(WRITE, WRITTEN),
        Pause(300),
        Ask(ALL, DONE),
        Stream(372, "b0 b5 40 b8 0b"),
        Ask(STOP, DONE),
        Ask(TO_9600, DONE),
        Pause(250),
        Rate(9600),
    ];
    play(lms200(), &steps);
}

#[test]
fn player_writes_seven_bytes_of_configuration_and_takes_a_sub_range() {
    const WRITTEN: &str = "02 80 25 00 f7 01 00 00 46 00 00 01 01 00 00 02 02 02 00 00 0a 0a 50 64 00 0a 0a 50 64 00 0a 0a 50 64 00 00 00 00 \
         02 00 10 b3 6f";
    let steps = [
        Ask(STOP, DONE),
        Pause(1000),
        Ask(TO_38400, DONE),
        Pause(1000),
        Ask(TYPE, TYPE_200),
        Ask(INSTALL, DONE),
        Ask("02 00 05 00 3b b4 00 64 00 97 49", "02 80 07 00 bb 01 b4 00 64 00 10 5b 30"),
        Ask(READ, CONFIG),
        Ask("02 00 08 00 77 00 00 46 00 00 01 01 a2 4e", WRITTEN),
        Ask("02 00 06 00 20 27 01 00 b5 00 12 09", DONE),
        Stream(376, "b7 01 00 b5 00 b5 40 b8 0b"),
    ];
    play(lms200(), &steps);
}
