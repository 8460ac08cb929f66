#!/bin/sh
# Makes the captures of this folder anew, each with its sidecar. The first is the same, byte for byte, each time; the others are
# recorded live from the mock and differ in their times.
# Usage: hil-fixtures/captures/make.sh [FOLDER]   (from anywhere; FOLDER is this one when left out)
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$here}
mkdir -p "$out"
cd "$root"
cargo build --quiet -p biplane-mock -p biplane-onboard
bin=${CARGO_TARGET_DIR:-$root/target}/debug
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill "$server" 2>/dev/null; rm -rf "$work"' EXIT INT TERM

# Ports relative to the work folder: the rig goes into the captures.
cat > "$work/rig.toml" <<TOML
[horizontal]
port = "links/lms-horizontal"
[vertical]
port = "links/lms-vertical"
[base]
port = "links/base"
TOML

# sidecar NAME DEVICE SETTINGS OBTAINED
sidecar() {
    crc=$(gzip -1 -c "$out/$1.mcap" | tail -c 8 | od -An -N4 -tx1 | awk '{ print $4 $3 $2 $1 }')
    cat > "$out/$1.toml" <<TOML
device = "$2"
settings = "$3"
origin = "synthetic"
date = "$(date -u +%Y-%m-%d)"
obtained = '''
$4
'''
crc32 = "$crc"
TOML
}

# live NAME SECONDS SERVE-ARGUMENTS...: record the mock, keep the serial bytes.
live() {
    name=$1
    seconds=$2
    shift 2
    "$bin/biplane-mock" serve --links "$work/links" "$@" 2>"$work/serve.log" &
    server=$!
    tries=0
    until [ -e "$work/links/base" ]; do
        tries=$((tries + 1))
        [ "$tries" -lt 100 ] || { cat "$work/serve.log"; exit 1; }
        sleep 0.1
    done
    (cd "$work" && "$bin/biplane-onboard" --quiet record --rig rig.toml --raw --duration "${seconds}s" -o "$name.mcap" --force)
    kill "$server"
    wait "$server" || true
    server=
    "$bin/biplane-mock" extract "$work/$name.mcap" -o "$out/$name.mcap" --force
}

"$bin/biplane-mock" simulate --world corridor --cruise 0.6 --seed 1 --read-bytes 62 -o "$out/corridor-38400.mcap" --force
sidecar corridor-38400 "two LMS 291-S05 and a Pioneer 3-DX, simulated" \
    "lasers 180 deg, 1 deg, cm, 38400 Bd; base 9600 Bd; reads of at most 62 bytes, 0.3 ms late on average" \
    "biplane-mock simulate --world corridor --cruise 0.6 --seed 1 --read-bytes 62 -o corridor-38400.mcap"

live start-up 5 --world corridor --power-on-message --laser-baud 19200
sidecar start-up "mock: two LMS 291-S05 found at 19200 Bd, and a Pioneer 3-DX" \
    "both directions; lasers 180 deg, 1 deg, cm, taken to 38400 Bd; base 9600 Bd" \
    "biplane-mock serve --world corridor --power-on-message --laser-baud 19200 --links LINKS
biplane-onboard record --rig RIG --raw --duration 5s -o run.mcap
biplane-mock extract run.mcap -o start-up.mcap"

live faults 8 --world corridor --laser-baud 38400 --fault loose-connector --fault bit-noise --fault usb-stall --seed 11
sidecar faults "mock: two LMS 291-S05 and a Pioneer 3-DX behind a loose connector, bit noise and a stalling USB adapter" \
    "both directions; lasers 180 deg, 1 deg, cm, 38400 Bd; base 9600 Bd" \
    "biplane-mock serve --world corridor --laser-baud 38400 --fault loose-connector --fault bit-noise --fault usb-stall --seed 11 --links LINKS
biplane-onboard record --rig RIG --raw --duration 8s -o run.mcap
biplane-mock extract run.mcap -o faults.mcap"
# The longest stall and the longest hiccup of usb-stall: a copy that is served departs when this one was read.
echo "late_reads_ms = 308" >> "$out/faults.toml"
ls -l "$out"
