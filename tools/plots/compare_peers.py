"""Compares speed and spike-time error of merkel and other simulators for the same neurons.

usage: compare_peers.py MERKEL [--csv FILE]

MERKEL is the program. It is compared with the installed ones of Brian2 (Debian: python3-brian), in its C++
standalone mode, and NEURON (python3-neuron). 450 uncoupled neurons receive 8 to 14 uA/cm2 for half a second at
steps of 25 us. Brian2 computes the model's neurons by exponential Euler, its default for these equations. NEURON
computes its own `hh`, the same neuron without the calcium channel, by its two fixed-step methods. The measure of
speed is processor time on one core, alternating with `merkel bench`; ratios are medians of pairs. Spike times are
those that each simulator reports; their reference is merkel's RK4 at 0.5 us, which the tests compare with CVODE.
If TouchSim can be imported (https://github.com/hsaal/touchsim, on PYTHONPATH; Debian: python3-numba, python3-skimage), its
SA1 afferents, at the places of those of `goodwin`, feel the same presses at 5 kHz as the whole `goodwin` scene of
`merkel run`. The models differ, so only their cost is compared; `merkel score` has the errors against recordings.
--csv only writes the points of Brian2 and NEURON as a table.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np

NEURONS = 450
DURATION_MS = 500.0
STEP_US = 25.0
RUNS = 5
CHECKED = [0, 150, 300, 449]  # neurons with compared spike times
CURRENTS = 8.0 + 6.0 * np.arange(NEURONS) / NEURONS  # uA/cm2
STEPS = DURATION_MS * 1e3 / STEP_US

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


def resting():
    """Gates m, n, h at rest."""
    a_m, b_m = 2.5 / np.expm1(2.5), 4.0
    a_n, b_n = 0.1 / np.expm1(1.0), 0.125
    a_h, b_h = 0.07, 1 / (np.exp(3.0) + 1)
    return a_m / (a_m + b_m), a_n / (a_n + b_n), a_h / (a_h + b_h)


class Brian2:
    method = "exponential Euler"
    options = []  # of merkel: the same neuron

    def __init__(self, folder):
        warnings.filterwarnings("ignore")
        import brian2 as b2

        self.name = f"Brian2 {b2.__version__}, C++ standalone"
        self.folder, self.device = str(folder / "brian"), b2.device
        b2.set_device("cpp_standalone", build_on_run=False, directory=self.folder)
        b2.prefs.devices.cpp_standalone.openmp_threads = 0
        b2.defaultclock.dt = STEP_US * b2.us
        m0, n0, h0 = resting()
        mS, uF, cm2, mV = b2.msiemens, b2.ufarad, b2.cm**2, b2.mV
        names = dict(
            C=1 * uF / cm2, gl=0.3 * mS / cm2, gNa=120 * mS / cm2, gK=36 * mS / cm2,
            gCa=0.1 * mS / cm2, ENa=50 * mV, EK=-77 * mV, ECa=120 * mV, Vr=-65 * mV,
        )  # fmt: skip
        ionic = 120 * m0**3 * h0 * (50 + 65) + 36 * n0**4 * (-77 + 65) + 0.1 * m0 * h0 * (120 + 65)
        names["El"] = (-65 - ionic / 0.3) * mV
        group = b2.NeuronGroup(
            NEURONS, EQUATIONS, threshold="V > -20*mV", refractory="V > -20*mV",
            method="exponential_euler", namespace=names,
        )  # fmt: skip
        group.V, group.m, group.n, group.h = -65 * mV, m0, n0, h0
        group.I = CURRENTS * b2.uA / cm2
        self.monitor = b2.SpikeMonitor(group)
        self.network = b2.Network(group, self.monitor)
        self.network.run(DURATION_MS * b2.ms)
        b2.device.build(directory=self.folder, compile=True, run=False)
        self.device = b2.device

    def run(self):
        """Processor time of the simulating program, s."""
        before = sum(os.times()[2:4])
        self.device.run(self.folder, with_output=False, run_args=[])
        return sum(os.times()[2:4]) - before

    def trains(self):
        times, who = 1e3 * np.array(self.monitor.t), np.array(self.monitor.i)
        return {i: times[who == i] for i in CHECKED}


class Neuron:
    options = ["--set", "gCaL=0"]
    cells = None  # created once: NEURON simulates every existing cell

    def __init__(self, second_order):
        from neuron import __version__, h

        self.name, self.h, self.second_order = f"NEURON {__version__}, hh", h, second_order
        self.method = "Crank-Nicolson (secondorder=2)" if second_order else "backward Euler, its default"
        if Neuron.cells is None:
            Neuron.cells, Neuron.times = make_neuron_cells(h)

    def run(self):
        """Processor time of the steps, s."""
        self.h.secondorder = 2 if self.second_order else 0
        self.h.dt = 1e-3 * STEP_US
        self.h.finitialize(-65.0)
        begin = time.process_time()
        for _ in range(int(STEPS)):
            self.h.fadvance()
        seconds = time.process_time() - begin
        self.found = {i: np.array(times) for i, times in Neuron.times.items()}
        return seconds

    def trains(self):
        return self.found


def make_neuron_cells(h):
    """Sections with NEURON's hh under constant currents, and vectors for the spike times of some."""
    h.load_file("stdrun.hoc")
    h.cvode_active(0)
    h.celsius = 6.3
    m0, n0, h0 = resting()
    cells, times = [], {}
    for i, current in enumerate(CURRENTS):
        soma = h.Section(name=f"neuron{i}")
        soma.L = soma.diam = 20.0
        soma.cm = 1.0
        soma.insert("hh")
        soma.ena, soma.ek = 50.0, -77.0
        segment = soma(0.5)
        # The leak that sets the resting potential to exactly -65 mV.
        segment.hh.el = -65 - (120 * m0**3 * h0 * (50 + 65) + 36 * n0**4 * (-77 + 65)) / 0.3
        clamp = h.IClamp(segment)
        clamp.delay, clamp.dur = 0.0, 1e9
        clamp.amp = current * segment.area() * 1e-8 * 1e3  # uA/cm2 * cm2 -> nA
        detector = h.NetCon(segment._ref_v, None, sec=soma)
        detector.threshold = -20.0
        if i in CHECKED:
            times[i] = h.Vector()
            detector.record(times[i])
        cells.append((soma, clamp, detector))
    return cells, times


