//! Fans measured ahead of time, on a thread of their own: casting their rays takes milliseconds, in which a
//! port's thread could not send.
//!
//! The next fan is expected as far behind the last as that was behind the one before. A wrong guess costs
//! time, never a wrong scan: a source's ranges depend on what is asked alone.

use crate::rig::fan::{Fan, FanSource};
use std::sync::mpsc::channel;

/// The same source, behind a thread that measures the fan that will probably be asked for next. The thread
/// ends with the source.
///
/// # Errors
/// When the system gives no thread.
pub(super) fn ahead(mut source: FanSource) -> std::io::Result<FanSource> {
    let (asks, asked) = channel::<Fan>();
    let (answer, answers) = channel();
    std::thread::Builder::new().spawn(move || {
        for fan in asked {
            if answer.send(source(&fan)).is_err() {
                break;
            }
        }
    })?;
    let (mut pending, mut last): (Option<Fan>, Option<Fan>) = (None, None);
    Ok(Box::new(move |fan| {
        if pending.take_if(|pending| pending != fan).is_some() {
            let _ = answers.recv();
        }
        if pending.is_none() {
            let _ = asks.send(*fan);
        }
        // A thread that is gone has nothing to say.
        let words = answers.recv().unwrap_or_default();
        pending = last
            .map(|last| fan.first_beam_ns - last.first_beam_ns)
            .filter(|step_ns| *step_ns > 0)
            .map(|step_ns| fan.later(step_ns))
            .filter(|next| asks.send(*next).is_ok());
        last = Some(*fan);
        words
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fan_is_the_one_that_was_asked_for_whatever_was_guessed() {
        let echo = |fan: &Fan| vec![fan.first_beam_ns as u16, fan.count];
        let mut source = ahead(Box::new(echo)).unwrap();
        let fan = Fan { first_beam_ns: 0, beam_ns: 1.5, first_rad: -1.0, step_rad: 0.1, count: 3 };
        for (at_ns, count) in [(10, 3), (20, 3), (30, 3), (35, 3), (40, 4), (5, 4), (15, 4), (25, 4)] {
            let asked = Fan { count, ..fan.later(at_ns) };
            assert_eq!(source(&asked), echo(&asked));
        }
    }
}
