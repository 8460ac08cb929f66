//! Finding the rate, losing the device, finding it again.

use super::*;

#[test]
fn a_device_at_its_power_on_rate_is_found_and_taken_to_the_configured_one() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n150 {STOP}\n300 = 9600\n300 {STOP}\n380 {MODE_DONE}\n380 {ASK_TYPE}\n\
         400 {TYPE}\n400 ! is a LMS291;S05;X01.27\n400 ! answers at 9600 Bd\n400 > 02 00 02 00 20 40 50 08\n\
         480 < 06\n480 {MODE_DONE}\n480 = 38400\n580 {ASK_TYPE}\n600 {TYPE}\n600 ! runs at 38400 Bd\n\
         600 {ASK_CONFIG}\n610 {CONFIG}\n610 {ASK_STATUS}\n620 {STATUS}\n620 {ASK_FAULTS}\n630 {NO_FAULTS}\n\
         630 {STREAM}\n640 {MODE_DONE}\n640 ! streams\n1000 end"
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_device_left_streaming_is_stopped_and_its_answer_found_behind_the_cut_scan() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n3 < stump150\n30 {MODE_DONE}\n70 {ASK_TYPE}\n{}\n200 end",
        settings_read(140)
    );
    check(&mut streaming(HALF), &script);
    let later = format!("0 = 38400\n0 {STOP}\n3 < stump150\n80 {MODE_DONE}\n80 {ASK_TYPE}\n81 end");
    check(&mut streaming(HALF), &later);
}

#[test]
fn a_silent_device_is_looked_for_at_every_rate_again_and_again_and_that_is_said_once() {
    let mut script = String::new();
    for (at, baud) in [(0, 38400), (300, 9600), (600, 500_000), (900, 19200)] {
        script += &format!("{at} = {baud}\n{at} {STOP}\n{} {STOP}\n", at + 150);
    }
    script += "1200 ! no answer yet, asking on (is it switched on and connected?)\n";
    // Not said again.
    let round = [38400, 9600, 500_000, 38400, 9600, 19200];
    for (index, baud) in round.into_iter().cycle().take(18).enumerate() {
        let at = 1200 + 200 * index;
        script += &format!("{at} = {baud}\n{at} {STOP}\n");
    }
    script += "4799 end";
    check(&mut streaming(HALF), &script);
}

#[test]
fn the_rate_of_a_lost_laser_and_that_of_power_on_are_asked_often_and_its_absence_said_once() {
    let mut script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         1100 ! silent for 900 ms, starting again\n",
        settings_read(90)
    );
    let round = [38400, 9600, 500_000, 38400, 9600, 19200];
    for (index, baud) in round.iter().cycle().take(18).enumerate() {
        let at = 1100 + 200 * index;
        if index == 6 {
            script += &format!("{at} ! no answer yet, asking on (is it switched on and connected?)\n");
        }
        script += &format!("{at} = {baud}\n{at} {STOP}\n");
    }
    script += "4699 end";
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_silent_line_that_turns_noisy_is_a_device_switched_on_and_asked_at_its_rate_at_once() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         1100 ! silent for 900 ms, starting again\n1100 = 38400\n1100 {STOP}\n1300 = 9600\n1300 {STOP}\n\
         1500 = 500000\n1500 {STOP}\n1510 < noise29\n1570 = 9600\n1570 {STOP}\n1650 < 06\n1660 {MODE_DONE}\n\
         1660 {ASK_TYPE}\n1700 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn noise_that_goes_on_after_the_stop_request_is_a_device_at_another_rate() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n100 < noise30\n150 = 9600\n150 {STOP}\n250 < noise30\n300 = 500000\n300 {STOP}\n\
         304 < 06\n380 {MODE_DONE}\n380 {ASK_TYPE}\n400 end"
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_change_of_mode_that_is_acknowledged_has_three_seconds() {
    let script = format!("0 = 38400\n0 {STOP}\n10 < 06\n3000 {MODE_DONE}\n3000 {ASK_TYPE}\n3010 end");
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_power_cycle_is_seen_as_garbage_then_the_device_is_found_at_its_power_on_rate() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n700 < noise20\n\
         1080 ! no intact telegram for 950 ms, starting again\n1080 = 38400\n1080 {STOP}\n\
         1280 = 9600\n1280 {STOP}\n1410 {MODE_DONE}\n1410 {ASK_TYPE}\n1430 {TYPE}\n1430 ! answers at 9600 Bd\n\
         1430 > 02 00 02 00 20 40 50 08\n1440 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_power_on_telegram_while_streaming_starts_again_at_once() {
    let settings = LaserSettings { baud: 9600, ..HALF };
    let power_on = "< 02 80 17 00 90 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 31 30 20 10 63 5E";
    let mut session = streaming(settings);
    let script = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n115 {NO_FAULTS}\n120 {MODE_DONE}\n500 {power_on}\n501 end"
    );
    let lines: Vec<String> = script.lines().map(str::to_owned).collect();
    let transcript = play(&mut session, &lines).join("\n");
    let tail = format!("500 ! was switched on or reset, starting again\n500 = 9600\n500 {STOP}\n501 end");
    assert!(transcript.ends_with(&tail), "{transcript}");
}

