//! The tiles of a pool in the order of their last use: the oldest one is known at once, however many there
//! are.

/// No tile.
const NONE: u16 = u16::MAX;

/// The neighbors of a tile in the order.
#[derive(Copy, Clone, Debug)]
struct Link {
    older: u16,
    younger: u16,
}

/// A list of tiles from the oldest to the youngest.
#[derive(Clone, Debug)]
pub(crate) struct Ages {
    links: Vec<Link>,
    oldest: u16,
    youngest: u16,
}

impl Ages {
    /// Memory for a tile.
    pub(crate) const BYTES_PER_TILE: usize = size_of::<Link>();

    /// An empty order with memory for so many tiles.
    pub(crate) fn with_capacity(tiles: usize) -> Self {
        Self { links: Vec::with_capacity(tiles), oldest: NONE, youngest: NONE }
    }

    /// There is one more tile, which is not in the order yet.
    pub(crate) fn grow(&mut self) {
        self.links.push(Link { older: NONE, younger: NONE });
    }

    /// A tile that is not in the order becomes the youngest.
    pub(crate) fn push(&mut self, tile: u16) {
        self.links[usize::from(tile)] = Link { older: self.youngest, younger: NONE };
        match self.youngest {
            NONE => self.oldest = tile,
            last => self.links[usize::from(last)].younger = tile,
        }
        self.youngest = tile;
    }

    /// Takes a tile out of the order.
    pub(crate) fn remove(&mut self, tile: u16) {
        let Link { older, younger } = self.links[usize::from(tile)];
        match older {
            NONE => self.oldest = younger,
            older => self.links[usize::from(older)].younger = younger,
        }
        match younger {
            NONE => self.youngest = older,
            younger => self.links[usize::from(younger)].older = older,
        }
    }

    /// The tile that was not used for the longest time.
    pub(crate) fn oldest(&self) -> Option<u16> {
        (self.oldest != NONE).then_some(self.oldest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_is_the_one_that_a_plain_list_names() {
        let (mut ages, mut plain) = (Ages::with_capacity(8), Vec::new());
        (0..8).for_each(|_| ages.grow());
        for step in 0_u32..500 {
            let tile = (step * 37 % 101 % 8) as u16;
            let place = plain.iter().position(|other| *other == tile);
            if let Some(place) = place {
                plain.remove(place);
                ages.remove(tile);
            }
            // Every third time it stays out.
            if place.is_none() || step % 3 != 0 {
                plain.push(tile);
                ages.push(tile);
            }
            assert_eq!(ages.oldest(), plain.first().copied(), "step {step}");
        }
    }
}
