"""Recordings of Lab Streaming Layer (LabRecorder, XDF) with the streams of several rigs on one clock."""
import struct
import typing
import xml.etree.ElementTree

import numpy as np

from ._merkel import Error

_TYPES = {"int8": "<i1", "int16": "<i2", "int32": "<i4", "int64": "<i8", "float32": "<f4", "double64": "<f8"}
_HEADER, _SAMPLES, _OFFSET = 2, 3, 4
_ROBUST_S = 1e-4  # an offset further from the line counts less
_RESET_S = 1.0


class RecordedStream(typing.NamedTuple):
    """A stream of a LabRecorder file. time_s is on the recorder's clock, the same for all streams."""
    time_s: np.ndarray
    values: typing.Any
    host: str
    clock_error_s: float
    info: typing.Any


class _Reading:
    def __init__(self, info, stream):
        self.stream, self.info = stream, info
        self.name = info.findtext("name") or f"stream {stream}"
        self.host = info.findtext("hostname") or ""
        self.format = info.findtext("channel_format")
        self.channels = int(info.findtext("channel_count"))
        rate = float(info.findtext("nominal_srate") or 0)
        self.period = 1 / rate if rate > 0 else 0.0
        self.stamps, self.values, self.clocks = [], [], []
        self.last = 0.0
        if self.format != "string" and self.format not in _TYPES or self.channels < 1:
            raise ValueError("its values have an unknown format")

    def add(self, data):
        count, place = _length(data, 0)
        if self.format == "string":
            return self._add_texts(data, place, count)
        row = np.dtype([("flag", "u1"), ("stamp", "<f8"), ("values", _TYPES[self.format], (self.channels,))])
        if (len(data) - place) == count * row.itemsize:
            rows = np.frombuffer(data, row, count, place)
            if count == 0 or (rows["flag"] == 8).all():
                self.stamps.extend(rows["stamp"].tolist())
                self.values.append(rows["values"])
                self.last = self.stamps[-1] if count else self.last
                return
        values = np.empty((count, self.channels), _TYPES[self.format])
        size = values.dtype.itemsize * self.channels
        for i in range(count):
            place = self._stamp(data, place)
            values[i] = np.frombuffer(data, values.dtype, self.channels, place)
            place += size
        self.values.append(values)

    def _stamp(self, data, place):
        if data[place] == 8:
            self.last = struct.unpack_from("<d", data, place + 1)[0]
        elif data[place] == 0:
            self.last += self.period
        else:
            raise ValueError("a sample's time is damaged")
        self.stamps.append(self.last)
        return place + 1 + data[place]

    def _add_texts(self, data, place, count):
        for _ in range(count):
            place = self._stamp(data, place)
            row = []
            for _ in range(self.channels):
                length, place = _length(data, place)
                if place + length > len(data):
                    raise ValueError("a text is longer than its chunk")
                row.append(data[place:place + length].decode("utf-8", "replace"))
                place += length
            self.values.append(row)

    def finish(self):
        time_s = np.array(self.stamps, float)
        line, error_s = _clock_line(np.array(self.clocks, float).reshape(-1, 2), self.name)
        values = self.values if self.format == "string" else \
            np.concatenate(self.values) if self.values else np.empty((0, self.channels), _TYPES[self.format])
        return RecordedStream(time_s + line[0] + line[1] * time_s, values, self.host, error_s, self.info)


def _length(data, place):
    width = data[place]
    if width not in (1, 4, 8) or place + 1 + width > len(data):
        raise ValueError("a length is damaged")
    return int.from_bytes(data[place + 1:place + 1 + width], "little"), place + 1 + width


def _clock_line(clocks, name):
    """(offset, drift) of a stream's clock against the recorder's by Huber's robust line, as pyxdf fits it; and its
    median residual."""
    if len(clocks) == 0:
        return (0.0, 0.0), float("nan")
    times, offsets = clocks.T
    if len(clocks) == 1:
        return (offsets[0], 0.0), float("nan")
    steps, intervals = np.abs(np.diff(offsets)), np.diff(times)
    if ((intervals < 0) | ((steps - np.median(steps) > _RESET_S) & (intervals - np.median(intervals) > 5))).any():
        raise Error(f"the clock of {name} was reset during the recording, so its times have no line: read the parts "
                    "before and after with pyxdf")
    middle = times.min()
    design = np.stack([np.ones_like(times), times - middle], axis=1)
    line, weights = np.zeros(2), np.ones_like(times)
    for _ in range(200):
        before, root = line, np.sqrt(weights)
        line = np.linalg.lstsq(design * root[:, None], offsets * root, rcond=None)[0]
        residual = np.abs(offsets - design @ line)
        weights = _ROBUST_S / np.maximum(residual, _ROBUST_S)
        if np.allclose(line, before, rtol=0, atol=1e-13):
            break
    return (line[0] - line[1] * middle, line[1]), float(np.median(residual))


def load_streams(file):
    """Reads a LabRecorder file (XDF) with the streams of several rigs: a dict from names to RecordedStream.

    All times are on the recorder's clock: LSL's measurements of the clocks' offsets are applied as pyxdf does. A rig
    that runs `merkel run … --sink lsl:left` is the stream "left", with the number of an afferent for each spike.
    Streams of one name get their host's: "left@rig-2". Raises Error if the file cannot be read.
    """
    streams, place = {}, 4
    try:
        with open(file, "rb") as opened:
            data = opened.read()
    except OSError as error:
        raise Error(f"cannot read {file}: {error.strerror}") from None
    if data[:4] != b"XDF:":
        raise Error(f"{file} is not an XDF file: it does not start with \"XDF:\"")
    try:
        while place < len(data):
            start = place
            length, place = _length(data, place)
            if place + length > len(data) or length < 2:
                break  # the recorder was stopped within this chunk
            tag, = struct.unpack_from("<H", data, place)
            content, place = data[place + 2:place + length], place + length
            if tag not in (_HEADER, _SAMPLES, _OFFSET):
                continue
            number, = struct.unpack_from("<I", content)
            if tag == _HEADER:
                streams[number] = _Reading(xml.etree.ElementTree.fromstring(content[4:]), number)
            elif tag == _SAMPLES:
                streams[number].add(content[4:])
            else:
                streams[number].clocks.append(struct.unpack_from("<dd", content, 4))
    except (ValueError, KeyError, IndexError, TypeError, struct.error, xml.etree.ElementTree.ParseError) as error:
        raise Error(f"{file} is damaged at byte {start}: {error}") from None
    names = [stream.name for stream in streams.values()]
    named = {}
    for stream in streams.values():
        name = stream.name if names.count(stream.name) == 1 else f"{stream.name}@{stream.host}"
        named[name if name not in named else f"{name} {stream.stream}"] = stream.finish()
    return named