#[test]
fn a_refused_acknowledge_is_answered_by_the_same_question_after_a_pause() {
    let script = format!("0 = 38400\n0 {STOP}\n10 < 15\n70 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n81 end");
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_rate_that_the_port_does_not_have_is_said_once_and_left_out() {
    let mut script = format!(
        "0 = 38400\n0 {STOP}\n150 {STOP}\n300 = 9600\n300 {STOP}\n450 {STOP}\n600 = 500000\n600 {STOP}\n\
         601 lacks 500000\n601 ! its port does not run at 500000 Bd, which is left out\n\
         601 = 19200\n601 {STOP}\n751 {STOP}\n901 ! no answer yet, asking on (is it switched on and connected?)\n"
    );
    for (index, baud) in [38400, 9600, 38400, 9600, 19200].into_iter().cycle().take(10).enumerate() {
        let at = 901 + 200 * index;
        script += &format!("{at} = {baud}\n{at} {STOP}\n");
    }
    script += "2899 end";
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_laser_is_not_taken_to_a_rate_that_the_port_does_not_have() {
    let settings = LaserSettings { baud: 500_000, ..HALF };
    let script = format!(
        "0 = 500000\n0 {STOP}\n1 lacks 500000\n1 ! its port does not run at 500000 Bd, which is left out\n\
         1 = 9600\n1 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n100 {TYPE}\n100 ! is a LMS291;S05;X01.27\n\
         100 ! answers at 9600 Bd\n100 ! does not change to 500000 Bd, stays at 9600 Bd\n100 {ASK_CONFIG}\n101 end"
    );
    check(&mut streaming(settings), &script);
}

#[test]
fn a_laser_that_streams_on_behind_a_port_that_comes_back_is_left_alone() {
    let up = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         250 < stump100\n260 gone\n5000 back\n5000 = 38400\n",
        settings_read(90)
    );
    let on = "5300 < stump150\n5500 < scan361\n5500 * 361 beams\n6300 < scan361\n6300 * 361 beams\n6301 end";
    check(&mut streaming(HALF), &format!("{up}{on}"));
    // Without power it would be silent: a third of a second tells.
    let off = format!("5350 ! silent for 5100 ms, starting again\n5350 = 38400\n5350 {STOP}\n5351 end");
    check(&mut streaming(HALF), &format!("{up}{off}"));
}

#[test]
fn a_port_that_comes_back_while_a_laser_is_looked_for_is_asked_for_its_rates_anew() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n150 {STOP}\n300 = 9600\n300 {STOP}\n450 {STOP}\n600 = 500000\n600 {STOP}\n\
         601 lacks 500000\n601 ! its port does not run at 500000 Bd, which is left out\n601 = 19200\n601 {STOP}\n\
         610 gone\n9000 back\n9000 = 38400\n9000 = 19200\n9000 = 38400\n9000 {STOP}\n9150 {STOP}\n\
         9300 = 9600\n9300 {STOP}\n9450 {STOP}\n9600 = 500000\n9600 {STOP}\n9601 end"
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_rate_that_the_device_refuses_is_asked_for_once_and_that_is_said_once() {
    let asked = format!(
        "0 = 38400\n0 {STOP}\n150 {STOP}\n300 = 9600\n300 {STOP}\n380 {MODE_DONE}\n380 {ASK_TYPE}\n\
         400 {TYPE}\n400 ! is a LMS291;S05;X01.27\n400 ! answers at 9600 Bd\n400 > 02 00 02 00 20 40 50 08\n480 < 06\n"
    );
    // As a command that it does not know, and as one that it knows and does not carry out.
    for refused in ["< 02 80 02 00 92 10 7F 33", "< 02 80 03 00 A0 01 10 14 0B"] {
        let script = format!(
            "{asked}490 {refused}\n490 ! does not change to 38400 Bd, stays at 9600 Bd\n490 {ASK_CONFIG}\n\
             500 {CONFIG}\n500 {ASK_STATUS}\n501 end"
        );
        check(&mut streaming(HALF), &script);
    }
}
