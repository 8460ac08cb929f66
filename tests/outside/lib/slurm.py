"""A Slurm cluster of one machine: munge, a controller and nodes of one processor each, all in one folder,
without systemd. Needs root and Debian's slurm-wlm and munge."""

import os
import signal
import socket
import subprocess
from pathlib import Path

from lib.programs import wait_until

CONFIG = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmctldPort={port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/controller.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,batch_sched_delay=0,sched_min_interval=0
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
MinJobAge=600
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Cluster:
    """Runs as long as the block does."""

    def __init__(self, folder, nodes, first_port=17650):
        self.folder, self.nodes, self.port = Path(folder), nodes, first_port
        self.running = {}
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self):
        host = socket.gethostname().split(".")[0]
        lines = [
            f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={self.port + 1 + number} CPUs=1"
            for number, name in enumerate(self.nodes)
        ]
        for name in ["state", *self.nodes]:
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        config = CONFIG.format(host=host, port=self.port, folder=self.folder, nodes="\n".join(lines))
        (self.folder / "slurm.conf").write_text(config)
        try:
            self._start_munge()
            self._start("controller", ["slurmctld", "-D", "-i", "-f", str(self.folder / "slurm.conf")])
            for name in self.nodes:
                self._start(name, ["slurmd", "-D", "-N", name, "-f", str(self.folder / "slurm.conf")])
            self.wait(
                lambda: self.said("sinfo", "-h", "-t", "idle", "-o", "%D").strip() == str(len(self.nodes)), 40
            )
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for name in [*self.nodes, "controller", "munge"]:
            self.kill(name)

    def _start_munge(self):
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        self.folder.chmod(0o755)
        of_munge = ["socket", "pid-file", "log-file", "seed-file"]
        words = [f"--{name}={self.folder}/munge.{name.split('-')[0]}" for name in of_munge]
        self._start("munge", ["munged", "--foreground", "--force", f"--key-file={key}", *words])
        self.wait((self.folder / "munge.socket").exists, 10)

    def _start(self, name, command):
        log = (self.folder / f"{name}.out").open("w")
        self.running[name] = subprocess.Popen(
            command, stdout=log, stderr=log, env=self.environment, start_new_session=True
        )

    def kill(self, name):
        """A power cut: the daemon and the jobs of the node, without a word."""
        process = self.running.pop(name, None)
        if process is None:
            return
        # Jobs are sessions of their own; their step daemons tell the node's name.
        found = subprocess.run(
            ["ps", "-eo", "pid=,sid=,args="], capture_output=True, text=True, check=True
        ).stdout
        rows = [line.split(None, 2) for line in found.splitlines()]
        below = {process.pid}
        for _ in range(4):
            below |= {int(pid) for pid, *_ in rows if self._parent(int(pid)) in below}
        spool = str(self.folder / name)
        below |= {int(pid) for pid, _, words in rows if spool in words and "slurm" in words}
        for pid in below:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        process.wait()

    @staticmethod
    def _parent(pid):
        try:
            return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, ValueError):
            return None

    def said(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, env=self.environment, cwd=self.folder)
        return done.stdout

    def wait(self, done, seconds):
        wait_until(done, seconds, f"the cluster took more than {seconds} s; see {self.folder}")
