"""Many runs on the cores of this machine, or on any concurrent.futures.Executor: merkel.batch()."""
import concurrent.futures
import csv
import fcntl
import hashlib
import itertools
import json
import numbers
import os
import pathlib
import sys

import numpy as np

from ._batch_job import FORMATS, run_job
from ._merkel import Error, Scene, __version__, _git_hash, presets

_KEYS = ("scene", "overrides", "press", "probe", "seed", "duration_s", "keep", "name")
_PRESS = ("depth_mm", "force_N", "x_mm", "y_mm", "time_s", "rate_hz")
_RESULTS = ("status", "error", "spikes", "firing", "rate_hz", "busiest_hz", "simulated_s", "verdict", "version", "spike_hash",
            "file", "run_s")


class Result:
    """One job of a batch: its row of the table, and what it kept."""

    def __init__(self, row, kept, folder):
        self._row, self._kept, self._folder = row, kept, folder

    @property
    def row(self):
        """The job's row of the table: its keys, then status ("done" or "failed"), error, spikes, …: a dict."""
        return self._row

    @property
    def file(self):
        """The file of the job in the folder of the batch; None if it has none."""
        return pathlib.Path(self._folder, self._row["file"]) if self._row["file"] else None

    @property
    def run(self):
        """The Run; None if the job failed or its result is elsewhere (file, value)."""
        return self._kept if hasattr(self._kept, "spike_hash") else None

    @property
    def spikes(self):
        """(spikes,) as Run.spikes, from memory or from the job's .npz file. Raises Error if they were not kept."""
        if self.run is not None:
            return self.run.spikes
        if self.file is not None and self.file.suffix == ".npz":
            with np.load(self.file) as arrays:
                return arrays["spikes"]
        raise Error(self._row["error"] or "the job did not keep its spikes as arrays: use keep=\"spikes\"")

    @property
    def value(self):
        """What the function keep returned for the run; None for another keep."""
        if self.file is not None and self.file.suffix == ".npy":
            return np.load(self.file, allow_pickle=False)
        return None if self.run is not None else self._kept

    def __repr__(self):
        return f"<Result {self._row['job']}: {self._row['error'] or str(self._row['spikes']) + ' spikes'}>"


class Batch:
    """The results of merkel.batch(), in the order of the jobs: a sequence of Result."""

    def __init__(self, results):
        self._results = results

    @property
    def rows(self):
        """The table as a list of dicts, one for each job."""
        return [result.row for result in self._results]

    @property
    def table(self):
        """The table as a pandas.DataFrame. Raises Error without pandas: use rows."""
        try:
            import pandas
        except ImportError:
            raise Error("the table needs pandas (python3-pandas): install it, or use rows, a list of dicts") from None
        return pandas.DataFrame(self.rows, columns=_columns(self.rows))

    def __len__(self):
        return len(self._results)

    def __getitem__(self, index):
        return self._results[index]

    def __repr__(self):
        failed = sum(row["status"] != "done" for row in self.rows)
        return f"<Batch of {len(self)} jobs, {failed} failed>"


