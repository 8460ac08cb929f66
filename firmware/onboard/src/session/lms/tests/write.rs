//! Writing the configuration: read twice, written once, only what differs, read back whole.

use biplane_wire::lms::{Config, Reply, Status, Unit};

use super::*;

/// The configuration as read, but for byte 6: millimeters (checksum by hand).
const WRITE_MM: &str = "> 02 00 23 00 77 00 00 46 00 00 00 01 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 00 02 00 0A E2";
const INSTALL: &str = "> 02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5";

/// A reply with a configuration: 34 bytes, unit as given; the checksum is computed.
fn config_reply(unit: Unit, written: Option<bool>) -> String {
    let mut config = Config::from_bytes(&Config::FACTORY).expect("it fits");
    config.set_unit(unit);
    let reply = match written {
        None => Reply::Config(config),
        Some(accepted) => Reply::ConfigWritten { accepted, config },
    };
    reply_line(&reply)
}

fn reply_line(reply: &Reply<'_>) -> String {
    let mut bytes = [0; 64];
    let length = reply.emit(0x80, Status::OK, &mut bytes).expect("it fits");
    let words: Vec<String> = bytes[..length].iter().map(|byte| format!("{byte:02X}")).collect();
    format!("< {}", words.join(" "))
}

/// A block as a reply with a configuration.
fn block_reply(change: impl Fn(&mut [u8; 34])) -> String {
    let mut block = Config::FACTORY;
    change(&mut block);
    reply_line(&Reply::Config(Config::from_bytes(&block).expect("it fits")))
}

fn play_text(session: &mut LaserSession, lines: &str) -> String {
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    play(session, &lines).join("\n")
}

/// From the start to the moment when the configuration may be written, at 120 ms, and is read once more
/// before that.
fn until_compared() -> String {
    format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n90 {ASK_CONFIG}\n100 {CONFIG}\n100 {ASK_STATUS}\n110 {STATUS}\n110 {ASK_FAULTS}\n\
         120 {NO_FAULTS}\n120 {ASK_CONFIG}"
    )
}

/// What a device sends until it is asked to write, at 200 ms.
fn sent_until_written() -> String {
    format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n130 {CONFIG}\n200 {MODE_DONE}"
    )
}

const MM: LaserSettings = LaserSettings { unit: Unit::Mm, ..HALF };
const WRITE: &str = "> 02 00 23 00 77";
const WRITTEN: &str = "! configuration written: units mm instead of cm";
const KEPT: &str = "! does not take what the rig asks: units mm instead of cm";

#[test]
fn other_units_are_written_once_in_installation_mode_and_read_back() {
    let script = format!(
        "{}\n130 {CONFIG}\n130 {INSTALL}\n200 {MODE_DONE}\n200 {WRITE_MM}\n210 < 06\n600 {}\n600 {STOP}\n680 {MODE_DONE}\n\
         680 {ASK_CONFIG}\n770 {}\n770 {WRITTEN}\n770 {STREAM}\n850 {MODE_DONE}\n850 ! streams\n900 end",
        until_compared(),
        config_reply(Unit::Mm, Some(true)),
        config_reply(Unit::Mm, None),
    );
    let mut session = streaming(MM);
    check(&mut session, &script);
    assert_eq!((session.health().writes, session.health().differs), (1, false));
}

#[test]
fn a_device_that_does_not_take_a_configuration_is_not_offered_it_again() {
    for answer in [config_reply(Unit::Cm, Some(true)), config_reply(Unit::Cm, Some(false))] {
        let lines = format!(
            "{}\n210 < 06\n600 {answer}\n680 {MODE_DONE}\n770 {CONFIG}\n780 {CONFIG}\n850 {MODE_DONE}\n900 < scan361\n\
             2000 {MODE_DONE}\n2010 {TYPE}\n2020 {CONFIG}\n2030 {STATUS}\n2040 {NO_FAULTS}\n2050 {MODE_DONE}\n2100 < scan361\n\
             2101 end",
            sent_until_written()
        );
        let mut session = streaming(MM);
        let transcript = play_text(&mut session, &lines);
        assert_eq!(transcript.matches(WRITE).count(), 1, "{transcript}");
        assert_eq!(transcript.matches(KEPT).count(), 1, "{transcript}");
        assert_eq!(transcript.matches("! streams").count(), 2, "{transcript}");
        // Centimeters where millimeters were asked for: the telegram says what it is in.
        assert_eq!(transcript.matches("* 361 beams").count(), 2, "{transcript}");
        assert!(session.health().differs);
    }
}