def installed(folder):
    """The simulators that can be imported; prints the others."""
    peers = []
    for make, package in [
        (lambda: Brian2(folder), "python3-brian"),
        (lambda: Neuron(False), "python3-neuron"),
        (lambda: Neuron(True), "python3-neuron"),
    ]:
        try:
            peers.append(make())
        except ImportError as error:
            print(f"skipped: {error} (Debian: {package})", file=sys.stderr)
    return peers


class TouchSim:
    """Its SA1 afferents at the places of merkel's, under the same press (a sine around 1 mm) for a second."""

    DEPTH_MM, AMPLITUDE_MM, SINE_HZ, RATE_HZ = 1.0, 0.3, 5.0, 5000
    SPHERE_MM, SPACING_MM = 3.0, 0.25  # its radius, and that of TouchSim's pins from each other
    # name: the tip in a scene of merkel
    TIPS = {"pin of 1 mm": 'tip = "pin"\ndiameter_mm = 1', "sphere of radius 3 mm": "radius_mm = 3"}

    def __init__(self, merkel):
        if not hasattr(np, "bool"):
            np.bool = bool  # removed from numpy 1.24; TouchSim uses it
        import touchsim

        self.merkel, self.touchsim = merkel, touchsim
        places = subprocess.run([merkel, "inspect", "afferents", "goodwin"], check=True, capture_output=True, text=True)
        table = np.genfromtxt(places.stdout.splitlines(), delimiter=",", names=True)
        self.afferents = touchsim.AfferentPopulation(
            *[touchsim.Afferent("SA1", location=[row["x_mm"], row["y_mm"]]) for row in table]
        )  # fmt: skip

    def stimulus(self, tip):
        pins, radius_mm = np.zeros((1, 3)), 0.5
        if tip.startswith("sphere"):
            edge = np.arange(-self.SPHERE_MM, self.SPHERE_MM + 0.01, self.SPACING_MM)
            x, y = (each.ravel() for each in np.meshgrid(edge, edge))
            below = (x**2 + y**2) / (2 * self.SPHERE_MM)
            pins, radius_mm = np.column_stack([x, y, -below])[below < self.DEPTH_MM + self.AMPLITUDE_MM], self.SPACING_MM / 2
        time_s = np.arange(self.RATE_HZ) / self.RATE_HZ
        press = self.DEPTH_MM * np.clip(time_s / 0.1, 0, 1) + np.where(
            time_s > 0.1, self.AMPLITUDE_MM * np.sin(2 * np.pi * self.SINE_HZ * time_s), 0
        )  # fmt: skip
        depths = press + pins[:, 2:]
        return self.touchsim.Stimulus(
            trace=np.maximum(depths, 0), location=pins[:, :2] + [15, 10], fs=self.RATE_HZ, pin_radius=radius_mm
        )  # fmt: skip

    def theirs(self, tip):
        """Processor time of a simulated second (contact and spikes), s, and the spikes in it."""
        before = time.process_time()
        response = self.afferents.response(self.stimulus(tip))
        return time.process_time() - before, sum(np.size(each) for each in response.spikes)

    def ours(self, scene):
        """The same of merkel: a long run less a short one."""
        def used(seconds):
            before = sum(os.times()[2:4])
            subprocess.run([self.merkel, "run", scene, "--fast", "--duration-s", str(seconds)], check=True, capture_output=True)
            return sum(os.times()[2:4]) - before

        return (used(22) - used(2)) / 20

    def rows(self, folder):
        for tip, keys in self.TIPS.items():
            scene, pins = folder / "press.toml", len(self.stimulus(tip).location)
            uri = (f"sim:sine?depth_mm={self.DEPTH_MM}&amplitude_mm={self.AMPLITUDE_MM}&frequency_hz={self.SINE_HZ}"
                   "&hold_s=200")
            scene.write_text(f'preset = "goodwin"\n[probe]\nuri = "{uri}"\n{keys}\n')
            _, spikes = self.theirs(tip)  # compiles
            assert spikes > 0, "TouchSim's afferents do not feel the press"
            pairs = [(self.theirs(tip)[0], self.ours(scene)) for _ in range(RUNS)]
            theirs, ours = (1e3 * statistics.median(column) for column in zip(*pairs))
            ratio = statistics.median(a / b for a, b in pairs)
            yield f"| {tip} ({pins} of TouchSim's pins) | {theirs:.0f} | {ours:.0f} | {ratio:.1f} |"


