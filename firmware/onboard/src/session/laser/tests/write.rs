//! Writing the configuration: once, only what differs, read back.

use biplane_wire::lms::{Config, Reply, Status, Unit};

use super::*;

/// The configuration as read, but for byte 6: millimetres (checksum by hand).
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
    let mut bytes = [0; 64];
    let length = reply.emit(0x80, Status::OK, &mut bytes).expect("it fits");
    let words: Vec<String> = bytes[..length].iter().map(|byte| format!("{byte:02X}")).collect();
    format!("< {}", words.join(" "))
}

/// From the start to the moment when the configuration may be written, at 120 ms.
fn until_compared() -> String {
    format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n90 {ASK_CONFIG}\n100 {CONFIG}\n100 {ASK_STATUS}\n110 {STATUS}\n110 {ASK_FAULTS}\n\
         120 {NO_FAULTS}"
    )
}

const MM: LaserSettings = LaserSettings { unit: Unit::Mm, ..HALF };

#[test]
fn other_units_are_written_once_in_installation_mode_and_read_back() {
    let script = format!(
        "{}\n120 {INSTALL}\n200 {MODE_DONE}\n200 {WRITE_MM}\n210 < 06\n600 {}\n600 {STOP}\n680 {MODE_DONE}\n\
         680 {ASK_CONFIG}\n770 {}\n770 ! configuration written: units mm instead of cm\n770 {STREAM}\n\
         850 {MODE_DONE}\n850 ! streams\n900 end",
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
    let kept = "! does not take what the rig asks: units mm instead of cm";
    for answer in [config_reply(Unit::Cm, Some(true)), config_reply(Unit::Cm, Some(false))] {
        let lines = format!(
            "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n200 {MODE_DONE}\n210 < 06\n\
             600 {answer}\n680 {MODE_DONE}\n770 {CONFIG}\n850 {MODE_DONE}\n900 < scan361\n2000 {MODE_DONE}\n\
             2010 {TYPE}\n2020 {CONFIG}\n2030 {STATUS}\n2040 {NO_FAULTS}\n2050 {MODE_DONE}\n2100 < scan361\n2101 end"
        );
        let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
        let mut session = streaming(MM);
        let transcript = play(&mut session, &lines).join("\n");
        assert_eq!(transcript.matches("> 02 00 23 00 77").count(), 1, "{transcript}");
        assert_eq!(transcript.matches(kept).count(), 1, "{transcript}");
        assert_eq!(transcript.matches("! streams").count(), 2, "{transcript}");
        // Centimetres where millimetres were asked for: the telegram says what it is in.
        assert_eq!(transcript.matches("* 361 beams").count(), 2, "{transcript}");
        assert!(session.health().differs);
    }
}

#[test]
fn a_write_that_was_acknowledged_is_waited_for_and_never_sent_twice() {
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n200 {MODE_DONE}\n210 < 06\n15199 end"
    );
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    let mut session = streaming(MM);
    let transcript = play(&mut session, &lines).join("\n");
    assert!(transcript.ends_with(&format!("200 {WRITE_MM}\n210 < 06\n15199 end")), "{transcript}");
    let after = play(&mut session, &["15201 end".to_owned()]).join("\n");
    assert_eq!(after, format!("15200 ! gave up writing the configuration\n15200 {STOP}\n15201 end"));
}

#[test]
fn a_write_that_was_not_heard_is_sent_once_more() {
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n200 {MODE_DONE}\n9000 end"
    );
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    let transcript = play(&mut streaming(MM), &lines).join("\n");
    assert_eq!(transcript.matches("> 02 00 23 00 77").count(), 2, "{transcript}");
}
