"""Draws the stimulation commands of three encoders for one press. usage: encoding.py MERKEL OUT.png"""

import csv
import io
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ENCODERS = ("linear", "okorokova", "rate")
SCENE = """preset = "goodwin"
[stimulation]
max_charge_nC = 16
max_total_uA = 1000
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
rows = list(csv.DictReader(io.StringIO(text)))
with open(TRACE, encoding="utf-8") as file:
    press = list(csv.DictReader(line for line in file if not line.startswith("#")))

figure, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True)
axes[0].plot([float(p["time_s"]) for p in press], [float(p["depth_mm"]) for p in press], color="black")
axes[0].set_ylabel("depth (mm)")
for name in ENCODERS:
    own = [row for row in rows if row["electrode"] == name]
    times = [float(row["time_s"]) for row in own]
    for axis, key, label in ((axes[1], "amplitude_uA", "amplitude (µA)"),
                             (axes[2], "frequency_Hz", "frequency (Hz)")):
        axis.step(times, [float(row[key]) for row in own], where="post", label=name)
        axis.set_ylabel(label)
axes[1].legend()
axes[2].set_xlabel("time (s)")
figure.tight_layout()
figure.savefig(sys.argv[2], dpi=110, metadata={"Software": None})
