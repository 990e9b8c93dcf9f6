#!/usr/bin/python3
"""Makes seeds for fuzzing recorded sessions: a whole session, a chunk of every kind, and a rig as LabRecorder writes it.
usage: session_seeds.py MERKEL FOLDER"""
import os
import struct
import subprocess
import sys
import tempfile
import time


def chunks(content):
    """(tag, bytes with their length) of every chunk of an XDF file."""
    place = 4
    while place < len(content):
        width = content[place]
        length = int.from_bytes(content[place + 1:place + 1 + width], "little")
        end = place + 1 + width + length
        yield int.from_bytes(content[place + 1 + width:place + 3 + width], "little"), content[place:end]
        place = end


def recording_of_a_rig():
    def chunk(tag, stream, content):
        content = struct.pack("<HI", tag, stream) + content
        return b"\4" + struct.pack("<I", len(content)) + content

    def stream(number, name, kind, form, channels, described, *rows):
        head = (f"<info><name>{name}</name><type>{kind}</type><channel_count>{channels}</channel_count><nominal_srate>0"
                f"</nominal_srate><channel_format>{form}</channel_format><source_id>merkel-{name}</source_id>"
                f"<desc>{described}</desc></info>")
        samples = b"".join(b"\x08" + struct.pack("<d", 100.0 + place) + row for place, row in enumerate(rows))
        return (chunk(2, number, head.encode()) + chunk(4, number, struct.pack("<dd", 100.0, -4.0))
                + chunk(4, number, struct.pack("<dd", 101.0, -4.1)) + chunk(3, number, bytes((1, len(rows))) + samples))
    file_header = b"<info><version>1.0</version></info>"
    end = b"merkel: end of run"
    facts = "<merkel><clock_monotonic_ns>1</clock_monotonic_ns><clock_utc_ns>2</clock_utc_ns></merkel>"
    return (b"XDF:" + bytes((1, len(file_header) + 2)) + struct.pack("<H", 1) + file_header
            + stream(1, "a", "Spikes", "int32", 1, facts + "<afferents><afferent><patch>0</patch></afferent></afferents>",
                     struct.pack("<i", 1), struct.pack("<i", 2), struct.pack("<i", 1))
            + stream(2, "a.samples", "ProbeSamples", "double64", 1, "<channels><channel><label>depth</label></channel></channels>",
                     struct.pack("<d", 0.5), struct.pack("<d", 0.6), struct.pack("<d", 0.5))
            + stream(3, "a.marks", "Markers", "string", 1, "", b"\1\4sync", bytes((1, len(end))) + end, b"\1\4sync"))


def main():
    merkel, folder = sys.argv[1:]
    with tempfile.TemporaryDirectory() as work:
        path, tty = os.path.join(work, "s.xdf"), os.path.join(work, "tty")
        device = subprocess.Popen([merkel, "simulate-probe", "hbf1", "--trace",
                                   "tests/traces/taps.csv", "--link", tty, "--unplug-s", "0.3",
                                   "--repeat"], stdout=subprocess.DEVNULL)
        while not os.path.exists(tty):
            time.sleep(0.01)
        subprocess.run([merkel, "run", "--probe", f"serial:{tty}?protocol=hbf1", "--duration-s",
                        "1", "--sink", f"xdf:{path}?frames=1"], check=True, stdout=subprocess.DEVNULL)
        device.kill()
        with open(path, "rb") as file:
            content = file.read()
    seeds = {}
    headers = b"XDF:"
    for tag, chunk in chunks(content):
        if tag < 3:
            headers += chunk
        stream = chunk[7:11] if tag != 5 else b""
        smallest = seeds.get((tag, stream))
        if smallest is None or len(chunk) < len(smallest):
            seeds[tag, stream] = chunk
    samples = b"".join(chunk for (tag, _), chunk in seeds.items() if tag > 2)
    os.makedirs(folder, exist_ok=True)
    inputs = [b"\0" + headers + samples, b"\1" + samples, b"\0" + recording_of_a_rig()]
    inputs += [b"\1" + chunk for (tag, _), chunk in seeds.items() if tag > 2]
    for number, each in enumerate(inputs):
        with open(os.path.join(folder, f"seed{number}"), "wb") as file:
            file.write(each)


if __name__ == "__main__":
    main()
