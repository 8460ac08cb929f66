//! The lower envelope of late readings of a regular event: a line that no reading lies below.
//!
//! Readings of event n come at `n periods + phase + lateness`, lateness never negative. The line is found in
//! two steps, as in passive clock synchronization (E. Olson, "A Passive Solution to the Sensor
//! Synchronization Problem", IROS 2010) and in the estimation of clock skew (Moon, Skelly, Towsley, INFOCOM
//! 1999): the rate is the slope of the lower convex hull of the readings of the last half minute, where it
//! crosses the middle of that time; the phase is the earliest of the latest readings, carried on at that rate
//! and a little faster, by as much as the rate is not known. Memory is fixed: of each second the earliest
//! reading is kept.

/// Blocks that are kept.
const BLOCKS: usize = 32;

/// How an [`Envelope`] follows.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct EnvelopeParams {
    /// Length of the time of which one reading is kept, nanoseconds. Larger: the rate is steadier and follows
    /// later.
    pub block_ns: i64,
    /// And of at least so many readings.
    pub block_readings: u32,
    /// The phase rests on readings no older than this, nanoseconds. Larger: bridges longer times without a
    /// prompt read, takes longer to forget.
    pub phase_ns: i64,
    /// A device's rate differs from the nominal by no more than this, millionths. Larger: chance looks like
    /// drift; smaller: a device beyond is stamped late.
    pub largest_ppm: f64,
    /// By so much it usually differs (standard deviation), millionths: what is believed while little has been
    /// seen.
    pub usual_ppm: f64,
    /// So late is a prompt read, nanoseconds: what a rate is uncertain by, over the time that it was seen.
    pub prompt_ns: f64,
    /// The least by which the phase may rise beyond the rate found, millionths. Larger: strays further
    /// between two prompt reads.
    pub min_rise_ppm: f64,
    /// The most, before a rate is known.
    pub max_rise_ppm: f64,
}

impl Default for EnvelopeParams {
    fn default() -> Self {
        Self {
            block_ns: 1_000_000_000,
            block_readings: 4,
            phase_ns: 10_000_000_000,
            largest_ppm: 600.0,
            usual_ppm: 100.0,
            prompt_ns: 60_000.0,
            min_rise_ppm: 5.0,
            max_rise_ppm: 200.0,
        }
    }
}

/// A reading: which event, and how much later than its nominal time, nanoseconds.
#[derive(Copy, Clone, Debug, Default)]
struct Reading {
    event: i64,
    late_ns: f64,
}

/// The line.
#[derive(Clone, Debug)]
pub(crate) struct Envelope {
    params: EnvelopeParams,
    period_ns: i64,
    origin_ns: i64,
    blocks: heapless::Deque<Reading, BLOCKS>,
    /// The earliest of the block that is under way, and that block's first event.
    current: Reading,
    block_begin: i64,
    block_readings: u32,
    /// Deviation of the rate and what it is uncertain by, nanoseconds an event.
    rate: f64,
    rise: f64,
}

impl Envelope {
    /// A line through one reading: event 0 at `time_ns`.
    #[must_use]
    pub(crate) fn new(params: EnvelopeParams, period_ns: i64, time_ns: i64) -> Self {
        Self {
            rise: params.max_rise_ppm * 1e-6 * period_ns as f64,
            params,
            period_ns,
            origin_ns: time_ns,
            blocks: heapless::Deque::new(),
            current: Reading::default(),
            block_begin: 0,
            block_readings: 1,
            rate: 0.0,
        }
    }

    /// The same rate through another reading, which is event 0 from now on: the phase is another one.
    pub(crate) fn restart(&mut self, time_ns: i64) {
        self.blocks.clear();
        self.origin_ns = time_ns;
        self.current = Reading::default();
        (self.block_begin, self.block_readings) = (0, 1);
    }

