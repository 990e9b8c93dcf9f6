"""Emulates a CereStim M96 that a laboratory's glue program drives by stim-csv or stim-zmq. Written from the public command set:
"configure" takes a configuration (1 to 15), a polarity, a number of pulses (0: free running), two amplitudes (1 to 215 µA), two widths
(44 to 65535 µs), a frequency (4 to 5000 Hz) and the time between the phases (53 to 65535 µs), all whole numbers. It shares no code with
merkel.
"""
import math
import queue
import threading
import time

import stimulation_receivers

EXPIRED = "expired"  # why the stimulator switched off by itself

CONFIGURATIONS, RANGES = 15, {"amp1": (1, 215), "amp2": (1, 215), "width1": (44, 65535), "width2": (44, 65535),
                              "frequency": (4, 5000), "interphase": (53, 65535)}  # fmt: skip


class Refused(Exception):
    pass


class CereStim:
    def __init__(self):
        self.configurations, self.playing = {}, {}

    def configure(self, number, **settings):
        if not 1 <= number <= CONFIGURATIONS:
            raise Refused(f"configuration {number}")
        if number in self.playing.values():
            raise Refused(f"configuration {number} is playing")
        for name, (low, high) in RANGES.items():
            value = settings[name]
            if value != int(value) or not low <= value <= high:
                raise Refused(f"{name} = {value}")
        if settings["amp1"] * settings["width1"] != settings["amp2"] * settings["width2"]:
            raise Refused("the charges of the phases differ")
        if settings["frequency"] * (settings["width1"] + settings["interphase"] + settings["width2"]) > 1e6:
            raise Refused("a pulse is longer than the period")
        self.configurations[number] = settings

    def play(self, channels):
        """Replaces what plays: channel to configuration."""
        for number in channels.values():
            if number not in self.configurations:
                raise Refused(f"configuration {number} was never made")
        self.playing = dict(channels)


class Stimulator(stimulation_receivers.Receiver):
    """A receiver of commands (stimulation_receivers.Pipe or Zmq) with a stimulator behind it: one configuration for each different train
    of an update. Its notes are what the stimulator did with E1. It switches off by itself when the last update is no longer valid."""

    def __init__(self, source, electrodes, phase_us, interphase_us):
        super().__init__(f"{source.receiver}, stimulator")
        self.source, self.electrodes, self.phase_us, self.interphase_us = source, electrodes, phase_us, interphase_us

    def settings(self, uA, Hz):
        return {"amp1": uA, "amp2": uA, "width1": self.phase_us, "width2": self.phase_us, "frequency": Hz, "interphase": self.interphase_us}

    def update(self, rows):
        trains = {row["electrode"]: (float(row["amplitude_uA"]), float(row["frequency_Hz"])) for row in rows if float(row["amplitude_uA"]) > 0}
        different = sorted(set(trains.values()))
        self.stimulator.play({})
        for number, train in enumerate(different, start=1):
            self.stimulator.configure(number, **self.settings(*train))
        self.stimulator.play({electrode: different.index(train) + 1 for electrode, train in trains.items()})

    def playing_uA(self, electrode):
        number = self.stimulator.playing.get(electrode)
        return self.stimulator.configurations[number]["amp1"] if number else 0

    def receive(self, commands):
        try:
            for item in self.source.commands():
                commands.put(item)
        except ConnectionError:
            pass  # the program has ended, or the stimulator switches off by itself

    def read(self):
        self.stimulator, commands, rows, valid_until, last = CereStim(), queue.SimpleQueue(), [], math.inf, None
        threading.Thread(target=self.receive, args=[commands], daemon=True).start()
        while True:
            try:
                row, arrived = commands.get(timeout=min(max(0.0, valid_until - time.monotonic()), 60.0))
            except queue.Empty:
                if self.stimulator.playing and time.monotonic() >= valid_until:
                    self.stimulator.play({})
                    yield stimulation_receivers.Update(last.time_s, 0, last.heartbeat, EXPIRED, time.monotonic(), last.sent)
                valid_until = math.inf
                continue
            assert row["kind"] == "update", "no electrode of a group"
            rows.append(row)
            if len(rows) < self.electrodes:
                continue
            update, rows, refused = rows, [], ""
            if time.monotonic() < int(row["valid_until_ns"]) * 1e-9 or all(float(each["amplitude_uA"]) == 0 for each in update):
                try:
                    self.update(update)
                except Refused as error:
                    self.stimulator.play({})
                    refused = f"{error}: {update}"
                valid_until = int(row["valid_until_ns"]) * 1e-9
            last = stimulation_receivers.Update(row["time_s"], self.playing_uA(update[0]["electrode"]), row["heartbeat"],
                                                update[0]["stop"], arrived, int(row["sent_monotonic_ns"]) * 1e-9, refused)
            yield last
