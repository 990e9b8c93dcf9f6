"""A stand-in with the interface of National Instruments' module nidaqmx, as far as an example calls it: presses of 2 V."""
import time
import types

from . import constants


class Task:
    def __enter__(self):
        self.ai_channels = types.SimpleNamespace(add_ai_voltage_chan=self._add)
        self.timing = types.SimpleNamespace(cfg_samp_clk_timing=self._time)
        return self

    def __exit__(self, *error):
        return False

    def _add(self, physical_channel, *, min_val, max_val):
        assert physical_channel == "Dev1/ai0" and min_val < 2.0 < max_val

    def _time(self, rate, *, sample_mode, samps_per_chan):
        assert sample_mode is constants.AcquisitionType.CONTINUOUS and samps_per_chan > 0
        self._rate_hz = rate

    def start(self):
        self._begin, self._number = time.monotonic(), 0

    def read(self, number_of_samples_per_channel):
        first, self._number = self._number, self._number + number_of_samples_per_channel
        time.sleep(max(0.0, self._begin + self._number / self._rate_hz - time.monotonic()))
        return [2.0 * ((k / self._rate_hz) % 0.4 > 0.2) for k in range(first, self._number)]