def batch(jobs, executor=None, *, out=None, keep="spikes", cores=None, progress=None):
    """Runs many jobs and returns a Batch: results in the order of the jobs, and a table with one row for each.

    jobs is an iterable of dicts, or a pandas table. Keys of a job: scene (a Scene, a preset or a file; default
    "paper"); overrides (a dict of keys of the scene), or these keys themselves ("skin.radius_mm": 8); press (a dict
    of arrays as in Scene.run(), a trace or session, or the URI of a simulated press) or probe (a URI);
    seed; duration_s; keep; name. Empty cells of a table (None, NaN) are left out.

    keep says what becomes of a run: "spikes" (the Run; with out an .npz file), "table" (only the row), a file
    format ("nwb", "xdf", "csv", "sonata" or "gdf"; needs out), or a function of the Run that returns numbers or an array
    (a repeated call knows it by its name).

    A job that fails is a row with the error. With out, a folder, finished jobs are recorded at once, and a repeated
    call runs only the others; out/results.csv is the table. executor is any concurrent.futures.Executor whose
    workers can import merkel (Dask: client.get_executor()); by default, one process for each core runs the
    jobs, or as many as cores says. progress shows a bar (needs tqdm); by default on a terminal.

    >>> press = {"depth_mm": [0, 0.5, 1, 1.5, 1.5], "rate_hz": 100}
    >>> done = batch([{"press": press, "seed": seed} for seed in (1, 2)], cores=1)
    >>> [row["status"] for row in done.rows]
    ['done', 'done']
    """
    journal = _Journal(out) if out is not None else None
    rows, kept, twins = {}, {}, {}

    def new_jobs():
        for number, given in enumerate(_dicts(jobs)):
            row, job = _prepared(number, given, keep, journal.folder if journal else None)
            rows[number] = row
            if job is None:
                continue
            numbers_of_job = twins.setdefault(row["id"], [])
            numbers_of_job.append(number)
            if len(numbers_of_job) > 1:
                continue
            finished = journal.finished(row["id"]) if journal else None
            if finished is None:
                yield job
            else:
                kept[row["id"]] = finished, None

    total = len(jobs) if hasattr(jobs, "__len__") else None
    try:
        with _Bar(total, progress) as bar:
            for identity, outcome, value in _outcomes(new_jobs(), executor, cores):
                kept[identity] = outcome, value
                if journal:
                    journal.add(identity, outcome)
                bar.advance()
        for identity, numbers_of_job in twins.items():
            for number in numbers_of_job:
                rows[number].update(kept[identity][0])
        results = [Result(row, kept.get(row["id"], (None, None))[1], journal.folder if journal else None)
                   for row in rows.values()]
        if journal:
            journal.write_table([result.row for result in results])
    finally:
        if journal:
            journal.close()
    return Batch(results)


def _dicts(jobs):
    if hasattr(jobs, "to_dict") and hasattr(jobs, "columns"):
        return jobs.to_dict("records")
    return jobs


def _is_empty(value):
    return value is None or (isinstance(value, float) and value != value)


def _text(value):
    """A value as in a scene file; texts without quotes."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        value = float(value)
        return str(int(value)) if value.is_integer() and abs(value) < 2**53 else repr(value)
    if hasattr(value, "__iter__"):
        return "[" + ", ".join(map(_text, value)) + "]"
    raise Error(f"a job's value cannot be {value!r}: use a number, a text or a list")


def _whole(name, value):
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or value != int(value) or value < 0:
        raise Error(f"{name} must be a whole number from 0 on, but is {value!r}")
    return int(value)


def _digest(path, _known={}):
    """A hash of a file's content; it is read once while it does not change."""
    status = os.stat(path)
    key = os.path.realpath(path), status.st_mtime_ns, status.st_size
    if key not in _known:
        _known[key] = hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()
    return _known[key]


def _scene(given):
    """What a worker makes the scene of: the name of a preset, or a text."""
    if isinstance(given, Scene):
        return given.text
    if given in presets():
        return given
    return Scene(given).text


def _probe(given):
    """(URI, hash of its file). Recordings get their whole path, because workers may run in other folders."""
    uri = given if isinstance(given, str) and given.partition(":")[0].isalpha() and ":" in given else "replay:" + os.fspath(given)
    if not uri.startswith("replay:"):
        return uri, None
    path, mark, options = uri[len("replay:"):].partition("?")
    path = os.path.abspath(path)
    if not os.path.isfile(path):
        raise Error(f"there is no recording {path}")
    return "replay:" + path + mark + options, _digest(path)