def print_touchsim(merkel):
    try:
        peer = TouchSim(merkel)
    except (ImportError, AttributeError) as error:
        print(f"TouchSim is skipped: {error} (https://github.com/hsaal/touchsim on PYTHONPATH; Debian: python3-numba, "
              "python3-skimage)", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as folder:
        rows = list(peer.rows(pathlib.Path(folder)))
    print(f"\n{len(peer.afferents)} SA1 afferents; processor time of a simulated second, ms; medians of {RUNS} pairs\n")
    print("| press | TouchSim, 5 kHz | merkel run goodwin | ratio |\n|---|---|---|---|\n" + "\n".join(rows))


def spikes_of(merkel, current, *options):
    text = subprocess.run(
        [merkel, "inspect", "neuron", "--current", repr(float(current)), "--duration-ms", str(DURATION_MS), *options],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    return np.array([float(line.split(",")[1]) for line in text.splitlines()[1:]])


def error_ms(trains, reference):
    """RMS error over all spikes, and the number of neurons with a wrong number of spikes."""
    differ, squares = 0, []
    for i in CHECKED:
        count = min(len(trains[i]), len(reference[i]))
        differ += len(trains[i]) != len(reference[i])
        squares += list((np.asarray(trains[i][:count]) - reference[i][:count]) ** 2)
    return float(np.sqrt(np.mean(squares))), differ


class Bench:
    """`merkel bench` of the same number of neurons."""

    def __init__(self, merkel):
        self.merkel, self.target = merkel, ""

    def ns(self, *options):
        """Time per neuron-step in ns, by precision."""
        bench = json.loads(
            subprocess.run([self.merkel, "bench", "--neurons", str(NEURONS), "--json", *options],
                           check=True, capture_output=True, text=True).stdout
        )  # fmt: skip
        self.target = bench["simd_target"]
        return {p["precision"]: p["ns_per_neuron_step"] for p in bench["populations"] if not p["coupled"]}


def checked_spikes(merkel, *options):
    return {i: spikes_of(merkel, CURRENTS[i], *options) for i in CHECKED}


def timed(peers, bench):
    """Processor times of the peers' runs and merkel's costs, interleaved; without `bench` only the peers'."""
    seconds, ours = {peer: [] for peer in peers}, {"double": [], "float": []}
    for peer in peers:
        peer.run()  # warm up
    for _ in range(RUNS if peers else 0):
        for peer in peers:
            seconds[peer].append(peer.run())
        for precision, ns in bench.ns().items() if bench else []:
            ours[precision].append(ns)
    return seconds, ours


def write_csv(path, peers, seconds, errors):
    with open(path, "w", encoding="utf-8") as file:
        file.write("peer,step_us,cost_us_per_neuron_second,rms_error_ms\n")
        for peer in peers:
            cost_us = statistics.median(seconds[peer]) * 1e6 / NEURONS / (1e-3 * DURATION_MS)
            name = f"{peer.name.split()[0]} {peer.method.split(',')[0].split(' (')[0]}"
            file.write(f"{name},{STEP_US},{cost_us},{errors[peer][0]}\n")


def print_table(merkel, bench, peers, references, seconds, ours, errors):
    rows = []
    for peer in peers:
        ns = [1e9 * s / (STEPS * NEURONS) for s in seconds[peer]]
        error, differ = errors[peer]
        ratios = {p: statistics.median(a / b for a, b in zip(ns, ours[p])) for p in ours}
        ours_error, _ = error_ms(checked_spikes(merkel, *peer.options), references[tuple(peer.options)])
        counts = f"; {differ} of {len(CHECKED)} neurons have a wrong number of spikes" if differ else ""
        rows.append(
            f"| {peer.name}: {peer.method} | {statistics.median(ns):.1f} | {error:.3g}{counts} "
            f"| {ratios['double']:.1f} | {ratios['float']:.1f} | {ours_error / error:.2g} |"
        )
    for method, step_us in [("crank_nicolson", 25.0), ("staggered_multistep", 25.0), ("staggered_multistep", 50.0)]:
        options = ["--method", method, "--step-us", str(step_us)]
        runs = [bench.ns(*options) for _ in range(RUNS)]
        ns = {p: statistics.median(run[p] for run in runs) for p in runs[0]}
        error, _ = error_ms(checked_spikes(merkel, *options), references[()])
        per_25 = 25.0 / step_us
        rows.append(
            f"| merkel: {method}, steps of {step_us:g} us | {ns['double'] * per_25:.2f} (float {ns['float'] * per_25:.2f}) "
            f"| {error:.2g} | | | |"
        )
    print(f"{NEURONS} neurons, {DURATION_MS:g} ms, one core, {bench.target}; medians of {RUNS} interleaved runs\n")
    print("| simulator and method | ns per neuron-step of 25 us | rms spike-time error, ms | time / merkel's, double | float | merkel's error / its |")
    print("|---|---|---|---|---|---|")
    print("\n".join(rows))


def main():
    merkel = os.path.abspath(sys.argv[1])
    csv = sys.argv[3] if len(sys.argv) > 3 and sys.argv[2] == "--csv" else None
    bench = None if csv else Bench(merkel)
    with tempfile.TemporaryDirectory() as folder:
        peers = installed(pathlib.Path(folder))
        seconds, ours = timed(peers, bench)
        references = {
            options: checked_spikes(merkel, "--method", "rk4", "--step-us", "0.5", *options)
            for options in {tuple(peer.options) for peer in peers} | (set() if csv else {()})
        }
        errors = {peer: error_ms(peer.trains(), references[tuple(peer.options)]) for peer in peers}
        if csv:
            write_csv(csv, peers, seconds, errors)
        else:
            print_table(merkel, bench, peers, references, seconds, ours, errors)
    if not csv:
        print_touchsim(merkel)


if __name__ == "__main__":
    main()
