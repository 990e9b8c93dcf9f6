"""Reads XDF files, written from the format's description (github.com/sccn/xdf/wiki/Specifications)
and independent of merkel's code."""
import struct
import xml.etree.ElementTree as xml

FORMATS = {"float32": "f", "double64": "d", "int8": "b", "int16": "h", "int32": "i", "int64": "q"}


class Stream:
    def __init__(self, header):
        self.name = header.findtext("name")
        self.count = int(header.findtext("channel_count"))
        self.format = header.findtext("channel_format")
        self.description = header.find("desc")
        self.labels = [c.findtext("label") for c in header.findall("desc/channels/channel")]
        self.stamps = []
        self.samples = []
        self.footer = None
        self.type = header.findtext("type")
        self.rate = float(header.findtext("nominal_srate"))
        self.clock_offsets = []

    def column(self, label):
        index = self.labels.index(label)
        return [sample[index] for sample in self.samples]


class Xdf:
    """header (an XML element), streams by name, and true if the file ends with a complete chunk."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.bytes = file.read()
        if self.bytes[:4] != b"XDF:":
            raise ValueError("no XDF file")
        self.sizes = {}  # bytes of the chunks, by tag
        self.header, self.by_id, self.whole, self.boundaries = None, {}, True, 0
        place = 4
        while place < len(self.bytes):
            length_bytes = self.bytes[place]
            if place + 1 + length_bytes > len(self.bytes):
                self.whole = False
                break
            length = int.from_bytes(self.bytes[place + 1:place + 1 + length_bytes], "little")
            start = place + 1 + length_bytes
            if start + length > len(self.bytes):
                self.whole = False
                break
            self._chunk(struct.unpack_from("<H", self.bytes, start)[0],
                        self.bytes[start + 2:start + length])
            place = start + length
        self.streams = {stream.name: stream for stream in self.by_id.values()}

    def _chunk(self, tag, content):
        if tag == 1:
            self.header = xml.fromstring(content)
        elif tag == 5:
            assert content.hex() == "43a546dccbf5410fb30ed5467383cbe4"
            self.boundaries += 1
        elif tag in (2, 3, 4, 6):
            (number,) = struct.unpack_from("<I", content)
            self.sizes[tag] = self.sizes.get(tag, 0) + len(content) + 7
            if tag == 2:
                self.by_id[number] = Stream(xml.fromstring(content[4:]))
            elif tag == 4:
                self.by_id[number].clock_offsets.append(struct.unpack_from("<dd", content, 4))
            elif tag == 6:
                self.by_id[number].footer = xml.fromstring(content[4:])
            elif tag == 3:
                self._samples(self.by_id[number], content)
        else:
            raise ValueError(f"unknown chunk {tag}")

    def _samples(self, stream, content):
        width = content[4]
        count = int.from_bytes(content[5:5 + width], "little")
        place = 5 + width
        if stream.format == "string":
            self._strings(stream, content, place, count)
            return
        values = struct.Struct(f"<{stream.count}{FORMATS[stream.format]}")
        for _ in range(count):
            stamped = content[place]
            place += 1
            if stamped:
                stream.stamps.append(struct.unpack_from("<d", content, place)[0])
                place += 8
            else:  # pyxdf and EEGLAB count on by the nominal rate
                stream.stamps.append(stream.stamps[-1] + 1 / stream.rate)
            stream.samples.append(values.unpack_from(content, place))
            place += values.size
        assert place == len(content)

    @staticmethod
    def _strings(stream, content, place, count):
        for _ in range(count):
            assert content[place] == 8
            stream.stamps.append(struct.unpack_from("<d", content, place + 1)[0])
            width = content[place + 9]
            length = int.from_bytes(content[place + 10:place + 10 + width], "little")
            place += 10 + width
            stream.samples.append((content[place:place + length].decode(),))
            place += length
        assert place == len(content)
