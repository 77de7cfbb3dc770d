"""Simulate driven granular chains and calibrate models of them against laboratory records.

A number is in SI; a text in its place carries its unit, such as ``"1.5 MHz"``. Work runs without the interpreter's lock. Ctrl-C stops it.

Examples
--------
>>> import granchain
>>> record = granchain.read("vib.csv")  # doctest: +SKIP
>>> outcome = granchain.calibrate(record, "horn_tip.csv", "annulus")  # doctest: +SKIP
>>> outcome.verdict, outcome.parameters["alpha"].value  # doctest: +SKIP
"""

from ._calibrations import Calibration, Parameter, Posterior, Runs, calibrate
from ._granchain import (
    CalibrationError,
    FeatureError,
    GranchainError,
    RecordError,
    SceneError,
    SimulationError,
    UsageError,
    __version__,
)
from ._keywords import Quantity, ReadingOptions, RecordsOptions, SampleOptions
from ._records import Record, Sampling, Spectrum, features, read, spectrum
from ._scenes import Key, Run, Scene, Setting, Sweep, replay, scene_keys, scenes, sweep

__all__ = [
    "Calibration",
    "CalibrationError",
    "FeatureError",
    "GranchainError",
    "Key",
    "Parameter",
    "Posterior",
    "Quantity",
    "ReadingOptions",
    "Record",
    "RecordError",
    "RecordsOptions",
    "Run",
    "Runs",
    "SampleOptions",
    "Sampling",
    "Scene",
    "SceneError",
    "Setting",
    "SimulationError",
    "Spectrum",
    "Sweep",
    "UsageError",
    "__version__",
    "calibrate",
    "features",
    "read",
    "replay",
    "scene_keys",
    "scenes",
    "spectrum",
    "sweep",
]
