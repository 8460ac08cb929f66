//! A rig without faults, in simulated time: everything comes up, and everything that is sent is recorded.

use biplane_mock::faults::Faults;
use biplane_recording::Port;

use crate::rig::devices::{idle_lines, rig_at, with_inertial_unit};
use crate::rig::plan::Plan;
use crate::rig::verdict::inertial::{inertial_account, sent_samples};
use crate::rig::verdict::truth::{LONGEST_PARTIAL_FRAME_NS, laser_account, pioneer_account, sent_scans};
use crate::rig::verdict::witness::Witness;
use crate::rig::{S, SimRig};

#[test]
fn without_faults_every_telegram_that_was_sent_is_recorded() {
    for baud in [38_400, 500_000] {
        let rig = with_inertial_unit(rig_at(baud), 230_400, 400);
        let mut sim = SimRig::new(
            &rig,
            idle_lines(&rig, 1, &Faults::default(), &[]),
            Plan::default(),
            Witness::default(),
        );
        sim.run(10 * S, |_| false);
        let [horizontal, vertical, base, imu] = sim.lines.each_ref().map(|line| line.as_ref().unwrap());
        let witness = sim.engine.sink();
        for (port, line, recorded) in
            [(Port::Horizontal, horizontal, &witness.scans[0]), (Port::Vertical, vertical, &witness.scans[1])]
        {
            let telegrams = sent_scans(&line.sent, &line.delivered);
            let account = laser_account(port, &telegrams, &line.delivered, recorded, &sim.reported);
            assert!(account.sent > 80, "{port:?} {account:?} {:?}", sim.reported);
            // The last one may still be on its way.
            assert!(account.lost() == 0 && account.damaged <= 1, "{port:?} {account:?}");
            assert!(account.undetected == 0 && account.wrongly_kept == 0, "{port:?} {account:?}");
        }
        let account = pioneer_account(
            &base.sent,
            &base.delivered,
            0,
            &witness.odometry_ns,
            &sim.reported,
            LONGEST_PARTIAL_FRAME_NS,
        );
        assert!(account.intact > 80 && account.lost() == 0, "{account:?}");
        assert!(account.undetected == 0 && account.wrongly_kept == 0, "{account:?}");
        assert!(witness.poses > 80);
        let messages = sent_samples(&imu.sent, &imu.delivered);
        let account = inertial_account(&messages, &imu.delivered, &witness.samples);
        assert!(account.intact > 3_800 && account.lost() == 0 && account.damaged <= 1, "{account:?}");
        assert!(account.undetected == 0 && account.wrongly_kept == 0, "{account:?}");
    }
}
