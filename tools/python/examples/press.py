"""A press and the spikes of its afferents, as a picture: press.py [FILE.png]"""
import sys

import matplotlib
import merkel
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

scene = merkel.Scene("finger")
time_s = np.arange(0, 1.2, 0.001)
depth_mm = 1.5 * np.clip(np.minimum(time_s - 0.1, 1.1 - time_s) / 0.1, 0, 1)
run = scene.run(depth_mm=depth_mm, time_s=time_s)

figure, (press, raster, rate) = plt.subplots(3, sharex=True)
press.plot(time_s, depth_mm)
press.set_ylabel("depth (mm)")
raster.plot(run.spikes["time_s"], run.spikes["neuron"], "|k", markersize=2)
raster.set_ylabel("afferent")
rate.step(run.start_s + 0.02 * np.arange(len(run.psth(0.02))), run.psth(0.02), where="post")
rate.set_ylabel("mean rate (Hz)")
rate.set_xlabel("time (s)")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "press.png")
