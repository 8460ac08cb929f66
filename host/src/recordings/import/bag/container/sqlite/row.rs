//! A row of an SQLite table: its number, and values each of its own type.

/// The value of a column.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Value<'a> {
    Null,
    Integer(i64),
    Real(f64),
    /// A text or a blob.
    Bytes(&'a [u8]),
}

/// A row.
#[derive(Debug)]
pub(crate) struct Row<'a> {
    /// Its number in the table.
    pub number: i64,
    /// The types of its columns, then their bytes.
    pub payload: &'a [u8],
}

impl<'a> Row<'a> {
    /// The value of a column, counted from 0; `None` where the row has no such column or is damaged.
    pub(crate) fn value(&self, column: usize) -> Option<Value<'a>> {
        let (header_size, rest) = varint(self.payload)?;
        let header_size = usize::try_from(header_size).ok()?;
        let mut types = self.payload.get(self.payload.len() - rest.len()..header_size)?;
        let mut data = self.payload.get(header_size..)?;
        for _ in 0..column {
            let (kind, rest) = varint(types)?;
            types = rest;
            data = value_of(kind, data)?.1;
        }
        let (kind, _) = varint(types)?;
        Some(value_of(kind, data)?.0)
    }
}

/// A value and what follows it.
fn value_of(kind: u64, data: &[u8]) -> Option<(Value<'_>, &[u8])> {
    let size = match kind {
        0 | 8 | 9 => 0,
        1..=4 => kind as usize,
        5 => 6,
        6 | 7 => 8,
        10 | 11 => return None,
        long => usize::try_from((long - 12) / 2).ok()?,
    };
    let (bytes, rest) = data.split_at_checked(size)?;
    let integer = || {
        let sign = if bytes.first().is_some_and(|first| first & 0x80 != 0) { -1 } else { 0 };
        bytes.iter().fold(sign, |value: i64, &byte| value << 8 | i64::from(byte))
    };
    let value = match kind {
        0 => Value::Null,
        8 | 9 => Value::Integer(kind as i64 - 8),
        1..=6 => Value::Integer(integer()),
        7 => Value::Real(f64::from_bits(integer() as u64)),
        _ => Value::Bytes(bytes),
    };
    Some((value, rest))
}

/// A number of one to nine bytes, seven bits a byte, the highest first; and what follows it.
pub(crate) fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut value = 0;
    for (place, &byte) in bytes.iter().enumerate().take(8) {
        value = value << 7 | u64::from(byte & 0x7F);
        if byte & 0x80 == 0 {
            return Some((value, &bytes[place + 1..]));
        }
    }
    let last = bytes.get(8)?;
    Some((value << 8 | u64::from(*last), &bytes[9..]))
}

#[cfg(test)]
mod tests {
    use super::{Row, Value, varint};

    #[test]
    fn values_are_those_of_a_row_worked_out_by_hand() {
        // Header of 7 bytes: null, 1-byte integer, 6-byte integer, the constant 1, text of 2, blob of 3.
        let payload = [7, 0, 1, 5, 9, 17, 18, 0xFE, 0, 0, 0, 1, 0, 2, b'o', b'k', 7, 8, 9];
        let row = Row { number: 1, payload: &payload };
        let found: Vec<Option<Value>> = (0..7).map(|column| row.value(column)).collect();
        let expected = [
            Some(Value::Null),
            Some(Value::Integer(-2)),
            Some(Value::Integer(0x1_0002)),
            Some(Value::Integer(1)),
            Some(Value::Bytes(b"ok")),
            Some(Value::Bytes(&[7, 8, 9])),
            None,
        ];
        assert_eq!(found, expected);
        for end in 0..payload.len() {
            let row = Row { number: 1, payload: &payload[..end] };
            assert_eq!(row.value(5), None, "{end}");
        }
    }

    #[test]
    fn numbers_take_up_to_nine_bytes() {
        assert_eq!(varint(&[0x7F, 9]), Some((127, &[9][..])));
        assert_eq!(varint(&[0x81, 0x00]), Some((128, &[][..])));
        assert_eq!(varint(&[0xFF; 9]), Some((u64::MAX, &[][..])));
        assert_eq!(varint(&[0xFF; 8]), None);
        assert_eq!(varint(&[]), None);
    }
}
