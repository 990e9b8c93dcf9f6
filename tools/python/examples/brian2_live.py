"""Afferents drive a Brian2 network, a tick at a time: a SpikeGeneratorGroup is given each tick's spikes."""
import brian2 as b2
import merkel
import numpy as np

b2.prefs.codegen.target = "numpy"
scene = merkel.Scene("finger")
stream = scene.stream()
afferents = b2.SpikeGeneratorGroup(len(scene.afferents), [], [] * b2.ms)
cuneate = b2.NeuronGroup(1, "dv/dt = -v/(10*ms) : 1", threshold="v > 1", reset="v = 0", method="exact")
synapses = b2.Synapses(afferents, cuneate, on_pre="v += 0.05")
synapses.connect()
monitor, arrived = b2.SpikeMonitor(cuneate), b2.SpikeMonitor(afferents)
network = b2.Network(afferents, cuneate, synapses, monitor, arrived)
for tick in range(200):
    new, _ = stream.push(tick / 1000, depth_mm=1.5 * min(1.0, tick / 100))
    # A push returns the spikes from two ticks ago to one tick ago: two ticks later, they all lie ahead.
    times = new["time_s"] + 0.002
    # Down to Brian2's step: a spike at the end of this run would be forgotten.
    steps = np.unique(np.stack([new["neuron"] - 1.0, np.floor(times * 1e4 + 1e-6)]), axis=1)
    afferents.set_spikes(steps[0].astype(int), steps[1] * 0.1 * b2.ms)
    network.run(1 * b2.ms)
print(f"{monitor.num_spikes} spikes of the second-order neuron")
between = np.count_nonzero(np.round(arrived.t / b2.ms * 10) % 10)
print(f"{arrived.num_spikes} spikes arrived, {between} of them between ticks")
