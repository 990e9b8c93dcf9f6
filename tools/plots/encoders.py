"""Draws the tables of `merkel compare-encoders --out DIR`. usage: encoders.py DIR"""

import pathlib
import sys

from tables import plt, read_table, select

FOLDER = pathlib.Path(sys.argv[1])
touch = read_table(FOLDER / "touch.csv")
encoders = read_table(FOLDER / "encoders.csv")

figure, axes = plt.subplots(2, 1, figsize=(9, 6), sharex=True)
for probe in sorted(set(touch["probe"])):
    own = select(touch, probe=probe)
    axes[0].plot(own["time_s"], own["depth_mm"], label=f"probe {probe:.0f}")
axes[0].set_ylabel("depth (mm)")
if len(set(touch["probe"])) > 1:
    axes[0].legend()
for name in dict.fromkeys(encoders["encoder"]):
    own = select(encoders, encoder=name)
    axes[1].step(own["time_s"], own["charge_uC_per_s"], where="post", label=name)
axes[1].set_ylabel("charge (µC/s)")
axes[1].set_xlabel("time (s)")
axes[1].legend()
figure.savefig(FOLDER / "encoders.png", metadata={"Software": None})
