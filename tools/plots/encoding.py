"""Draws the stimulation commands of three encoders for one press. usage: encoding.py MERKEL OUT.png"""

import subprocess
import sys
import tempfile

from tables import plt, read_table, select, table_of

ENCODERS = ("linear", "okorokova", "rate")
SCENE = """preset = "goodwin"
[stimulation]
max_charge_nC = 16
max_total_uA = 1000
watchdog_ms = 100
"""
ELECTRODE = """[[electrode]]
name = "{0}"
encoder = "{0}"
field_mm = [15, 10, 4]
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
"""
TRACE = "tests/traces/ramp_and_hold.csv"

with tempfile.NamedTemporaryFile("w", suffix=".toml") as scene:
    scene.write(SCENE + "".join(map(ELECTRODE.format, ENCODERS)))
    scene.flush()
    text = subprocess.run([sys.argv[1], "inspect", "encoding", scene.name, "--probe",
                           "replay:" + TRACE], check=True, capture_output=True, text=True).stdout
commands = table_of(text.splitlines())
press = read_table(TRACE)

figure, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True)
axes[0].plot(press["time_s"], press["depth_mm"], color="black")
axes[0].set_ylabel("depth (mm)")
for name in ENCODERS:
    own = select(commands, electrode=name)
    for axis, key, label in ((axes[1], "amplitude_uA", "amplitude (µA)"),
                             (axes[2], "frequency_Hz", "frequency (Hz)")):
        axis.step(own["time_s"], own[key], where="post", label=name)
        axis.set_ylabel(label)
axes[1].legend()
axes[2].set_xlabel("time (s)")
figure.savefig(sys.argv[2], metadata={"Software": None})
