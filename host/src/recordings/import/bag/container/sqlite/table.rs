//! All rows of a table: a tree of pages, walked from its root to its leaves.

use std::ops::ControlFlow;

use super::pages::{Damage, HEADER_SIZE, Pages};
use super::row::{Row, varint};
use crate::recordings::import::bag::container::channel::LONGEST_MESSAGE;

const INNER: u8 = 5;
const LEAF: u8 = 13;
/// A tree of pages with two children each would be deeper than this only with more pages than there are.
const DEEPEST: usize = 40;

/// Visits the rows below a page in the order of their numbers, until `visit` wants no more. What cannot be
/// read goes to `lose`.
pub(crate) fn rows(
    pages: &Pages<'_>,
    root: u32,
    lose: &mut dyn FnMut(Damage),
    visit: &mut dyn FnMut(&Row<'_>) -> ControlFlow<()>,
) {
    let mut walk = Walk { pages, lose, visit, visited: 0, payload: Vec::new() };
    let _ = walk.page(root, 0);
}

struct Walk<'a, 'b> {
    pages: &'a Pages<'b>,
    lose: &'a mut dyn FnMut(Damage),
    visit: &'a mut dyn FnMut(&Row<'_>) -> ControlFlow<()>,
    /// Pages seen so far: more than there are means a circle.
    visited: u32,
    payload: Vec<u8>,
}

impl Walk<'_, '_> {
    fn page(&mut self, number: u32, depth: usize) -> ControlFlow<()> {
        self.visited = self.visited.saturating_add(1);
        if depth > DEEPEST || self.visited > self.pages.count {
            (self.lose)(format!("the tree of pages is a circle at page {number}"));
            return ControlFlow::Break(());
        }
        let page = match self.pages.page(number) {
            Ok(page) => page,
            Err(damage) => {
                (self.lose)(format!("rows are lost: {damage}"));
                return ControlFlow::Continue(());
            }
        };
        let head = if number == 1 { HEADER_SIZE } else { 0 };
        match page.get(head) {
            Some(&INNER) => self.inner(&page, head, depth),
            Some(&LEAF) => self.leaf(number, &page, head),
            kind => {
                (self.lose)(format!("rows are lost: page {number} is of kind {kind:?}, expected a table's"));
                ControlFlow::Continue(())
            }
        }
    }

    fn inner(&mut self, page: &[u8], head: usize, depth: usize) -> ControlFlow<()> {
        for place in cells(page, head, 12) {
            let child = page.get(place..place + 4).and_then(|four| four.try_into().ok());
            self.page(child.map_or(0, u32::from_be_bytes), depth + 1)?;
        }
        let last = page.get(head + 8..head + 12).and_then(|four| four.try_into().ok());
        self.page(last.map_or(0, u32::from_be_bytes), depth + 1)
    }

    fn leaf(&mut self, number: u32, page: &[u8], head: usize) -> ControlFlow<()> {
        for place in cells(page, head, 8) {
            let mut payload = std::mem::take(&mut self.payload);
            let read = self.cell(page.get(place..).unwrap_or_default(), &mut payload);
            let flow = match read {
                Ok(row) => (self.visit)(&Row { number: row, payload: &payload }),
                Err(damage) => {
                    (self.lose)(format!("a row of page {number} is lost: {damage}"));
                    ControlFlow::Continue(())
                }
            };
            self.payload = payload;
            flow?;
        }
        ControlFlow::Continue(())
    }

    /// The number of the row in a cell; its bytes, also those in other pages, go to `payload`.
    fn cell(&self, cell: &[u8], payload: &mut Vec<u8>) -> Result<i64, Damage> {
        let short = || "its cell is cut off".to_owned();
        let (length, rest) = varint(cell).ok_or_else(short)?;
        let (number, rest) = varint(rest).ok_or_else(short)?;
        if length > LONGEST_MESSAGE {
            return Err(format!("it has {length} bytes; at most {LONGEST_MESSAGE} are taken"));
        }
        let length = length as usize;
        let local = local_size(length, self.pages.usable);
        payload.clear();
        payload.extend_from_slice(rest.get(..local).ok_or_else(short)?);
        let mut next = rest.get(local..local + 4).and_then(|four| four.try_into().ok());
        while payload.len() < length {
            let page = self.pages.page(next.map_or(0, u32::from_be_bytes))?;
            let (link, data) = page.split_first_chunk::<4>().ok_or_else(short)?;
            let count = (length - payload.len()).min(self.pages.usable - 4);
            payload.extend_from_slice(data.get(..count).ok_or_else(short)?);
            next = Some(*link);
        }
        Ok(number as i64)
    }
}

/// Where the cells of a page begin: pointers after its head.
fn cells(page: &[u8], head: usize, head_size: usize) -> impl Iterator<Item = usize> {
    let count = page.get(head + 3..head + 5).map_or(0, |two| u16::from_be_bytes([two[0], two[1]]));
    let start = head + head_size;
    let pointers = page.get(start..).unwrap_or_default().chunks_exact(2).take(usize::from(count));
    pointers.map(|two| usize::from(u16::from_be_bytes([two[0], two[1]])))
}

/// How many bytes of a row stand in its cell; the others stand in overflow pages.
fn local_size(length: usize, usable: usize) -> usize {
    if length <= usable - 35 {
        return length;
    }
    let smallest = (usable - 12) * 32 / 255 - 23;
    let fitting = smallest + (length - smallest) % (usable - 4);
    if fitting <= usable - 35 { fitting } else { smallest }
}
