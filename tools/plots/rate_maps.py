#!/usr/bin/env python3
"""Draws what single afferents make of surfaces that slide over them, as Phillips, Johnson & Hsiao 1988 drew letters.

usage: rate_maps.py SESSION... PICTURE   sessions of scenes with sim:scan, as merkel run SCENE --fast --sink xdf:SESSION makes

Above, each spike is a dot at the place of the surface that was above the afferent; below, the rate, smoothed over 0.3 mm.
The afferent is the one nearest to the finger's apex that fires. Needs the Python module and matplotlib.
"""
import sys

import merkel
import numpy as np
from tables import plt

LAG_S = 0.008  # of the contact of a sliding surface at 250 Hz
BIN_MM = 0.1
SMOOTH_MM = 0.3
HALF_MM = 6.0  # of what is drawn


def above(session):
    """The places of the surface above the chosen afferent: at its spikes, and at all ticks in contact."""
    ticks, spikes, afferents = session.ticks, session.spikes, session.afferents
    apex = np.array(session.scene["skin.apex_mm"])
    fired = np.bincount(spikes["neuron"], minlength=afferents["neuron"].max() + 1)[afferents["neuron"]]
    off = np.hypot(afferents["x_mm"] - apex[0], afferents["y_mm"] - apex[1])
    chosen = afferents[np.argmin(np.where(fired > 0.3 * fired.max(), off, np.inf))]

    def place(times_s):
        return [chosen[axis] - np.interp(times_s - LAG_S, ticks["time_s"], ticks[axis]) for axis in ("x_mm", "y_mm")]

    touching = ticks["force_N"] > 0.9 * ticks["force_N"].max()
    return place(spikes["time_s"][spikes["neuron"] == chosen["neuron"]]), place(ticks["time_s"][touching])


def smoothed(image):
    steps = np.arange(-10, 11) * BIN_MM
    weights = np.exp(-0.5 * (steps / SMOOTH_MM) ** 2)
    for axis in (0, 1):
        image = np.apply_along_axis(np.convolve, axis, image, weights, "same")
    return image


def main():
    *names, picture = sys.argv[1:]
    figure, all_axes = plt.subplots(2, len(names), figsize=(5 * len(names), 8), squeeze=False)
    for name, (dots, rates) in zip(names, all_axes.T):
        (x, y), (seen_x, seen_y) = above(merkel.load(name))
        ends = [(max(seen.min(), -HALF_MM), min(seen.max(), HALF_MM)) for seen in (seen_x, seen_y)]
        edges = [np.arange(*end, BIN_MM) for end in ends]
        counts = smoothed(np.histogram2d(x, y, edges)[0])
        time_s = smoothed(np.histogram2d(seen_x, seen_y, edges)[0]) * 1e-3
        dots.plot(x, y, ".", markersize=1.5, color="black")
        for axes in (dots, rates):
            axes.grid(False)
            axes.set(aspect="equal", xlim=ends[0], ylim=ends[1])
            axes.set(xlabel="x on the surface (mm)", ylabel="y on the surface (mm)")
        drawn = rates.pcolormesh(*edges, (counts / np.maximum(time_s, 1e-9)).T, cmap="Purples", rasterized=True)
        figure.colorbar(drawn, ax=rates, label="rate (Hz)")
    figure.savefig(picture)


main()
