# %% [markdown]
# # Design an encoder
#
# An electrode represents a disc of skin. An encoder converts the touch there to amplitude and frequency, within limits that the
# scene must set. Research software: see the warning at the top of [From spikes to stimulation commands](../core/encoding/README.md).

# %%
import matplotlib.pyplot as plt
import merkel
import numpy as np

SCENE = """
preset = "goodwin"

[[electrode]]
name = "E1"
field_mm = [15, 10, 3]
encoder = "{encoder}"
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]

[stimulation]
update_ms = 10
phase_us = 200
max_charge_nC = 16
max_total_uA = 300
max_slope_uA_per_s = 2000
watchdog_ms = 100
"""
time_s = np.arange(0, 1.5, 0.001)
force_N = 0.5 * np.clip(np.minimum(time_s - 0.2, 1.3 - time_s) / 0.05, 0, 1)

# %% [markdown]
# One press through three encoders. `linear` follows the force; `rate` and `recruited` follow the afferents, which fire most during
# the ramp.

# %%
figure, axes = plt.subplots(4, sharex=True, figsize=(7, 7))
axes[0].plot(time_s, force_N)
axes[0].set_ylabel("force (N)")
for axis, encoder in zip(axes[1:], ["linear", "rate", "recruited"]):
    run = merkel.Scene.from_text(SCENE.format(encoder=encoder)).run(time_s=time_s, force_N=force_N)
    commands = run.stimulation
    axis.step(commands["time_s"], commands["amplitude_uA"], where="post")
    axis.set_ylabel(f"{encoder} (µA)")
    assert commands["amplitude_uA"].max() <= 80
axes[-1].set_xlabel("time (s)")
figure.tight_layout()

# %% [markdown]
# A scene whose own ranges break its limits is refused, with the reason.

# %%
try:
    merkel.Scene.from_text(SCENE.format(encoder="rate").replace("max_charge_nC = 16", "max_charge_nC = 10")).run(probe="sim:ramp")
    raise AssertionError("the limit was not enforced")
except merkel.Error as error:
    print(error)
