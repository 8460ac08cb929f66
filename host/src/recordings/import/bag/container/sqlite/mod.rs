//! ROS 2 bags in SQLite files, read without SQLite: two plain tables, walked row by row.
//!
//! The file format (sqlite.org/fileformat2) has not changed since 2004. A bag needs little of it: pages, the
//! leaves and inner pages of tables, rows that go on in overflow pages, and the log of a recorder that was
//! killed (`-wal`). The library itself in C would take longer to compile than all of this program's other C.

mod pages;
mod row;
mod schema;
mod table;
mod wal;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

pub(crate) use self::pages::MAGIC;
use self::pages::{Damage, Pages};
use self::row::Value;
use self::schema::{Table, table_named};
use self::table::rows;
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
    let failed = |source| BagError::Read { path: path.to_owned(), source };
    let not_a_bag = |found| BagError::NotABag { path: path.to_owned(), found };
    let pages = Pages::open(file, path).map_err(failed)?.map_err(not_a_bag)?;
    let topics = table_named(&pages, "topics").map_err(not_a_bag)?;
    let messages = table_named(&pages, "messages").map_err(not_a_bag)?;
    let mut lose = |what: Damage| losses.add(path, &what);
    let channels = channels(&pages, &topics, &mut lose);
    let mut nobodys = 0_u64;
    let place = |name| messages.column(name).ok_or_else(|| not_a_bag(format!("has no column {name}")));
    let (topic_id, timestamp, data) = (place("topic_id")?, place("timestamp")?, place("data")?);
    let mut buffer = Vec::new();
    let mut odd = None;
    rows(&pages, messages.root, &mut lose, &mut |row| {
        let (Some(Value::Integer(topic)), Some(Value::Integer(received_ns)), Some(Value::Bytes(bytes))) =
            (row.value(topic_id), row.value(timestamp), row.value(data))
        else {
            nobodys += 1;
            return std::ops::ControlFlow::Continue(());
        };
        let Some(channel) = channels.get(&topic) else {
            nobodys += 1;
            return std::ops::ControlFlow::Continue(());
        };
        let bytes = match channel.kind {
            Kind::Other => &[],
            _ => match packed::message(bytes, &mut buffer) {
                Ok(bytes) => bytes,
                Err(error) => {
                    odd.get_or_insert_with(|| format!("a message on {}: {error}", channel.topic));
                    return std::ops::ControlFlow::Continue(());
                }
            },
        };
        visit(&RawMessage { channel, received_ns, bytes })
    });
    if nobodys > 0 {
        lose(format!("{nobodys} messages without time, data or a topic that is defined"));
    }
    if let Some(what) = odd {
        lose(what);
    }
    Ok(())
}

fn channels(pages: &Pages<'_>, topics: &Table, lose: &mut dyn FnMut(Damage)) -> BTreeMap<i64, Channel> {
    let place = |name| topics.column(name);
    let columns = [place("id"), place("name"), place("type"), place("serialization_format")];
    let mut channels = BTreeMap::new();
    rows(pages, topics.root, lose, &mut |row| {
        let [id, name, type_name, format] = columns;
        // An `INTEGER PRIMARY KEY` is kept as the row's number.
        let id = match id.and_then(|place| row.value(place)) {
            Some(Value::Integer(id)) => id,
            _ => row.number,
        };
        let text = |place: Option<usize>| match place.and_then(|place| row.value(place)) {
            Some(Value::Bytes(bytes)) => String::from_utf8_lossy(bytes).into_owned(),
            _ => String::new(),
        };
        channels.insert(id, Channel::ros2(&text(name), &text(type_name), &text(format)));
        std::ops::ControlFlow::Continue(())
    });
    channels
}
