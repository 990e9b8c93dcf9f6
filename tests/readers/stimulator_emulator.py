"""Emulates a CereStim M96 that a laboratory's glue program drives by stim-csv. Written from the public command set: "configure" takes a
configuration (1 to 15), a polarity, a number of pulses (0: free running), two amplitudes (1 to 215 µA), two widths (44 to 65535 µs), a
frequency (4 to 5000 Hz) and the time between the phases (53 to 65535 µs), all whole numbers. It shares no code with merkel.

usage: stimulator_emulator.py PIPE PHASE_US INTERPHASE_US   prints what it was set to, and what it had to refuse, as JSON
"""
import csv
import json
import sys

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


class Glue:
    """What stands between merkel and the stimulator: one configuration for each different train of an update."""

    def __init__(self, stimulator, phase_us, interphase_us):
        self.stimulator, self.phase_us, self.interphase_us = stimulator, phase_us, interphase_us
        self.updates, self.pulses, self.refused, self.trains = 0, 0, [], set()

    def settings(self, uA, Hz):
        return {"amp1": uA, "amp2": uA, "width1": self.phase_us, "width2": self.phase_us, "frequency": Hz, "interphase": self.interphase_us}

    def update(self, rows):
        self.updates += 1
        trains = {row["electrode"]: (float(row["amplitude_uA"]), float(row["frequency_Hz"])) for row in rows if float(row["amplitude_uA"]) > 0}
        self.trains.update(trains.values())
        different = sorted(set(trains.values()))
        self.stimulator.play({})
        for number, train in enumerate(different, start=1):
            self.stimulator.configure(number, **self.settings(*train))
        self.stimulator.play({electrode: different.index(train) + 1 for electrode, train in trains.items()})

    def pulse(self, row):
        self.pulses += 1
        free = next((number for number in range(1, CONFIGURATIONS + 1) if number not in self.stimulator.playing.values()), 0)
        self.stimulator.configure(free, **self.settings(float(row["amplitude_uA"]), 100))

    def attempt(self, action, what):
        try:
            action(what)
        except Refused as error:
            self.stimulator.play({})
            self.refused.append(f"{error}: {what}")

    def follow(self, rows):
        update = []
        for row in rows:
            if row["stop"] and float(row["amplitude_uA"]) != 0:
                self.refused.append(f"{row['amplitude_uA']} uA although {row['stop']}")
            if row["kind"] == "pulse":
                self.attempt(self.pulse, row)
                continue
            if update and row["heartbeat"] != update[0]["heartbeat"]:
                self.attempt(self.update, update)
                update = []
            update.append(row)
        if update:
            self.attempt(self.update, update)


def main():
    glue = Glue(CereStim(), int(sys.argv[2]), int(sys.argv[3]))
    with open(sys.argv[1], encoding="utf-8") as pipe:
        glue.follow(csv.DictReader(line for line in pipe if not line.startswith("#")))
    print(json.dumps({"updates": glue.updates, "pulses": glue.pulses, "trains": len(glue.trains), "refused": glue.refused}))


if __name__ == "__main__":
    main()
