"""Draws a solved contact: the tip, the pressure under it and the energy density at the receptors.

usage: contact.py DIR   with contact.csv in DIR; writes DIR/contact.png.
"""

import pathlib
import sys

import numpy as np
from tables import plt, read_table

PARTS = (
    ("gap_mm", "gap before the press (mm)", "Greys_r"),
    ("pressure_kPa", "pressure (kPa)", "Oranges"),
    ("sed_kPa", "energy density at the receptors (kPa)", "Purples"),
)


def main():
    folder = pathlib.Path(sys.argv[1])
    table = read_table(folder / "contact.csv")
    x = np.unique(table["x_mm"])
    y = np.unique(table["y_mm"])
    figure, all_axes = plt.subplots(1, 3, figsize=(13, 4.2))
    for axes, (name, label, colours) in zip(all_axes, PARTS):
        values = np.array(table[name]).reshape(len(y), len(x))
        values = np.ma.masked_invalid(values)
        axes.grid(False)
        drawn = axes.pcolormesh(x, y, values, cmap=colours, shading="nearest", rasterized=True)
        figure.colorbar(drawn, ax=axes, label=label)
        axes.set(aspect="equal", xlabel="x, along the finger (mm)", ylabel="y, across (mm)")
    figure.savefig(folder / "contact.png")


main()
