#!/usr/bin/env python3
"""Repeats the experiments of `merkel score` on TouchSim's SA1 afferents, as far as it can run them.

usage: /usr/bin/python3 tools/studies/experiments/on_touchsim.py [EXPERIMENT...]

TouchSim (https://github.com/hsaal/touchsim, on PYTHONPATH; Debian: python3-numba, python3-skimage) presses pins to a
depth into flat skin. A shape is therefore a lattice of pins, and where merkel presses with a force, TouchSim presses
1 mm deep, or in a scan as deep as the pattern is high. Rates are means of its SA1 models.
Without an EXPERIMENT: scanned_squares, vibrating_gratings, gaps_in_a_plate, spheres_on_human_fingers, turned_cylinders.
"""

import sys
import warnings

import numpy as np

warnings.filterwarnings("ignore")
if not hasattr(np, "bool"):
    np.bool = bool  # removed from numpy 1.24; TouchSim uses it
import touchsim  # noqa: E402

RATE_HZ = 2000
SCAN_STEP = 4  # samples for which a scanned pattern stays: TouchSim solves a contact for each new set of pins, and a turned edge makes many
SPACING_MM = 0.25
RAMP_S = 0.05


def lattice(half_mm):
    edge = np.arange(-half_mm, half_mm + 0.01, SPACING_MM)
    return (each.ravel() for each in np.meshgrid(edge, edge))


def trains(x, y, depth_mm, places=((0, 0),)):
    """Spike times of every SA1 model at each place; depth_mm of each pin over time."""
    touching = depth_mm.max(axis=1) > 0
    press = touchsim.Stimulus(
        trace=np.maximum(depth_mm[touching], 0), location=np.column_stack([x, y])[touching], fs=RATE_HZ,
        pin_radius=SPACING_MM / 2,
    )  # fmt: skip
    models = [touchsim.affpop_single_models(affclass="SA1", location=np.array(place, float)) for place in places]
    return [[np.asarray(train) for train in each.response(press).spikes] for each in models]


def rate(spikes, start, end):
    return sum(((train >= start) & (train < end)).sum() for train in spikes) / (len(spikes) * (end - start))


def held(x, y, depth_mm, places=((0, 0),), seconds=0.8, sine_mm=0.0):
    time_s = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    sine = np.where(time_s > RAMP_S, sine_mm * np.sin(2 * np.pi * 20 * (time_s - RAMP_S)), 0)
    return trains(x, y, depth_mm[:, None] * np.clip(time_s / RAMP_S, 0, 1) + sine, places)


def scanned_squares():
    speed = 20

    def scan(pattern, half_path_mm):
        x, y = lattice(5)
        steps = np.arange(int(2 * half_path_mm / speed * RATE_HZ)) // SCAN_STEP
        middle = -half_path_mm + speed * steps * SCAN_STEP / RATE_HZ
        depth = 0.5 * pattern(x[:, None] - middle, y[:, None] + 0 * middle)
        return [-half_path_mm + speed * train for train in trains(x, y, depth)[0]]

    def over(places, start, end):
        return rate(places, start, end) * speed

    square = scan(lambda x, y: (abs(x) <= 3.5) & (abs(y) <= 3.5), 8)
    rising = over(square, -5, -2)
    yield "falling edge / rising edge", over(square, 2, 5) / rising
    yield "middle of a square of 7 mm / rising edge", over(square, -1, 1) / rising
    sines = np.sin(np.radians([90, 75, 60, 45, 30, 15]))
    rates = []
    for sine in sines:
        bar = scan(lambda x, y: abs(x * sine + y * np.sqrt(1 - sine**2)) <= 2.5, 5.5 / sine)
        rates.append(over(bar, -4 / sine, -1 / sine))
    line = sines * (sines @ rates) / (sines @ sines)
    yield "largest deviation from the sine", abs(rates - line).max() / rates[0]
    small = lambda x, y: (abs(x) <= 0.5) & (abs(y) <= 0.5)  # noqa: E731
    alone = over(scan(small, 5), -1.5, 1.5)
    for radius in 3, 5, 7:
        among = scan(lambda x, y: small(x, y) | (np.hypot(x, y) > radius), 5)
        yield f"small square, raised surround at {radius} mm / without", over(among, -1.5, 1.5) / alone


