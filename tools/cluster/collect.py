"""One table and a picture of the rows of many runs: collect.py TABLE PICTURE ROW…"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

if len(sys.argv) < 4:
    sys.exit(__doc__)
rows = []
for path in sys.argv[3:]:
    with open(path, newline="") as file:
        rows += csv.DictReader(file)
rows.sort(key=lambda row: (row["scene"], row["name"]))
columns = [name for name in rows[0] if name not in ("job", "id", "file", "run_s")]
with open(sys.argv[1], "w", newline="") as file:
    writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)

names = sorted({row["name"] for row in rows})
figure, axis = plt.subplots(figsize=(7, 4))
for scene in dict.fromkeys(row["scene"] for row in rows):
    rates = {row["name"]: float(row["rate_hz"]) for row in rows if row["scene"] == scene}
    axis.plot(names, [rates.get(name) for name in names], "o-", label=scene)
axis.set_ylabel("mean rate of an afferent (Hz)")
axis.tick_params(axis="x", rotation=30)
axis.legend(title="scene")
figure.tight_layout()
figure.savefig(sys.argv[2])
