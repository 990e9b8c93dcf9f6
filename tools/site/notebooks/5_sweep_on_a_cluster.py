# %% [markdown]
# # Sweep on a cluster
#
# Every run is a function of its scene, its samples and its seed. A sweep is therefore a table of jobs, on the cores of one
# machine or on a cluster. Here: the mean rate against the depth of a press, for three seeds of the receptors.

# %%
import itertools

import matplotlib.pyplot as plt
import merkel
import numpy as np

time_s = np.arange(0, 0.5, 0.001)
cases = list(itertools.product(np.linspace(0.25, 1.5, 6), [1, 2, 3]))
jobs = [{"scene": "goodwin", "seed": seed, "press": {"time_s": time_s, "depth_mm": depth_mm * np.clip(time_s / 0.05, 0, 1)}}
        for depth_mm, seed in cases]
done = merkel.batch(jobs, keep="table")
done.table[["seed", "spikes", "rate_hz", "verdict", "spike_hash"]].head()

# %%
rates = done.table["rate_hz"].to_numpy().reshape(6, 3)
figure, axis = plt.subplots(figsize=(7, 4))
axis.plot(np.linspace(0.25, 1.5, 6), rates, "o-")
axis.set_xlabel("depth (mm)")
axis.set_ylabel("mean rate of all afferents (Hz)")
axis.legend(["seed 1", "seed 2", "seed 3"])
figure.tight_layout()
assert (np.diff(rates.mean(axis=1)) > 0).all()

# %% [markdown]
# On a cluster, the same jobs run on any `concurrent.futures.Executor`; with `out=`, a folder that all workers see, finished jobs are
# not run again:
#
# ```python
# from dask.distributed import Client
# done = merkel.batch(jobs, Client("scheduler:8786").get_executor(), out="results")
# ```
#
# A job that is repeated gives the same spikes to the last bit, on any node:

# %%
run = merkel.Scene("goodwin").run(**jobs[7]["press"], seed=jobs[7]["seed"])
assert run.spike_hash == done.rows[7]["spike_hash"]
