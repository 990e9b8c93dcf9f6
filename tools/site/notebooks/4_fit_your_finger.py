# %% [markdown]
# # Fit your finger
#
# Fingers differ in stiffness by a factor of two. One press that records depth and force gives the modulus and the stiffening of
# yours. Here a simulation replaces the recording: a sphere of 4 mm radius on skin of known modulus, with noise.

# %%
import pathlib
import subprocess
import tempfile

import matplotlib.pyplot as plt
import merkel
import numpy as np

folder = pathlib.Path(tempfile.mkdtemp())
random = np.random.default_rng(1)
time_s = np.arange(0, 2, 0.001)
depth_mm = 2 * np.clip(np.minimum(time_s, 2 - time_s), 0, 1)
modulus_kPa, stiffening_mm, radius_mm = 40.0, 1.5, 4.0
force_N = 4 / 3 * modulus_kPa * np.exp(depth_mm / stiffening_mm) * np.sqrt(radius_mm) * depth_mm**1.5 / 1000
force_N += 0.001 * random.standard_normal(len(time_s))
table = np.column_stack([time_s, depth_mm, force_N])
np.savetxt(folder / "press.csv", table, delimiter=",", header="time_s,depth_mm,force_N", comments="", fmt="%.6f")

# %%
done = subprocess.run(["merkel", "fit", "skin", "paper", "--trace", folder / "press.csv", "--radius-mm", str(radius_mm),
                       "--out", folder / "mine.toml"], capture_output=True, text=True)
print((done.stdout + done.stderr).replace(str(folder), "FOLDER"))
assert done.returncode == 0

# %% [markdown]
# The recording and the fitted law:

# %%
rows = [line.split(",") for line in done.stdout.split("depth_mm,force_N,model_N\n")[1].splitlines() if "," in line]
fitted = np.array([row for row in rows if len(row) == 3], dtype=float)
figure, axis = plt.subplots(figsize=(7, 4))
axis.plot(depth_mm, force_N, ".", markersize=1, label="recording")
axis.plot(fitted[:, 0], fitted[:, 2], label="fit")
axis.set_xlabel("depth (mm)")
axis.set_ylabel("force (N)")
axis.legend()
figure.tight_layout()
assert np.abs(fitted[:, 2] - fitted[:, 1]).max() < 0.05 * force_N.max()

# %% [markdown]
# The written scene is complete: it runs as any other.

# %%
scene = merkel.Scene(folder / "mine.toml")
print(f"stiffening {scene['skin.stiffening_mm']:.2f} mm (made with {stiffening_mm} mm)")
assert abs(scene["skin.stiffening_mm"] / stiffening_mm - 1) < 0.1
len(scene.run(time_s=time_s, depth_mm=depth_mm).spikes)
