"""An inlet of the Lab Streaming Layer through liblsl's C interface; run if liblsl is found."""
import ctypes
import os
import subprocess
import time

import merkel_program
from merkel_program import SOAK, SOAK_S

lsl = ctypes.CDLL(os.environ["MERKEL_LIBLSL"])
pointer, real, whole = ctypes.c_void_p, ctypes.c_double, ctypes.c_int
lsl.lsl_local_clock.restype = real
lsl.lsl_resolve_byprop.argtypes = [ctypes.POINTER(pointer), ctypes.c_uint, ctypes.c_char_p,
                                   ctypes.c_char_p, whole, real]
lsl.lsl_create_inlet.restype = pointer
lsl.lsl_create_inlet.argtypes = [pointer, whole, whole, whole]
lsl.lsl_open_stream.argtypes = [pointer, real, ctypes.POINTER(whole)]
lsl.lsl_pull_chunk_i.restype = ctypes.c_ulong
lsl.lsl_pull_chunk_i.argtypes = [pointer, ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(real),
                                 ctypes.c_ulong, ctypes.c_ulong, real, ctypes.POINTER(whole)]
CHUNK = 4096


class Inlet:
    def __init__(self, name):
        found = (pointer * 1)()
        if lsl.lsl_resolve_byprop(found, 1, b"name", name.encode(), 1, 30.0) != 1:
            raise RuntimeError(f"no stream {name}")
        # The largest buffer, in units of 100 samples.
        self.inlet = lsl.lsl_create_inlet(found[0], 100_000, 0, 1)
        self.error = whole()
        lsl.lsl_open_stream(self.inlet, 30.0, ctypes.byref(self.error))
        self.values, self.stamps = (ctypes.c_int32 * CHUNK)(), (real * CHUNK)()

    def chunk(self):
        """(stamps in s, neurons) of the received samples."""
        count = lsl.lsl_pull_chunk_i(self.inlet, self.values, self.stamps, CHUNK, CHUNK, 0.0,
                                     ctypes.byref(self.error))
        return self.stamps[:count], self.values[:count]


class Lsl(merkel_program.TestCase):
    def test_hours_of_spikes_lose_none(self):
        self.assertLess(abs(lsl.lsl_local_clock() - time.clock_gettime(time.CLOCK_MONOTONIC)), 0.1)
        seconds = min(SOAK_S, float(os.environ.get("MERKEL_SOAK_LSL_S", "15")))
        speed = os.environ.get("MERKEL_SOAK_LSL_SPEED", "10")
        name = f"merkel-soak-{os.getpid()}"
        program = subprocess.Popen([SOAK, f"{seconds}@{speed}", f"lsl:{name}?wait_s=60"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        inlet = Inlet(name)
        made, received = int(seconds * 5000), 0
        heard = time.monotonic()
        while received < made and time.monotonic() - heard < 20.0:
            stamps, neurons = inlet.chunk()
            if not stamps:
                time.sleep(0.002)
                continue
            heard = time.monotonic()
            for k, (stamp, neuron) in enumerate(zip(stamps, neurons), received):
                # Five per tick, 190 µs apart, starting at 7 ns.
                expected = (k // 5 * 1_000_000 + k % 5 * 190_000 + 7) * 1e-9
                if abs(stamp - expected) > 2e-7 or not 1 <= neuron <= 1000:
                    self.fail(f"spike {k}: {neuron} at {stamp} s, not at {expected} s")
            received += len(stamps)
        print(f"{received} of {made} spikes received", flush=True)
        self.assertEqual(received, made)
        self.assertEqual(program.wait(), 0)


if __name__ == "__main__":
    merkel_program.main()
