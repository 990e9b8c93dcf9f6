"""Draws runs side by side: press, raster, rates on the skin, stimulation.

usage: plot.py PICTURE FOLDER TITLE [FOLDER TITLE]…   An empty PICTURE opens a window. Each folder has some of press.csv,
spikes.csv, commands.csv and afferents.csv (merkel plot).
"""

import collections
import math
import pathlib
import re
import sys

from tables import plt, read_table, select

SHOWN = 40  # rows of a raster


def read(folder, name):
    path = pathlib.Path(folder, name + ".csv")
    return read_table(path) if path.exists() else {}


def titles(files):
    """The names of files: without folder and extension (press.xdf@left: press@left); with the folder where two are alike."""
    names = [re.sub(r"[.][^.@]*(?=@|$)", "", pathlib.Path(file).name) for file in files]
    return [f"{pathlib.Path(file).parent.name}/{name}" if names.count(name) > 1 else name for file, name in zip(files, names)]


class Column:
    """One run: its tables, and what is drawn of it."""

    def __init__(self, folder, title):
        self.title = title
        self.press, self.spikes = read(folder, "press"), read(folder, "spikes")
        self.commands, self.afferents = read(folder, "commands"), read(folder, "afferents")
        self.counts = collections.Counter(map(int, self.spikes.get("neuron", [])))
        times = self.press.get("time_s", []) or self.spikes.get("time_s", [])
        self.span_s = (min(times), max(times)) if times else (0.0, 1.0)

    def panels(self):
        """(name, height, drawing function) of each panel, from the top."""
        rows = []
        for key, label in (("depth_mm", "depth (mm)"), ("force_N", "force (N)")):
            if any(self.press.get(key, [])):
                rows.append((key, 1.0, lambda axes, key=key, label=label: self.draw_press(axes, key, label)))
        if self.spikes:
            rows.append(("raster", 2.0, self.draw_raster))
        if self.commands:
            rows.append(("commands", 1.2, self.draw_commands))
        if self.afferents and self.counts:
            rows.append(("skin", 3.0, None))
        return rows

    def draw_press(self, axes, key, label):
        for probe in sorted(set(self.press["probe"])):
            one = select(self.press, probe=probe)
            axes.plot(one["time_s"], one[key], linewidth=1.2, label=f"probe {probe:.0f}")
        axes.set_ylabel(label)
        if 1 < len(axes.lines) < 9:
            axes.legend(fontsize=8)

    def draw_raster(self, axes):
        busiest = [neuron for neuron, _ in self.counts.most_common(SHOWN)]
        row_of = {neuron: row + 1 for row, neuron in enumerate(busiest)}
        shown = [(time, row_of[int(neuron)]) for time, neuron in zip(self.spikes["time_s"], self.spikes["neuron"])
                 if int(neuron) in row_of]
        axes.plot([time for time, _ in shown], [row for _, row in shown], "|", color="black", markersize=3)
        axes.set_ylim(0.3, len(busiest) + 0.7)
        axes.yaxis.get_major_locator().set_params(integer=True)
        most = max(self.counts.values()) / max(self.span_s[1] - self.span_s[0], 1e-9)
        axes.set_title(f"{len(self.spikes['time_s'])} spikes; {len(self.counts)} afferents fired, at most {most:.0f} Hz on average",
                       fontsize=10)
        axes.set_ylabel(f"{'busiest ' if len(self.counts) > SHOWN else ''}{len(busiest)} afferents")

    def draw_commands(self, axes):
        for electrode in sorted(set(self.commands["electrode"])):
            one = select(self.commands, electrode=electrode)
            axes.step(one["time_s"], one["amplitude_uA"], where="post", linewidth=1)
        axes.set_ylabel("amplitude (µA)")

    def draw_skin(self, figure, place):
        patches = list(dict.fromkeys(self.afferents["patch"]))
        across = min(3, len(patches))
        grid = place.subgridspec(-(-len(patches) // across), across)
        duration_s = max(self.span_s[1] - self.span_s[0], 1e-9)
        rates = [self.counts[int(neuron)] / duration_s for neuron in self.afferents["neuron"]]
        for number, patch in enumerate(patches):
            axes = figure.add_subplot(grid[number // across, number % across])
            own = [i for i, name in enumerate(self.afferents["patch"]) if name == patch]
            x_mm = [self.afferents["x_mm"][i] for i in own]
            y_mm = [self.afferents["y_mm"][i] for i in own]
            dots = axes.scatter(x_mm, y_mm, c=[rates[i] for i in own], s=min(300, 12000 / len(own)),
                                cmap="Oranges", vmin=0, vmax=max(rates), edgecolors="0.6", linewidths=0.3)
            axes.set_aspect("equal")
            axes.invert_yaxis()
            axes.tick_params(labelsize=8)
            if len(patches) > 1:
                axes.set_title(patch, fontsize=9)
            else:
                self.mark_press(axes)
                axes.set_xlabel("distance from the fingertip (mm)")
                axes.set_ylabel("across the finger (mm)")
        figure.colorbar(dots, ax=figure.axes[-len(patches):], location="bottom", label="mean rate (Hz)", shrink=0.8)

    def mark_press(self, axes):
        if not self.press:
            return
        force = self.press["force_N"] if any(self.press["force_N"]) else self.press["depth_mm"]
        deepest = max(range(len(force)), key=force.__getitem__)
        if math.isnan(self.press["x_mm"][deepest]):  # of a tactile array
            return
        axes.plot(self.press["x_mm"][deepest], self.press["y_mm"][deepest], "+", color="tab:blue", markersize=12,
                  label="hardest press")
        axes.legend(loc="lower right", fontsize=8)


def main():
    picture, arguments = sys.argv[1], sys.argv[2:]
    columns = [Column(folder, title) for folder, title in zip(arguments[::2], titles(arguments[1::2]))]
    if not picture:
        open_window()
    heights = {}
    for column in columns:
        heights |= {name: height for name, height, _ in column.panels()}
    order = [name for name in ("depth_mm", "force_N", "raster", "commands", "skin") if name in heights]
    if not order:
        sys.exit("merkel: there is nothing to draw: the files contain neither a press nor spikes")
    figure = plt.figure(figsize=(2.5 + 4.75 * len(columns), 1.6 * sum(heights.values())))
    grid = figure.add_gridspec(len(order), len(columns), height_ratios=[heights[name] for name in order])
    for number, column in enumerate(columns):
        draw(figure, grid, number, column, order)
    if picture:
        figure.savefig(picture)
    else:
        plt.show()


def draw(figure, grid, number, column, order):
    first = axes = None
    for name, _, paint in column.panels():
        place = grid[order.index(name), number]
        if name == "skin":
            column.draw_skin(figure, place)
            continue
        axes = figure.add_subplot(place, sharex=first)
        paint(axes)
        if first is None:
            first = axes
            axes.set_title(column.title, fontsize=11)
            axes.set_xlim(*column.span_s)
    if axes is not None:
        axes.set_xlabel("time (s)")


def open_window():
    for backend in ("QtAgg", "GTK3Agg", "TkAgg"):
        try:
            plt.switch_backend(backend)
            return
        except ImportError:
            continue
    sys.exit("merkel: no window can be opened here: write a picture with --out picture.png")


main()
