"""Draws the tables of `merkel score`. usage: score.py DIR"""

import pathlib
import sys

from tables import picture, plt, read_table, select

FOLDER = pathlib.Path(sys.argv[1])
LABELS = {
    "curvature_per_m": "curvature of the indenter (1/m)",
    "amplitude_um": "amplitude, zero to peak (µm)",
    "offset_mm": "offset from the receptive field's centre (mm)",
    "position_mm": "position under the bars (mm)",
    "depth_mm": "depth of the hold (mm)",
}


def table_if_any(name):
    """A table of the folder; empty without the file."""
    return read_table(FOLDER / name) if (FOLDER / name).exists() else {}


def section(table, name, title):
    rows = select(table, section=name)
    if len(rows["x"]) < 2:
        return  # a single point needs no picture
    with picture(FOLDER / f"{name}.png", xlabel=LABELS.get(rows["x_name"][0], rows["x_name"][0]),
                 ylabel="fall of the rate (fraction)" if name == "hold_adaptation" else "rate (impulses/s)",
                 ylim=(0, None), title=title) as axes:
        for index, label in enumerate(dict.fromkeys(rows["set"])):
            of_set = select(rows, set=label)
            order = sorted(range(len(of_set["x"])), key=lambda i: of_set["x"][i])
            x, measured, predicted = ([of_set[c][i] for i in order] for c in ("x", "measured", "predicted"))
            axes.plot(x, predicted, "-", color=f"C{index}", label=f"model, {label.split(', ', 1)[-1]}")
            axes.plot(x, measured, "o", color=f"C{index}", label=f"recorded, {label.split(', ', 1)[-1]}")
        if name == "vibration":
            axes.set_xscale("log")
            ticks = [t for t in (10, 20, 30, 50, 100, 200, 300, 500, 1000)
                     if 0.7 * min(rows["x"]) < t < 1.4 * max(rows["x"])]
            axes.set_xticks(ticks, [f"{t}" for t in ticks])
            axes.minorticks_off()


def holds(table):
    with picture(FOLDER / "adaptation.png", xlabel="time since the hold began (s)", ylabel="rate (impulses/s)",
                 ylim=(0, None), title="Adaptation during a hold") as axes:
        for level in dict.fromkeys(table["level"]):
            rows = select(table, level=level)
            axes.plot(rows["time_s"], rows["rate_hz"], label=f"{level:g} {rows['unit'][0]}")


def rate_by_drive(table):
    with picture(FOLDER / "rate_by_drive.png", xlabel="constant drive (Hz)", ylabel="rate (impulses/s)",
                 ylim=(0, 1.15 * max(table["rate_hz"])), title="f–I curve of the neuron") as axes:
        axes.plot(table["drive_hz"], table["drive_hz"], "--", color="0.6", label="rate = drive")
        axes.plot(table["drive_hz"], table["rate_hz"], ".-", label="model")


def intervals(table):
    with picture(FOLDER / "intervals.png", xlabel="interval between impulses (ms)", ylabel="density (1/ms)",
                 title="Intervals at steady rates") as axes:
        for rate in dict.fromkeys(table["rate_hz"]):
            values = select(table, rate_hz=rate)["interval_ms"]
            axes.hist(values, bins=80, range=(0, 200), density=True, histtype="step", linewidth=1.5,
                      label=f"{rate:g} Hz")


def presses():
    """Every recorded press over time, with the recorded and the model's spikes, rates, and distances."""
    trials, psth, press, apart = (table_if_any(name) for name in ("trials.csv", "psth.csv", "press.csv", "distances.csv"))
    if not press:
        return
    for index, name in enumerate(dict.fromkeys(press["set"])):
        course, rates, spikes = (select(table, set=name) for table in (press, psth, trials))
        figure, (top, middle, bottom, bars) = plt.subplots(
            4, 1, figsize=(7.5, 7.6), gridspec_kw={"height_ratios": [1, 2, 2, 0.7]}, layout="constrained")
        for upper in (top, middle):
            upper.sharex(bottom)
            upper.tick_params(labelbottom=False)
        distances(bars, select(apart, set=name))
        top.plot(course["time_s"], course["level"], color="0.3")
        top.set_ylabel("force (N)" if course["unit"][0] == "N" else "depth (mm)")
        row = 0
        for source, colour in (("recorded", "C0"), ("model", "C1")):
            of_source = select(spikes, source=source)
            for trial in sorted(set(of_source["trial"]))[:20]:
                middle.eventplot(select(of_source, trial=trial)["time_s"], lineoffsets=row, colors=colour)
                row += 1
        middle.set_ylabel("trial (recorded: blue)")
        bottom.step(rates["time_s"], rates["recorded_hz"], where="mid", color="C0", label="recorded")
        bottom.step(rates["time_s"], rates["model_hz"], where="mid", color="C1", label="model")
        bottom.set(xlabel="time since the first sample (s)", ylabel="rate (impulses/s)")
        bottom.legend()
        figure.suptitle(name)
        figure.savefig(FOLDER / f"trials_{index + 1}.png")


def distances(axes, rows):
    """The distances of the model from the recorded trials, in units of those between the recorded trials."""
    labels = [name.split(",")[0] for name in rows["distance"]]
    ratios = rows["model_to_recorded"]
    if not all(recorded > 0 for recorded in rows["recorded_to_recorded"]):  # a single trial has no distance to another
        axes.set_xlabel("distance of the model from the recorded trial")
    else:
        ratios = [model / recorded for model, recorded in zip(ratios, rows["recorded_to_recorded"])]
        axes.axvline(1.0, color="C0", label="between recorded trials")
        axes.set_xlabel("distance of the model from the recorded trials / distance between these")
        axes.legend(loc="lower right", fontsize="small")
    axes.barh(labels, ratios, color="C1")
    axes.set_xlim(left=0)


def experiments():
    """A picture of each experiment: the model's curves, and what the source states of them."""
    table = table_if_any("experiment_curves.csv")
    for name in dict.fromkeys(table.get("experiment", [])):
        rows = select(table, experiment=name)
        panels = list(dict.fromkeys(zip(rows["x_name"], rows["y_name"])))
        figure, axes = plt.subplots(1, len(panels), figsize=(5.5 * len(panels), 4.8), squeeze=False,
                                    layout="constrained")
        for panel, (x_name, y_name) in zip(axes[0], panels):
            of_panel = select(rows, x_name=x_name, y_name=y_name)
            for index, series in enumerate(dict.fromkeys(of_panel["series"])):
                curve = select(of_panel, series=series)
                panel.plot(curve["x"], curve["model"], ".-", color=f"C{index}", label=f"model, {series}")
                if any(value == value for value in curve["recorded"]):
                    panel.plot(curve["x"], curve["recorded"], "o", fillstyle="none", color=f"C{index}",
                               label=f"recorded, {series}")
            panel.set(xlabel=x_name, ylabel=y_name)
            panel.legend()
        figure.suptitle(rows["title"][0])
        figure.savefig(FOLDER / f"{name}.png")


conditions = table_if_any("conditions.csv")
if conditions:
    section(conditions, "curvature_force", "Spheres pressed on the centre of the receptive field")
    section(conditions, "lateral_offset", "Spheres pressed beside the centre of the receptive field")
    section(conditions, "bar_profile", "Bars")
    section(conditions, "vibration", "Vibration")
    section(conditions, "hold_adaptation", "Fall of the rate during a hold")
for name, draw in (("holds", holds), ("rate_by_drive", rate_by_drive), ("intervals", intervals)):
    if drawn := table_if_any(f"{name}.csv"):
        draw(drawn)
presses()
experiments()
