"""Draws the tables of `merkel chart`. usage: charts.py DIR"""

import math
import pathlib
import sys

from matplotlib.colors import ListedColormap
from tables import picture, plt, read_table, select

FOLDER = pathlib.Path(sys.argv[1])
COLORS = {
    "forward_euler": "tab:gray",
    "exponential_euler": "tab:orange",
    "backward_euler": "tab:brown",
    "rush_larsen": "tab:green",
    "crank_nicolson": "tab:blue",
    "heun": "tab:pink",
    "rk4": "tab:purple",
    "staggered_multistep": "tab:red",
}


def unique(values):
    return list(dict.fromkeys(values))


LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def below(figure, handles, labels):
    figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=3, fontsize=9)


def integrators():
    table = read_table(FOLDER / "integrators.csv")
    figure, axes = plt.subplots(figsize=(9, 6))
    for method in unique(table["method"]):
        for precision, style in (("double", "o-"), ("float", "x:")):
            rows = select(table, method=method, precision=precision)
            points = [
                point
                for point in zip(rows["cost_us_per_neuron_second"], rows["rms_error_ms"],
                                 rows["share_unmatched"])
                if point[2] < 1
            ]
            if not points:
                continue
            right = [point[:2] for point in points if point[2] == 0]
            wrong = [point[:2] for point in points if point[2] > 0]
            if method == "cvode":
                axes.plot(*zip(*right), "s-", color="black", label="CVODE, 1e-3 to 1e-10")
                continue
            label = method if precision == "double" else None
            axes.plot([p[0] for p in right], [p[1] for p in right], style, color=COLORS[method],
                      markersize=5, label=label)
            axes.plot([p[0] for p in wrong], [p[1] for p in wrong],
                      "o" if precision == "double" else "x", color=COLORS[method], markersize=8,
                      fillstyle="none", alpha=0.6)
    if (FOLDER / "peers.csv").exists():
        peers = read_table(FOLDER / "peers.csv")
        for peer, cost, error, marker in zip(peers["peer"], peers["cost_us_per_neuron_second"],
                                             peers["rms_error_ms"], "*PX"):
            axes.plot([cost], [error], marker, color="black", markersize=11, linestyle="none",
                      label=f"{peer}, 25 µs")
    axes.plot([], [], "kx:", label="in single precision")
    axes.plot([], [], "ko", fillstyle="none", markersize=8, label="wrong spike counts")
    axes.set(xlabel="cost per neuron and simulated second (µs of one core)", ylabel="rms spike-time error (ms)",
             title="Integrators: steps of 200 to 6.25 µs, left to right", **LOGARITHMIC)
    axes.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    figure.savefig(FOLDER / "integrators.png", bbox_inches="tight")


def contact_stage():
    table = read_table(FOLDER / "contact_stage.csv")
    with picture(FOLDER / "contact_stage.png", (8.5, 5), xlabel="cost per tick (µs of one core)",
                 ylabel="largest error of an afferent's\nsummed drive (µA/cm²)",
                 title="Contact stage: 450 receptors under a sphere", **LOGARITHMIC) as axes:
        for name in unique(table["method"]):
            rows = select(table, method=name)
            axes.plot(rows["cost_us_per_tick"], [max(e, 1e-16) for e in rows["error_uA_per_cm2"]], "o-", label=name)
        axes.legend(fontsize=9)


def end_to_end():
    table = read_table(FOLDER / "end_to_end.csv")
    presses = unique(table["press"])
    figure, all_axes = plt.subplots(1, len(presses), figsize=(13, 5), sharey=True)
    for axes, press in zip(all_axes, presses):
        rows = select(table, press=press)
        near = "threshold" in press
        error = rows["median_error_ms" if near else "rms_error_ms"]
        for variant in unique(rows["variant"]):
            points = [
                (cost, max(e, 1e-5), share)
                for name, cost, e, share in zip(
                    rows["variant"], rows["cost_us_per_tick"], error, rows["share_unmatched"]
                )
                if name == variant
            ]
            line = axes.plot([p[0] for p in points], [p[1] for p in points], "o-", label=variant)[0]
            for cost, e, share in points:
                if share > 0:
                    axes.annotate(f"{100 * share:.0f} %", (cost, e), fontsize=8,
                                  color=line.get_color(), xytext=(3, 3), textcoords="offset points")
        axes.set(xlabel="cost per tick (µs of one core)", title=press, **LOGARITHMIC)
    all_axes[0].set_ylabel("spike-time error (ms): rms,\nnear threshold the median")
    handles, labels = all_axes[0].get_legend_handles_labels()
    below(figure, handles, labels)
    figure.suptitle("The whole chain; % = unmatched spikes")
    figure.savefig(FOLDER / "end_to_end.png", bbox_inches="tight")


