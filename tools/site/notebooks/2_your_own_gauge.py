# %% [markdown]
# # Your own gauge
#
# A device that prints lines is enough. Here a simulated one replaces it: `merkel simulate-probe` sends a recorded press on a
# pseudo-terminal, in real time. With a real gauge, use its port (`/dev/ttyUSB0`) instead.

# %%
import pathlib
import subprocess
import tempfile

import merkel
import numpy as np

folder = pathlib.Path(tempfile.mkdtemp())
port = folder / "gauge"
device = subprocess.Popen(["merkel", "simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv", "--repeat", "--link", port],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
uri = device.stdout.readline().strip()

# %% [markdown]
# `merkel connect` recognises the protocol, measures rate, jitter and clock, and writes a scene file.

# %%
done = subprocess.run(["merkel", "connect", port, "--yes", "--out", folder / "gauge.toml"],
                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
print(done.stdout.replace(str(folder), "FOLDER"))
assert done.returncode == 0

# %% [markdown]
# The live bridge reads the device, simulates the afferents and hands over spikes as they come. A session records the whole run.

# %%
received = []
with merkel.connect(f"serial:{port}?protocol=hbf1", "finger", sinks=[f"xdf:{folder / 'session.xdf'}"], duration_s=3) as bridge:
    for spikes, _ in bridge:
        received.append(spikes)
device.terminate()
device.communicate()
spikes = np.concatenate(received)
assert len(spikes) > 0
f"{len(spikes)} spikes live"

# %% [markdown]
# The recorded session reproduces the spikes of the live run, bit for bit.

# %%
session = merkel.load(folder / "session.xdf")
done = subprocess.run(["merkel", "replay", folder / "session.xdf"], capture_output=True, text=True)
print(done.stdout)
assert done.returncode == 0 and len(session.spikes) == len(spikes)
