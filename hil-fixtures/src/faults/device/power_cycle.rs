//! A power cycle: a device is dark for a while and then starts up as if just switched on.
//!
//! In the dark it hears and says nothing; what was on the line is cut. Then [`Device::power_on`] is called,
//! and the rest is the device's own manner: a laser boots for `LmsParams::boot_ns` (up to 60 s on a real
//! one), says 90h at its power-on rate and streams nothing; a base has lost its session and counts from zero.

use crate::devices::device::{Device, DeviceCounts};
use crate::faults::episodes::{Episode, EpisodeParams, Episodes};
use crate::rng::Rng;

/// How often the power goes, and for how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerCycleParams {
    /// The dark times. Pauses shorter than a driver's search for the rate (9 s) and the boot leave it no
    /// chance.
    pub dark: EpisodeParams,
}

impl Default for PowerCycleParams {
    fn default() -> Self {
        let dark =
            EpisodeParams { shortest_pause_s: 12.0, mean_pause_s: 8.0, shortest_s: 0.2, longest_s: 2.0 };
        Self { dark }
    }
}

/// A device whose power goes now and then.
pub struct PowerCycle {
    device: Box<dyn Device>,
    episodes: Episodes,
    /// The next dark time; it comes to pass also when nobody calls while it lasts.
    next: Option<Episode>,
    /// The dark time that the device is in.
    dark: Option<Episode>,
    cycles: u64,
}

impl PowerCycle {
    /// Dark by chance.
    #[must_use]
    pub fn new(device: Box<dyn Device>, params: PowerCycleParams, rng: Rng) -> Self {
        Self { device, episodes: Episodes::by_chance(params.dark, rng), next: None, dark: None, cycles: 0 }
    }

    /// Dark at the times told.
    #[must_use]
    pub fn given(device: Box<dyn Device>, dark: &[Episode]) -> Self {
        Self { device, episodes: Episodes::given(dark), next: None, dark: None, cycles: 0 }
    }

    /// When the power goes next, at this time or before it if nobody has called since.
    fn next(&mut self, now_ns: i64) -> Option<Episode> {
        self.next = self.next.or_else(|| self.episodes.current_or_next(now_ns));
        self.next
    }

    fn is_dark(&mut self, now_ns: i64) -> bool {
        self.dark.is_some() || self.next(now_ns).is_some_and(|next| next.from_ns <= now_ns)
    }
}

