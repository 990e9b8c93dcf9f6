"""How the jobs of merkel.batch() run: on processes of this machine or on an executor, and the journal of a folder."""
import concurrent.futures
import csv
import fcntl
import itertools
import json
import os

from ._batch_job import run_job
from ._batch_prepare import columns
from ._merkel import Error


def outcomes(jobs, executor, cores):
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


def _foreign(path):
    return Error(f"cannot write {path}: it exists, and no batch has written it; move it, or use another folder")


class Journal:
    """The folder of a batch: rows.jsonl has the outcome of each finished job, results.csv the table."""

    def __init__(self, folder):
        if not os.fspath(folder):
            raise Error("out must not be empty: name a folder, or leave it out")
        self.folder = os.path.abspath(folder)
        journal, table = os.path.join(self.folder, "rows.jsonl"), os.path.join(self.folder, "results.csv")
        if os.path.lexists(table) and not os.path.lexists(journal):
            raise _foreign(table)
        try:
            os.makedirs(self.folder, exist_ok=True)
            self._file = open(journal, "a+")
        except OSError as error:
            raise Error(f"cannot write {journal}: {error.strerror}") from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise Error(f"another batch is writing to {folder}: wait for its end, or use another folder") from None
        self._outcomes, self._job_of_file = {}, {}
        self._file.seek(0)
        text = self._file.read()
        for line in text.splitlines():
            try:
                entry = json.loads(line)
                identity = entry.pop("id")
                self._outcomes[identity] = entry
                self._job_of_file[entry.get("file", "")] = identity
            except (ValueError, KeyError, AttributeError):
                continue  # a line that a killed process left unfinished
        if text and not text.endswith("\n"):
            self._file.write("\n")

    def finished(self, identity):
        """The outcome of a job that was done before; failed ones are run again."""
        outcome = self._outcomes.get(identity)
        if outcome is None or outcome["status"] != "done":
            return None
        file = outcome["file"]
        # A job of the same name may have replaced the file since.
        own = self._job_of_file.get(file) == identity and os.path.exists(os.path.join(self.folder, file))
        return outcome if not file or own else None

    def check_own(self, job):
        """Raises Error if a file has the name of a job's kept one, but no batch has written it."""
        path = os.path.join(self.folder, job["file"])
        if job["name"] and job["file"] and job["file"] not in self._job_of_file and os.path.lexists(path):
            raise _foreign(path)

    def add(self, identity, outcome):
        self._file.write(json.dumps({"id": identity, **outcome}) + "\n")
        self._file.flush()

    def write_table(self, rows):
        path = os.path.join(self.folder, "results.csv")
        with open(path + ".part", "w", newline="") as file:
            writer = csv.DictWriter(file, columns(rows), restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        os.replace(path + ".part", path)

    def close(self):
        self._file.close()
