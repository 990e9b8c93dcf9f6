"""Draws one press through two models: depth over time, the spikes of both, and their rates on the skin.

usage: press.py DIR   with press.csv and, for each of the models paper and goodwin, MODEL_spikes.csv,
MODEL_summary.json and MODEL_afferents.csv in DIR; writes DIR/press.png.
"""

import json
import math
import pathlib
import sys

from matplotlib.patches import Circle
from tables import plt, read_table

MODELS = {
    "paper": "paper: 20 Hodgkin–Huxley afferents,\none for each subregion of the skin",
    "goodwin": "goodwin: 450 afferents with receptive\nfields, fitted to recordings",
}
MARKER_SIZE = {"paper": 2600, "goodwin": 34}
SHOWN = 40  # rows of a raster: the afferents nearest to the press


def draw_raster(axes, spikes, afferents, press):
    """One row for each of the nearest afferents, the nearest at the bottom."""
    distances = [
        math.hypot(x - press["x_mm"], y - press["y_mm"])
        for x, y in zip(afferents["x_mm"], afferents["y_mm"])
    ]
    order = sorted(range(len(distances)), key=distances.__getitem__)[:SHOWN]
    row_of = {index + 1: row + 1 for row, index in enumerate(order)}
    shown = [
        (time, row_of[int(neuron)])
        for time, neuron in zip(spikes["time_s"], spikes["neuron"])
        if int(neuron) in row_of
    ]
    axes.plot([time for time, _ in shown], [row for _, row in shown], "|", color="black", markersize=3)
    axes.set_ylim(0.3, len(order) + 0.7)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"{'nearest ' if len(order) < len(distances) else ''}{len(order)} afferents,\nby distance")


def draw_skin(figure, axes, model, afferents, rates, press):
    dots = axes.scatter(
        afferents["x_mm"],
        afferents["y_mm"],
        c=rates,
        s=MARKER_SIZE[model],
        marker="s" if model == "paper" else "o",
        cmap="Oranges",
        vmin=0,
        edgecolors="0.6",
        linewidths=0.4,
    )
    if press["contact_radius_mm"] is not None:
        axes.add_patch(
            Circle(
                (press["x_mm"], press["y_mm"]),
                press["contact_radius_mm"],
                fill=False,
                color="tab:blue",
                linewidth=2,
                label=f"contact at {press['depth_mm']:g} mm",
            )
        )
        axes.legend(loc="lower right", fontsize=8)
    axes.set_aspect("equal")
    axes.set_xlim(0, 30)
    axes.set_ylim(20, 0)
    axes.set_xlabel("distance from the fingertip (mm)")
    figure.colorbar(dots, ax=axes, location="bottom", label="rate during contact (Hz)", shrink=0.9)


def main():
    folder = pathlib.Path(sys.argv[1])
    trace = read_table(folder / "press.csv")
    figure = plt.figure(figsize=(11, 9))
    grid = figure.add_gridspec(3, 2, height_ratios=[0.9, 2, 3.4])
    first_skin = None
    for column, (model, title) in enumerate(MODELS.items()):
        spikes = read_table(folder / f"{model}_spikes.csv") or {"time_s": [], "neuron": []}
        afferents = read_table(folder / f"{model}_afferents.csv")
        summary = json.loads((folder / f"{model}_summary.json").read_text())
        press = summary["probes"][0]["deepest_press"]
        rates = [neuron["contact_rate_hz"] or 0.0 for neuron in summary["neurons"]]
        fired = sum(rate > 0 for rate in rates)

        depth = figure.add_subplot(grid[0, column])
        depth.plot(trace["time_s"], trace["depth_mm"], color="tab:blue")
        depth.set_title(title, fontsize=11)
        depth.tick_params(labelbottom=False)
        raster = figure.add_subplot(grid[1, column], sharex=depth)
        draw_raster(raster, spikes, afferents, press)
        raster.set_xlim(trace["time_s"][0], trace["time_s"][-1])
        raster.set_title(
            f"{len(spikes['time_s'])} spikes; {fired} afferents fired, at most {max(rates):.0f} Hz",
            fontsize=10,
        )
        skin = figure.add_subplot(grid[2, column], sharey=first_skin)
        draw_skin(figure, skin, model, afferents, rates, press)
        if column == 0:
            depth.set_ylabel("indentation\ndepth (mm)")
            skin.set_ylabel("across the finger (mm)")
            first_skin = skin
    figure.suptitle("One press through two models")
    figure.savefig(folder / "press.png")


if __name__ == "__main__":
    main()
