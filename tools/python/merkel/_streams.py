"""Recordings of Lab Streaming Layer (LabRecorder, XDF) with the streams of several rigs on one clock."""
import os
import typing
import xml.etree.ElementTree

import numpy as np

from ._merkel import Error, _xdf_streams

_TYPES = {"int8": "<i1", "int16": "<i2", "int32": "<i4", "int64": "<i8", "float32": "<f4", "double64": "<f8"}


class RecordedStream(typing.NamedTuple):
    """A stream of a LabRecorder file. time_s is on the recorder's clock, the same for all streams."""
    time_s: np.ndarray
    values: typing.Any
    host: str
    clock_error_s: float
    info: typing.Any


def load_streams(file):
    """Reads a LabRecorder file (XDF) with the streams of several rigs: a dict from names to RecordedStream.

    All times are on the recorder's clock: LSL's measurements of the clocks' offsets are applied as pyxdf does. A rig
    that runs `merkel run … --sink lsl:left` is the stream "left", with the number of an afferent for each spike.
    Streams of one name get their host's: "left@rig-2". Raises Error if the file cannot be read.
    """
    streams = {}
    for number, header, form, channels, time_s, values, clock_error_s in _xdf_streams(os.fspath(file)):
        try:
            info = xml.etree.ElementTree.fromstring(header)
        except xml.etree.ElementTree.ParseError as error:
            raise Error(f"the header of stream {number} in {file} is damaged: {error}") from None
        if form == "string":
            values = [[text.decode("utf-8", "replace") for text in values[i:i + channels]] for i in range(0, len(values), channels)]
        elif form in _TYPES and channels > 0:
            values = np.frombuffer(bytearray(values), _TYPES[form]).reshape(-1, channels)
        else:
            raise Error(f"the header of stream {number} in {file} is damaged: its values have an unknown format")
        streams[number] = RecordedStream(time_s, values, info.findtext("hostname") or "", clock_error_s, info)
    names = {number: stream.info.findtext("name") or f"stream {number}" for number, stream in streams.items()}
    named = {}
    for number, stream in streams.items():
        name = names[number] if list(names.values()).count(names[number]) == 1 else f"{names[number]}@{stream.host}"
        named[name if name not in named else f"{name} {number}"] = stream
    return named
