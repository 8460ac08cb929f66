#!/usr/bin/env bash
# Whether udev understands a rules file, and whether a port with a role gets its name, group and mode.
#   check_udev.sh FILE.rules      with `biplane-onboard` on PATH, whose rules for roles are tried as well
# Needs root: it works in a mount namespace of its own, whose /dev and /run are empty.
set -euo pipefail
if [ "${2:-}" != inside ]; then
    if [ "$(id -u)" != 0 ] || ! unshare --mount true 2> /dev/null; then
        echo "LEFT OUT: udev rules (needs root and mount namespaces)" >&2
        exit 0
    fi
    exec unshare --mount "$0" "$(realpath "$1")" inside
fi
rules="$1"
mount -t tmpfs none /dev
mount -t tmpfs none /run
mkdir -p /run/udev/rules.d
mknod -m 666 /dev/null c 1 3
cp "$rules" /run/udev/rules.d/90-biplane.rules

# A line that udev must complain of shows that it reads the folder.
echo 'NO_SUCH_KEY=="biplane"' > /run/udev/rules.d/91-wrong.rules
said="$(udevadm test --action=add /sys/class/net/lo 2>&1 | grep -E '9[01]-[a-z]*\.rules' || true)"
[[ "$said" = *91-wrong*NO_SUCH_KEY* ]] || { echo "udev does not read /run/udev/rules.d" >&2; exit 1; }
rm /run/udev/rules.d/91-wrong.rules
wrong="$(grep -vE '91-wrong|Reading (rules )?file|Skipping overridden file' <<< "$said" || true)"
[ -z "$wrong" ] || { echo "$wrong" >&2; exit 1; }

port=/sys/class/tty/ttyS0
[ -e "$port" ] || { echo "LEFT OUT: a port with a role (no ttyS0 here)" >&2; exit 0; }
mknod /dev/ttyS0 c 4 64
biplane-onboard udev-rule --base /dev/ttyS0 > /run/udev/rules.d/70-biplane-roles.rules
properties="$(udevadm test --action=add "$port" 2>&1)"
[[ "$properties" = *ID_MM_PORT_IGNORE=1* ]] || { echo "ModemManager is not kept away" >&2; exit 1; }
[ "$(readlink /dev/base)" = ttyS0 ] || { echo "/dev/base is not there" >&2; exit 1; }
[ "$(stat -c '%G %a' /dev/ttyS0)" = "dialout 660" ] || { echo "/dev/ttyS0 has $(stat -c '%G %a' /dev/ttyS0)" >&2; exit 1; }
