"""A laboratory's recordings as presses for `merkel score` and `merkel fit`: merkel.trials()."""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import typing

import numpy as np

from ._arguments import checked_by_signature
from ._merkel import Error

_FASTEST_HZ = 2000      # of a trace: twice the resolution of `merkel score`
_CONTACT = 0.05         # of the largest level: a press begins and ends there
_PAUSE_S = 0.2          # shorter pauses are part of a press
_SHORTEST_S = 0.01      # shorter ones are noise
_MARGIN_S = 0.5         # of rest before and after a press, at most
_ALIKE = 0.05           # of the peak: presses that differ less are trials of one
_COMPILED = {".pkl", ".pickle"}  # reading them runs what they contain


class Press(typing.NamedTuple):
    """A press and the spikes of its trials.

    level is the mean over the trials, in unit ("N" or "mm"); time_s, and the arrays of spike_times_s, one for each
    trial, count from the first sample; deviation is the largest distance of a trial's level from the mean.
    """
    name: str
    unit: str
    time_s: np.ndarray
    level: np.ndarray
    spike_times_s: list
    deviation: float

    def __repr__(self):
        return (f"<Press {self.name}: {self.level.max():.3g} {self.unit}, {self.time_s[-1]:.3g} s, "
                f"{len(self.spike_times_s)} trials, {sum(map(len, self.spike_times_s))} spikes>")


class Trials(list):
    """The result of merkel.trials(): a list of Press."""

    def __init__(self, presses, section):
        super().__init__(presses)
        self._section = section

    def write(self, folder, overwrite=False):
        """Writes a trace for each press and recordings.json, and returns its path, for `merkel score --data`."""
        folder = pathlib.Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        sections, files = [], {}
        for number, press in enumerate(self, 1):
            column = "force_N" if press.unit == "N" else "depth_mm"
            rows = "".join(f"{time:.9f},{level!r}\n" for time, level in zip(press.time_s.tolist(), press.level.tolist()))
            files[f"press_{number}.csv"] = f"time_s,{column}\n{rows}"
            sections.append({"name": press.name, "trace": f"press_{number}.csv",
                             "spike_times_s": [times.tolist() for times in press.spike_times_s], **self._section})
        files["recordings.json"] = json.dumps({"trials": sections}, indent=1) + "\n"
        for name, text in files.items():
            if (folder / name).exists() and not overwrite:
                raise Error(f"{folder / name} exists: remove it, or pass overwrite=True")
        for name, text in files.items():
            (folder / name).write_text(text)
        return str(folder / "recordings.json")


@checked_by_signature
def trials(recordings, *, force=None, depth=None, newtons_per_volt=None, mm_per_volt=None, spikes=None, tip="sphere",
           radius_mm=5.0, probe_diameter_mm=None, cite="own recordings"):
    """Presses with the recorded spikes of each trial, as a list of Press, from recordings of any laboratory.

    recordings is a Neo Block or Segment, or a list of them; or a dict of arrays, or a list of them: force_N or depth_mm
    (one number a sample), rate_hz, and spikes_s, the times of the spikes from the first sample on. force and depth are
    names of Neo's analog signals or of their channels; one in V needs newtons_per_volt or mm_per_volt. Where both are
    given, force drives. spikes is the name of a spike train, needed if there are several. The level at rest is
    subtracted.

    A segment is cut into its presses: a press begins and ends at 5 % of the largest level, and pauses of less than
    0.2 s belong to it. Presses whose levels agree within 5 % of the peak are trials of one press. Levels are averaged
    over blocks to at most 2000 samples/s. tip, radius_mm and probe_diameter_mm are those of tools/README.md.

    >>> import numpy as np
    >>> press = np.clip(np.minimum(np.arange(1000), 999 - np.arange(1000)) / 100 - 2, 0, 1)
    >>> trials({"force_N": 0.5 * press, "rate_hz": 1000, "spikes_s": [0.31, 0.35, 0.5]})
    [<Press press 1: 0.5 N, 0.999 s, 1 trials, 3 spikes>]
    """
    section = {"cite": cite, "tip": tip}
    if probe_diameter_mm is not None:
        section["probe_diameter_mm"] = probe_diameter_mm
    elif tip == "sphere":
        section["radius_mm"] = radius_mm
    cut = []
    for recording in _segments(recordings):
        if isinstance(recording, dict):
            source = _of_arrays(recording)
        else:
            source = _of_segment(recording, force or None, depth or None, newtons_per_volt, mm_per_volt, spikes)
        cut += _presses(*source)
    if not cut:
        raise Error("the recordings contain no press: their level never leaves its rest")
    return Trials(_grouped(cut), section)


