#!/usr/bin/env bash
# Inside the machine that check_boot.sh boots. It says PASS, or it has failed.
set -euo pipefail
echo booted
unit=biplane-onboard.service
records=/var/lib/biplane
fail() { echo "FAIL: $*"; systemctl status --no-pager --lines=30 "$unit" || true; ls -l "$records" || true; exit 1; }
property() { systemctl show --value --property "$1" "$unit"; }
wait_for() { # SECONDS WHAT COMMAND...
    local end=$((SECONDS + $1)) what="$2"
    shift 2
    until "$@" > /tmp/wait.log 2>&1; do
        [ "$SECONDS" -lt "$end" ] || fail "$what"
        sleep 0.5
    done
}
status_says() { property StatusText | grep -q "$1"; }
runs_as_another() { [ "$(property MainPID)" != "$1" ] && [ "$(property ActiveState)" = active ]; }

# Not `dpkg --purge biplane` if it was there before: this is a copy of that system.
dpkg --force-confnew --install /tmp/share/biplane.deb
[ "$(systemctl is-enabled "$unit")" = disabled ] || fail "enabled by the installation"
[ "$(property ActiveState)" = inactive ] || fail "started by the installation"

systemd-run --quiet --unit=mock biplane-mock serve --world corridor --links /run/mock
wait_for 10 "no mock" test -e /run/mock/base
sed -i 's#"/dev/#"/run/mock/#' /etc/biplane/rig.toml

# A device that anybody may open and that is no serial port: the sandbox keeps it shut. (It leaves pseudo-terminals open.)
minor="$(awk '$2 == "fuse" || $2 == "tun" { print $1; exit }' /proc/misc)"
if [ -n "$minor" ]; then
    mknod -m 666 /dev/other c 10 "$minor"
    setpriv --reuid=nobody --clear-groups bash -c ': <> /dev/other' || fail "/dev/other cannot be opened at all"
    cp /etc/biplane/rig.toml /tmp/rig.toml
    sed -i 's#/run/mock/base#/dev/other#' /etc/biplane/rig.toml
    systemctl start --no-block "$unit"
    wait_for 10 "a device outside the sandbox was not refused" bash -c "journalctl --no-pager --unit $unit | grep 'dev/other.*not permitted'"
    systemctl stop "$unit"
    [ -z "$(find "$records" -name '*.mcap*')" ] || fail "a device outside the sandbox was opened"
    cp /tmp/rig.toml /etc/biplane/rig.toml
    echo "ok: devices outside the sandbox stay shut"
fi

systemctl start "$unit"
wait_for 20 "no status line with a pose" status_says "matched"
first="$(property MainPID)"
for word in "NoNewPrivs:[[:space:]]1" "Seccomp:[[:space:]]2" "CapEff:[[:space:]]0000000000000000" "Uid:[[:space:]]$(id -u biplane)[[:space:]]"; do
    grep -q "^$word" "/proc/$first/status" || fail "$word: $(cat "/proc/$first/status")"
done
[ "$(stat -c '%U %a' "$records"/run-0001-*.mcap.active)" = "biplane 640" ] || fail "owner or mode of the recording"
echo "ok: records as $(stat -c %U /proc/"$first"), status: $(property StatusText)"

# It hangs: the watchdog ends it, systemd starts it again, what was cut off is made whole.
kill -STOP "$first"
wait_for 40 "the watchdog did not start it again" runs_as_another "$first"
wait_for 20 "it does not stream again" status_says "matched"
[ "$(property NRestarts)" = 1 ] || fail "$(property NRestarts) restarts"
[ -e "$(echo "$records"/run-0001-*.mcap)" ] || fail "the recording that was cut off was not made whole"
echo "ok: hung, ended by the watchdog, salvaged, started again"

systemctl stop "$unit"
[ "$(property Result)" = success ] || fail "stopped with $(property Result)"
[ "$(find "$records" -name '*.mcap' | wc -l) $(find "$records" -name '*.active' | wc -l)" = "2 0" ] || fail "two finished recordings were to be there"
for recording in "$records"/*.mcap; do
    biplane info "$recording" | grep -q /scan/vertical || fail "$recording"
done
dpkg --purge biplane
[ "$(find "$records" -name '*.mcap' | wc -l)" = 2 ] || fail "purging took recordings away"
echo "ok: stopped, two recordings, which stay when the package goes"
echo PASS
