#!/usr/bin/env python3
"""Has other people's clients of today's lasers read our mock lasers.

    check_network_clients.py WORKDIR [SECONDS]      with `biplane-mock` on PATH

`hokuyolx` streams distances of each second turn, then intensities of each fourth, of a mock UST-10LX over
TCP, after it has read the clock; it checks the sum of every line. `sick-scan-tcp` asks a mock LMS111 in CoLa
A for one scan after the other. Both run for SECONDS (20 when left out) without an error and see the walls of
the corridor. Both decode in Python: on a loaded machine they fall behind, and so does the mock; what is
missing of the stream is printed."""

import logging
import math
import sys
import threading
import time
from pathlib import Path

import hokuyolx
from sick_scan_tcp import SickScan

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig
from lib.programs import fresh_folder, wait_until
from lib.verdict import require

START_S = 30
UST_HZ = 40.0
# Both clients decode in Python and fall behind on a loaded machine.
MIN_HZ = 3.0
# The corridor's walls are 1.1 m to either side of the robot where it stands.
WALL_M, WALL_ERROR_M = 1.1, 0.1
NOWHERE = "127.0.0.1:1"


def served(work, name, protocol, *words):
    """One mock laser on a port of this machine, and its address."""
    rig = f'[horizontal]\nprotocol = "{protocol}"\naddress = "{NOWHERE}"\n[base]\nprotocol = "none"\n'
    folder = work / name
    folder.mkdir()
    (folder / "rig.toml").write_text(rig)
    words = ["--world", "corridor", "--rig", folder / "rig.toml", "--start-after", "1000", *words]
    devices = MockRig(folder, *words, rig=rig, waits=False)
    file = devices.ports / "lms-horizontal.address"
    wait_until(lambda: file.exists() and file.read_text().endswith("\n"), START_S, "no mock laser")
    host, port = file.read_text().strip().split(":")
    return devices, (host, int(port))


def check_side_walls(name, points):
    """`points`: (direction from straight ahead in radians, range in meters) of one scan."""
    for side in (-math.pi / 2, math.pi / 2):
        _, range_m = min(points, key=lambda point: abs(point[0] - side))
        near = abs(range_m - WALL_M) < WALL_ERROR_M
        require(near, f"{name}: the wall at {math.degrees(side):.0f} degrees is {range_m:.2f} m away")


def hokuyo(work, seconds):
    devices, address = served(work, "hokuyolx", "scip", "--hokuyo", "UST-10LX")
    with devices:
        # Its own start asks for %ST, which came with newer firmware than the mock has; it also counts the
        # times that the clock came round. A read that holds the begin of the next scan is an error to it, so
        # that it reads byte by byte.
        laser = hokuyolx.HokuyoLX(addr=address, tsync=False, activate=False, convert_time=False, buf=1)
        laser._tn = 0
        require(laser.model.startswith("UST-10LX"), f"hokuyolx: {laser.model}")
        laser.tsync_enter()
        clock_ms = [laser.tsync_get() for _ in range(10)]
        laser.tsync_exit()
        require(sorted(clock_ms) == clock_ms, f"hokuyolx: the clock says {clock_ms}")
        laser.activate()
        for what, iterate, skips in (
            ("distances", laser.iter_dist, 1),
            ("intensities", laser.iter_intens, 3),
        ):
            begin, scans, missing, last = time.monotonic(), 0, 0, None
            for scan, stamp, _ in iterate(skips=skips):
                scans += 1
                if last is not None:
                    turns = round((stamp - last) * UST_HZ / 1000)
                    off_ms = abs(stamp - last - 1000 * turns / UST_HZ)
                    right = turns > 0 and turns % (skips + 1) == 0 and off_ms <= 1 + 0.1 * turns
                    require(right, f"hokuyolx: {what}: a scan of {stamp} ms behind one of {last} ms")
                    missing += turns // (skips + 1) - 1
                last = stamp
                ranges = scan if what == "distances" else scan[:, 0]
                if time.monotonic() - begin > seconds:
                    break
            rate_hz = scans / (time.monotonic() - begin)
            print(f"hokuyolx: {scans} scans of {len(ranges)} {what}, {rate_hz:.1f} a second")
            print(f"  {missing} missing between the first and the last")
            require(rate_hz > MIN_HZ, f"hokuyolx: only {rate_hz:.1f} scans a second")
            angles = laser.get_angles()
            check_side_walls("hokuyolx", [(a, r / 1000) for a, r in zip(angles, ranges, strict=True)])
            laser.standby()
        laser.close()


def sick(work, seconds):
    devices, (host, port) = served(work, "sick-scan-tcp", "cola", "--network-laser", "LMS111")
    with devices:
        laser = SickScan(host, port)
        laser.socket_sick.settimeout(5)
        begin, scans = time.monotonic(), 0
        while time.monotonic() - begin < seconds:
            text = laser.scan()
            # It sends every request twice, and takes what comes: also the rest of the answer before.
            if not text.startswith("sRA LMDscandata"):
                continue
            directions, ranges_m = laser.extract_telegram(text)
            require(len(ranges_m) == 541, f"sick-scan-tcp: {len(ranges_m)} ranges")
            scans += 1
        rate_hz = scans / (time.monotonic() - begin)
        print(f"sick-scan-tcp: {scans} scans of {len(ranges_m)} ranges, {rate_hz:.1f} a second")
        require(rate_hz > MIN_HZ, f"sick-scan-tcp: only {rate_hz:.1f} scans a second")
        ahead = [(math.radians(degrees - 90), r) for degrees, r in zip(directions, ranges_m, strict=True)]
        check_side_walls("sick-scan-tcp", ahead)
        laser.release()


def main():
    # It tells of every scan that comes behind its request to stop.
    logging.disable(logging.WARNING)
    work = fresh_folder(Path(sys.argv[1]))
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
    failed = []
    threads = []
    for client in (hokuyo, sick):

        def run(client=client):
            try:
                client(work, seconds)
            except BaseException as error:  # noqa: BLE001 - told to the thread that waits
                failed.append(f"{client.__name__}: {error!r}")

        threads.append(threading.Thread(target=run))
        threads[-1].start()
    for thread in threads:
        thread.join()
    require(not failed, "; ".join(failed))


if __name__ == "__main__":
    main()