impl Device for PowerCycle {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        if !self.is_dark(now_ns) {
            self.device.handle(now_ns, bytes);
        }
    }

    fn handle_noise(&mut self, now_ns: i64, count: usize) {
        if !self.is_dark(now_ns) {
            self.device.handle_noise(now_ns, count);
        }
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        if let Some(dark) = self.dark {
            if now_ns < dark.to_ns {
                return dark.to_ns;
            }
            self.dark = None;
            self.device.power_on(dark.to_ns);
        }
        match self.next(now_ns) {
            // A caller that is late finds what left before the power went, and is asked to come again.
            Some(next) if next.from_ns <= now_ns => {
                self.device.poll(next.from_ns, out);
                (self.next, self.dark) = (None, Some(next));
                self.cycles += 1;
                next.to_ns.max(now_ns)
            }
            Some(next) => self.device.poll(now_ns, out).min(next.from_ns),
            None => self.device.poll(now_ns, out),
        }
    }

    fn power_on(&mut self, now_ns: i64) {
        self.dark = None;
        self.device.power_on(now_ns);
    }

    fn takes_connection(&mut self, now_ns: i64) -> bool {
        !self.is_dark(now_ns) && self.device.takes_connection(now_ns)
    }

    fn connected(&mut self, now_ns: i64) {
        self.device.connected(now_ns);
    }

    fn disconnected(&mut self, now_ns: i64) {
        self.device.disconnected(now_ns);
    }

    fn baud(&self) -> u32 {
        self.device.baud()
    }

    fn is_streaming(&self) -> bool {
        self.dark.is_none() && self.device.is_streaming()
    }

    fn counts(&self) -> DeviceCounts {
        let counts = self.device.counts();
        DeviceCounts { power_cycles: counts.power_cycles + self.cycles, ..counts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::base::feed::CycleFeed;
    use crate::devices::base::{BaseDevice, BaseParams};
    use crate::devices::lms::scans::feed::{MirrorFeed, Timeline};
    use crate::devices::lms::{LmsDevice, LmsParams};
    use crate::rig::source::{OdometrySample, OdometrySource, ScanSource, ScanWords};

    const S: i64 = 1_000_000_000;
    const DARK: Episode = Episode { from_ns: 3 * S, to_ns: 4 * S };

    struct World;

    impl ScanSource for World {
        fn scan(&mut self, _: i64, _: u16, _: u16, _: bool) -> Option<ScanWords> {
            Some(std::iter::repeat_n(300, 181).collect())
        }
    }

    /// A tick a millisecond.
    impl OdometrySource for World {
        fn sample(&mut self, t_ns: i64) -> OdometrySample {
            OdometrySample { x_raw: (t_ns / 1_000_000) as u16 & 0x7FFF, ..OdometrySample::default() }
        }
    }

    impl Timeline for World {
        fn world_ns(&self, device_ns: i64) -> i64 {
            device_ns
        }
    }

    /// Bytes and when they left, up to `end_ns`; each of `said` is said at its time.
    fn run(device: &mut dyn Device, end_ns: i64, reported: &[(i64, &[u8])]) -> Vec<(i64, u8)> {
        let (mut now_ns, mut received, mut reported) = (0, Vec::new(), reported.iter().peekable());
        while now_ns < end_ns {
            while let Some((at_ns, bytes)) = reported.next_if(|(at_ns, _)| *at_ns <= now_ns) {
                device.handle(*at_ns, bytes);
            }
            let mut out = Vec::new();
            let due_ns = device.poll(now_ns, &mut out);
            received.extend(out.into_iter().map(|byte| (now_ns, byte)));
            let next_ns = reported.peek().map_or(i64::MAX, |(at_ns, _)| *at_ns);
            now_ns = due_ns.max(now_ns + 1).min(next_ns.max(now_ns + 1));
        }
        received
    }

    #[test]
    fn a_laser_is_dark_boots_says_so_at_9600_and_streams_no_more() {
        let params = LmsParams { baud: 38_400, left_streaming: true, boot_ns: 5 * S, ..LmsParams::default() };
        let feed = MirrorFeed::new(Box::new(World), Box::new(World));
        let mut laser = PowerCycle::given(Box::new(LmsDevice::new(params, Box::new(feed))), &[DARK]);
        let stop: &[u8] = &[0x02, 0x00, 0x02, 0x00, 0x20, 0x25, 0x35, 0x08];
        let received = run(&mut laser, 12 * S, &[(3 * S + S / 2, stop), (6 * S, stop)]);
        let last_ns = received.iter().filter(|(at_ns, _)| *at_ns < 4 * S).map(|(at_ns, _)| *at_ns).max();
        assert!(last_ns.is_some_and(|at_ns| (2_800_000_000..=3 * S).contains(&at_ns)), "{last_ns:?}");
        let after: Vec<(i64, u8)> = received.into_iter().filter(|(at_ns, _)| *at_ns > 3 * S).collect();
        assert!(after[0].0 >= 9 * S && after[0].0 < 9 * S + 10_000_000);
        assert_eq!((after.len(), after[4].1), (26, 0x90));
        assert_eq!((laser.baud(), laser.is_streaming(), laser.counts().power_cycles), (9600, false, 1));
    }

    #[test]
    fn a_dark_time_that_nobody_called_in_comes_to_pass_all_the_same() {
        let params = LmsParams { left_streaming: true, boot_ns: S, ..LmsParams::default() };
        let feed = MirrorFeed::new(Box::new(World), Box::new(World));
        let mut laser = PowerCycle::given(Box::new(LmsDevice::new(params, Box::new(feed))), &[DARK]);
        let mut out = Vec::new();
        laser.poll(2 * S, &mut out);
        assert!(laser.is_streaming());
        laser.poll(20 * S, &mut out);
        laser.poll(20 * S, &mut out);
        assert_eq!((laser.is_streaming(), laser.counts().power_cycles), (false, 1));
    }

    #[test]
    fn a_base_loses_its_session_and_counts_from_zero() {
        let params = BaseParams { left_open: true, boot_ns: S / 2, ..BaseParams::default() };
        let feed = CycleFeed::new(Box::new(World), Box::new(World), S / 10);
        let mut base = PowerCycle::given(Box::new(BaseDevice::new(params, Box::new(feed))), &[DARK]);
        let sync = |step: u8| [0xFA, 0xFB, 3, step, 0, step];
        let (sync_0, sync_1, sync_2) = (sync(0), sync(1), sync(2));
        let reported: [(i64, &[u8]); 5] = [
            (4 * S + S / 4, &sync_0),
            (6 * S, &sync_0),
            (6 * S + S / 10, &sync_1),
            (6 * S + S / 5, &sync_2),
            (7 * S, &sync_1),
        ];
        let received = run(&mut base, 8 * S, &reported);
        assert!(received.iter().any(|(at_ns, _)| *at_ns < 3 * S));
        assert!(!received.iter().any(|(at_ns, _)| (3 * S + 1..6 * S).contains(at_ns)));
        let last: Vec<u8> =
            received.iter().filter(|(at_ns, _)| *at_ns >= 7 * S).map(|(_, byte)| *byte).collect();
        let start = last.windows(4).position(|head| head == [0xFA, 0xFB, 34, 0x32]).expect("a packet");
        // 3000 ticks since the power came back.
        assert_eq!(last[start + 4..start + 10], [0xB8, 0x0B, 0, 0, 0, 0]);
    }
}
