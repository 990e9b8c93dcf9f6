#!/usr/bin/env python3
"""Prints what each electrode applies, by the commands of the sink stim-zmq, and switches off by itself when they end.

usage: stimulation_subscriber.py tcp://127.0.0.1:5558"""
import json
import sys
import time

import zmq

socket = zmq.Context().socket(zmq.SUB)
socket.subscribe(b"\x64\x00")  # commands only
socket.connect(sys.argv[1])
valid_until_ns = {}  # by electrode that is on


def apply(electrode, amplitude_uA, frequency_Hz):
    print(electrode, amplitude_uA, frequency_Hz, flush=True)  # here, drive the stimulator
    valid_until_ns.pop(electrode, None)


while True:
    if socket.poll(1):  # ms
        command = json.loads(socket.recv_multipart()[-1])
        name, uA, valid_ns = command["electrode"], command["amplitude_uA"], command["valid_until_ns"]
        if uA == 0 or time.monotonic_ns() < valid_ns:  # an off always counts
            apply(name, uA, command["frequency_Hz"])
            if uA > 0 and command["kind"] == "update":
                valid_until_ns[name] = valid_ns
    for name in [each for each, end_ns in valid_until_ns.items() if time.monotonic_ns() >= end_ns]:
        apply(name, 0, 0)
