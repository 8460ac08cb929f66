//! Reading what the laser is and how it is set, and setting its field of view.

use biplane_wire::lms::Request;

use crate::session::event::{Event, Step};
use crate::session::lms::device::{Device, Goal};
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::timing::retry::Patience;

/// Most answers take 80 to 110 ms and their transfer.
const READ: Patience = Patience::new(250, 3).acknowledged(600);
const VARIANT: Patience = Patience::new(300, 3).acknowledged(3000);
/// Bytes of a status report, the longest of these answers.
const REPLY_BYTES: usize = 160;
/// The one variant of an S14: field of view, degrees, and step, hundredths of a degree.
const S14_VARIANT: (u16, u16) = (90, 50);

/// A question that is answered by one of these reports.
pub(crate) fn read(talk: &mut Dialogue, state: State, step: Step, request: Request) -> Next {
    let patience = READ.longer_by(talk.transfer_ns(REPLY_BYTES));
    talk.ask(state, step, request, patience)
}

/// What was read of the device before may be that of another one: until it is read anew, nothing is known.
pub(crate) fn read_configuration(talk: &mut Dialogue, device: &mut Device) -> Next {
    device.info.config = None;
    device.info.status_data = None;
    read(talk, State::ReadConfiguration, Step::ReadConfiguration, Request::ReadConfig)
}

pub(crate) fn read_status(talk: &mut Dialogue, device: &mut Device) -> Next {
    device.info.variant = None;
    read(talk, State::ReadStatus, Step::ReadStatus, Request::Status)
}

pub(crate) fn read_faults(talk: &mut Dialogue, device: &mut Device) -> Next {
    device.info.faults = None;
    read(talk, State::ReadFaults, Step::ReadFaults, Request::Errors)
}

/// Says faults where there are some, and again only when they have changed.
fn say_faults(talk: &mut Dialogue, device: &mut Device) {
    let faults = device.info.faults.unwrap_or_default();
    if faults.count > 0 && faults != talk.event_dedup.faults {
        talk.say(Event::Faults(faults));
    }
    talk.event_dedup.faults = faults;
    device.health.faults = faults;
    // Where the list says which, that says more.
    let has_fault = device.info.has_fault == Some(true) && faults.count == 0;
    if has_fault && !talk.event_dedup.has_fault {
        talk.say(Event::HasFault);
    }
    talk.event_dedup.has_fault = has_fault;
}

/// All is read: a probe ends here. Otherwise the configuration is written when it differs, then the variant
/// set.
pub(crate) fn all_read(talk: &mut Dialogue, device: &mut Device) -> Next {
    say_faults(talk, device);
    if device.is_s14() {
        // Whatever its status report says: it has but one.
        device.info.variant = Some(S14_VARIANT);
    }
    match device.goal {
        Goal::Probe => Next::Done,
        Goal::Stream => Next::Write,
    }
}

/// An S14 has but one variant, and no command for it.
pub(crate) fn set_variant(talk: &mut Dialogue, device: &Device) -> Next {
    let wanted = device.wanted_variant();
    let has_choice = !device.is_s14() && wanted.0 != S14_VARIANT.0;
    if device.info.variant == Some(wanted) {
        talk.event_dedup.variant = None;
        Next::StartStream
    } else if has_choice {
        let request = Request::Variant { angle_deg: wanted.0, resolution_cdeg: wanted.1 };
        talk.ask(State::SetVariant, Step::SetVariant, request, VARIANT)
    } else {
        keep_variant(talk, device)
    }
}

/// The device says which variant it has now, and whether it took the one that it was asked for.
pub(crate) fn variant_answered(talk: &mut Dialogue, device: &Device, taken: Option<(u16, u16)>) -> Next {
    if taken == Some(device.wanted_variant()) {
        talk.event_dedup.variant = None;
        Next::StartStream
    } else {
        Next::Refused
    }
}

/// Goes on with the variant as it is.
pub(crate) fn keep_variant(talk: &mut Dialogue, device: &Device) -> Next {
    if let Some((fov_deg, resolution_cdeg)) = device.info.variant
        && talk.event_dedup.variant != device.info.variant
    {
        talk.event_dedup.variant = device.info.variant;
        talk.say(Event::VariantKept { fov_deg, resolution_cdeg });
    }
    Next::StartStream
}
