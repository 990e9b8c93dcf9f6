"""A control loop of one's own: samples in, spikes out, a millisecond at a time.

Prints the rate of the busiest afferent every 100 ms, as an encoder for an electrode would use it.
"""
import merkel
import numpy as np

scene = merkel.Scene("finger")
stream = scene.stream()
counts = np.zeros(len(scene.afferents), dtype=int)
for tick in range(500):
    time_s = tick / 1000
    depth_mm = 1.5 * min(1.0, time_s / 0.1)
    new = stream.push(time_s, depth_mm=depth_mm)
    np.add.at(counts, new.spikes["neuron"] - 1, 1)
    if tick % 100 == 99:
        print(f"{time_s:.1f} s: {10 * counts.max()} Hz, afferent {counts.argmax() + 1}")
        counts[:] = 0