def stability():
    table = read_table(FOLDER / "stability.csv")
    methods = unique(table["method"])
    figure, all_axes = plt.subplots(2, len(methods), figsize=(15, 7), sharey="row", sharex=True)
    colors = ListedColormap(["#7fbf7b", "#f7d774", "#c0392b"])
    for column, method in enumerate(methods):
        for axes, name, other in (
            (all_axes[0][column], "current_uA_per_cm2", "gain_mS_per_cm2"),
            (all_axes[1][column], "gain_mS_per_cm2", "current_uA_per_cm2"),
        ):
            rows = select(table, method=method, **{other: 0.0})
            if name == "gain_mS_per_cm2":
                keep = [g > 0 for g in rows[name]]
                rows = {k: [v for v, ok in zip(c, keep) if ok] for k, c in rows.items()}
            steps = sorted(set(rows["step_us"]))
            values = sorted(set(rows[name]))
            grid = [[math.nan] * len(steps) for _ in values]
            for step, value, outcome in zip(rows["step_us"], rows[name], rows["outcome"]):
                grid[values.index(value)][steps.index(step)] = outcome
            # Each cell extends halfway to its neighbours on the logarithmic axis.
            middles = [math.sqrt(a * b) for a, b in zip(steps, steps[1:])]
            edges = [steps[0] ** 2 / middles[0], *middles, steps[-1] ** 2 / middles[-1]]
            heights = [i - 0.5 for i in range(len(values) + 1)]
            axes.grid(False)
            axes.pcolormesh(edges, heights, grid, cmap=colors, vmin=0, vmax=2)
            axes.set_xscale("log")
            axes.minorticks_off()
            shown = [5, 10, 20, 50, 100, 200, 500]
            axes.set_xticks(shown, [f"{step:g}" for step in shown], rotation=90, fontsize=8)
            rows_shown = range(0, len(values), 2)
            axes.set_yticks(rows_shown, [f"{values[i]:g}" for i in rows_shown], fontsize=8)
        all_axes[0][column].set_title(method, fontsize=10)
        all_axes[1][column].set_xlabel("step (µs)")
    all_axes[0][0].set_ylabel("current (µA/cm²)")
    all_axes[1][0].set_ylabel("coupling gain (mS/cm²)")
    for label, color in (("right", 0), ("wrong spike count", 1), ("diverged", 2)):
        all_axes[0][0].plot([], [], "s", color=colors(color), label=label, markersize=10)
    below(figure, *all_axes[0][0].get_legend_handles_labels())
    figure.suptitle("Stability: method × step × drive, and method × step × coupling")
    figure.savefig(FOLDER / "stability.png", bbox_inches="tight")


def touch():
    table = read_table(FOLDER / "touch.csv")
    figure, (area, active) = plt.subplots(1, 2, figsize=(11, 4.5), sharey=True)
    for receptors in unique(table["receptors"]):
        rows = select(table, receptors=receptors)
        label = f"{receptors:.0f} receptors, {rows['afferents'][0]:.0f} afferents"
        area.plot(rows["contact_area_mm2"], rows["cost_us_per_tick"], "o-", label=label)
        active.plot(rows["active_afferents"], rows["cost_us_per_tick"], "o-", label=label)
    area.set(xlabel="contact area (mm²)", ylabel="cost per tick (µs of one core)")
    active.set_xlabel("active afferents")
    active.set_xscale("symlog", linthresh=16)
    for axes in (area, active):
        axes.set_yscale("log")
    area.legend(fontsize=9)
    figure.suptitle("Cost against the touched area")
    figure.savefig(FOLDER / "touch.png")


def solved_contact():
    table = read_table(FOLDER / "solved_contact.csv")
    with picture(FOLDER / "solved_contact.png", (7, 4.5), xlabel="cold solution (ms of one core)",
                 ylabel="error of the force (%)", **LOGARITHMIC) as axes:
        for tip in unique(table["tip"]):
            rows = select(table, tip=tip)
            axes.plot(rows["cold_ms"], [100 * max(abs(e), 1e-6) for e in rows["force_error"]], "o-", label=tip)


for draw in (integrators, contact_stage, solved_contact, end_to_end, stability, touch):
    try:
        draw()
    except FileNotFoundError:
        pass  # a part that was not made
