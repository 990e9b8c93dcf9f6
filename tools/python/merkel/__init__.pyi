"""Types of the module merkel. Times are in s, lengths in mm, forces in N unless a name says otherwise."""
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
__all__: list[str]

class Error(RuntimeError):
    """The message that the program would print: what happened, where, and what to do."""

@final
class Table:
    """One table of a scene: scene.skin.radius_mm."""
    def __getattr__(self, key: str) -> Any: ...
    def __setattr__(self, key: str, value: Any) -> None: ...

@final
class Scene:
    """A preset ("paper", "finger", ...) or a scene file."""
    def __init__(self, name_or_file: str | PathLike[str] = ..., *, overrides: Mapping[str, Any] | None = ...) -> None: ...
    @staticmethod
    def from_text(text: str, *, overrides: Mapping[str, Any] | None = ...) -> Scene: ...
    @property
    def keep_model(self) -> bool: ...
    @keep_model.setter
    def keep_model(self, keep: bool) -> None: ...
    @property
    def text(self) -> str: ...
    @property
    def uris(self) -> list[str]: ...
    def keys(self) -> list[str]: ...
    def __getattr__(self, table: str) -> Table: ...
    def __getitem__(self, key: str) -> Any: ...
    def __setitem__(self, key: str, value: Any) -> None: ...
    @property
    def probes(self) -> int: ...
    @property
    def afferents(self) -> NDArray[np.void]:
        """(afferents,) of neuron, patch, x_mm, y_mm, field_radius_mm, receptors."""
    def run(
        self,
        *,
        depth_mm: ArrayLike | None = ...,
        force_N: ArrayLike | None = ...,
        x_mm: ArrayLike | None = ...,
        y_mm: ArrayLike | None = ...,
        time_s: ArrayLike | None = ...,
        rate_hz: float | None = ...,
        probe: str | Sequence[str] | None = ...,
        seed: int | None = ...,
        duration_s: float | None = ...,
        sinks: Sequence[str] = ...,
        overwrite: bool = ...,
    ) -> Run: ...
    def stream(self, *, max_gap_s: float = ...) -> Stream: ...

@final
class Run:
    """The result of a batch run."""
    @property
    def spikes(self) -> NDArray[np.void]:
        """(spikes,) of time_s, neuron, patch, flags, in order of time."""
    @property
    def afferents(self) -> NDArray[np.void]: ...
    @property
    def stimulation(self) -> NDArray[np.void]:
        """(commands,) of time_s, electrode, kind, stop, amplitude_uA, frequency_Hz, heartbeat."""
    @property
    def start_s(self) -> float: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def counters(self) -> dict[str, int]: ...
    @property
    def notices(self) -> list[str]: ...
    @property
    def verdict(self) -> str: ...
    @property
    def spike_hash(self) -> str: ...
    def times(self, neuron: int) -> NDArray[np.float64]: ...
    def rate(self, bin_s: float) -> NDArray[np.float64]:
        """Rates in Hz: (bins, afferents)."""
    def psth(self, bin_s: float) -> NDArray[np.float64]:
        """Mean rate of an afferent in each bin, Hz: (bins,)."""

class Output(NamedTuple):
    """Spikes and stimulation commands since the last call; no commands without electrodes."""
    spikes: NDArray[np.void]
    stimulation: NDArray[np.void]

@final
class Stream:
    """The model, one sample at a time."""
    def push(
        self,
        time_s: float,
        *,
        depth_mm: float | None = ...,
        force_N: float | None = ...,
        x_mm: float | None = ...,
        y_mm: float | None = ...,
        probe: int = ...,
    ) -> Output: ...
    def finish(self) -> Output: ...
    def set_drive(self, electrode: str, amplitude: float, frequency: float | None = ...) -> None: ...
    @property
    def time_s(self) -> float | None: ...

@final
class Bridge:
    """The real-time pipeline in the background. Iterate to get spikes and stimulation as they come."""
    def __enter__(self) -> Bridge: ...
    def __exit__(self, *exc: object) -> None: ...
    def __iter__(self) -> Iterator[Output]: ...
    def __next__(self) -> Output: ...
    def read(self, timeout_s: float = ...) -> Output: ...
    @property
    def ended(self) -> bool: ...
    def stop(self) -> None: ...
    def set_drive(self, electrode: str, amplitude: float, frequency: float | None = ...) -> None: ...
    def stop_stimulation(self) -> None: ...
    def start_stimulation(self) -> None: ...
    def mark(self, label: str) -> None: ...
    def tare(self, probe: int | None = ...) -> bool: ...
    @property
    def counters(self) -> dict[str, int]: ...
    @property
    def notices(self) -> list[str]: ...

