"""Shared by the plot scripts: reading tables, and one style for all pictures."""

import contextlib
import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

plt.rcParams.update(
    {
        "figure.constrained_layout.use": True,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "font.size": 11,
        "savefig.dpi": 110,
    }
)


@contextlib.contextmanager
def picture(path, size=(7.5, 4.8), **properties):
    """Axes with these properties (those of Axes.set()) and a legend of what is drawn, saved as a picture."""
    figure, axes = plt.subplots(figsize=size)
    yield axes
    axes.set(**properties)
    if axes.get_legend() is None:
        axes.legend()
    figure.savefig(path)


def read_table(path):
    """Columns of a CSV table by name, as numbers if they are numeric; '#' lines are skipped."""
    with open(path, newline="") as file:
        return table_of(file)


def table_of(lines):
    """The same of the lines of a table."""
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    table = {}
    for name in rows[0] if rows else {}:
        column = [row[name] for row in rows]
        try:
            column = [float(value) for value in column]
        except ValueError:
            pass
        table[name] = column
    return table


def select(table, **wanted):
    """The rows of a table whose columns have the wanted values."""
    keep = [
        all(table[name][i] == value for name, value in wanted.items())
        for i in range(len(next(iter(table.values()))))
    ]
    return {name: [v for v, k in zip(column, keep) if k] for name, column in table.items()}