    /// When event `event` is, as far as is known, nanoseconds.
    #[must_use]
    pub(crate) fn at_ns(&self, event: i64) -> i64 {
        let slope = self.rate + self.rise;
        let carried =
            |reading: &Reading| reading.late_ns + slope * event.saturating_sub(reading.event) as f64;
        let oldest = self.current.event.saturating_sub(self.params.phase_ns / self.period_ns);
        let recent = self.blocks.iter().rev().take_while(|reading| reading.event >= oldest);
        let late_ns = recent.map(carried).fold(carried(&self.current), f64::min);
        self.nominal_ns(event).saturating_add(late_ns as i64)
    }

    /// By how much [`Envelope::at_ns`] may err so many events on, nanoseconds.
    #[must_use]
    pub(crate) fn uncertain_ns(&self, events: i64) -> i64 {
        (self.rise * events as f64) as i64
    }

    /// From one event to the next, nanoseconds.
    #[must_use]
    pub(crate) fn period_ns(&self) -> f64 {
        self.period_ns as f64 + self.rate
    }

    /// A reading of event `event`, later than those before.
    pub(crate) fn add(&mut self, event: i64, time_ns: i64) {
        let reading = Reading { event, late_ns: time_ns.saturating_sub(self.nominal_ns(event)) as f64 };
        let is_long = event.saturating_sub(self.block_begin) >= self.params.block_ns / self.period_ns;
        if is_long && self.block_readings >= self.params.block_readings {
            self.close_block(reading);
            return;
        }
        self.block_readings += 1;
        if reading.late_ns
            <= self.current.late_ns + self.rate * event.saturating_sub(self.current.event) as f64
        {
            self.current = reading;
        }
    }

    fn nominal_ns(&self, event: i64) -> i64 {
        self.origin_ns.saturating_add(event.saturating_mul(self.period_ns))
    }

    fn close_block(&mut self, next: Reading) {
        if self.blocks.is_full() {
            self.blocks.pop_front();
        }
        // There is room now.
        let _ = self.blocks.push_back(self.current);
        (self.current, self.block_begin, self.block_readings) = (next, next.event, 1);
        self.learn_rate();
    }

    /// The slope of the lower hull over the middle of the time seen, believed as far as that time allows.
    fn learn_rate(&mut self) {
        let hull = self.lower_hull();
        let (Some(first), Some(last)) = (hull.first(), hull.last()) else { return };
        let span = (last.event - first.event) as f64;
        if span <= 0.0 {
            return;
        }
        let middle = first.event + (last.event - first.event) / 2;
        let edge = hull.windows(2).find(|edge| edge[1].event >= middle);
        let Some([from, to]) = edge else { return };
        let slope = (to.late_ns - from.late_ns) / (to.event - from.event) as f64;
        let mean_ns =
            self.blocks.iter().map(|r| r.late_ns - from.late_ns - slope * (r.event - from.event) as f64);
        let scatter_ns = mean_ns.sum::<f64>() / self.blocks.len() as f64;
        let period_ns = self.period_ns as f64;
        let unsure = (0.25 * scatter_ns.max(0.0) + self.params.prompt_ns) / span;
        let usual = self.params.usual_ppm * 1e-6 * period_ns;
        let largest = self.params.largest_ppm * 1e-6 * period_ns;
        let worth = usual * usual / (usual * usual + unsure * unsure);
        self.rate = worth * slope.clamp(-largest, largest);
        let (minimum, maximum) = (self.params.min_rise_ppm, self.params.max_rise_ppm);
        self.rise = unsure.clamp(minimum * 1e-6 * period_ns, maximum * 1e-6 * period_ns);
    }

    /// Lower convex hull of the closed blocks, from the oldest to the newest.
    fn lower_hull(&self) -> heapless::Vec<Reading, BLOCKS> {
        let mut hull: heapless::Vec<Reading, BLOCKS> = heapless::Vec::new();
        for &reading in &self.blocks {
            while let [.., a, b] = hull.as_slice() {
                let slope_before = (b.late_ns - a.late_ns) * (reading.event - a.event) as f64;
                if slope_before < (reading.late_ns - a.late_ns) * (b.event - a.event) as f64 {
                    break;
                }
                hull.pop();
            }
            // A hull has no more corners than there are blocks.
            let _ = hull.push(reading);
        }
        hull
    }
}
