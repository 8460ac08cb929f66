//! What is asked of which device, and bytes of chance. Sessions against mock devices stand in the tests of
//! the crate.

use biplane_recording::Rig;
use biplane_wire::scip::{Delivery, Parameters};

use crate::session::device_session::{Input, Output, Session};
use crate::session::scip::ScipSession;
use crate::session::scip::settings::ScipSettings;
use crate::session::testing::noise::{Noise, endure};

const UTM: Parameters = Parameters {
    min_mm: 23,
    max_mm: 60_000,
    steps_per_turn: 1440,
    first_step: 0,
    last_step: 1080,
    front_step: 540,
    rpm: 2400,
};
const URG: Parameters = Parameters {
    min_mm: 20,
    max_mm: 5_600,
    steps_per_turn: 1024,
    first_step: 44,
    last_step: 725,
    front_step: 384,
    rpm: 600,
};

fn settings() -> ScipSettings {
    ScipSettings::from(&Rig::default().horizontal.scip_at_address("192.168.0.10:10940"))
}

#[test]
fn the_rig_is_asked_for_in_the_devices_own_steps() {
    let all = settings().request(&UTM).unwrap();
    assert_eq!((all.first_step, all.last_step, all.cluster, all.values()), (0, 1080, 1, 1081));
    let asked = ScipSettings {
        fov_deg: Some(180.0),
        resolution_deg: Some(0.5),
        scan_hz: Some(20.0),
        remission: Some(true),
        ..settings()
    };
    let request = asked.request(&UTM).unwrap();
    assert_eq!((request.first_step, request.last_step, request.cluster), (180, 900, 2));
    assert_eq!((request.values(), request.with_intensity), (361, true));
    assert_eq!(request.delivery, Delivery::Stream { skip: 1, count: 0 });
}

#[test]
fn what_a_device_does_not_offer_is_refused_with_the_list_of_what_it_does() {
    let offers =
        "up to 239.1 degrees, in steps of 0.3516 or a multiple, 10.0 Hz divided by 1 to 10, no remission";
    for asked in [
        ScipSettings { fov_deg: Some(270.0), ..settings() },
        ScipSettings { resolution_deg: Some(0.25), ..settings() },
        ScipSettings { resolution_deg: Some(0.5), ..settings() },
        ScipSettings { scan_hz: Some(40.0), ..settings() },
        ScipSettings { scan_hz: Some(4.0), ..settings() },
        ScipSettings { remission: Some(true), ..settings() },
    ] {
        assert_eq!(asked.request(&URG).unwrap_err().to_string(), offers, "{asked:?}");
    }
    let asked = ScipSettings { fov_deg: Some(270.0), resolution_deg: Some(0.75), ..settings() };
    assert!(asked.request(&UTM).is_ok());
}

#[test]
fn a_recording_that_begins_behind_the_answers_is_read_by_the_steps_of_its_scans() {
    let mut session = ScipSession::listening(settings(), 0);
    let ramp = "MD0000002401000\n99b\n4SAF>\n0?X0@=0@b0AG0Al0BQ0C60C[0D@0De0EJ0Eo0FT0G90G^0HC0Hh0IM0J20JW0K<0I\n\
                Ka0LF0Lk0MPR\n\n";
    session.handle(0, Input::Bytes(ramp.as_bytes()));
    let mut events = Vec::new();
    let mut scans = 0;
    loop {
        match session.poll() {
            Output::WaitUntil(_) => break,
            Output::Event(event) => events.push(event.to_string()),
            Output::TimedScan => scans += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(session.counts().frames, 1);
    assert_eq!(scans, 1, "{events:?}");
    assert!(events[0].contains("geometry assumed"), "{events:?}");
}

#[test]
fn no_bytes_of_chance_end_a_session() {
    let mut noise = Noise::new(5);
    let serial = ScipSettings { baud: Some(115_200), ..settings() };
    for settings in [settings(), serial] {
        let mut session = ScipSession::streaming(settings, 0);
        endure(&mut session, &mut noise, 3000, 300_000_000, |noise| {
            let replies: [&[u8]; 6] = [
                b"QT\n00P\n\n",
                b"QT\n0Ee\n\n",
                b"QT\nE\n\n",
                b"VV\n00P\n\n",
                b"PP\n00P\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\nAMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n",
                b"MD0044072501000\n00P\n\n",
            ];
            let mut bytes = replies[noise.below(6)].to_vec();
            bytes.extend((0..noise.below(60)).map(|_| noise.byte()));
            bytes
        });
        assert_eq!(session.overflowed(), 0);
    }
}
