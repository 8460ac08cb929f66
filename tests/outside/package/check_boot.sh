#!/usr/bin/env bash
# The package on a machine that boots: systemd as process 1 of namespaces of their own, over a throw-away overlay of this system.
# There the package is installed, its service records from mock devices within its sandbox, is stopped dead and found by the
# watchdog, salvages, goes on, and is stopped.
#   check_boot.sh PACKAGE.deb WORKDIR
# Needs root, overlayfs and a writable cgroup tree (version 2, alone or beside version 1); left out, said so, where systemd does not boot.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
package="$1"
work="$2"
rm -rf "$work"
mkdir -p "$work/share" "$work/overlay"
work="$(cd "$work" && pwd)"
cp "$package" "$work/share/biplane.deb"
cp "$here/check_booted.sh" "$work/share/"
cgroup="$(awk '$3 == "cgroup2" { print $2; exit }' /proc/mounts)/biplane-check-$$"

leave_out() { echo "LEFT OUT: the service under systemd ($*)" >&2; exit 0; }
clean_up() {
    # The namespaces have ended with their process 1; their groups are empty.
    [ ! -d "$cgroup" ] || find "$cgroup" -depth -type d -exec rmdir {} + 2> "$work/rmdir.log" || true
}
trap clean_up EXIT
if [ "$(id -u)" != 0 ]; then leave_out "not root"; fi
mkdir "$cgroup" 2> "$work/cgroup.log" || leave_out "no writable cgroup tree"

# Everything that process 1 finds; $1 is the folder of this check.
root_of_machine() {
    set -euo pipefail
    local root="$1/overlay/root" device
    mount --make-rprivate /
    mount -t tmpfs none "$1/overlay"
    mkdir "$1"/overlay/{upper,work,root}
    mount -t overlay overlay -o "lowerdir=/,upperdir=$1/overlay/upper,workdir=$1/overlay/work" "$root"
    mount -t proc proc "$root/proc"
    mount -t sysfs sysfs "$root/sys"
    if ! mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"; then
        mount -t tmpfs none "$root/sys/fs"
        mkdir "$root/sys/fs/cgroup"
        mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
    fi
    mount -t tmpfs none "$root/dev"
    mkdir "$root"/dev/{pts,shm}
    # Pseudo-terminals stand for serial ports: anybody may open them, as `dialout` may open those.
    mount -t devpts -o newinstance,ptmxmode=0666,mode=666 devpts "$root/dev/pts"
    ln -s pts/ptmx "$root/dev/ptmx"
    ln -s /proc/self/fd "$root/dev/fd"
    for device in "null 3" "zero 5" "full 7" "random 8" "urandom 9"; do
        mknod -m 666 "$root/dev/${device% *}" c 1 "${device#* }"
    done
    mount -t tmpfs none "$root/run"
    mount -t tmpfs none "$root/tmp"
    mkdir "$root/tmp/share"
    mount --bind "$1/share" "$root/tmp/share"
    cat > "$root/etc/systemd/system/check.service" << UNIT
[Unit]
DefaultDependencies=no
[Service]
Type=oneshot
TimeoutStartSec=150
ExecStart=/tmp/share/check_booted.sh
ExecStopPost=systemctl --force --force poweroff
StandardOutput=append:/tmp/share/log
StandardError=append:/tmp/share/log
UNIT
    printf '[Unit]\nWants=check.service\nAfter=check.service\nDefaultDependencies=no\n' > "$root/etc/systemd/system/check.target"
    container=biplane exec chroot "$root" /lib/systemd/systemd --system --unit=check.target --log-target=console --show-status=0
}
export -f root_of_machine

(
    echo "$BASHPID" > "$cgroup/cgroup.procs"
    exec timeout --kill-after=5 200 unshare --mount --pid --fork --kill-child --uts --ipc --net --cgroup --mount-proc \
        bash -c "root_of_machine '$work'"
) > "$work/console" 2>&1 < /dev/null || true

grep -q '^booted$' "$work/share/log" 2> "$work/grep.log" || leave_out "it does not boot here: $work/console"
grep -qx PASS "$work/share/log" || { tail -n 40 "$work/share/log" >&2; exit 1; }
grep '^ok: ' "$work/share/log"