def vibrating_gratings():
    x, y = lattice(7)
    modulation = {}
    for name, depth, sine in ("static", 1.0, 0.0), ("deeper", 1.3, 0.0), ("vibrating", 1.0, 0.2):
        each = []
        for period in 1, 2, 4, 8:
            rates = []
            for shift in period * np.arange(4) / 6:
                ridge = abs((y - shift + period / 2) % period - period / 2) <= period / 4 + 1e-9
                rates.append(rate(held(x[ridge], y[ridge], np.full(ridge.sum(), depth), sine_mm=sine)[0], 0.3, 0.8))
            each.append((max(rates) - min(rates)) / max(max(rates) + min(rates), 1e-9))
        modulation[name] = np.array(each)
    yield "least growth of the modulation", np.diff(modulation["static"]).min()
    yield "modulation, vibrating / static", modulation["vibrating"].mean() / modulation["static"].mean()
    yield "modulation, 1.3 mm / 1 mm deep", modulation["deeper"].mean() / modulation["static"].mean()


def gaps_in_a_plate():
    x, y = lattice(7)
    yield "plate, Hz", rate(held(x, y, np.ones(x.size))[0], 0.3, 0.8)
    for gap in 0.75, 1.25:
        pins = abs(y) > gap / 2 - 1e-9
        middle, edge = held(x[pins], y[pins], np.ones(pins.sum()), ((0, 0), (0, gap / 2)))
        yield f"middle of a gap of {gap} mm, Hz", rate(middle, 0.3, 0.8)
        yield "its edge, Hz", rate(edge, 0.3, 0.8)


def spheres_on_human_fingers():
    x, y = lattice(5)
    rates = []
    for depth in 0.6, 0.8, 1.0:
        rates.append([])
        for curvature in 0, 0.0806, 0.172, 0.34, 0.694:
            pins = depth - curvature * (x**2 + y**2) / 2
            rates[-1].append(rate(held(x, y, pins, seconds=1.0)[0], 0, 1))
    rates = np.array(rates)
    ordered = np.concatenate([np.diff(rates, axis=0).ravel(), np.diff(rates, axis=1).ravel()]) > 0
    yield "pairs in the right order (depths of 0.6, 0.8 and 1 mm)", np.mean(ordered)


def turned_cylinders():
    recorded = {0.521: [-11.6, -6.13, -0.06, 5.3, 11.3], 0.172: [-14.9, -6.0, 2.3, 9.3, 17.3]}
    x, y = lattice(6)
    places = [(i, j) for j in range(-4, 5) for i in range(-4, 5)]
    at = np.array(places, float)
    for curvature, angles in recorded.items():
        found = []
        for turned in np.radians([-9, -4.5, 0, 4.5, 9]):
            off = y * np.cos(turned) - x * np.sin(turned)
            spikes = held(x, y, 1 - curvature * off**2 / 2, places, seconds=0.5)
            rates = np.array([rate(each, 0, 0.5) for each in spikes])

            def missed(angle, b):
                angle = np.radians(angle)
                ridge = np.exp(-b * (at[:, 1] * np.cos(angle) - at[:, 0] * np.sin(angle)) ** 2)
                return rates @ rates - (ridge @ rates) ** 2 / (ridge @ ridge)

            each = ((missed(angle, b), angle) for b in np.geomspace(0.02, 3, 50) for angle in np.arange(-30, 30.1, 0.25))
            found.append(min(each)[1])
        deviation = np.sqrt(np.mean(np.subtract(found, angles) ** 2))
        yield f"deviation of the angles, {1e3 * curvature:g} /m, rms, degrees", deviation


def main():
    every = [scanned_squares, vibrating_gratings, gaps_in_a_plate, spheres_on_human_fingers, turned_cylinders]
    wanted = sys.argv[1:] or [each.__name__ for each in every]
    for experiment in every:
        if experiment.__name__ in wanted:
            for name, value in experiment():
                print(f"| {experiment.__name__} | {name} | {value:.2f} |", flush=True)


if __name__ == "__main__":
    main()
