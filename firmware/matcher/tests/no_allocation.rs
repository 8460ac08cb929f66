//! After construction and the first scan the tracker allocates nothing: counted by the allocator of this test
//! program.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use biplane_matcher::{Beam, Guess, Method, Outcome, PairMatcher, Pose2, Scan, Tracker, TrackerParams};

struct Counting;

thread_local! {
    /// Of this thread alone: the test harness allocates on its own.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on unchanged to the system's allocator; counting touches no memory but its own
// counter.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps `alloc`'s contract, which is the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps `dealloc`'s contract, and `memory` came from the system's allocator.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The range from a point inside a rectangle 8 by 6 m about the origin, and in its middle a post that comes
/// and goes.
fn range_m(from: &Pose2, angle_rad: f64, disturbed: bool) -> f32 {
    let (sin, cos) = (from.theta_rad + angle_rad).sin_cos();
    let to_x = if cos > 0.0 { (4.0 - from.x_m) / cos } else { (-4.0 - from.x_m) / cos };
    let to_y = if sin > 0.0 { (3.0 - from.y_m) / sin } else { (-3.0 - from.y_m) / sin };
    let range_m = to_x.abs().min(to_y.abs());
    (if disturbed && angle_rad.abs() < 0.2 { range_m.min(0.9) } else { range_m }) as f32
}

/// Allocations after the first scan, and the outcomes that there were: matched, lost, without returns.
fn run(method: Method) -> (u64, [bool; 3]) {
    let mut params = TrackerParams::for_method(method);
    params.map.tiles = 24; // so that tiles are recycled as well
    params.gradient.half_window_m = 5.0;
    let mut tracker = Tracker::new(params);
    let mut beams = [Beam::default(); 181];
    let (mut before, mut outcomes) = (0, [false; 3]);
    for i in 0..2001_i32 {
        let at = f64::from(i) * 0.01;
        // A turn that the odometry does not feel is searched for in all headings; what is half as far off as
        // it was is lost.
        let (turned, lost) = ((500..530).contains(&i), (900..930).contains(&i));
        let odom_from_base = Pose2::new(2.0 * at.sin(), 1.0 - at.cos(), at);
        let truth = odom_from_base * Pose2::new(0.0, 0.0, if turned { 1.5 } else { 0.0 });
        for (beam, k) in beams.iter_mut().zip(-90_i32..) {
            let angle_rad = f64::from(k).to_radians();
            let range_m =
                if i % 400 == 399 { f32::INFINITY } else { range_m(&truth, angle_rad, i % 50 > 25) };
            let range_m = if lost { 0.5 * range_m } else { range_m };
            let direction_in_base = [angle_rad.cos() as f32, angle_rad.sin() as f32];
            *beam = Beam { direction_in_base, range_m, delay_s: 0.0 };
        }
        let scan = Scan {
            stamp_ns: i64::from(i % 7) * 1_000_000,
            laser_in_base_m: [0.1, 0.0],
            beams: &beams,
            twist_in_base: [0.2, 0.0, 0.1],
        };
        let odom = (i % 100 < 90).then_some(odom_from_base);
        match tracker.track(&scan, odom).outcome {
            Outcome::First => {}
            Outcome::Matched | Outcome::Weak => outcomes[0] = true,
            Outcome::Lost => outcomes[1] = true,
            Outcome::NoReturns => outcomes[2] = true,
        }
        if i == 0 {
            before = ALLOCATIONS.get();
        }
    }
    (ALLOCATIONS.get() - before, outcomes)
}

#[test]
fn two_thousand_scans_after_the_first_allocate_nothing_whatever_becomes_of_them() {
    for method in Method::ALL {
        assert_eq!(run(method), (0, [true; 3]), "{method}");
    }
}

#[test]
fn finding_scans_in_others_allocates_nothing_also_while_a_journal_is_kept() {
    for method in Method::ALL {
        let mut matcher = PairMatcher::new(TrackerParams::for_method(method));
        matcher.keep_journal(64);
        let mut beams = [Beam::default(); 181];
        let before = ALLOCATIONS.get();
        for i in 0..60_i32 {
            let base = Pose2::new(0.02 * f64::from(i), 0.01 * f64::from(i), 0.03 * f64::from(i));
            for (beam, k) in beams.iter_mut().zip(-90_i32..) {
                let angle_rad = f64::from(k).to_radians();
                let direction_in_base = [angle_rad.cos() as f32, angle_rad.sin() as f32];
                *beam = Beam { direction_in_base, range_m: range_m(&base, angle_rad, false), delay_s: 0.0 };
            }
            let scan =
                Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] };
            if i % 3 == 0 {
                matcher.set_reference(&scan);
            }
            let reference_from_base = Pose2::new(0.05, -0.05, 0.2);
            matcher.find(&scan, &Guess { reference_from_base, half_m: 0.1, half_rad: 0.5 });
        }
        assert_eq!(ALLOCATIONS.get() - before, 0, "{method}");
    }
}
