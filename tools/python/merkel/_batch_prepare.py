"""What becomes of the jobs of merkel.batch() before they run: rows of its table, and what a worker needs."""
import copy
import hashlib
import numbers
import os
import pickle
import reprlib

import numpy as np

from ._batch_job import EXTENSIONS, FORMATS, error_text
from ._merkel import Error, Scene, _batch_names, _numbers, _session_jobs, _split_fragment, _value_text, presets

_KEYS = ("scene", "overrides", "press", "probe", "seed", "duration_s", "keep", "name")
_PRESS = ("depth_mm", "force_N", "x_mm", "y_mm", "time_s", "rate_hz")
RESULTS = ("status", "error", "spikes", "firing", "rate_hz", "busiest_hz", "simulated_s", "verdict", "version", "spike_hash",
           "file", "run_s", "command")


def dicts(jobs):
    """The jobs as dicts: of a pandas table, of sessions or folders of sessions, or as they are."""
    if isinstance(jobs, (str, os.PathLike)):
        jobs = [jobs]
    if isinstance(jobs, (list, tuple)) and jobs and all(isinstance(job, (str, os.PathLike)) for job in jobs):
        columns_of_jobs, rows = _session_jobs([os.fspath(job) for job in jobs])
        return [dict(zip(columns_of_jobs, row)) for row in rows]
    if hasattr(jobs, "to_dict") and hasattr(jobs, "columns"):
        return jobs.to_dict("records")
    if isinstance(jobs, dict) or not hasattr(jobs, "__iter__"):
        raise Error(f"jobs must be a list of dicts, a pandas table or paths of sessions, but is {reprlib.repr(jobs)}")
    return jobs


def _is_empty(value):
    return value is None or type(value).__name__ == "NAType" or (isinstance(value, numbers.Real) and value != value)


def _whole(name, value):
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or value % 1 != 0 or value < 0:
        raise Error(f"{name} must be a whole number from 0 on, but is {value!r}")
    return int(value)


def _scene(given):
    """(identity, pickled, has_sinks): the name of a preset and None, or a scene without sinks, and whether it had some."""
    if not isinstance(given, Scene) and given in presets():
        return given, None, False
    scene = copy.copy(given) if isinstance(given, Scene) else Scene(given)
    has_sinks = scene._drop_sinks()
    return scene._identity(), pickle.dumps(scene), has_sinks


def _probe(given):
    """A URI. Recordings get their whole path, because workers may run in other folders."""
    uri = given if isinstance(given, str) and given.partition(":")[0].isalpha() and ":" in given else "replay:" + os.fspath(given)
    if not uri.startswith("replay:"):
        return uri
    whole, fragment = _split_fragment(uri)
    path, mark, options = whole[len("replay:"):].partition("?")
    if os.path.exists(path) or os.path.exists(path.rpartition("@")[0]):  # or a rig in a file of LabRecorder
        path = os.path.abspath(path)
    elif os.path.dirname(path) or os.path.splitext(path)[1]:
        raise Error(f"there is no recording {os.path.abspath(path)}")
    return "replay:" + path + mark + options + ("" if fragment is None else "#" + fragment)


def prepared(number, given, keep, folder):
    """(row, job): the job's keys as a row of the table, and what a worker needs; no job if the keys are wrong."""
    if not hasattr(given, "items"):
        raise Error(f"job {number} must be a dict of its keys, but is {reprlib.repr(given)}")
    given = {name: value for name, value in given.items() if not _is_empty(value)}
    row = {"job": number, "id": "", "scene": "paper"}
    row.update((name, value if isinstance(value, (str, numbers.Number)) else str(value))
               for name, value in given.items() if name not in ("overrides", "press", "keep", "scene"))
    scene = given.get("scene", "paper")
    row["scene"] = repr(scene) if isinstance(scene, Scene) else str(scene)
    row.update(dict.fromkeys(RESULTS, ""), status="failed")
    try:
        job = _job(given, row, keep, folder)
    except Exception as error:  # whatever a wrong value raises is its job's failure, not the batch's
        row["error"] = error_text(error)
        return row, None
    row["id"] = job["id"]
    return row, job


def _job(given, row, keep, folder):
    overrides = dict(given.get("overrides", {}))
    for name, value in given.items():
        if "." in name:
            overrides[name] = value
        elif name not in _KEYS:
            raise Error(f"a job has no key {name}: the known ones are {', '.join(_KEYS)}, and keys of the scene such "
                        "as skin.radius_mm")
    scene = given.get("scene", "paper")
    identity, pickled, has_sinks = _scene(scene)
    job = {"scene": identity, "pickled": pickled, "has_sinks": has_sinks,
           "overrides": {name: _value_text(value) for name, value in overrides.items()}, "press": None, "probe": None, "file": "",
           "command": "", "seed": None, "duration_s": None, "folder": folder, "keep": given.get("keep", keep),
           "name": str(given.get("name", ""))}
    row.update((name, job["overrides"][name]) for name in given.get("overrides", {}))
    if not callable(job["keep"]):
        if job["keep"] not in ("spikes", "table", *FORMATS):
            raise Error(f"keep must be a function or one of spikes, table, {', '.join(FORMATS)}, but is {job['keep']!r}")
        if job["keep"] in FORMATS and folder is None:
            raise Error(f"keep=\"{job['keep']}\" writes files: pass out=FOLDER")
    more = ""
    press = given.get("press")
    if press is not None and "probe" in given:
        raise Error("pass either a press or a probe, not both")
    if isinstance(press, dict):
        unknown = [name for name in press if name not in _PRESS]
        if unknown:
            raise Error(f"a press has no {unknown[0]}: its arrays are {', '.join(_PRESS)}")
        job["press"] = {name: value if name == "rate_hz" else _numbers(name, value)
                        for name, value in press.items() if value is not None}
        if not job["press"]:
            raise Error(f"a press has no arrays: pass some of {', '.join(_PRESS)}")
        for name, value in sorted(job["press"].items()):
            digest = hashlib.sha256(np.ascontiguousarray(value, float).tobytes()).hexdigest()
            more += f"{name} {np.shape(value)} {digest}\n"
        row["press"] = "arrays"
    elif press is not None or "probe" in given:
        job["probe"] = _probe(press if press is not None else given["probe"])
        row["probe"] = job["probe"]
    if "seed" in given:
        job["seed"] = _whole("seed", given["seed"])
    if "duration_s" in given:
        job["duration_s"] = float(given["duration_s"])
    if callable(job["keep"]):
        kept = f"{job['keep'].__module__}.{job['keep'].__qualname__}"
    else:
        kept = "" if job["keep"] == "table" else job["keep"]
    extension = "npy" if callable(job["keep"]) else EXTENSIONS.get(kept, "")
    job["id"], job["command"], job["file"] = _batch_names(
        str(scene), job["scene"], job["probe"] or "", job["seed"], job["duration_s"], list(job["overrides"].items()), kept,
        job["name"], more, extension if folder is not None else "")
    if job["press"] or isinstance(scene, Scene):
        job["command"] = ""
    return job


def columns(rows):
    """The columns of a table: the jobs' keys in the order of their first use, then the results."""
    keys = dict.fromkeys(name for row in rows for name in row if name not in RESULTS)
    return [*keys, *RESULTS]
