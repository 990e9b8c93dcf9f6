"""Tactile spikes from a haptic probe: simulated SAI afferents, live and in batches.

>>> import numpy as np, merkel
>>> scene = merkel.Scene("paper")
>>> depth = np.clip(np.linspace(0, 6, 400), 0, 1.5)      # mm, one sample per millisecond
>>> run = scene.run(depth_mm=depth, rate_hz=1000)
>>> run.spikes.dtype.names
('time_s', 'neuron', 'patch', 'flags')
>>> len(run.spikes) > 0
True

Times are in s, lengths in mm, forces in N. Neurons are numbered from 1, probes and patches from 0. Errors
raise merkel.Error with the message that the program would print.
"""
from . import _arguments
from ._merkel import Bridge, Error, Output, Run, Scene, Session, Stream, Table, __version__, load, presets
from ._merkel import connect as _connect
from ._batch import Batch, Result, batch
from ._fit import Fit, fit
from ._streams import RecordedStream, load_streams
from ._trials import Press, Trials, trials

__all__ = ["Batch", "Bridge", "Device", "Error", "Fit", "Output", "Press", "RecordedStream", "Result", "Run", "Scene", "Session", "Stream", "Table", "Trials", "__version__", "batch", "connect", "fit", "load", "load_streams", "presets", "trials"]


for _class in (Bridge, Run, Scene, Session, Stream):
    for _name, _method in list(vars(_class).items()):
        if isinstance(_method, staticmethod):
            setattr(_class, _name, staticmethod(_arguments.checked(getattr(_class, _name), is_method=False)))
        elif callable(_method) and (not _name.startswith("_") or _name in ("__getitem__", "__setitem__", "__init__")):
            if (_method.__doc__ or "").startswith(_name + "("):
                _title = {"__init__": "Scene()", "__getitem__": "scene[key]", "__setitem__": "scene[key]"}.get(_name)
                setattr(_class, _name, _arguments.checked(getattr(_class, _name), _title))
load, presets, _connect = (_arguments.checked(each, is_method=False) for each in (load, presets, _connect))


class Device:
    """A device with channels for several probes, such as the sensors of a hand on one line.

    It is opened once, and each probe takes some of its channels: by name, with or without the unit, or by column.

    >>> hand = Device("serial:/dev/ttyUSB0?protocol=csv&columns=time_us,thumb_N,index_N,index_mm")
    >>> hand["thumb_N"]
    'serial:/dev/ttyUSB0?protocol=csv&columns=time_us,thumb_N,index_N,index_mm#thumb_N'
    >>> hand.probe(force="index_N", depth=4).rpartition("#")[2]
    'force=index_N,depth=4'

    Pass such probes to connect: connect({"thumb": hand["thumb_N"], "index": hand["index_N"]}, scene).
    """

    def __init__(self, uri):
        self._uri = str(uri)

    @property
    def uri(self):
        """The URI of the device, without channels."""
        return self._uri

    def __getitem__(self, channel):
        return f"{self.uri}#{channel}"

    def probe(self, *, force=None, depth=None, x=None, y=None):
        """The URI of a probe with these channels as its readings."""
        chosen = {"force": force, "depth": depth, "x": x, "y": y}
        return f"{self.uri}#" + ",".join(f"{key}={channel}" for key, channel in chosen.items() if channel is not None)

    def __repr__(self):
        return f"Device({self.uri!r})"


@_arguments.checked_by_signature
def connect(probe=None, scene="paper", *, sinks=(), duration_s=None, overwrite=False, allow_remote=False,
            most_unread=1_000_000):
    """Starts the real-time pipeline: probe -> model -> sinks, and spikes and stimulation to Python.

    probe is a URI ("serial:/dev/ttyUSB0?protocol=hbf1", "sim:taps?live=1"); None for those of the scene. For a scene with several probes it is a
    list of URIs, one for each, or a dict from patches to URIs: {"thumb": "serial:…", "index": "serial:…"}; the
    probes that the dict leaves out keep the scene's own URI, which must not be a simulated press beside devices. scene is a Scene, a preset or a scene
    file. sinks are URIs ("xdf:session.xdf", "view:8080"). Leave the with block, or call stop(), to end the run. Beyond most_unread unread spikes (and as many commands), new
    ones are lost for Python only: Bridge.counters counts them.

    >>> with connect("sim:ramp?depth_mm=1.5&hold_s=0.3&live=1") as bridge:
    ...     spikes = [new.spikes for new in bridge]
    >>> bridge.ended
    True
    """
    if not isinstance(scene, Scene):
        scene = Scene(scene)
    return _connect(_uris(probe, scene), scene, sinks=[sinks] if isinstance(sinks, str) else sinks, duration_s=duration_s, overwrite=overwrite,
                    allow_remote=allow_remote, most_unread=most_unread)


def _uris(probe, scene):
    """One URI for each probe of a scene."""
    if probe is None:
        return scene.uris
    if isinstance(probe, (str, Device)):
        return [getattr(probe, "uri", probe)]
    if not isinstance(probe, dict):
        if not hasattr(probe, "__iter__"):
            raise Error("connect(): probe must be a URI, a list of URIs or a dict from patches to URIs, but is "
                        + repr(probe))
        return list(probe)
    patches = [scene[f"probe[{i}].patch"] for i in range(scene.probes)]
    unknown = [patch for patch in probe if patch not in patches]
    if unknown:
        raise Error(f"no probe of the scene presses on {unknown[0]}; its probes press on {', '.join(map(str, patches))}")
    simulated = [patch for i, patch in enumerate(patches) if patch not in probe and scene.uris[i].startswith("sim:")]
    if simulated and any(not str(uri).startswith("sim:") for uri in probe.values()):
        raise Error(f"the scene simulates the presses on {', '.join(map(str, simulated))}: give a probe for each, or a scene with only the "
                    "[[probe]] tables that you have, each with its patch")
    return [probe.get(patch, scene.uris[i]) for i, patch in enumerate(patches)]
