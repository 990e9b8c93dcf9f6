# %% [markdown]
# # From a session to NWB and Elephant
#
# A session holds a whole run. `merkel export` converts it to NWB; Neo's objects lead to Elephant.

# %%
import pathlib
import subprocess
import tempfile

import h5py
import merkel
import neo
import numpy as np

folder = pathlib.Path(tempfile.mkdtemp())
scene = merkel.Scene("finger")
scene.run(probe="sim:taps?count=3", sinks=[f"xdf:{folder / 'session.xdf'}"])
subprocess.run(["merkel", "export", folder / "session.xdf", "--sink", f"nwb:{folder / 'session.nwb'}"], check=True,
               capture_output=True)
session = merkel.load(folder / "session.xdf")
len(session.spikes)

# %% [markdown]
# NWB is HDF5: the spike times are in the table `units`, and any NWB reader opens the file.

# %%
with h5py.File(folder / "session.nwb") as nwb:
    times_s = nwb["units/spike_times"][:]
    print(sorted(nwb), len(times_s), "spikes")
assert len(times_s) == len(session.spikes)

# %% [markdown]
# A spike train of Neo for each afferent that fired. These are the input of Elephant's functions.

# %%
end_s = float(session.spikes["time_s"].max()) + 0.001
trains = [neo.SpikeTrain(session.spikes["time_s"][session.spikes["neuron"] == neuron], units="s", t_stop=end_s, neuron=int(neuron))
          for neuron in np.unique(session.spikes["neuron"])]
segment = neo.Segment()
segment.spiketrains.extend(trains)
f"{len(trains)} trains, {sum(len(train) for train in trains)} spikes"

# %% [markdown]
# With Elephant installed (`pip install elephant`), for example:
#
# ```python
# from elephant.statistics import instantaneous_rate, cv2, isi
# rates = instantaneous_rate(segment.spiketrains, sampling_period=5 * quantities.ms)
# irregularity = [cv2(isi(train)) for train in segment.spiketrains if len(train) > 3]
# ```
#
# The same measure of irregularity by numpy:

# %%
intervals = [np.diff(train.magnitude) for train in trains if len(train) > 3]
cv2 = [np.mean(2 * np.abs(np.diff(each)) / (each[1:] + each[:-1])) for each in intervals]
f"median CV2 of {len(cv2)} afferents: {np.median(cv2):.2f}"