#[test]
fn a_block_that_was_damaged_when_it_was_read_is_never_written() {
    // Blanking, restart, a contour's byte: nothing that the rig asks for.
    let damaged = block_reply(|block| (block[0], block[6]) = (7, 0));
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {damaged}\n110 {STATUS}\n120 {NO_FAULTS}\n130 {CONFIG}\n140 {CONFIG}\n\
         200 {MODE_DONE}\n201 end"
    );
    let transcript = play_text(&mut streaming(MM), &lines);
    assert!(transcript.ends_with(&format!("200 {WRITE_MM}\n201 end")), "{transcript}");
    // And where no two reads in a row are alike, nothing is.
    let other = block_reply(|block| (block[10], block[6]) = (9, 0));
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {damaged}\n110 {STATUS}\n120 {NO_FAULTS}\n130 {CONFIG}\n140 {other}\n150 {CONFIG}\n\
         250 {MODE_DONE}\n251 end"
    );
    let transcript = play_text(&mut streaming(MM), &lines);
    assert_eq!(transcript.matches(WRITE).count(), 0, "{transcript}");
    assert!(transcript.contains("150 ! gave up reading the configuration"), "{transcript}");
    assert!(transcript.contains(&format!("150 {KEPT}")) && transcript.contains("! streams"), "{transcript}");
}

#[test]
fn a_difference_that_was_but_a_damaged_read_leads_to_no_write() {
    let mm = config_reply(Unit::Mm, None);
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n130 {mm}\n140 {mm}\n250 {MODE_DONE}\n251 end"
    );
    let mut session = streaming(MM);
    let transcript = play_text(&mut session, &lines);
    assert!(!transcript.contains(INSTALL) && transcript.contains("! streams"), "{transcript}");
    assert!(!session.health().differs);
}

#[test]
fn success_is_said_only_of_a_block_that_reads_back_whole() {
    let normalized = block_reply(|block| (block[3], block[33]) = (2, 5));
    let until_left = format!(
        "{}\n210 < 06\n600 {}\n680 {MODE_DONE}\n770 {normalized}",
        sent_until_written(),
        config_reply(Unit::Mm, Some(true))
    );
    // Damaged when it was read back: the next read is as it was sent.
    let mm = config_reply(Unit::Mm, None);
    let transcript = play_text(&mut streaming(MM), &format!("{until_left}\n860 {mm}\n861 end"));
    assert!(transcript.contains(&format!("860 {WRITTEN}")), "{transcript}");
    // The device holds something else, whoever did that.
    let mut session = streaming(MM);
    let transcript =
        play_text(&mut session, &format!("{until_left}\n860 {normalized}\n950 {MODE_DONE}\n951 end"));
    let reported = "860 ! holds another configuration than was written to it: byte 3 02h instead of 00h, byte 33 05h instead of 00h";
    assert!(transcript.contains(reported) && transcript.contains("950 ! streams"), "{transcript}");
    assert!(!transcript.contains(WRITTEN), "{transcript}");
    assert_eq!((session.health().writes, session.health().differs), (1, false));
}

#[test]
fn a_write_is_waited_for_whether_its_acknowledge_came_or_not_and_then_read_back() {
    for acknowledge in ["210 < 06\n", ""] {
        let mut session = streaming(MM);
        let transcript =
            play_text(&mut session, &format!("{}\n{acknowledge}15199 end", sent_until_written()));
        assert!(transcript.ends_with(&format!("200 {WRITE_MM}\n{acknowledge}15199 end")), "{transcript}");
        let mm = config_reply(Unit::Mm, None);
        let after = play_text(&mut session, &format!("15280 {MODE_DONE}\n15370 {mm}\n15371 end"));
        let script = format!(
            "15200 ! gave up writing the configuration\n15200 {STOP}\n15280 {MODE_DONE}\n15280 {ASK_CONFIG}\n15370 {mm}\n\
             15370 {WRITTEN}\n15370 {STREAM}\n15371 end"
        );
        assert_eq!(after, script);
        assert_eq!(session.health().writes, 1);
    }
}