def _prepared(number, given, keep, folder):
    """(row, job): the job's keys as a row of the table, and what a worker needs; no job if the keys are wrong."""
    row = {"job": number, "id": "", "scene": "paper"}
    row.update((name, value if isinstance(value, (str, numbers.Number)) else str(value))
               for name, value in given.items()
               if not (_is_empty(value) or name in ("overrides", "press", "keep", "scene")))
    scene = given.get("scene")
    row["scene"] = repr(scene) if isinstance(scene, Scene) else "paper" if _is_empty(scene) else str(scene)
    row.update((name, _text(value)) for name, value in (given.get("overrides") or {}).items())
    row.update(dict.fromkeys(_RESULTS, ""), status="failed")
    try:
        job = _job(given, row, keep, folder)
    except Error as error:
        row["error"] = str(error)
        return row, None
    row["id"] = job["id"]
    return row, job


def _job(given, row, keep, folder):
    given = {name: value for name, value in given.items() if not _is_empty(value)}
    overrides = dict(given.get("overrides", {}))
    for name, value in given.items():
        if "." in name:
            overrides[name] = value
        elif name not in _KEYS:
            raise Error(f"a job has no key {name}: the known ones are {', '.join(_KEYS)}, and keys of the scene such "
                        "as skin.radius_mm")
    job = {"scene": _scene(given.get("scene", "paper")), "overrides": {name: _text(value) for name, value in overrides.items()},
           "press": None, "probe": None, "seed": None, "duration_s": None, "folder": folder,
           "keep": given.get("keep", keep)}
    if not callable(job["keep"]):
        if job["keep"] not in ("spikes", "table", *FORMATS):
            raise Error(f"keep must be a function or one of spikes, table, {', '.join(FORMATS)}, but is {job['keep']!r}")
        if job["keep"] in FORMATS and folder is None:
            raise Error(f"keep=\"{job['keep']}\" writes files: pass out=FOLDER")
    content = [__version__, _git_hash, job["scene"], list(job["overrides"].items())]
    press = given.get("press")
    if press is not None and "probe" in given:
        raise Error("pass either a press or a probe, not both")
    if isinstance(press, dict):
        unknown = [name for name in press if name not in _PRESS]
        if unknown:
            raise Error(f"a press has no {unknown[0]}: its arrays are {', '.join(_PRESS)}")
        job["press"] = {name: value if name == "rate_hz" else np.asarray(value, float) for name, value in press.items()}
        for name, value in sorted(job["press"].items()):
            content.append([name, np.shape(value), hashlib.sha256(np.ascontiguousarray(value, float).tobytes()).hexdigest()])
        row["press"] = "arrays"
    elif press is not None or "probe" in given:
        job["probe"], file_hash = _probe(press if press is not None else given["probe"])
        content.append([job["probe"], file_hash])
        row["probe"] = job["probe"]
    if "seed" in given:
        job["seed"] = _whole("seed", given["seed"])
    if "duration_s" in given:
        job["duration_s"] = float(given["duration_s"])
    kept = job["keep"] if isinstance(job["keep"], str) else f"{job['keep'].__module__}.{job['keep'].__qualname__}"
    content += [job["seed"], job["duration_s"], kept]
    job["id"] = hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
    return job


def _outcomes(jobs, executor, cores):
    """(id, outcome, what was kept) of each job, as they finish."""
    if executor is not None:
        for job, future in _finished(jobs, executor, 256):
            yield _outcome(job, future)
        return
    cores = cores or len(os.sched_getaffinity(0))
    while True:
        broken = []
        context = _context()
        own_core = context.Value("i", 0) if cores <= len(os.sched_getaffinity(0)) else None
        pool = concurrent.futures.ProcessPoolExecutor(cores, context, _start_worker, (os.getpid(), own_core))
        try:
            for job, future in _finished(jobs, pool, 3 * cores):
                if isinstance(future.exception(), concurrent.futures.BrokenExecutor):
                    broken.append(job)
                else:
                    yield _outcome(job, future)
        except BaseException:
            for process in list((pool._processes or {}).values()):
                process.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
        if not broken:
            return
        # A worker died. Each job that it may have run gets a process of its own, so that only the guilty one fails.
        for job in broken:
            with concurrent.futures.ProcessPoolExecutor(1, _context(), _start_worker, (os.getpid(),)) as alone:
                future = alone.submit(run_job, job)
                yield _outcome(job, future)


