//! The second reading of bags: each message that is taken, in the order of stamps, into a recording.

use std::ops::ControlFlow;
use std::path::Path;

use biplane_recording::messages::{Imu, LaserScan, Odometry, TfMessage, TransformStamped};
use biplane_recording::rig::Mount;
use biplane_recording::topics::{FRAME_BASE, FRAME_IMU, FRAME_LASER_HORIZONTAL, FRAME_LASER_VERTICAL};
use biplane_recording::{Topic, WriteError, Writer};

use super::container::{BagFile, Losses, RawMessage};
use super::error::BagError;
use super::frames::bare;
use super::messages::BagMessage;
use super::messages::odometry::OdometryMaker;
use super::messages::scans::{clean, is_usable, stated_increment_s, stated_scan_time_s, sweep_ns};
use super::options::{BagOptions, Stamps};
use super::plan::{LaserPlan, OdometrySource, Plan};
use super::reorder::Reorder;
use super::report::BagReport;

/// A message on its way out.
#[derive(Clone, PartialEq, Debug)]
enum Out {
    Scan(Topic, LaserScan),
    Odometry(Box<Odometry>),
    Imu(Box<Imu>),
}

/// What is being written.
pub(crate) struct Conversion<'a> {
    plan: &'a Plan,
    options: &'a BagOptions,
    writer: Writer,
    odometry: OdometryMaker,
    reorder: Reorder<Out>,
    /// The last message written of each kind.
    last: [Option<Out>; 4],
    last_ns: i64,
    frames_written: bool,
    failed: Option<WriteError>,
    report: BagReport,
}

impl<'a> Conversion<'a> {
    /// Into a recording that is begun.
    pub(crate) fn new(writer: Writer, plan: &'a Plan, options: &'a BagOptions) -> Self {
        Self {
            plan,
            options,
            writer,
            odometry: OdometryMaker::new(plan.child_from_base),
            reorder: Reorder::default(),
            last: [const { None }; 4],
            last_ns: i64::MIN,
            frames_written: false,
            failed: None,
            report: BagReport::default(),
        }
    }

