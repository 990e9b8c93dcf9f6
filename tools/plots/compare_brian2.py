"""Runs the same neurons in Brian2's C++ standalone mode and in merkel, and prints the ratios.

usage: compare_brian2.py MERKEL [--csv FILE]     (MERKEL is the program; needs Debian's
python3-brian). With --csv, Brian2's point alone is written as a table.

N uncoupled neurons under 8 to 14 uA/cm2 for half a second at steps of 25 us: Brian2's
exponential Euler, its default for these equations, against merkel's default method. Both are
built for speed and timed on one core, in turn, several times; medians are compared. Errors are of
spike times against merkel's RK4 at 0.5 us, which the tests hold against CVODE.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import warnings

warnings.filterwarnings("ignore")
import brian2 as b2  # noqa: E402
import numpy as np  # noqa: E402

NEURONS = 450
DURATION_MS = 500.0
STEP_US = 25.0
RUNS = 5
CHECKED = [0, 150, 300, 449]  # neurons whose spike times are compared

EQUATIONS = """
dV/dt = (gl*(El-V) + gNa*m**3*h*(ENa-V) + gK*n**4*(EK-V) + gCa*m*h*(ECa-V) + I)/C : volt
dm/dt = alpha_m*(1-m) - beta_m*m : 1
dn/dt = alpha_n*(1-n) - beta_n*n : 1
dh/dt = alpha_h*(1-h) - beta_h*h : 1
v = (V - Vr)/mV : 1
alpha_m = 0.1*(25-v)/(exp((25-v)/10)-1)/ms : Hz
beta_m = 4*exp(-v/18)/ms : Hz
alpha_n = 0.01*(10-v)/(exp((10-v)/10)-1)/ms : Hz
beta_n = 0.125*exp(-v/80)/ms : Hz
alpha_h = 0.07*exp(-v/20)/ms : Hz
beta_h = 1/(exp((30-v)/10)+1)/ms : Hz
I : amp/meter**2
"""


def resting(v=0.0):
    a_m = 25.0 / 10 / np.expm1(2.5)
    a_n = 0.1 / np.expm1(1.0)
    a_h, b_h = 0.07, 1 / (np.exp(3.0) + 1)
    b_m, b_n = 4.0, 0.125
    return a_m / (a_m + b_m), a_n / (a_n + b_n), a_h / (a_h + b_h)


def run_brian2(folder, currents):
    b2.set_device("cpp_standalone", build_on_run=False, directory=str(folder))
    b2.prefs.devices.cpp_standalone.openmp_threads = 0
    b2.defaultclock.dt = STEP_US * b2.us
    m0, n0, h0 = resting()
    mS, uF, cm2, mV = b2.msiemens, b2.ufarad, b2.cm**2, b2.mV
    names = dict(
        C=1 * uF / cm2, gl=0.3 * mS / cm2, gNa=120 * mS / cm2, gK=36 * mS / cm2,
        gCa=0.1 * mS / cm2, ENa=50 * mV, EK=-77 * mV, ECa=120 * mV, Vr=-65 * mV,
    )  # fmt: skip
    ionic = (
        120 * m0**3 * h0 * (50 + 65) + 36 * n0**4 * (-77 + 65) + 0.1 * m0 * h0 * (120 + 65)
    )
    names["El"] = (-65 - ionic / 0.3) * mV
    group = b2.NeuronGroup(
        len(currents),
        EQUATIONS,
        threshold="V > -20*mV",
        refractory="V > -20*mV",
        method="exponential_euler",
        namespace=names,
    )
    group.V, group.m, group.n, group.h = -65 * mV, m0, n0, h0
    group.I = currents * b2.uA / cm2
    monitor = b2.SpikeMonitor(group)
    b2.run(DURATION_MS * b2.ms)
    b2.device.build(directory=str(folder), compile=True, run=False)
    seconds = []
    for _ in range(RUNS):
        b2.device.run(str(folder), with_output=False, run_args=[])
        seconds.append(b2.device._last_run_time)
    trains = {i: 1e3 * np.array(monitor.t)[np.array(monitor.i) == i] for i in CHECKED}
    return statistics.median(seconds), trains


def spikes_of(merkel, current, *options):
    text = subprocess.run(
        [merkel, "inspect", "neuron", "--current", repr(float(current)),
         "--duration-ms", str(DURATION_MS), *options],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    return np.array([float(line.split(",")[1]) for line in text.splitlines()[1:]])


def rms_error(train, reference):
    count = min(len(train), len(reference))
    return float(np.sqrt(np.mean((train[:count] - reference[:count]) ** 2)))


def main():
    merkel = os.path.abspath(sys.argv[1])
    currents = 8.0 + 6.0 * np.arange(NEURONS) / NEURONS
    with tempfile.TemporaryDirectory() as folder:
        brian_s, brian_trains = run_brian2(pathlib.Path(folder) / "brian", currents)
    steps = DURATION_MS * 1e3 / STEP_US
    brian_ns = 1e9 * brian_s / (steps * NEURONS)
    brian_error, our_error, counts_differ = [], [], 0
    for i in CHECKED:
        reference = spikes_of(merkel, currents[i], "--method", "rk4", "--step-us", "0.5")
        ours = spikes_of(merkel, currents[i])
        counts_differ += len(brian_trains[i]) != len(reference)
        brian_error.append(rms_error(brian_trains[i], reference))
        our_error.append(rms_error(ours, reference))
    brian_rms = float(np.sqrt(np.mean(np.square(brian_error))))
    our_rms = float(np.sqrt(np.mean(np.square(our_error))))
    if len(sys.argv) > 3 and sys.argv[2] == "--csv":
        cost_us = brian_s * 1e6 / NEURONS / (1e-3 * DURATION_MS)
        pathlib.Path(sys.argv[3]).write_text(
            "step_us,cost_us_per_neuron_second,rms_error_ms\n"
            f"{STEP_US},{cost_us},{brian_rms}\n"
        )
        return
    bench = json.loads(
        subprocess.run([merkel, "bench", "--json"], check=True, capture_output=True, text=True).stdout
    )
    ours_ns = {
        p["precision"]: p["ns_per_neuron_step"]
        for p in bench["populations"]
        if p["neurons"] == NEURONS and not p["coupled"]
    }
    print(f"{NEURONS} neurons, steps of {STEP_US:g} us, {DURATION_MS:g} ms, one core")
    print(f"Brian2 {b2.__version__} C++ standalone, exponential Euler: {brian_ns:.1f} ns per neuron-step,"
          f" rms spike-time error {brian_rms:.3g} ms")  # fmt: skip
    print(f"merkel crank_nicolson, {bench['simd_target']}: {ours_ns['double']:.2f} ns per neuron-step"
          f" in double ({ours_ns['float']:.2f} in float), rms spike-time error {our_rms:.3g} ms")  # fmt: skip
    print(f"merkel is {brian_ns / ours_ns['double']:.1f} times as fast in double,"
          f" {brian_ns / ours_ns['float']:.1f} in float; its error is {our_rms / brian_rms:.2g} of Brian2's")  # fmt: skip
    if counts_differ:
        print(f"({counts_differ} of {len(CHECKED)} neurons have a different spike count in Brian2)")


if __name__ == "__main__":
    main()