def _segments(recordings):
    """Segments and dicts, one after the other."""
    if isinstance(recordings, dict) or hasattr(recordings, "analogsignals"):
        yield recordings
    elif hasattr(recordings, "segments"):
        yield from recordings.segments
    elif isinstance(recordings, (list, tuple)) or type(recordings).__name__ == "ObjectList":  # Neo 0.14
        for each in recordings:
            yield from _segments(each)
    else:
        raise Error(f"recordings must be Neo's segments or dicts of arrays, not {type(recordings).__name__}")


def _of_arrays(recording):
    """(unit, level, rate, spike times from the first sample) of a dict of arrays."""
    unknown = set(recording) - {"force_N", "depth_mm", "rate_hz", "spikes_s"}
    if unknown:
        raise Error(f"recordings have force_N or depth_mm, rate_hz and spikes_s, not {sorted(unknown)[0]}")
    key = next((key for key in ("force_N", "depth_mm") if key in recording), None)
    if key is None or "rate_hz" not in recording or "spikes_s" not in recording:
        raise Error("a recording of arrays needs force_N or depth_mm, rate_hz and spikes_s")
    level = np.asarray(recording[key], dtype=float)
    return key.rpartition("_")[2], level, float(recording["rate_hz"]), np.asarray(recording["spikes_s"], dtype=float)


def _channels(segment):
    """Neo's analog channels by name: of the signal, or of its channel if the signal has several."""
    found = {}
    for number, signal in enumerate(segment.analogsignals):
        width = signal.shape[1]
        names = signal.array_annotations.get("channel_names")
        if names is None or len(names) != width:
            names = [signal.name or f"signal{number}"] if width == 1 else \
                [f"{signal.name or f'signal{number}'}[{i}]" for i in range(width)]
        for i, name in enumerate(names):
            found.setdefault(str(name), (signal, i))
        if width == 1 and signal.name:
            found.setdefault(signal.name, (signal, 0))
    return found


def _of_segment(segment, force, depth, newtons_per_volt, mm_per_volt, spikes):
    """(unit, level, rate, spike times from the first sample) of a Neo segment."""
    channels = _channels(segment)
    wanted, unit, per_volt, option = (force, "N", newtons_per_volt, "newtons_per_volt") if force is not None \
        else (depth, "mm", mm_per_volt, "mm_per_volt")
    if wanted not in channels:
        raise Error(f"there is no analog channel {wanted!r}: name the one of the force or depth; the channels are "
                    + (", ".join(channels) or "none"))
    signal, column = channels[wanted]
    level = signal[:, column:column + 1]
    if _is_unit(level, unit):
        level = np.asarray(level.rescale(unit).magnitude, dtype=float)[:, 0]
    elif _is_unit(level, "V"):
        if per_volt is None:
            raise Error(f"the channel {wanted} is in {level.dimensionality}: pass {option}")
        level = per_volt * np.asarray(level.rescale("V").magnitude, dtype=float)[:, 0]
    else:
        raise Error(f"the channel {wanted} is in {level.dimensionality}, which is neither {unit} nor V")
    trains = {str(train.name or f"train{i}"): train for i, train in enumerate(segment.spiketrains)}
    if spikes is None and len(trains) == 1:
        spikes = next(iter(trains))
    if spikes not in trains:
        raise Error(f"choose a spike train by spikes, not {spikes!r}: there " +
                    (f"are {', '.join(trains)}" if trains else "is none"))
    begin_s = float(signal.t_start.rescale("s"))
    times_s = np.sort(np.asarray(trains[spikes].rescale("s").magnitude, dtype=float)) - begin_s
    return unit, level, float(signal.sampling_rate.rescale("Hz")), times_s


