from collections.abc import Callable, Sequence
from os import PathLike
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]
_Arrays: TypeAlias = tuple[_Floats, _Floats]
_Progress: TypeAlias = Callable[[int, int], object] | None
_Path: TypeAlias = str | PathLike[str]

__version__: str
__all__ = [
    "Calibration",
    "CalibrationError",
    "FeatureError",
    "GranchainError",
    "Record",
    "RecordError",
    "Run",
    "Scene",
    "SceneError",
    "SimulationError",
    "UsageError",
    "__version__",
    "built_in",
    "calibrate",
    "keys",
    "measure",
    "read",
    "read_bytes",
    "replay",
    "run_program",
    "spectrum",
    "sweep",
    "table",
    "universal",
]

class GranchainError(Exception):
    """Base of every error of this package. The message says what was expected, what was found, and what to pass."""

class UsageError(GranchainError):
    """Arguments are wrong or contradict each other."""

class RecordError(GranchainError):
    """A file or array cannot be read as a record."""

class SceneError(GranchainError):
    """A key or value of a scene is wrong."""

class SimulationError(GranchainError):
    """A run fails, or needs too much work or memory."""

class FeatureError(GranchainError):
    """A record has nothing to measure."""

class CalibrationError(GranchainError):
    """A fit is not possible."""

def run_program(typed: Sequence[str], subcommand: str | None = None) -> int: ...
@final
class Record:
    def series(self) -> _Arrays: ...
    def raw(self) -> _Arrays: ...
    def about(self) -> str: ...

def read(path: _Path, flags: Sequence[str]) -> Record: ...
def read_bytes(path: _Path, bytes: bytes, flags: Sequence[str]) -> Record: ...
def table(time: _Floats, values: _Floats, name: str, unit: str) -> bytes: ...
def universal(record: Record, title: str, raw: bool) -> bytes: ...
def measure(
    record: Record,
    drive: tuple[Record, str] | None,
    drive_frequency: float | None,
    span: tuple[float | None, float | None],
) -> str: ...
def spectrum(values: _Floats, start: float, step: float, window: tuple[float, float]) -> _Arrays: ...
@final
class Scene:
    def __new__(
        cls,
        source: str,
        text: str | None,
        overrides: Sequence[str],
        drive: Record | None,
        chain: bool,
        limits: bool,
    ) -> Scene: ...
    def settings(self) -> str: ...
    def about(self) -> str: ...
    def to_toml(self) -> str: ...

@final
class Run:
    def time(self) -> _Floats: ...
    def columns(self) -> list[tuple[str, _Floats]]: ...
    def displacements(self) -> list[_Floats]: ...
    def seen(self) -> _Arrays: ...
    def features(self) -> str: ...
    def about(self) -> str: ...

def built_in() -> list[tuple[str, str]]: ...
def keys() -> str: ...
def replay(scene: Scene, cache_folder: _Path | None, progress: _Progress) -> Run: ...
def sweep(
    scene: Scene,
    axes: Sequence[str],
    ensemble: int | None,
    seed: int,
    cache_folder: _Path | None,
    progress: _Progress,
) -> tuple[str, str]: ...
@final
class Calibration:
    def file(self, name: str) -> bytes | None: ...
    def files(self) -> list[PathLike[str]]: ...
    def fingerprints(self) -> bytes | None: ...
    def parameters(self, law: int) -> list[str]: ...
    def has_below(self, law: int) -> bool: ...
    def posterior(self, law: int, below: bool) -> tuple[NDArray[np.float64], _Floats]: ...
    def draw(self, law: int, below: bool, count: int, seed: int) -> NDArray[np.float64]: ...
    def runs(self, law: int, below: bool) -> tuple[NDArray[np.float64], _Floats, list[str | None]]: ...
    def write(self, folder: _Path, force: bool) -> PathLike[str]: ...

def calibrate(
    flags: Sequence[str],
    cache_folder: _Path | None,
    measured: Sequence[bytes | None],
    drives: Sequence[bytes | None],
    progress: _Progress,
) -> Calibration: ...
