#!/usr/bin/env python3
"""Has somebody else's LMS 2xx client read our mock laser.

    check_clients.py WORKDIR      with `biplane-mock`, `rawlog-grabber`, `rawlog-edit` on PATH

`rawlog-grabber` of Debian's mrpt-apps runs at 38400 and at 500000 Bd, with its own search for the rate and
its own set-up; what it wrote is judged by MRPT's own `rawlog-edit`. Takes 40 s."""

import re
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig
from lib.programs import fresh_folder
from lib.verdict import fail, require

# A scan of 181 values fills 96.9 ms of a 38400 Bd line, so that every eighth turn is sent: 9.38 Hz; at 500000
# Bd every turn is: 75.08 Hz. A loaded machine is allowed to lose some. The client spends four seconds on its
# search and set-up. Baud, seconds, scans a second at least.
RATES = [(38400, 18, 9), (500000, 10, 70)]
LEAST_SCANS = 100
LONGEST_S = 60
INI = """[global]
rawlog_prefix = {prefix}
time_between_launches = 100
use_sensoryframes = 0
GRABBER_PERIOD_MS = 100
[LASER]
driver = CSickLaserSerial
process_rate = 150
sensorLabel = LASER
COM_port_LIN = {port}
COM_baudRate = {baud}
mm_mode = 1
FOV = 180
resolution = 100
pose_x = 0
pose_y = 0
pose_z = 0
pose_yaw = 0
pose_pitch = 0
pose_roll = 0
"""


class Client:
    """One run of rawlog-grabber at one rate."""

    def __init__(self, work, baud):
        self.baud = baud
        self.folder = work / str(baud)
        self.folder.mkdir()
        self.log = self.folder / "grabber.log"

    def require(self, condition, sentence):
        if condition:
            return
        for log in (self.log, self.folder / "mock.log"):
            lines = log.read_text(errors="replace").splitlines() if log.exists() else []
            print(*lines[-30:], sep="\n", file=sys.stderr)
        fail(f"rawlog-grabber at {self.baud} Bd: {sentence}")

    def grab(self, seconds):
        """Lets it read for so long. It ends at the first byte on its standard input, or at its end."""
        devices = MockRig(self.folder, "--world", "corridor")
        try:
            ini = self.folder / "laser.ini"
            prefix, port = self.folder / "out", devices.ports / "lms-horizontal"
            ini.write_text(INI.format(prefix=prefix, port=port, baud=self.baud))
            with open(self.log, "wb") as log:
                grabber = subprocess.Popen(
                    ["rawlog-grabber", ini], stdin=subprocess.PIPE, stdout=log, stderr=log
                )
                time.sleep(seconds)
                grabber.stdin.close()
                try:
                    code = grabber.wait(timeout=LONGEST_S - seconds)
                except subprocess.TimeoutExpired:
                    grabber.kill()
                    code = grabber.wait()
        finally:
            mock_code = devices.stop()
        self.require(mock_code == 0, f"biplane-mock failed with {mock_code}")
        self.require(code == 0, f"it ended with {code}")
        wrong = re.search(
            r"(?i)^.*(error|exception|warn|cannot|timeout).*$", self.log.read_text(errors="replace"), re.M
        )
        self.require(not wrong, f"its log has an error: {wrong and wrong.group()}")

    def edited(self, *words):
        """What rawlog-edit says, of the first file that was written."""
        rawlog = min(self.folder.glob("out_*.rawlog"), default=None)
        self.require(rawlog, "it wrote no file")
        done = subprocess.run(
            ["rawlog-edit", *words, "-i", rawlog.name], cwd=self.folder, capture_output=True, text=True
        )
        self.require(done.returncode == 0, f"its file does not read back: {done.stderr}")
        return done.stdout

    def count(self, least_hz):
        """Scans and their rate, by MRPT's own reader. Its line is `Sensor (Label/Occurs/Rate/Durat.) : LASER
        / scans / rate / s`."""
        line = re.search(r"^Sensor .*", self.edited("--info"), re.M)
        self.require(line, "no scan in its file")
        scans, rate_hz = line.group().split("/")[-3:-1]
        self.require(int(scans) >= LEAST_SCANS, f"{scans} scans, wanted {LEAST_SCANS}")
        self.require(float(rate_hz) >= least_hz, f"{rate_hz} scans a second, wanted {least_hz}")
        return int(scans), float(rate_hz)

    def check_contents(self):
        """The robot stands between the corridor's walls, 1.1 m to either side: the outermost of 181 beams see
        them in every scan."""
        self.edited("--export-2d-scans-txt")
        texts = [path.read_text() for path in self.folder.glob("*_LASER.txt")]
        rows = [line.split() for text in texts for line in text.splitlines() if not line.startswith("%")]
        wrong = sum(
            len(row) != 363 or not all(0.9 <= float(range_m) <= 1.3 for range_m in (row[1], row[181]))
            for row in rows
        )
        self.require(
            len(rows) >= LEAST_SCANS and wrong == 0,
            f"{wrong} of its {len(rows)} scans are not of the corridor",
        )


def main(work):
    for baud, seconds, least_hz in RATES:
        client = Client(work, baud)
        client.grab(seconds)
        scans, rate_hz = client.count(least_hz)
        client.check_contents()
        print(f"ok: rawlog-grabber at {baud} Bd: {scans} scans, {rate_hz:g} a second, no error")


require(len(sys.argv) == 2, __doc__)
main(fresh_folder(sys.argv[1]))
