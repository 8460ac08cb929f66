//! Tables as text: comma-separated values with a header, no quotes, as our own programs write them.

use std::io::{self, BufRead};

/// What is wrong with a table.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TableError {
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A column is missing.
    #[error("there is no column \"{wanted}\" in it; its first line is \"{header}\"")]
    NoColumn {
        /// The column.
        wanted: &'static str,
        /// The first line, shortened.
        header: String,
    },
    /// A line has more or fewer fields than the header.
    #[error("line {line}: {found} fields, the header has {expected}")]
    Fields {
        /// Line number from 1.
        line: usize,
        /// Fields of the line.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field is no number.
    #[error("line {line}: expected a number for \"{column}\", found \"{found}\"")]
    Number {
        /// Line number from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// The field.
        found: String,
    },
    /// Only a header.
    #[error("there is no row in it")]
    Empty,
}

/// A table: rows of fields under a header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Table {
    header: String,
    rows: Vec<Vec<String>>,
}

fn fields(line: &str) -> Vec<String> {
    line.split(',').map(|field| field.trim().to_owned()).collect()
}

impl Table {
    /// Reads a table.
    ///
    /// # Errors
    /// When a line has another number of fields than the header, or there is no row.
    pub(crate) fn read(input: impl BufRead) -> Result<Self, TableError> {
        let mut lines = input.lines();
        let header = lines.next().transpose()?.unwrap_or_default();
        let expected = fields(&header).len();
        let mut rows = Vec::new();
        for (index, line) in lines.enumerate() {
            let row = fields(&line?);
            if row.len() != expected {
                return Err(TableError::Fields { line: index + 2, found: row.len(), expected });
            }
            rows.push(row);
        }
        if rows.is_empty() { Err(TableError::Empty) } else { Ok(Self { header, rows }) }
    }

    /// A column's fields.
    ///
    /// # Errors
    /// When there is none of this name.
    pub(crate) fn texts(&self, column: &'static str) -> Result<Vec<&str>, TableError> {
        let index = fields(&self.header).iter().position(|name| name == column).ok_or_else(|| {
            TableError::NoColumn { wanted: column, header: self.header.chars().take(120).collect() }
        })?;
        Ok(self.rows.iter().map(|row| row[index].as_str()).collect())
    }

    /// A column's numbers; `nan` and `inf` are numbers, too.
    ///
    /// # Errors
    /// When there is no column of this name, or a field in it is no number.
    pub(crate) fn numbers(&self, column: &'static str) -> Result<Vec<f64>, TableError> {
        let number = |(index, text): (usize, &str)| {
            text.parse().map_err(|_| TableError::Number { line: index + 2, column, found: text.to_owned() })
        };
        self.texts(column)?.into_iter().enumerate().map(number).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Table;

    #[test]
    fn columns_are_found_by_name_and_what_is_wrong_is_named() {
        let table = Table::read(&b"name, x_m\nmap,1.5\ngradient,inf\n"[..]).unwrap();
        assert_eq!(table.texts("name").unwrap(), ["map", "gradient"]);
        assert_eq!(table.numbers("x_m").unwrap(), [1.5, f64::INFINITY]);
        let number = table.numbers("name").unwrap_err().to_string();
        assert_eq!(number, "line 2: expected a number for \"name\", found \"map\"");
        let missing = table.numbers("y_m").unwrap_err().to_string();
        assert_eq!(missing, "there is no column \"y_m\" in it; its first line is \"name, x_m\"");
        let ragged = Table::read(&b"a,b\n1,2\n3\n"[..]).unwrap_err().to_string();
        assert_eq!(ragged, "line 3: 1 fields, the header has 2");
        assert_eq!(Table::read(&b"a,b\n"[..]).unwrap_err().to_string(), "there is no row in it");
        assert!(Table::read(&b""[..]).is_err());
    }
}
