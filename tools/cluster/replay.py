"""Replays one session through one scene: replay.py MERKEL SCENE SESSION NWB ROW

Writes the run as an NWB file and its row of results (CSV, as merkel batch writes it)."""
import csv
import pathlib
import subprocess
import sys
import tempfile

if len(sys.argv) != 6:
    sys.exit(__doc__)
program, scene, session, nwb, row = sys.argv[1:]
folder = pathlib.Path(row).parent
folder.mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory(dir=folder, prefix=".replay-") as out:
    jobs = pathlib.Path(out, "jobs.csv")
    with open(jobs, "w", newline="") as file:
        csv.writer(file).writerows([["name", "scene", "probe"], [pathlib.Path(session).stem, scene, "replay:" + session]])
    done = subprocess.run([program, "batch", jobs, "--out", out, "--keep", "nwb", "--jobs", "1"], stderr=subprocess.PIPE,
                          text=True)
    if done.returncode:
        sys.exit(done.stderr)
    written, = pathlib.Path(out).glob("*.nwb")
    written.rename(nwb)
    pathlib.Path(out, "results.csv").rename(row)
