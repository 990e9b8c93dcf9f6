#!/usr/bin/python3
"""Makes seeds for fuzzing recorded sessions: a whole session, and a chunk of every kind.
usage: session_seeds.py MERKEL FOLDER"""
import os
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
    inputs = [b"\0" + headers + samples, b"\1" + samples]
    inputs += [b"\1" + chunk for (tag, _), chunk in seeds.items() if tag > 2]
    for number, each in enumerate(inputs):
        with open(os.path.join(folder, f"seed{number}"), "wb") as file:
            file.write(each)


if __name__ == "__main__":
    main()
