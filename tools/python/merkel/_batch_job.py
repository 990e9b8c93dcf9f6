"""One job of merkel.batch(), on a worker."""
import collections
import os
import pickle
import time

import numpy as np

from ._merkel import Error, Scene, __version__, _git_hash

FORMATS = {"nwb": "nwb", "xdf": "xdf", "csv": "csv", "sonata": "h5", "gdf": "gdf"}
EXTENSIONS = {**FORMATS, "spikes": "npz"}
_MOST_BYTES = 64 << 20  # that pass through a scheduler for one job
_MOST_SCENES = 2
_scenes = collections.OrderedDict()


def _scene_of(job):
    """The scene of a job; the last ones are kept with their models, which take longer to build than to run."""
    key = job["scene"], tuple(job["overrides"].items())
    scene = _scenes.pop(key, None)
    if scene is None:
        scene = pickle.loads(job["pickled"]) if job["pickled"] else Scene(job["scene"])
        scene._override({**job["overrides"], "loop.threads": 1})  # the jobs share the cores; the spikes are the same
        scene.keep_model = True
    _scenes[key] = scene
    while len(_scenes) > _MOST_SCENES:
        _scenes.popitem(last=False)
    return scene


def error_text(error):
    """Why a job failed, on one line."""
    text = str(error) if isinstance(error, Error) else f"{type(error).__name__}: {error}"
    return " ".join(text.split())


def run_job(job):
    """(outcome, what to keep): the outcome has the columns of the job's row."""
    begin = time.perf_counter()
    try:
        kept, outcome = _run(job)
    except Exception as error:  # whatever a keep function raises is its job's failure, not the batch's
        return {"status": "failed", "error": error_text(error)}, None
    outcome["run_s"] = round(time.perf_counter() - begin, 6)
    return outcome, kept


def _run(job):
    keep, folder = job["keep"], job["folder"]
    file, sinks = job["file"], []
    if keep in FORMATS:
        sinks = [f"{keep}:{os.path.join(folder, file)}"]
    press = job["press"] or {}
    run = _scene_of(job).run(**press, probe=job["probe"], seed=job["seed"], duration_s=job["duration_s"], sinks=sinks,
                             overwrite=True)
    kept = None
    if callable(keep):
        kept = keep(run)
        if folder is not None:
            array = np.asarray(kept)
            if array.dtype.hasobject:
                raise Error(f"keep returned {type(kept).__name__}: with out=, return numbers or an array")
            kept = None
            _write(folder, file, lambda out: np.save(out, array, allow_pickle=False))
    elif keep == "spikes" and folder is not None:
        _write(folder, file, lambda out: np.savez(out, spikes=run.spikes, stimulation=run.stimulation,
                                                  afferents=run.afferents, start_s=run.start_s,
                                                  duration_s=run.duration_s))
    elif keep == "spikes":
        size = run.spikes.nbytes + run.stimulation.nbytes
        if size > _MOST_BYTES:
            raise Error(f"the run takes {size >> 20} MiB, too much to return: pass out=FOLDER, and it goes to a file")
        kept = run
    counts = np.bincount(run.spikes["neuron"], minlength=1)
    span_s = max(run.duration_s, 1e-9)
    return kept, {
        "status": "done", "error": "", "spikes": len(run.spikes), "firing": int(np.count_nonzero(counts)),
        "rate_hz": round(len(run.spikes) / max(len(run.afferents), 1) / span_s, 6),
        "busiest_hz": round(int(counts.max()) / span_s, 6), "simulated_s": run.duration_s, "verdict": run.verdict,
        "version": f"{__version__} {_git_hash}", "spike_hash": run.spike_hash, "file": file, "command": job["command"]}


def _write(folder, name, write):
    """Writes a file that has its name only when it is complete."""
    path = os.path.join(folder, name)
    with open(path + ".part", "wb") as out:
        write(out)
    os.replace(path + ".part", path)
