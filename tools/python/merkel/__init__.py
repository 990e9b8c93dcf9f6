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
from ._merkel import Bridge, Error, Output, Run, Scene, Session, Stream, Table, __version__, load, presets
from ._merkel import connect as _connect

__all__ = ["Bridge", "Error", "Output", "Run", "Scene", "Session", "Stream", "Table", "__version__", "connect", "load", "presets"]


def connect(probe, scene="paper", *, sinks=(), duration_s=None, overwrite=False, allow_remote=False,
            most_unread=1_000_000):
    """Starts the real-time pipeline: probe -> model -> sinks, and spikes and stimulation to Python.

    probe is a URI ("serial:/dev/ttyUSB0?protocol=hbf1", "sim:taps?live=1"), scene a Scene, a preset or a scene
    file. sinks are URIs ("xdf:session.xdf", "view:8080"). Leave the with block, or call stop(), to end the run. Beyond most_unread unread spikes (and as many commands), new
    ones are lost for Python only: Bridge.counters counts them.

    >>> with connect("sim:ramp?depth_mm=1.5&hold_s=0.3&live=1") as bridge:
    ...     spikes = [new.spikes for new in bridge]
    >>> bridge.ended
    True
    """
    if not isinstance(scene, Scene):
        scene = Scene(scene)
    return _connect(probe, scene, sinks=list(sinks), duration_s=duration_s, overwrite=overwrite,
                    allow_remote=allow_remote, most_unread=most_unread)
