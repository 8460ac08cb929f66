"""Mock devices on pseudo-terminals in a folder of their own, served by `biplane-mock` for as long as a
program needs them."""

import atexit
import signal
import subprocess

from lib.programs import wait_until

START_S = 60


def rig_text(ports, vertical=True, laser_lines=()):
    """A `rig.toml` whose devices are those that `biplane-mock serve --links PORTS` links, with more lines for
    each laser."""
    lasers = ["horizontal", "vertical"] if vertical else ["horizontal"]
    lines = [
        line for laser in lasers for line in (f"[{laser}]", f'port = "{ports}/lms-{laser}"', *laser_lines)
    ]
    return "\n".join([*lines, "[base]", f'port = "{ports}/base"', ""])


class MockRig:
    """Served devices: `ports` has their links, `rig` names a `rig.toml` of them. They are there once it is
    made, unless `waits` is false, and end with its block."""

    def __init__(self, folder, *words, rig=None, waits=True):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.ports = folder / "ports"
        self.rig = folder / "rig.toml"
        self.rig.write_text(rig or rig_text(self.ports))
        self.log = open(folder / "mock.log", "wb")  # noqa: SIM115 - closed by stop()
        command = ["biplane-mock", "serve", *map(str, words), "--links", str(self.ports)]
        self.process = subprocess.Popen(command, stdout=self.log, stderr=subprocess.STDOUT)
        # Whoever forgets to stop it, or fails: it ends with the program.
        atexit.register(self.process.kill)
        if waits:
            wait_until(
                (self.ports / "base").exists,
                START_S,
                f"`{' '.join(command)}` serves nothing: {folder}/mock.log",
            )

    def stop(self):
        """Asks the devices to end, which writes their truth; returns the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        code = self.process.wait(timeout=60)
        self.log.close()
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
