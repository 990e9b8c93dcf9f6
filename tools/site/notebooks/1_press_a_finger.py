# %% [markdown]
# # Press a finger
#
# A flat plate presses the preset `finger` by 1.5 mm and is lifted again. The run takes the depth as an array and returns the spikes
# as an array.

# %%
import matplotlib.pyplot as plt
import merkel
import numpy as np

scene = merkel.Scene("finger")
time_s = np.arange(0, 1.2, 0.001)
depth_mm = 1.5 * np.clip(np.minimum(time_s - 0.1, 1.1 - time_s) / 0.1, 0, 1)
run = scene.run(time_s=time_s, depth_mm=depth_mm)
len(run.spikes), len(scene.afferents)

# %% [markdown]
# Each mark is a spike. The afferents fire during the ramp, and more slowly while the press is held.

# %%
figure, (press, raster, rate) = plt.subplots(3, sharex=True, figsize=(7, 6))
press.plot(time_s, depth_mm)
press.set_ylabel("depth (mm)")
raster.plot(run.spikes["time_s"], run.spikes["neuron"], "|k", markersize=2)
raster.set_ylabel("afferent")
psth = run.psth(0.02)
rate.step(run.start_s + 0.02 * np.arange(len(psth)), psth, where="post")
rate.set_ylabel("mean rate (Hz)")
rate.set_xlabel("time (s)")
figure.tight_layout()

# %% [markdown]
# The same spikes on the skin: every afferent is drawn at the centre of its receptive field, its area grows with its number of spikes.

# %%
afferents = scene.afferents
counts = np.bincount(run.spikes["neuron"], minlength=len(afferents) + 1)[1:]
figure, skin = plt.subplots(figsize=(7, 4.5))
skin.scatter(afferents["x_mm"], afferents["y_mm"], s=1, color="0.7")
skin.scatter(afferents["x_mm"], afferents["y_mm"], s=2 * counts)
skin.set_aspect("equal")
skin.set_xlabel("x, along the finger (mm)")
skin.set_ylabel("y (mm)")
figure.tight_layout()

# %% [markdown]
# The same samples and the same seed give the same spikes, bit for bit.

# %%
again = scene.run(time_s=time_s, depth_mm=depth_mm)
assert np.array_equal(again.spikes, run.spikes)