@final
class Session:
    """A recorded session as arrays. Times count from the start of the run."""
    @property
    def spikes(self) -> NDArray[np.void]: ...
    @property
    def samples(self) -> NDArray[np.void]: ...
    @property
    def extra(self) -> dict[str, NDArray[np.float64]]: ...
    @property
    def taxels(self) -> dict[int, NDArray[np.float32]]: ...
    @property
    def ticks(self) -> NDArray[np.void]: ...
    @property
    def events(self) -> NDArray[np.void]: ...
    @property
    def afferents(self) -> NDArray[np.void]: ...
    @property
    def stimulation(self) -> NDArray[np.void]: ...
    @property
    def marks(self) -> list[tuple[float, str]]: ...
    @property
    def sync(self) -> NDArray[np.void]: ...
    @property
    def facts(self) -> dict[str, str]: ...
    @property
    def alignments(self) -> dict[str, NDArray[np.float64]]: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def start_unix_s(self) -> float | None: ...
    @property
    def start_device_s(self) -> float: ...
    @property
    def complete(self) -> bool: ...

class Result:
    """One job of a batch: its row of the table, and what it kept."""
    @property
    def row(self) -> dict[str, Any]: ...
    @property
    def file(self) -> Path | None: ...
    @property
    def run(self) -> Run | None: ...
    @property
    def spikes(self) -> NDArray[np.void]: ...
    @property
    def value(self) -> Any: ...

class Batch:
    """The results of merkel.batch(), in the order of the jobs."""
    @property
    def rows(self) -> list[dict[str, Any]]: ...
    @property
    def table(self) -> Any:
        """A pandas.DataFrame."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> Result: ...

def batch(
    jobs: Iterable[Mapping[str, Any]] | Iterable[str | PathLike[str]] | str | PathLike[str] | Any,
    executor: Executor | None = ...,
    *,
    out: str | PathLike[str] | None = ...,
    keep: str | Callable[[Run], Any] = ...,
    cores: int | None = ...,
    progress: bool | None = ...,
) -> Batch: ...

class Fit:
    """The result of merkel.fit()."""
    @property
    def scene(self) -> Scene: ...
    @property
    def parameters(self) -> list[dict[str, Any]]: ...
    @property
    def cost_before(self) -> float: ...
    @property
    def cost_after(self) -> float: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def determined(self) -> bool: ...

def fit(
    scene: Scene | str | PathLike[str] = ...,
    data: str | PathLike[str] | None = ...,
    parameters: str | Sequence[str] = ...,
    executor: Executor | None = ...,
    *,
    trials: int = ...,
    evaluations: int = ...,
    cores: int | None = ...,
) -> Fit: ...

class Press(NamedTuple):
    """A press and the spikes of its trials. level is the mean over them; unit is "N" or "mm"."""
    name: str
    unit: str
    time_s: NDArray[np.float64]
    level: NDArray[np.float64]
    spike_times_s: list[NDArray[np.float64]]
    deviation: float

class Trials(list[Press]):
    def write(self, folder: str | PathLike[str], overwrite: bool = ...) -> str: ...

def trials(
    recordings: Any,
    *,
    force: str | None = ...,
    depth: str | None = ...,
    newtons_per_volt: float | None = ...,
    mm_per_volt: float | None = ...,
    spikes: str | None = ...,
    tip: str = ...,
    radius_mm: float = ...,
    probe_diameter_mm: float | None = ...,
    cite: str = ...,
) -> Trials: ...
class Device:
    @property
    def uri(self) -> str: ...
    def __init__(self, uri: str) -> None: ...
    def __getitem__(self, channel: str | int) -> str: ...
    def probe(
        self,
        *,
        force: str | int | None = ...,
        depth: str | int | None = ...,
        x: str | int | None = ...,
        y: str | int | None = ...,
    ) -> str: ...

def connect(
    probe: str | Device | Sequence[str] | Mapping[str, str] | None = ...,
    scene: Scene | str | PathLike[str] = ...,
    *,
    sinks: str | Sequence[str] = ...,
    duration_s: float | None = ...,
    overwrite: bool = ...,
    allow_remote: bool = ...,
    most_unread: int = ...,
) -> Bridge: ...
class RecordedStream(NamedTuple):
    """A stream of a LabRecorder file. time_s is on the recorder's clock, the same for all streams."""
    time_s: NDArray[np.float64]
    values: Any
    host: str
    clock_error_s: float
    info: Any

def load_streams(file: str | PathLike[str]) -> dict[str, RecordedStream]: ...
def load(file: str | PathLike[str]) -> Session: ...
def presets() -> list[str]: ...
