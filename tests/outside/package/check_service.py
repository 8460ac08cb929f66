#!/usr/bin/env python3
"""The service's own commands, run as systemd would run them, against mock devices; no systemd needed.

    check_service.py UNIT WORKDIR      with biplane-onboard, biplane-mock, biplane on PATH

Ready without its ports; ready and watched with them; killed in mid-recording, its file torn as by a power
cut, and the salvage behind it cut off as well; what was cut off is made whole before the next start, which
takes the next number; stopped as the unit stops it. The rig, the folder of recordings and the programs take
the places of those in the unit. Plain Python; takes 20 s."""

import os
import shlex
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig, rig_text
from lib.programs import fresh_folder, output_of
from lib.verdict import fail, require


def unit_values(unit, key):
    lines = unit.read_text().splitlines()
    return [line.split("=", 1)[1].strip() for line in lines if line.startswith(key + "=")]


class Manager:
    """What systemd is to the service: starts it, hears it, stops it."""

    def __init__(self, unit, work):
        self.unit = unit
        self.work = work
        self.recordings = work / "recordings"
        self.recordings.mkdir(parents=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(work / "notify"))
        self.watchdog_s = float(unit_values(unit, "WatchdogSec")[0])
        self.stop_s = float(unit_values(unit, "TimeoutStopSec")[0])
        self.stop_signal = getattr(signal, unit_values(unit, "KillSignal")[0])

    def words(self, line):
        """A command line of the unit, its paths replaced by ours, its variable by the package's default."""
        etc = self.unit.parents[4] / "etc" if "lib" in self.unit.parts else None
        default = etc / "default/biplane-onboard" if etc else self.unit.parent / "biplane-onboard.default"
        variable = next(row for row in default.read_text().splitlines() if row.startswith("BIPLANE_RECORD="))
        line = line.removeprefix("-").replace("$BIPLANE_RECORD", shlex.split(variable)[0].split("=", 1)[1])
        line = line.replace("/etc/biplane/rig.toml", str(self.work / "rig.toml"))
        line = line.replace("/var/lib/biplane", str(self.recordings)).replace("/usr/bin/", "")
        return shlex.split(line)

    def start(self):
        for line in unit_values(self.unit, "ExecStartPre"):
            done = subprocess.run(self.words(line), check=False)
            require(done.returncode == 0 or line.startswith("-"), f"{line} ended with {done.returncode}")
        environment = dict(os.environ, NOTIFY_SOCKET=str(self.work / "notify"))
        environment["WATCHDOG_USEC"] = str(int(self.watchdog_s * 1e6))
        environment.pop("WATCHDOG_PID", None)
        words = self.words(unit_values(self.unit, "ExecStart")[0])
        with open(self.work / "service.log", "ab") as log:
            self.process = subprocess.Popen(
                words, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )

    def hear(self, seconds):
        """Everything the service says in so many seconds: (time, text)."""
        heard, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                heard.append((time.monotonic(), self.socket.recv(4096).decode()))
            except TimeoutError:
                break
        return heard

    def wait_ready(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            require(self.process.poll() is None, f"it ended with {self.process.returncode}")
            if any("READY=1" in text for _, text in self.hear(0.5)):
                return
        fail(f"not ready within {seconds} s")

    def check_watchdog(self, seconds):
        start = time.monotonic()
        heard = self.hear(seconds)
        alive = [moment for moment, text in heard if "WATCHDOG=1" in text]
        moments = [start, *alive, time.monotonic()]
        longest = max(b - a for a, b in zip(moments, moments[1:]))
        in_time = longest < self.watchdog_s / 2
        require(in_time, f"silent for {longest:.1f} s, the watchdog waits {self.watchdog_s} s")
        require(any("STATUS=" in text for _, text in heard), "it says no status")

    def stop(self):
        self.process.send_signal(self.stop_signal)
        start = time.monotonic()
        code = self.process.wait(timeout=self.stop_s)
        return code, time.monotonic() - start

    def kill(self):
        self.process.kill()
        self.process.wait()

    def names(self):
        return sorted(path.name for path in self.recordings.iterdir())


def power_cut(unfinished):
    """What a power cut may leave: the end never written, in a file that has grown; and half a copy of a
    salvage that was cut off."""
    size = unfinished.stat().st_size
    os.truncate(unfinished, size - size // 7)
    os.truncate(unfinished, size + 5000)
    copy = unfinished.with_name(unfinished.name.removesuffix(".active") + ".recovering")
    copy.write_bytes(os.urandom(5000))


def check_waiting(manager):
    """No adapter is plugged in: it waits, says so, and a stop ends it."""
    manager.start()
    manager.wait_ready(10)
    code, _ = manager.stop()
    require(code == 0, f"stopped while it waited: exit code {code}")
    require(
        not [name for name in manager.names() if name.endswith(".mcap")], f"it recorded {manager.names()}"
    )


def check_recording(manager):
    """Recording, killed, torn, started again, stopped; returns its first file and the seconds that the stop
    took."""
    manager.start()
    manager.wait_ready(20)
    manager.check_watchdog(9)
    first = manager.names()
    require(len(first) == 1 and first[0].endswith(".mcap.active"), f"it records to {first}")
    manager.kill()
    power_cut(manager.recordings / first[0])

    manager.start()
    manager.wait_ready(20)
    manager.hear(8)
    code, seconds = manager.stop()
    allowed = [0, *map(int, unit_values(manager.unit, "SuccessExitStatus"))]
    require(code in allowed, f"stopped: exit code {code}")
    return first[0].removesuffix(".active"), seconds


def main(unit, work):
    (work / "rig.toml").write_text(rig_text(work / "ports"))
    manager = Manager(unit, work)
    check_waiting(manager)
    with MockRig(work, "--world", "corridor", waits=False):
        first, seconds = check_recording(manager)
    # What was torn stays beside what was saved of it.
    names = [name for name in manager.names() if not name.endswith(".damaged")]
    require(len(names) == 2 and all(name.endswith(".mcap") for name in names), f"it left {names}")
    require(names[0] == first and names[0][:8] != names[1][:8], f"{first} became {names}")
    for name in names:
        info = output_of("biplane", "info", manager.recordings / name)
        require("/scan/horizontal" in info and "/pose" in info, f"{name} holds no scans or poses: {info}")
    print(f"recordings {', '.join(names)}; stopped within {seconds:.1f} s")


require(len(sys.argv) == 3, __doc__)
main(Path(sys.argv[1]).resolve(), fresh_folder(sys.argv[2]))
