"""A card of National Instruments as a probe: nidaqmx reads the volts, and merkel reads them as a device's lines.

ni_card.py Dev1/ai0 0.17553 [SECONDS] takes the channel and its N per V. The modules of LabJack and Phidgets go to the
same place: whatever reads a block of numbers sends it as lines.
"""
import socket
import sys
import threading

import merkel
import nidaqmx
from nidaqmx.constants import AcquisitionType

RATE_HZ, BLOCK, PORT = 10_000, 20, 29_750
channel, newtons_per_volt = sys.argv[1], float(sys.argv[2])
stopped = threading.Event()


def send():
    lines = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with nidaqmx.Task() as task:
        task.ai_channels.add_ai_voltage_chan(channel, min_val=-10.0, max_val=10.0)
        task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=RATE_HZ)
        task.start()
        number = 0
        while not stopped.is_set():
            volts = task.read(number_of_samples_per_channel=BLOCK)
            text = "".join(f"{(number + i) / RATE_HZ:.6f},{newtons_per_volt * volt:.9g}\n" for i, volt in enumerate(volts))
            lines.sendto(text.encode(), ("127.0.0.1", PORT))
            number += len(volts)


card = merkel.Device(f"udp:127.0.0.1:{PORT}?protocol=csv&columns=time_s,force_N&rate_hz={RATE_HZ}")
threading.Thread(target=send, daemon=True).start()
with merkel.connect(card["force_N"], "goodwin", duration_s=float(sys.argv[3]) if len(sys.argv) > 3 else None) as bridge:
    spikes = sum(len(new.spikes) for new in bridge)
stopped.set()
print(f"{spikes} spikes of {bridge.counters['samples']} samples")
