"""Keywords as flags of the program, which has the one list of them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict

Quantity: TypeAlias = float | str
"""A number in SI, or a text with its unit, such as ``"1.5 MHz"``."""

StrPath: TypeAlias = str | os.PathLike[str]

# Of these a flag is never without its unit; a plain number is SI.
_UNITS = {"bandwidth": "Hz", "sample_rate": "Hz", "delay": "s", "trigger": "s"}
_UNITS |= {f"drive_{name}": unit for name, unit in _UNITS.items()} | {"drive_frequency": "Hz"}

# Keys of a reading that have no flag of their own.
_READ = {
    "time_column", "time_unit", "baseline", "invert", "bandwidth", "delay", "trigger", "missing", "delimiter", "decimal", "range", "resample",
    "dataset", "averages", "mask", "response", "force_frequency",
}  # fmt: skip
_DRIVE_READ = {f"drive_{name}" for name in _READ | {"channel", "unit", "scale", "sample_rate"}}


class SampleOptions(TypedDict, total=False):
    """Keywords about samples. What is left out is assumed, and the assumption is listed in `Record.assumed`."""

    baseline: Literal["auto", "pretrigger", "mean", "plateau", "none"]
    """Offset that is removed."""
    invert: bool
    """Change the sign. Positive must be from piston to support."""
    bandwidth: Quantity
    """−6 dB bandwidth of the vibrometer, Hz."""
    delay: Quantity
    """Group delay of the vibrometer, s: the record lags the motion by it."""
    trigger: Quantity
    """Instant of the trigger on the time axis, s. It becomes t = 0."""
    scale: str
    """Sensitivity, for a column in volts: ``"125 mm/s/V"``, ``"2 um/V"``, ``"250 nV/Pa"``."""
    range: str
    """Full-scale value of vibrometer or hydrophone, such as ``"1 m/s"``."""
    resample: bool
    """Interpolate uneven samples onto an even grid by a cubic spline."""
    drive_frequency: Quantity
    """Drive frequency f0, Hz."""
    force_frequency: bool
    """Accept the stated drive frequency although the strongest line of the horn's record is another."""


class ReadingOptions(SampleOptions, total=False):
    """Keywords about a file, in addition to those of `SampleOptions`.

    What is left out is read from the file, or assumed and listed in `Record.assumed`.
    """

    channel: str | int
    """Column of the recorded quantity: its header or its number from 1."""
    time_column: str | int
    """Column of time: its header or its number from 1."""
    unit: str
    """Unit of the recorded quantity, such as ``mm/s``; overrides the file."""
    time_unit: str
    """Unit of time, such as ``us``; overrides the file."""
    missing: Literal["refuse", "interpolate"]
    """Whether cells such as ``n/a`` are refused or interpolated."""
    delimiter: str
    """Delimiter of the values: ``comma``, ``semicolon`` or ``tab``."""
    decimal: str
    """Decimal mark: ``point`` or ``comma``."""
    sample_rate: Quantity
    """Sample rate of a file without a column of time, Hz."""
    dataset: int
    """Function of a universal file, or segment of a file with several, from 1."""
    averages: int
    """Number of shots of which the record is the mean."""
    response: str
    """Frequency response of the instrument: ``bessel``, ``butterworth-2``, or rows such as ``1MHz:-2.1dB``."""
    mask: str
    """Samples that are masked: ``auto``, ``none``, or stretches such as ``12.1us:13.4us``."""
    bench: StrPath
    """Bench file, which says how each channel is read. Keywords win over it."""


class RecordsOptions(ReadingOptions, total=False):
    """Keywords of `ReadingOptions`, and with ``drive_`` before them the same for the horn's record (``drive_scale="2 um/V"``)."""

    drive_channel: str | int
    drive_time_column: str | int
    drive_unit: str
    drive_time_unit: str
    drive_baseline: Literal["auto", "pretrigger", "mean", "plateau", "none"]
    drive_invert: bool
    drive_bandwidth: Quantity
    drive_delay: Quantity
    drive_trigger: Quantity
    drive_missing: Literal["refuse", "interpolate"]
    drive_delimiter: str
    drive_decimal: str
    drive_sample_rate: Quantity
    drive_scale: str
    drive_range: str
    drive_resample: bool
    drive_dataset: int
    drive_averages: int
    drive_response: str
    drive_mask: str


def text(value: object) -> str:
    """A value as it is typed: floats with all their digits, lists in brackets."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value) if isinstance(os.fspath(value), str) else str(value)
    if isinstance(value, Sequence) or hasattr(value, "tolist") and getattr(value, "ndim", 0) > 0:
        items: Iterable[Any] = value if isinstance(value, Sequence) else value.tolist()
        return "[" + ", ".join(text(item) for item in items) + "]"
    if hasattr(value, "item"):
        value = value.item()
    return repr(value)


def assignments(settings: Mapping[str, object] | None) -> list[str]:
    """``KEY=VALUE`` of every setting."""
    return [f"{key}={text(value)}" for key, value in (settings or {}).items()]


def flag(name: str, value: object) -> list[str]:
    """A flag with its value, as typed; nothing for ``None`` and ``False``."""
    if value is None or value is False:
        return []
    if name in _UNITS and not isinstance(value, str):
        value = f"{text(value)} {_UNITS[name]}"
    said = text(value)
    if name in _READ:
        return ["--read", f"{name}={said}"]
    if name in _DRIVE_READ:
        return ["--drive-read", f"{name.removeprefix('drive_')}={said}"]
    typed = "--" + name.replace("_", "-")
    if value is True:
        return [typed]
    return [f"{typed}={said}"] if said.startswith("-") else [typed, said]


def flags(options: Mapping[str, object], prefix: str = "") -> list[str]:
    """The flags of many options."""
    return [word for name, value in options.items() for word in flag(prefix + name, value)]
