"""One run of `biplane` over a file, and what it must not do: every run ends in time and memory, without a
panic."""

import subprocess
import time
from pathlib import Path

from lib.programs import peak_memory_mb

LONGEST_S, MOST_MB = 60, 1500


class Trials:
    """Counts runs, and notes what is wrong with them. Files are those of the current folder."""

    def __init__(self):
        self.runs, self.faults = 0, []

    def run(self, name, *words):
        """Exit code and what was said."""
        self.runs += 1
        with open("said", "wb") as said:
            process = subprocess.Popen(["biplane", *map(str, words)], stdout=said, stderr=subprocess.STDOUT)
            end, peak_mb = time.monotonic() + LONGEST_S, 0.0
            while process.poll() is None:
                peak_mb = max(peak_mb, peak_memory_mb(process.pid))
                if time.monotonic() > end:
                    process.kill()
                    self.faults.append(f"{name}: not done after {LONGEST_S} s")
                time.sleep(0.005)
        text = Path("said").read_text(errors="replace")
        if process.returncode not in (0, 1, 2) or "panicked" in text:
            self.faults.append(f"{name}: exit code {process.returncode}: {text.strip()[-300:]}")
        if peak_mb > MOST_MB:
            self.faults.append(f"{name}: {peak_mb:.0f} MB")
        return process.returncode, text

    def expect(self, name, condition, what):
        if not condition:
            self.faults.append(f"{name}: {what}")

    def fails(self, name, *says, command="planes"):
        """A file that is refused: exit code 1, one line that says why, nothing left behind."""
        code, text = self.run(name, command, name, "-o", "left")
        is_one_line = text.count("\n") == 1 and text.startswith("biplane: ")
        self.expect(name, code == 1, f"exit code {code}")
        self.expect(name, is_one_line, f"says more than one line: {text[:300]}")
        self.expect(name, all(word in text for word in says), f"does not say {says}: {text.strip()[:300]}")
        self.expect(name, not list(Path.cwd().glob("left*")), "leaves a folder")


trials = Trials()
run, expect, fails = trials.run, trials.expect, trials.fails
