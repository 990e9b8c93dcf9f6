"""Many runs on the cores of this machine, or on any concurrent.futures.Executor: merkel.batch()."""
import pathlib
import sys
import warnings

import numpy as np

from ._batch_engine import Journal, outcomes
from ._batch_prepare import columns, dicts, prepared
from ._arguments import checked_by_signature, whole_or_none
from ._merkel import Error


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
        return pandas.DataFrame(self.rows, columns=columns(self.rows))

    def __len__(self):
        return len(self._results)

    def __getitem__(self, index):
        return self._results[index]

    def __repr__(self):
        failed = sum(row["status"] != "done" for row in self.rows)
        return f"<Batch of {len(self)} jobs, {failed} failed>"


@checked_by_signature
def batch(jobs, executor=None, *, out=None, keep="spikes", cores=None, progress=None):
    """Runs many jobs and returns a Batch: results in the order of the jobs, and a table with one row for each.

    jobs is an iterable of dicts, a pandas table, or sessions and folders of sessions, by their paths: the press of each
    through the scene that it holds, under its name. Keys of a job: scene (a Scene, a preset or a file; default
    "paper"); overrides (a dict of keys of the scene), or these keys themselves ("skin.radius_mm": 8); press (a dict
    of arrays as in Scene.run(), a trace or session, or the URI of a simulated press) or probe (a URI);
    seed; duration_s; keep; name. Empty cells of a table (None, NaN) are left out.

    keep says what becomes of a run: "spikes" (the Run; with out an .npz file), "table" (only the row), a file
    format ("nwb", "xdf", "csv", "sonata" or "gdf"; needs out), or a function of the Run that returns numbers or an array
    (a repeated call knows it by its name). The sinks of a scene are not opened, since all jobs would write to them;
    a warning says so.

    A job that fails is a row with the error. With out, a folder, finished jobs are recorded at once, and a repeated
    call runs only the others, and so does `merkel batch` with the same folder; out/results.csv is the table, whose last
    column is the command that repeats the job. A kept file is named by name, or by the job's id. executor is any concurrent.futures.Executor whose
    workers can import merkel (Dask: client.get_executor()); by default, one process for each core runs the
    jobs, or as many as cores says. progress shows a bar (needs tqdm); by default on a terminal.

    >>> press = {"depth_mm": [0, 0.5, 1, 1.5, 1.5], "rate_hz": 100}
    >>> done = batch([{"press": press, "seed": seed} for seed in (1, 2)], cores=1)
    >>> [row["status"] for row in done.rows]
    ['done', 'done']
    """
    whole_or_none(cores=cores)
    jobs = dicts(jobs)
    journal = Journal(out) if out is not None else None
    rows, kept, twins, files, with_sinks = {}, {}, {}, {}, []

    def new_jobs():
        for number, given in enumerate(jobs):
            row, job = prepared(number, given, keep, journal.folder if journal else None)
            rows[number] = row
            if job is None:
                continue
            if job["has_sinks"]:
                with_sinks.append(number)
            numbers_of_job = twins.setdefault(row["id"], [])
            numbers_of_job.append(number)
            if len(numbers_of_job) > 1:
                continue
            if files.setdefault(job["file"], row["id"]) != row["id"] and job["file"]:
                raise Error(f"two different jobs have the name \"{job['name']}\", but each keeps a file of its name: "
                            "give them different names")
            if journal:
                journal.check_own(job)
            finished = journal.finished(row["id"]) if journal else None
            if finished is None:
                yield job
            else:
                kept[row["id"]] = finished, None

    total = len(jobs) if hasattr(jobs, "__len__") else None
    try:
        with _Bar(total, progress) as bar:
            for identity, outcome, value in outcomes(new_jobs(), executor, cores):
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
    if with_sinks:
        warnings.warn("a batch does not open the sinks of its scenes, since all jobs would write to them: "
                      "keep=\"csv\" or another format writes a file for each job", stacklevel=3)
    return Batch(results)


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
