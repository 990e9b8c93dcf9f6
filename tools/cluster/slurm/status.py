#!/usr/bin/env python3
"""The state of a Slurm job as Snakemake wants it: running, success or failed. It notices jobs that were killed."""
import subprocess
import sys

shown = subprocess.run(["scontrol", "show", "job", "-o", sys.argv[1]], capture_output=True, text=True)
facts = dict(fact.partition("=")[::2] for fact in shown.stdout.split())
state = facts.get("JobState")
if state is None:  # forgotten by the controller: ask the accounting, if there is one
    shown = subprocess.run(["sacct", "-X", "-n", "-P", "-o", "State", "-j", sys.argv[1]], capture_output=True, text=True)
    state = (shown.stdout.split() or ["COMPLETED"])[0]
if state == "COMPLETED":
    print("success")
elif state in ("PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "REQUEUED"):
    print("running")
else:
    print("failed")
