"""Fits a scene to recordings, on the cores of this machine or on any concurrent.futures.Executor: merkel.fit()."""
import collections
import os
import pathlib

from ._arguments import checked_by_signature, whole_or_none
from ._merkel import Error, Scene, _fit, _fit_points, _fit_part

_MOST_PARTS = 64
_parts = collections.OrderedDict()


class Fit:
    """The result of merkel.fit()."""

    def __init__(self, result):
        self._result = result

    @property
    def scene(self):
        """The fitted Scene."""
        return self._result["scene"]

    @property
    def parameters(self):
        """A list of dicts, one for each parameter: name, before, after, and relative_error, its standard error."""
        return self._result["parameters"]

    @property
    def cost_before(self):
        """Mean square error of the given scene, in Hz²."""
        return self._result["cost_before"]

    @property
    def cost_after(self):
        """Mean square error of the fitted scene, in Hz²."""
        return self._result["cost_after"]

    @property
    def evaluations(self):
        """How often the model was evaluated."""
        return self._result["evaluations"]

    @property
    def determined(self):
        """Whether the data determine each parameter, and all combinations of them."""
        return self._result["determined"]

    def __repr__(self):
        return f"<Fit: {self.cost_before:.3f} -> {self.cost_after:.3f} Hz²>"


@checked_by_signature
def fit(scene="goodwin", data=None, parameters=("gain_Hz_per_kPa", "fast_weight", "slow_weight"), executor=None, *,
        trials=16, evaluations=200, cores=None):
    """Fits parameters of a scene to recordings as `merkel fit` does, and returns a Fit.

    scene is a Scene, a preset or a scene file whose afferents are driven by energy density. data is a file of
    recordings (JSON; format in tools/README.md); None: the published ones. parameters are names as of
    `merkel fit --parameter`. Each press is repeated trials times, and the model evaluated at most about evaluations
    times. The presses of an evaluation run on threads, one for each core, or as many as cores says; or on
    executor, any concurrent.futures.Executor whose workers can import merkel (Dask: client.get_executor()) and
    read the file data. The result is the same.

    >>> done = fit("goodwin", parameters=["gain_Hz_per_kPa"], trials=1, evaluations=10)
    >>> done.cost_after <= done.cost_before
    True
    """
    if not isinstance(scene, Scene):
        scene = Scene(scene)
    whole_or_none(trials=trials, evaluations=evaluations, cores=cores)
    if isinstance(parameters, str):
        parameters = [parameters]
    if not isinstance(parameters, (list, tuple)) or not all(isinstance(name, str) for name in parameters):
        raise Error(f"parameters must be a list of names, not {parameters!r}")
    if data is not None and not isinstance(data, (str, os.PathLike)):
        raise Error(f"data must be a file of recordings, not {data!r}")
    names, file = list(parameters), "" if data is None else str(pathlib.Path(data).absolute())
    elsewhere = None
    if executor is not None:
        parts = min(_fit_points(scene, file), 2 * _workers(executor))
        job = scene.text, file, tuple(names), trials, parts

        def elsewhere(values):
            answers = [0.0] * _fit_points(scene, file)
            tasks = [executor.submit(_responses, job, part, values) for part in range(parts)]
            for part, task in enumerate(tasks):
                answers[part::parts] = task.result()
            return answers

    return Fit(_fit(scene, file, names, trials, evaluations, cores or len(os.sched_getaffinity(0)), elsewhere))


def _workers(executor):
    """How many tasks it runs at once, as far as it says; Dask's executor has a client, which knows its workers."""
    if hasattr(executor, "_client"):
        return max(1, sum(executor._client.nthreads().values()))
    return getattr(executor, "_max_workers", None) or 8


def _responses(job, part, values):
    """The responses of a part of the points; its presses are computed once in each process."""
    key = job, part
    known = _parts.pop(key, None)
    if known is None:
        text, data, names, trials, parts = job
        known = _fit_part(Scene.from_text(text), data, list(names), trials, part, parts)
    _parts[key] = known
    while len(_parts) > _MOST_PARTS:
        _parts.popitem(last=False)
    return known(values)