def _is_unit(level, unit):
    try:
        level.units.rescale(unit)
    except ValueError:
        return False
    return True


def _presses(unit, level, rate_hz, spikes_s):
    """The presses of one recording: (unit, seconds of a sample, level, spike times), each from its own first sample."""
    if level.ndim != 1 or len(level) < 2 or not np.all(np.isfinite(level)):
        raise Error("a force or depth must be a list of finite numbers, at least two")
    if not rate_hz > 0 or not np.all(np.isfinite(spikes_s)):
        raise Error("the rate must be positive, and the times of spikes finite")
    block = max(1, int(rate_hz // _FASTEST_HZ))
    level = level[:len(level) // block * block].reshape(-1, block).mean(axis=1)
    step_s = block / rate_hz
    offset_s = 0.5 * (block - 1) / rate_hz  # of a block's middle
    lowest = np.quantile(level, 0.05)
    level = level - np.median(level[level <= lowest + _CONTACT * (level.max() - lowest)])
    touching = np.flatnonzero(level > _CONTACT * level.max()) if level.max() > 0 else np.array([], dtype=int)
    if len(touching) == 0:
        return []
    ends = np.flatnonzero(np.diff(touching) * step_s > _PAUSE_S)
    first = touching[np.concatenate(([0], ends + 1))]
    last = touching[np.concatenate((ends, [len(touching) - 1]))]
    margin = int(round(_MARGIN_S / step_s))
    cut = []
    for i, (begin, end) in enumerate(zip(first, last)):
        if (end - begin) * step_s < _SHORTEST_S:
            continue
        before = 0 if i == 0 else (last[i - 1] + begin) // 2
        after = len(level) - 1 if i + 1 == len(first) else (end + first[i + 1]) // 2
        begin, end = max(before, begin - margin), min(after, end + margin)
        since = spikes_s - (begin * step_s + offset_s)
        cut.append((unit, step_s, level[begin:end + 1], since[(since >= 0) & (since <= (end - begin) * step_s)]))
    return cut


def _grouped(cut):
    """Presses that are alike become trials of one."""
    groups = []
    for press in cut:
        unit, step_s, level, _ = press
        for group in groups:
            other_unit, other_step_s, other, _ = group[0]
            shared = min(len(level), len(other))
            alike = unit == other_unit and step_s == other_step_s \
                and abs(len(level) - len(other)) * step_s < 0.02 \
                and np.max(np.abs(level[:shared] - other[:shared])) <= _ALIKE * other.max()
            if alike:
                group.append(press)
                break
        else:
            groups.append([press])
    presses = []
    for number, group in enumerate(groups, 1):
        unit, step_s, _, _ = group[0]
        length = min(len(level) for _, _, level, _ in group)
        levels = np.array([level[:length] for _, _, level, _ in group])
        mean = levels.mean(axis=0)
        presses.append(Press(f"press {number}", unit, np.arange(length) * step_s, mean, [times for *_, times in group],
                             float(np.abs(levels - mean).max())))
    return presses


def _blocks(folder, allow_pickle):
    """What Neo reads of the files of a folder."""
    try:
        import neo.io
    except ImportError:
        raise Error("recordings are read by Neo: install python3-neo") from None
    blocks, skipped = [], []
    for path in sorted(pathlib.Path(folder).iterdir()):
        suffix = path.suffix.lower()
        if suffix in _COMPILED and not allow_pickle:
            raise Error(f"{path} may run any program when it is read: pass --allow-pickle if you made it yourself")
        readers = [reader for reader in neo.io.iolist if reader.is_readable and suffix[1:] in reader.extensions]
        for reader in readers:
            try:
                blocks += reader(str(path)).read()
                break
            except Exception as error:  # each format fails in its own way
                failure = f"{path.name} ({reader.__name__}: {error})"
        else:
            skipped.append(failure if readers else f"{path.name} (no format of Neo)")
    if not blocks:
        raise Error(f"Neo reads no file of {folder}" + (": " + "; ".join(skipped) if skipped else ""))
    for each in skipped:
        print(f"not read: {each}", file=sys.stderr)
    return blocks


def main(arguments=None):
    """The command `python -m merkel.trials`."""
    parser = argparse.ArgumentParser(
        prog="python -m merkel.trials", description="Makes the recordings of a folder, in any format that Neo reads, "
        "into presses with their recorded spikes, and compares a scene with them.")
    parser.add_argument("folder", help="of recordings")
    parser.add_argument("--force", help="name of the channel with the force")
    parser.add_argument("--depth", help="name of the channel with the depth, without one of the force")
    parser.add_argument("--newtons-per-volt", type=float)
    parser.add_argument("--mm-per-volt", type=float)
    parser.add_argument("--spikes", help="name of the spike train, if there are several")
    parser.add_argument("--tip", default="sphere", choices=["sphere", "pin"])
    parser.add_argument("--radius-mm", type=float, default=5.0, help="of a sphere; default 5")
    parser.add_argument("--probe-diameter-mm", type=float, help="of a pin")
    parser.add_argument("--cite", default="own recordings")
    parser.add_argument("--out", default="trials", help="folder to write to; default trials")
    parser.add_argument("--score", metavar="SCENE", help="compare this scene or preset, by merkel score")
    parser.add_argument("--trials", type=int, default=50, help="repetitions of each press by --score; default 50")
    parser.add_argument("--allow-pickle", action="store_true", help="read pickled files, which may run any program")
    parser.add_argument("--overwrite", action="store_true")
    given = parser.parse_args(arguments)
    try:
        if not os.path.isdir(given.folder):
            raise Error(f"there is no folder {given.folder}")
        if given.force is None and given.depth is None:
            raise Error("name the channel of the force or depth: --force NAME")
        if given.tip == "pin" and given.probe_diameter_mm is None:
            raise Error("a pin needs --probe-diameter-mm")
        found = trials(_blocks(given.folder, given.allow_pickle), force=given.force, depth=given.depth,
                       newtons_per_volt=given.newtons_per_volt, mm_per_volt=given.mm_per_volt, spikes=given.spikes,
                       tip=given.tip, radius_mm=given.radius_mm, probe_diameter_mm=given.probe_diameter_mm,
                       cite=given.cite)
        for press in found:
            print(f"{press.name}: {press.level.max():.4g} {press.unit}, {len(press.spike_times_s)} trials within "
                  f"{press.deviation:.2g} {press.unit}, {sum(map(len, press.spike_times_s))} spikes")
        data = found.write(given.out, given.overwrite)
        command = ["merkel", "score", given.score or "goodwin", "--data", data, "--out", os.path.join(given.out, "score"),
                   "--trials", str(given.trials)]
        if given.overwrite:
            command.append("--overwrite")
        if given.score is None:
            print(f"wrote {data}; compare a scene with it by\n  {' '.join(command)}")
            return 0
        command[0] = os.environ.get("MERKEL_PROGRAM") or shutil.which("merkel")
        if not command[0]:
            raise Error(f"wrote {data}, but the program merkel is not in the path: install it for --score")
        return subprocess.run(command, check=False).returncode
    except (Error, OSError) as error:
        print(f"merkel.trials: {error}", file=sys.stderr)
        return 2
