//! How much memory the process may have: its address space (`ulimit -v`) and its control group.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use rustix::process::{Resource, getrlimit};

use crate::memory::megabytes;

/// Where the kernel shows control groups.
const CGROUPS: &str = "/sys/fs/cgroup";

/// Who sets a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedBy {
    /// `RLIMIT_AS`: all that is mapped counts, used or not.
    AddressSpace,
    /// `RLIMIT_DATA`.
    DataSegment,
    /// `memory.max` of the control group or of one above it.
    ControlGroup,
    /// Whoever started the program, or its own default ([`crate::memory::keep_below`]).
    Program,
}

/// The lowest limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// So many bytes.
    pub bytes: u64,
    /// Whose.
    pub by: LimitedBy,
}

impl Limit {
    /// The limit of this process; `None` when there is none.
    pub(super) fn of_this_process() -> Option<Self> {
        let of_process = [(Resource::As, LimitedBy::AddressSpace), (Resource::Data, LimitedBy::DataSegment)];
        let of_process = of_process
            .into_iter()
            .filter_map(|(resource, by)| Some(Self { bytes: getrlimit(resource).current?, by }));
        let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        let of_group = group_files(&groups)
            .into_iter()
            .filter_map(|file| limit_in(&fs::read_to_string(file).ok()?))
            .map(|bytes| Self { bytes, by: LimitedBy::ControlGroup });
        of_process.chain(of_group).min_by_key(|limit| limit.bytes)
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let by = match self.by {
            LimitedBy::AddressSpace => "address space (ulimit -v)",
            LimitedBy::DataSegment => "data (ulimit -d)",
            LimitedBy::ControlGroup => "memory (its control group's limit)",
            LimitedBy::Program => "memory (--memory)",
        };
        write!(f, "this process may have {} of {by}", megabytes(self.bytes))
    }
}

/// Three quarters of what the machine or the control group has, bytes; `None` where the system does not tell.
pub(super) fn three_quarters() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| total_in(&text));
    let group = Limit::of_this_process().map(|limit| limit.bytes);
    machine.into_iter().chain(group).min().map(|bytes| bytes / 4 * 3)
}

/// `MemTotal` of the kernel's figures, bytes.
fn total_in(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The first version's way to say "none" is the largest number of whole pages; the second's is "max".
const NO_LIMIT_BYTES: u64 = 1 << 62;

/// What a group's file says.
fn limit_in(text: &str) -> Option<u64> {
    text.trim().parse().ok().filter(|bytes| *bytes < NO_LIMIT_BYTES)
}

/// Files that may hold a limit: of the process's group and of all above it, in both versions of control
/// groups.
fn group_files(groups: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { continue };
        let (root, name) = match controllers {
            "" => (PathBuf::from(CGROUPS), "memory.max"),
            some if some.split(',').any(|one| one == "memory") => {
                (Path::new(CGROUPS).join("memory"), "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let groups =
            Path::new(path.trim_start_matches('/')).ancestors().map(|group| root.join(group).join(name));
        files.extend(groups);
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_and_all_above_it_may_hold_the_limit() {
        let files = |groups| {
            let files = group_files(groups).into_iter();
            files.map(|file| file.display().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(
            files("0::/system.slice/x.service\n"),
            [
                "/sys/fs/cgroup/system.slice/x.service/memory.max",
                "/sys/fs/cgroup/system.slice/memory.max",
                "/sys/fs/cgroup/memory.max"
            ]
        );
        assert_eq!(files("5:cpu:/\n4:memory:/\n"), ["/sys/fs/cgroup/memory/memory.limit_in_bytes"]);
        assert!(files("nonsense").is_empty());
    }

    #[test]
    fn a_group_without_a_limit_has_none() {
        assert_eq!(limit_in("1048576\n"), Some(1 << 20));
        assert_eq!([limit_in("max\n"), limit_in("9223372036854771712\n"), limit_in("")], [None; 3]);
    }

    #[test]
    fn the_machine_tells_what_it_has() {
        assert_eq!(total_in("MemTotal:        2048 kB\nMemFree: 1 kB\n"), Some(2 << 20));
        assert_eq!([total_in(""), total_in("MemTotal: many kB"), total_in("MemTotal: 5")], [None; 3]);
        assert!(three_quarters().is_some_and(|bytes| bytes > 1 << 20));
    }

    #[test]
    fn a_limit_says_what_sets_it() {
        let limit = Limit { bytes: 300_000_000, by: LimitedBy::AddressSpace };
        assert_eq!(limit.to_string(), "this process may have 300 MB of address space (ulimit -v)");
    }
}
