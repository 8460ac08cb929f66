//! Where a table begins and which columns it has: the file's own list of tables, on its first page.

use std::ops::ControlFlow;

use super::pages::{Damage, Pages};
use super::row::Value;
use super::table::rows;

/// A table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Table {
    /// The page it begins on.
    pub root: u32,
    columns: Vec<String>,
}

impl Table {
    /// The place of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }
}

/// The table of that name. The error says what the file is instead.
pub(crate) fn table_named(pages: &Pages<'_>, name: &str) -> Result<Table, Damage> {
    let (mut found, mut names, mut damage) = (None, Vec::new(), None);
    let mut lose = |what: Damage| damage = Some(what);
    rows(pages, 1, &mut lose, &mut |row| {
        let text = |column| match row.value(column) {
            Some(Value::Bytes(bytes)) => String::from_utf8_lossy(bytes).into_owned(),
            _ => String::new(),
        };
        let (kind, table, sql) = (text(0), text(1), text(4));
        if kind != "table" {
            return ControlFlow::Continue(());
        }
        if let (true, Some(Value::Integer(root))) = (table == name, row.value(3)) {
            let root = u32::try_from(root).unwrap_or_default();
            found = Some(Table { root, columns: columns(&sql) });
        }
        names.push(table);
        ControlFlow::Continue(())
    });
    found.ok_or_else(|| match damage {
        Some(damage) => format!("is a SQLite file whose tables cannot be read: {damage}"),
        None => format!("is a SQLite file without a table `{name}` (it has {})", names.join(", ")),
    })
}

/// The columns' names in `CREATE TABLE name(id INTEGER PRIMARY KEY, name TEXT, ...)`.
fn columns(sql: &str) -> Vec<String> {
    let inside = sql.split_once('(').map_or("", |(_, rest)| rest);
    let mut depth = 0_i32;
    let parts = inside.split(|c: char| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        c == ',' && depth == 0
    });
    let name = |part: &str| {
        let word = part.split_whitespace().next().unwrap_or_default();
        word.trim_matches(['"', '`', '[', ']', '\'']).to_owned()
    };
    parts.map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::columns;

    #[test]
    fn columns_are_the_first_words_between_the_commas() {
        let sql = "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL, \
            \"timestamp\" NUMERIC(10,5) NOT NULL, data BLOB NOT NULL)";
        assert_eq!(columns(sql), ["id", "topic_id", "timestamp", "data"]);
        assert_eq!(columns(""), [""]);
    }
}