#[test]
fn a_write_that_did_not_arrive_is_sent_once_more_and_no_oftener() {
    // Refused by its checksum: the device says so at once, and holds what it held.
    let mut lines = sent_until_written();
    for at in [210, 1210] {
        lines += &format!(
            "\n{at} < 15\n{} {MODE_DONE}\n{} {CONFIG}\n{} {CONFIG}\n{} {MODE_DONE}",
            at + 140,
            at + 240,
            at + 340,
            at + 990
        );
    }
    let mut session = streaming(MM);
    let transcript = play_text(&mut session, &format!("{lines}\n2400 end"));
    assert_eq!(transcript.matches(WRITE).count(), 2, "{transcript}");
    assert_eq!(session.health().writes, 2);
    assert!(transcript.contains(KEPT) && transcript.contains("! streams"), "{transcript}");
}

#[test]
fn a_stop_waits_until_the_write_is_over_and_read_back() {
    let mm = config_reply(Unit::Mm, None);
    let lines = format!(
        "{}\n210 < 06\n300 stop\n600 {}\n680 {MODE_DONE}\n770 {mm}\n850 {MODE_DONE}\n900 end",
        sent_until_written(),
        config_reply(Unit::Mm, Some(true))
    );
    let mut session = streaming(MM);
    let transcript = play_text(&mut session, &lines);
    let end =
        format!("770 {mm}\n770 {WRITTEN}\n770 {STOP}\n850 {MODE_DONE}\n850 ! left idle at 38400 Bd\n900 end");
    assert!(transcript.contains("300 stop\n600 <") && transcript.ends_with(&end), "{transcript}");
    assert!(session.is_done());
    // A device that never answers again keeps nobody for ever.
    let mut session = streaming(MM);
    let transcript = play_text(&mut session, &format!("{}\n300 stop\n17400 end", sent_until_written()));
    assert!(session.is_done(), "{transcript}");
    assert!(transcript.contains("! did not answer when asked to stop"), "{transcript}");
}

#[test]
fn what_one_device_refused_is_offered_to_another_one() {
    let refused = config_reply(Unit::Cm, Some(false));
    // An LMS 200 in its place (the checksum is computed).
    let other = reply_line(&Reply::Type { text: biplane_wire::lms::Text(b"LMS200;30106;X01.27 ") });
    let lines = format!(
        "{}\n210 < 06\n600 {refused}\n680 {MODE_DONE}\n770 {CONFIG}\n780 {CONFIG}\n850 {MODE_DONE}\n900 < scan361\n\
         2000 {MODE_DONE}\n2010 {other}\n2020 {CONFIG}\n2030 {STATUS}\n2040 {NO_FAULTS}\n2050 {CONFIG}\n2120 {MODE_DONE}\n\
         2121 end",
        sent_until_written()
    );
    let transcript = play_text(&mut streaming(MM), &lines);
    assert_eq!(transcript.matches(WRITE).count(), 2, "{transcript}");
}

#[test]
fn an_old_configuration_is_not_that_of_a_device_that_does_not_tell_its_own() {
    // Measuring mode 06 (15 bits) before; afterwards neither configuration nor status report is answered.
    let wide = block_reply(|block| (block[5], block[6]) = (6, 0));
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {wide}\n110 {STATUS}\n120 {NO_FAULTS}\n200 {MODE_DONE}\n300 < scan361\n\
         2000 {MODE_DONE}\n2010 {TYPE}\n4000 {NO_FAULTS}\n5000 end"
    );
    let mut session = streaming(HALF);
    let transcript = play_text(&mut session, &lines);
    assert!(transcript.contains("300 * 361 beams"), "{transcript}");
    assert_eq!(
        (session.info().config.as_ref(), session.info().measuring_mode()),
        (None, None),
        "{transcript}"
    );
}
