"""One subscriber for the spikes of several rigs over ZeroMQ, and what each of them lost: three_rigs.py RIG=ENDPOINT…

Each rig runs `merkel run … --sink zmq:tcp://ADDRESS:PORT?topic=RIG` (from other machines with --allow-remote). The
example ends when no rig has sent anything for two seconds.
"""
import json
import struct
import sys

import zmq

rigs = dict(argument.split("=", 1) for argument in sys.argv[1:] if "=" in argument)
if not rigs:
    sys.exit(__doc__)
context = zmq.Context()
subscriber = context.socket(zmq.SUB)
subscriber.setsockopt(zmq.RCVHWM, 1_000_000)
for rig, endpoint in rigs.items():
    subscriber.setsockopt(zmq.SUBSCRIBE, struct.pack("<H", 1) + rig.encode())  # spikes of this topic
    subscriber.connect(endpoint)

received = dict.fromkeys(rigs, 0)
lost = dict.fromkeys(rigs, 0)
expected = dict.fromkeys(rigs)  # the number of the next message, after the first one
subscriber.setsockopt(zmq.RCVTIMEO, 20_000)
while True:
    try:
        head, text = subscriber.recv_multipart()
    except zmq.Again:
        break
    subscriber.setsockopt(zmq.RCVTIMEO, 2_000)
    rig, spike = head[2:].decode(), json.loads(text)
    if expected[rig] is not None and spike["seq"] > expected[rig]:
        lost[rig] += spike["seq"] - expected[rig]
    expected[rig] = spike["seq"] + 1
    received[rig] += 1
for rig in rigs:
    print(f"{rig}: {received[rig]} spikes received, {lost[rig]} lost on the way")
context.destroy(linger=0)
