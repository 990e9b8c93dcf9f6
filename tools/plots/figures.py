"""Draws the tables of `merkel figures`. usage: figures.py DIR"""

import pathlib
import sys

from tables import picture, plt, read_table, select

FOLDER = pathlib.Path(sys.argv[1])


def grating():
    table = read_table(FOLDER / "fig4_grating.csv")
    figure, (energy, rate) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True)
    energy.plot(table["x_mm"], table["sed_kPa"], color="tab:blue")
    energy.set(ylabel="strain energy density\nat 0.65 mm (kPa)", ylim=(0, 1.1 * max(table["sed_kPa"])))
    rate.plot(table["x_mm"], table["rate_hz"], color="tab:red")
    for axes in (energy, rate):
        axes.fill_between(
            table["x_mm"], 0, 1, where=[p == 1 for p in table["pressed"]],
            transform=axes.get_xaxis_transform(), color="0.85", zorder=0, label="bar, 1 mm deep",
        )
    rate.set(xlabel="position across the grating (mm)", ylabel="firing rate (Hz)", ylim=(0, 1.1 * max(table["rate_hz"])))
    energy.legend(loc="upper center")
    figure.suptitle("Fig. 4: bars of 5 mm with gaps of 3 and 5 mm")
    figure.savefig(FOLDER / "fig4_grating.png")


def depth_profiles():
    table = read_table(FOLDER / "fig5_depth.csv")
    with picture(FOLDER / "fig5_depth.png", (8, 4.5), xlim=(0, 8), ylim=(0, None), xlabel="distance from the axis (mm)",
                 ylabel="strain energy density\nat 0.65 mm (kPa)", title="Fig. 5: a sphere pressed 1 to 5 mm deep") as axes:
        for depth in range(1, 6):
            rows = select(table, radius_mm=5.0, depth_mm=float(depth))
            axes.plot(rows["r_mm"], rows["sed_kPa"], label=f"R = 5 mm, {depth} mm deep",
                      color=plt.cm.viridis((depth - 1) / 4.5))
        rows = select(table, radius_mm=2.0, depth_mm=1.0)
        axes.plot(rows["r_mm"], rows["sed_kPa"], "k--", label="R = 2 mm, 1 mm deep")


SETS = (("paper", "default set"), ("paper-wide", "wide set"))


def centre_press():
    table = read_table(FOLDER / "fig6_centre_press.csv")
    figure, all_axes = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True)
    for axes, (name, title) in zip(all_axes, SETS):
        rows = select(table, set=name)
        marks = axes.scatter(rows["mean_distance_mm"], rows["rate_hz"], c=rows["receptors"],
                             cmap="viridis", s=70, edgecolors="0.3")
        for neuron, x, y in zip(rows["neuron"], rows["mean_distance_mm"], rows["rate_hz"]):
            if y < 3:
                continue  # silent ones would crowd the axis
            axes.annotate(f"{neuron:.0f}", (x, y), textcoords="offset points", xytext=(5, 5),
                          fontsize=9)
        axes.set(xlabel="mean distance of the receptors (mm)", title=f"{title}, seed 1")
    all_axes[0].set_ylabel("firing rate (Hz)")
    figure.colorbar(marks, ax=all_axes, label="receptors of the afferent")
    figure.suptitle("Fig. 6: a press at the centre; numbers: afferents that fire")
    figure.savefig(FOLDER / "fig6_centre_press.png")


def draws():
    table = read_table(FOLDER / "fig7_draws.csv")
    figure, grid = plt.subplots(2, 2, figsize=(10, 7), sharey=True)
    for row, (name, title) in zip(grid, SETS):
        rows = select(table, set=name)
        for axes, column, label in (
            (row[0], "mean_distance_mm", "mean distance of the receptors (mm)"),
            (row[1], "receptors", "receptors of the afferent"),
        ):
            axes.plot(rows[column], rows["rate_hz"], ".", markersize=3, alpha=0.4)
            axes.set(xlabel=label, title=title)
        row[0].set_ylabel("firing rate (Hz)")
    figure.suptitle(f"Fig. 7: rate against distance and receptor count, {max(table['seed']):.0f} receptor draws")
    figure.savefig(FOLDER / "fig7_draws.png")


def positions():
    table = read_table(FOLDER / "fig8_positions.csv")
    with picture(FOLDER / "fig8_positions.png", (8, 4.5), xlabel="receptors of the pressed subregion",
                 ylabel="rate of the network (Hz)", title="Fig. 8: a press at the centre of each subregion") as axes:
        axes.plot(table["receptors"], table["network_rate_hz"], ".", color="0.6", markersize=5,
                  label=f"{max(table['seed']):.0f} receptor draws")
        first = select(table, seed=1.0)
        axes.plot(first["receptors"], first["network_rate_hz"], "o", color="tab:red", label="seed 1")
        for position, x, y in zip(first["position"], first["receptors"], first["network_rate_hz"]):
            axes.annotate(f"{position:.0f}", (x, y), textcoords="offset points", xytext=(5, 4), fontsize=8)


def contact_laws():
    table = read_table(FOLDER / "contact_laws.csv")
    figure, all_axes = plt.subplots(1, 2, figsize=(10, 4.2))
    for axes, radius in zip(all_axes, (2.0, 5.0)):
        rows = select(table, radius_mm=radius)
        for column, label, style in (
            ("hertz_N", "half-space, Hertz", "-"),
            ("exact_sphere_N", "half-space, exact sphere", "--"),
            ("layer_N", "4 mm on bone", "-"),
        ):
            axes.plot(rows["depth_mm"], rows[column], style, label=label)
        axes.set(xlabel="indentation depth (mm)", ylabel="force (N)", title=f"sphere of {radius:g} mm radius")
    all_axes[0].legend()
    figure.savefig(FOLDER / "contact_laws.png")


for draw in (grating, depth_profiles, centre_press, draws, positions, contact_laws):
    draw()
