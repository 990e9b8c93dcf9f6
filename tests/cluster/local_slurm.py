"""A Slurm cluster of one node, this machine, for the duration of a with block. Needs root."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time

PROGRAMS = {"slurmctld": "slurmctld", "slurmd": "slurmd", "munged": "munge", "sbatch": "slurm-client",
            "scancel": "slurm-client"}


def missing():
    """Why it cannot start here; empty if it can."""
    if os.getuid() != 0:
        return "Slurm's daemons need root"
    for program, package in PROGRAMS.items():
        if shutil.which(program) is None:
            return f"{program} is missing (tools/install_packages cluster installs {package})"
    return ""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class LocalSlurm:
    def __init__(self):
        self._daemons = []

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory(prefix="merkel-slurm-", dir="/var/tmp")
        self.folder = pathlib.Path(self._folder.name)
        self.folder.chmod(0o755)
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _daemon(self, *command):
        with open(self.folder / (command[0] + ".log"), "w") as log:
            self._daemons.append(subprocess.Popen(command, stdout=log, stderr=log, env=self.environment,
                                                  start_new_session=True))

    def _start(self):
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o600)
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}
        munge = self.folder / "munge.socket"
        self._daemon("munged", "--foreground", f"--socket={munge}", f"--key-file={key}", f"--log-file={self.folder}/munge.log",
                     f"--pid-file={self.folder}/munged.pid", f"--seed-file={self.folder}/munge.seed", "--num-threads=2")
        self._wait(munge.exists, "munged")
        host = socket.gethostname()
        (self.folder / "state").mkdir()
        (self.folder / "spool").mkdir()
        (self.folder / "slurm.conf").write_text(f"""
ClusterName=merkel
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={munge}
CredType=cred/munge
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/controller.log
SlurmdLogFile={self.folder}/node.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000,requeue_delay=1
MinJobAge=300
KillWait=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
        self._daemon("slurmctld", "-D")
        self._daemon("slurmd", "-D")
        self._wait(lambda: "idle" in self.run("sinfo", "-h", "-o", "%t", check=False), "an idle node")

    def run(self, *command, check=True):
        done = subprocess.run(command, capture_output=True, text=True, env=self.environment, timeout=60)
        if check and done.returncode:
            raise RuntimeError(f"{' '.join(command)}: {done.stderr}")
        return done.stdout

    def _wait(self, condition, what):
        deadline = time.monotonic() + 60
        while not condition():
            dead = [daemon.args[0] for daemon in self._daemons if daemon.poll() is not None]
            if dead or time.monotonic() > deadline:
                logs = "".join(path.read_text()[-2000:] for path in self.folder.glob("*.log"))
                raise RuntimeError(f"no {what}; ended: {dead}\n{logs}")
            time.sleep(0.1)

    def cancel_all(self):
        """Ends every job: the daemons would leave their processes behind."""
        self.run("scancel", "--full", "--signal=KILL", "--state=RUNNING", check=False)
        self.run("scancel", "--user=root", check=False)
        deadline = time.monotonic() + 30
        while self.run("squeue", "-h", "-o", "%i", check=False).strip() and time.monotonic() < deadline:
            time.sleep(0.1)

    def __exit__(self, *exc):
        if any(daemon.args[0] == "slurmd" and daemon.poll() is None for daemon in self._daemons):
            self.cancel_all()
        for daemon in reversed(self._daemons):
            if daemon.poll() is None:
                daemon.send_signal(signal.SIGTERM)
                try:
                    daemon.wait(20)
                except subprocess.TimeoutExpired:
                    daemon.kill()
                    daemon.wait()
        self._folder.cleanup()
