# %% [markdown]
# # Sweep on a cluster
#
# Every run is a function of its scene, its samples and its seed. A sweep is therefore a map over parameters, on the cores of one
# machine or as an array job. Here: the mean rate against the depth of a press, for three seeds of the receptors.

# %%
import itertools
from concurrent.futures import ThreadPoolExecutor

import matplotlib.pyplot as plt
import merkel
import numpy as np

time_s = np.arange(0, 0.5, 0.001)


def mean_rate_Hz(case):
    depth_mm, seed = case
    run = merkel.Scene("goodwin").run(time_s=time_s, depth_mm=depth_mm * np.clip(time_s / 0.05, 0, 1), seed=seed)
    return len(run.spikes) / len(run.afferents) / run.duration_s


cases = list(itertools.product(np.linspace(0.25, 1.5, 6), [1, 2, 3]))
with ThreadPoolExecutor(2) as pool:
    rates = np.array(list(pool.map(mean_rate_Hz, cases))).reshape(6, 3)

# %%
figure, axis = plt.subplots(figsize=(7, 4))
axis.plot(np.linspace(0.25, 1.5, 6), rates, "o-")
axis.set_xlabel("depth (mm)")
axis.set_ylabel("mean rate of all afferents (Hz)")
axis.legend(["seed 1", "seed 2", "seed 3"])
figure.tight_layout()
assert (np.diff(rates.mean(axis=1)) > 0).all()

# %% [markdown]
# On a cluster, each task of an array job runs one case, and the order of the tasks does not matter:
#
# ```sh
# #SBATCH --array=0-17
# python3 -c "import sys; from sweep import cases, mean_rate_Hz; print(mean_rate_Hz(cases[int(sys.argv[1])]))" $SLURM_ARRAY_TASK_ID
# ```
#
# A task that is repeated gives the same number to the last bit, on any node:

# %%
assert mean_rate_Hz(cases[7]) == rates.ravel()[7]
