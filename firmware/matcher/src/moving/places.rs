//! Places in the map, to be asked which of them lie near another one.
//!
//! Frame: map. Units: meters. They are compared side by side, and only what may be near is looked at closely.

use biplane_geometry::vec2::distance;

/// Places side by side.
const LANES: usize = 8;
/// Nothing nearer than a distance is farther than this many times it, squared, however both are rounded.
const ROUNDED: f32 = 1.001;

/// Places: a column an axis.
#[derive(Clone, Debug)]
pub(super) struct Places {
    x_m: Vec<f32>,
    y_m: Vec<f32>,
}

impl Places {
    /// Memory for so many places.
    pub(super) fn with_capacity(places: usize) -> Self {
        let room = places.next_multiple_of(LANES);
        Self { x_m: Vec::with_capacity(room), y_m: Vec::with_capacity(room) }
    }

    /// Takes over places in place of those before.
    pub(super) fn fill(&mut self, places: impl Iterator<Item = [f32; 2]>) {
        self.x_m.clear();
        self.y_m.clear();
        for [x_m, y_m] in places {
            self.x_m.push(x_m);
            self.y_m.push(y_m);
        }
        let whole = self.x_m.len().next_multiple_of(LANES);
        for axis in [&mut self.x_m, &mut self.y_m] {
            axis.resize(whole, f32::INFINITY);
        }
    }

    /// Names the places that lie nearer to one than `reach_m`, in their order, and how far they are.
    #[inline]
    pub(super) fn within(&self, at_m: [f32; 2], reach_m: f32, mut name: impl FnMut(usize, f32)) {
        let limit = ROUNDED * reach_m * reach_m;
        let chunks = self.x_m.as_chunks::<LANES>().0.iter().zip(self.y_m.as_chunks::<LANES>().0);
        for ((x_m, y_m), first) in chunks.zip((0..).step_by(LANES)) {
            let mut is_any_near = 0;
            for lane in 0..LANES {
                let (dx, dy) = (x_m[lane] - at_m[0], y_m[lane] - at_m[1]);
                is_any_near |= u32::from(dx * dx + dy * dy <= limit);
            }
            if is_any_near == 0 {
                continue;
            }
            for ((x_m, y_m), index) in x_m.iter().zip(y_m).zip(first..) {
                let away_m = distance([*x_m, *y_m], at_m);
                if away_m < reach_m {
                    name(index, away_m);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_is_named_and_nothing_else() {
        let all: Vec<[f32; 2]> = (0..53).map(|i| [i as f32 * 0.1, (i * 7 % 13) as f32 * 0.1]).collect();
        let mut places = Places::with_capacity(53);
        for count in [0, 1, 8, 53] {
            places.fill(all[..count].iter().copied());
            for reach_m in [0.05, 0.3, 1.0] {
                let (at_m, mut named) = ([2.02, 0.35], Vec::new());
                places.within(at_m, reach_m, |index, away_m| named.push((index, away_m)));
                let away = all[..count].iter().map(|place| distance(*place, at_m)).enumerate();
                assert!(away.filter(|(_, away_m)| *away_m < reach_m).eq(named), "{count} {reach_m}");
            }
        }
    }
}
