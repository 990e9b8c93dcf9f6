"""Draws one run: depth over time, spike raster, and the rate map of the subregions.

usage: press.py DIR   with press.csv, spikes.csv, summary.json and receptors.csv in DIR;
writes DIR/press.png.
"""

import json
import pathlib
import sys

from matplotlib.patches import Circle
from tables import plt, read_table

COLUMNS, ROWS = 5, 4
LENGTH_MM, WIDTH_MM = 30.0, 20.0


def main():
    folder = pathlib.Path(sys.argv[1])
    trace = read_table(folder / "press.csv")
    spikes = read_table(folder / "spikes.csv") or {"time_s": [], "neuron": []}
    receptors = read_table(folder / "receptors.csv")
    summary = json.loads((folder / "summary.json").read_text())
    rates = [neuron["rate_hz"] for neuron in summary["neurons"]]

    figure = plt.figure(figsize=(8.5, 9))
    grid = figure.add_gridspec(3, 1, height_ratios=[1, 1.6, 4.2])

    depth = figure.add_subplot(grid[0])
    depth.plot(trace["time_s"], trace["depth_mm"], color="tab:blue")
    depth.set_ylabel("indentation\ndepth (mm)")
    depth.tick_params(labelbottom=False)

    raster = figure.add_subplot(grid[1], sharex=depth)
    raster.plot(spikes["time_s"], spikes["neuron"], "|", color="black", markersize=4)
    raster.set_ylim(COLUMNS * ROWS + 0.7, 0.3)
    raster.set_yticks(range(1, COLUMNS * ROWS + 1, 3))
    raster.set_ylabel("afferent")
    raster.set_xlabel("time (s)")
    raster.set_xlim(trace["time_s"][0], trace["time_s"][-1])

    skin = figure.add_subplot(grid[2])
    image = skin.imshow(
        [rates[row * COLUMNS : (row + 1) * COLUMNS] for row in range(ROWS)],
        extent=(0, LENGTH_MM, WIDTH_MM, 0),
        cmap="Oranges",
        vmin=0,
        vmax=1.3 * max(max(rates), 1.0),
        aspect="equal",
    )
    skin.plot(receptors["x_mm"], receptors["y_mm"], ".", color="0.2", markersize=3)
    press = summary["probes"][0]["deepest_press"]
    skin.add_patch(
        Circle(
            (press["x_mm"], press["y_mm"]),
            press["contact_radius_mm"],
            fill=False,
            color="tab:blue",
            linewidth=2,
            label=f"contact at {press['depth_mm']:g} mm",
        )
    )
    for number in range(1, COLUMNS * ROWS + 1):
        column, row = (number - 1) % COLUMNS, (number - 1) // COLUMNS
        skin.text(
            column * LENGTH_MM / COLUMNS + 0.3,
            row * WIDTH_MM / ROWS + 0.3,
            str(number),
            va="top",
            fontsize=8,
            color="0.2",
        )
    skin.set_xticks([column * LENGTH_MM / COLUMNS for column in range(COLUMNS + 1)])
    skin.set_yticks([row * WIDTH_MM / ROWS for row in range(ROWS + 1)])
    skin.grid(color="0.7", linewidth=0.6, alpha=1)
    skin.set_xlabel("distance from the fingertip (mm); dots: receptors")
    skin.set_ylabel("across the finger (mm)")
    skin.legend(loc="lower right", fontsize=8)
    figure.colorbar(image, ax=skin, label="mean rate (Hz)", shrink=0.8)
    figure.suptitle(f"{len(spikes['time_s'])} spikes of 20 SAI afferents under one press")
    figure.savefig(folder / "press.png")


if __name__ == "__main__":
    main()
