//! MCAP files of ROS 2, and of ROS 1 messages, by the reader of our own recordings. A file that is cut off is
//! read as far as it goes.

use std::fs::File;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use biplane_recording::mcap::read::ChannelInfo;
use biplane_recording::{ReadError, Reader};

use super::channel::{Channel, Kind, RawMessage, Visit};
use super::losses::Losses;
use super::packed;
use crate::recordings::import::bag::error::BagError;

/// Visits the messages of a file.
pub(crate) fn read(
    file: &File,
    path: &Path,
    losses: &mut Losses,
    visit: &mut Visit<'_>,
) -> Result<(), BagError> {
    // The file may have no name any more.
    let name = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
    let reader = match Reader::open_unfinished(&name) {
        Ok(reader) => reader,
        Err(error) => {
            losses.add(path, &words(&error, &name));
            return Ok(());
        }
    };
    let mut last: Option<(Arc<ChannelInfo>, Channel)> = None;
    let mut buffer = Vec::new();
    for entry in reader.messages() {
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                losses.add(path, &format!("{}; what follows is lost", words(&error, &name)));
                return Ok(());
            }
        };
        let channel = match &last {
            Some((info, channel)) if Arc::ptr_eq(info, &entry.channel) => channel,
            _ => {
                let info = &entry.channel;
                let channel = Channel::ros2(&info.topic_name, &info.type_name, &info.message_encoding);
                &last.insert((Arc::clone(info), channel)).1
            }
        };
        let bytes = match channel.kind {
            Kind::Other => &[],
            _ => match packed::message(&entry.bytes, &mut buffer) {
                Ok(bytes) => bytes,
                Err(error) => {
                    losses.add(path, &format!("a message on {}: {error}", channel.topic));
                    continue;
                }
            },
        };
        let message = RawMessage { channel, received_ns: entry.log_time_ns, bytes };
        if visit(&message).is_break() {
            return Ok(());
        }
    }
    Ok(())
}

/// What is wrong, without the name that only this process knows.
fn words(error: &ReadError, name: &Path) -> String {
    error.to_string().replace(&format!("{}: ", name.display()), "").replace(&name.display().to_string(), "it")
}