    /// Takes all messages of a file.
    pub(crate) fn read(&mut self, file: &BagFile, spool: &Path) -> Result<(), BagError> {
        // What cannot be read was counted in the first reading.
        file.read(spool, &mut Losses::default(), &mut |raw| {
            self.take(raw);
            let taken = self.write_due(false);
            match taken {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    self.failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        })?;
        self.failed.take().map_or(Ok(()), |error| Err(error.into()))
    }

    /// Writes what still waits, and ends the recording.
    pub(crate) fn finish(mut self) -> Result<BagReport, BagError> {
        self.write_due(true)?;
        self.writer.finish()?;
        Ok(self.report)
    }

    fn take(&mut self, raw: &RawMessage<'_>) {
        let topic = bare(&raw.channel.topic);
        let Ok(message) = BagMessage::decode(raw, self.options.echo) else { return };
        match message {
            BagMessage::Scan { scan, .. } => self.take_scan(topic, scan, raw.received_ns),
            BagMessage::Odometry(odometry) => {
                if self.plan.odometry == OdometrySource::Topic(topic.to_owned()) {
                    let made = self.odometry.of_message(&odometry);
                    self.push_odometry(made, raw.received_ns);
                }
            }
            BagMessage::Tf(tf) => tf.transforms.iter().for_each(|transform| {
                if self.is_odometry(transform) {
                    let made = self.odometry.of_transform(transform);
                    self.push_odometry(made, raw.received_ns);
                }
            }),
            BagMessage::Imu(imu) => self.take_imu(topic, imu, raw.received_ns),
            BagMessage::Other => {}
        }
    }

    fn is_odometry(&self, transform: &TransformStamped) -> bool {
        let (from, to) = (bare(&transform.frame_id), bare(&transform.child_frame_id));
        match &self.plan.odometry {
            OdometrySource::Transforms { parent, child } => parent == from && child == to,
            _ => false,
        }
    }

    fn take_scan(&mut self, topic: &str, mut scan: LaserScan, received_ns: i64) {
        let is_of = |laser: &&LaserPlan| laser.topic == topic && laser.frame == bare(&scan.frame_id);
        let lasers = [
            (Some(&self.plan.horizontal), Topic::ScanHorizontal, FRAME_LASER_HORIZONTAL),
            (self.plan.vertical.as_ref(), Topic::ScanVertical, FRAME_LASER_VERTICAL),
        ];
        let found = lasers.into_iter().find(|(laser, ..)| laser.as_ref().is_some_and(is_of));
        let Some((Some(laser), out, frame)) = found else { return };
        if !is_usable(&scan) {
            self.report.unusable_scans += 1;
            return;
        }
        if let Some(times) = laser.times.filter(|_| laser.is_override || stated_increment_s(&scan).is_none())
        {
            scan.time_increment_s = times.time_increment_s;
            scan.scan_time_s = stated_scan_time_s(&scan).unwrap_or(times.scan_time_s);
        }
        if laser.by_receipt {
            scan.stamp_ns = received_ns.saturating_sub(sweep_ns(&scan));
        }
        scan.stamp_ns = scan.stamp_ns.saturating_add(laser.delay_ns);
        frame.clone_into(&mut scan.frame_id);
        clean(&mut scan);
        let bytes = 4 * (scan.ranges_m.len() + scan.intensities.len());
        self.reorder.push(scan.stamp_ns, received_ns, bytes + size_of::<Out>(), Out::Scan(out, scan));
    }

    fn push_odometry(&mut self, made: Option<Odometry>, received_ns: i64) {
        let Some(mut made) = made else {
            self.report.unusable_poses += 1;
            return;
        };
        if self.options.stamps == Stamps::Receipt {
            made.stamp_ns = received_ns;
        }
        self.reorder.push(made.stamp_ns, received_ns, size_of::<Out>(), Out::Odometry(Box::new(made)));
    }

    fn take_imu(&mut self, topic: &str, mut imu: Imu, received_ns: i64) {
        let Some((_, mount)) = self.plan.imu.as_ref().filter(|(name, _)| name == topic) else { return };
        if self.options.stamps == Stamps::Receipt {
            imu.stamp_ns = received_ns;
        }
        imu.frame_id = imu_frame(bare(&imu.frame_id), mount.as_ref());
        self.reorder.push(imu.stamp_ns, received_ns, size_of::<Out>(), Out::Imu(Box::new(imu)));
    }

    /// Writes what has waited long enough, or all.
    fn write_due(&mut self, all: bool) -> Result<(), WriteError> {
        while let Some((stamp_ns, out)) = if all { self.reorder.pop_any() } else { self.reorder.pop() } {
            self.write_frames(stamp_ns)?;
            self.write(stamp_ns, out)?;
        }
        Ok(())
    }

    fn write(&mut self, stamp_ns: i64, out: Out) -> Result<(), WriteError> {
        let place = match &out {
            Out::Scan(Topic::ScanHorizontal, _) => 0,
            Out::Scan(..) => 1,
            Out::Odometry(_) => 2,
            Out::Imu(_) => 3,
        };
        if self.last[place].as_ref().is_some_and(|last| is_repeated(last, &out)) {
            self.report.duplicates += 1;
            return Ok(());
        }
        let report = &mut self.report;
        report.backward_stamps += usize::from(stamp_ns < self.last_ns);
        self.last_ns = stamp_ns;
        match &out {
            Out::Scan(topic, scan) => {
                report.scans[usize::from(*topic == Topic::ScanVertical)] += 1;
                let [first, last] = report.stamps_ns.unwrap_or([stamp_ns; 2]);
                report.stamps_ns = Some([first.min(stamp_ns), last.max(stamp_ns)]);
                self.writer.write(*topic, stamp_ns, stamp_ns, scan)?;
            }
            Out::Odometry(odometry) => {
                report.odometry += 1;
                self.writer.write(Topic::Odom, stamp_ns, stamp_ns, &**odometry)?;
            }
            Out::Imu(imu) => {
                report.imu += 1;
                self.writer.write(Topic::Imu, stamp_ns, stamp_ns, &**imu)?;
            }
        }
        self.last[place] = Some(out);
        Ok(())
    }

    /// Before the first message: where lasers and inertial unit sit.
    fn write_frames(&mut self, stamp_ns: i64) -> Result<(), WriteError> {
        if self.frames_written {
            return Ok(());
        }
        self.frames_written = true;
        let horizontal = Some((FRAME_LASER_HORIZONTAL.to_owned(), self.plan.horizontal.mount));
        let vertical =
            self.plan.vertical.as_ref().map(|laser| (FRAME_LASER_VERTICAL.to_owned(), laser.mount));
        let imu =
            self.plan.imu.as_ref().and_then(|(_, mount)| Some((imu_frame("", mount.as_ref()), (*mount)?)));
        let imu = imu.filter(|(frame, _)| frame == FRAME_IMU);
        let transforms = [horizontal, vertical, imu].into_iter().flatten().map(|(child_frame_id, mount)| {
            TransformStamped {
                stamp_ns,
                frame_id: FRAME_BASE.to_owned(),
                child_frame_id,
                translation_m: mount.translation_m(),
                rotation_xyzw: mount.rotation_xyzw(),
            }
        });
        let message = TfMessage { transforms: transforms.collect() };
        self.writer.write(Topic::TfStatic, stamp_ns, stamp_ns, &message)
    }
}

/// The frame of an inertial unit that sits where the base does is the base; where it sits elsewhere, its own.
fn imu_frame(frame: &str, mount: Option<&Mount>) -> String {
    match mount {
        Some(mount) if *mount == Mount::default() => FRAME_BASE.to_owned(),
        Some(_) => FRAME_IMU.to_owned(),
        None => frame.to_owned(),
    }
}

/// The same message once more, to the bit: NaN in it is equal to itself.
fn is_repeated(last: &Out, out: &Out) -> bool {
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    match (last, out) {
        (Out::Scan(_, a), Out::Scan(_, b)) => {
            a.stamp_ns == b.stamp_ns && bits(&a.ranges_m) == bits(&b.ranges_m)
        }
        (a, b) => a == b,
    }
}