def _finished(jobs, executor, most):
    """(job, future) as they finish; at most `most` jobs wait in the executor. Stops taking jobs from a broken one."""
    waiting, broken = {}, False
    while True:
        for job in itertools.islice(jobs, 0 if broken else most - len(waiting)):
            try:
                waiting[executor.submit(run_job, job)] = job
            except concurrent.futures.BrokenExecutor as error:
                failed = concurrent.futures.Future()
                failed.set_exception(error)
                waiting[failed] = job
                broken = True
                break
        if not waiting:
            return
        for future in concurrent.futures.wait(waiting, return_when=concurrent.futures.FIRST_COMPLETED).done:
            broken = broken or isinstance(future.exception(), concurrent.futures.BrokenExecutor)
            yield waiting.pop(future), future


def _outcome(job, future):
    error = future.exception()
    if error is None:
        return job["id"], *future.result()
    if isinstance(error, concurrent.futures.BrokenExecutor):
        error = "the process that ran the job was killed; if memory ran out, run fewer jobs at once (cores=)"
    return job["id"], {"status": "failed", "error": " ".join(str(error).split()) or type(error).__name__}, None


def _context():
    import multiprocessing
    # A forked process needs no __main__ that can be imported, so that batch() works in scripts and notebooks.
    return multiprocessing.get_context("fork")


def _start_worker(parent, own_core=None):
    """own_core counts the workers that have taken a core: the threads of two jobs never meet on one."""
    import ctypes
    import signal
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C: the parent ends its workers
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG: a killed parent leaves no worker
    if os.getppid() != parent:
        os._exit(1)
    if own_core is not None:
        with own_core:
            core = sorted(os.sched_getaffinity(0))[own_core.value]
            own_core.value += 1
        os.sched_setaffinity(0, [core])


def _columns(rows):
    """The columns of a table: the jobs' keys in the order of their first use, then the results."""
    keys = dict.fromkeys(name for row in rows for name in row if name not in _RESULTS)
    return [*keys, *_RESULTS]


class _Journal:
    """The folder of a batch: rows.jsonl has the outcome of each finished job, results.csv the table."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)
        os.makedirs(self.folder, exist_ok=True)
        self._file = open(os.path.join(self.folder, "rows.jsonl"), "a+")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise Error(f"another batch is writing to {folder}: wait for its end, or use another folder") from None
        self._outcomes = {}
        self._file.seek(0)
        text = self._file.read()
        for line in text.splitlines():
            try:
                entry = json.loads(line)
                self._outcomes[entry.pop("id")] = entry
            except (ValueError, KeyError, AttributeError):
                continue  # a line that a killed process left unfinished
        if text and not text.endswith("\n"):
            self._file.write("\n")

    def finished(self, identity):
        """The outcome of a job that was done before; failed ones are run again."""
        outcome = self._outcomes.get(identity)
        if outcome is None or outcome["status"] != "done":
            return None
        return outcome if not outcome["file"] or os.path.exists(os.path.join(self.folder, outcome["file"])) else None

    def add(self, identity, outcome):
        self._file.write(json.dumps({"id": identity, **outcome}) + "\n")
        self._file.flush()

    def write_table(self, rows):
        path = os.path.join(self.folder, "results.csv")
        with open(path + ".part", "w", newline="") as file:
            writer = csv.DictWriter(file, _columns(rows), restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        os.replace(path + ".part", path)

    def close(self):
        self._file.close()


class _Bar:
    """A progress bar of tqdm, if it is installed and wanted."""

    def __init__(self, total, wanted):
        self._bar = None
        if wanted or (wanted is None and sys.stderr.isatty()):
            try:
                from tqdm import tqdm
                self._bar = tqdm(total=total, unit="job")
            except ImportError:
                if wanted:
                    raise Error("progress=True needs tqdm (python3-tqdm): install it, or leave progress out") from None

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        if self._bar:
            self._bar.close()

    def advance(self):
        if self._bar:
            self._bar.update()
