"""Records of the laboratory: read into arrays, with what was assumed on the way."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _granchain as native
from ._keywords import Quantity, ReadingOptions, SampleOptions, StrPath, flags

if TYPE_CHECKING:
    import pandas
    import xarray
    from typing_extensions import Unpack

Kind: TypeAlias = Literal["horn-tip", "vibrometer", "hydrophone"]
Floats: TypeAlias = NDArray[np.float64]

_COLUMNS = {"m": "displacement", "m/s": "velocity", "Pa": "pressure"}
# Data set 58: quantity of the ordinate.
_UFF = {"displacement": 8, "velocity": 11, "pressure": 15}
_UFF_UNITS = {8: "m", 11: "m/s", 15: "Pa"}


@dataclass(frozen=True)
class Sampling:
    """Instants of an even record.

    Attributes
    ----------
    start, step
        First instant and interval, s.
    rate
        Samples a second, Hz.
    count
        Number of samples.
    """

    start: float
    step: float
    rate: float
    count: int


class Record:
    """One record, in SI; motion is positive from piston to support, t = 0 is the trigger.

    Made by :func:`read` or :meth:`from_arrays`.
    """

    def __init__(self, record: native.Record, path: str, options: list[str], content: bytes | None = None) -> None:
        self._record = record
        self._path = path
        self._options = options
        self._bytes = content

    @classmethod
    def from_arrays(
        cls,
        values: ArrayLike,
        *,
        unit: str,
        time: ArrayLike | None = None,
        sample_rate: float | None = None,
        start: float = 0.0,
        kind: Kind = "vibrometer",
        name: str | None = None,
        **reading: Unpack[SampleOptions],
    ) -> Record:
        """A record of samples that are in memory, read as the same samples in a file would be.

        Parameters
        ----------
        values
            Samples.
        unit
            Their unit: ``"m/s"``, ``"um"``, ``"kPa"``, or ``"V"`` with `scale`.
        time
            Instants, s; or else
        sample_rate, start
            samples a second, Hz, and the first instant, s.
        kind
            What was recorded where.
        name
            What it is called in messages and reports [default: its kind].
        **reading
            What samples do not say: see :class:`SampleOptions`.
        """
        for what, array in (("values", values), ("time", time)):
            if array is not None and np.ma.is_masked(array):
                raise native.UsageError(
                    f"`{what}`: expected samples without a mask, found masked ones; cut them out with `compressed()`, or fill them"
                )
        samples = np.ascontiguousarray(values, dtype=np.float64)
        if time is None:
            if sample_rate is None:
                raise native.UsageError("expected `time` or `sample_rate`, found neither; pass one of them")
            instants = start + np.arange(samples.size, dtype=np.float64) / float(sample_rate)
        else:
            instants = np.ascontiguousarray(time, dtype=np.float64)
        content = native.table(instants, samples, _COLUMNS.get(unit, "signal"), unit)
        options = flags({"kind": kind, **reading})
        path = f"(array)/{name or kind}"
        return cls(native.read_bytes(path, content, options), path, options, content)

    @cached_property
    def _about(self) -> dict[str, Any]:
        about: dict[str, Any] = json.loads(self._record.about())
        return about

    @cached_property
    def _series(self) -> tuple[Floats, Floats]:
        return self._record.series()

    @property
    def time(self) -> Floats:
        """Instants, s."""
        return self._series[0]

    @property
    def values(self) -> Floats:
        """Samples in :attr:`unit`: displacement of a horn tip, velocity of a bead, pressure of a hydrophone."""
        return self._series[1]

    @cached_property
    def raw(self) -> tuple[Floats, Floats]:
        """Instants (s) and samples (SI of :attr:`recorded`) as they stand in the file."""
        return self._record.raw()

    @property
    def unit(self) -> str:
        """SI unit of :attr:`values`."""
        return str(self._about["unit"])

    @property
    def quantity(self) -> str:
        """What :attr:`values` are: ``displacement``, ``velocity``, ``pressure``."""
        return str(self._about["quantity"])

    @property
    def recorded(self) -> str:
        """What the file's column held; a horn tip's velocity has been integrated."""
        return str(self._about["recorded"])

    @property
    def kind(self) -> str:
        """What was recorded where: ``horn-tip``, ``vibrometer``, ``hydrophone``."""
        return str(self._about["kind"])

    @property
    def path(self) -> str:
        """The file; ``(array)/NAME`` of one that is in memory."""
        return self._path

    @property
    def sha256(self) -> str:
        """SHA-256 of its bytes."""
        return str(self._about["sha256"])

    @property
    def sampling(self) -> Sampling:
        """Its instants."""
        return Sampling(**self._about["sampling"])

    @property
    def assumed(self) -> list[str]:
        """What was assumed on reading."""
        return list(self._about["assumed"])

    @property
    def warnings(self) -> list[str]:
        """What looks wrong but could be read: what was seen, why it matters, what to do."""
        return list(self._about["warnings"])

    @property
    def noise_rms(self) -> float:
        """Noise in :attr:`unit`, rms; 0 if unknown."""
        return float(self._about["noise_rms"])

    @property
    def bandwidth(self) -> float | None:
        """−6 dB bandwidth of the vibrometer, Hz, where stated."""
        found = self._about["bandwidth"]
        return None if found is None else float(found)

    @property
    def drive_frequency(self) -> float | None:
        """f0, Hz: as stated, else the strongest line of a horn's record."""
        found = self._about["drive_frequency"]
        return None if found is None else float(found)

    @property
    def about(self) -> dict[str, Any]:
        """Everything that is known of it but the samples: baseline, clipping, columns, comments …"""
        return dict(self._about)

    def __len__(self) -> int:
        return self.sampling.count

    def __repr__(self) -> str:
        sampling = self.sampling
        return f"<Record {self.path}: {self.quantity} in {self.unit}, {sampling.count} samples at {sampling.rate:.6g} Hz>"

    def save(self, path: StrPath, *, raw: bool = False) -> None:
        """Write it as a table (``.csv``) or, by the ending ``.uff`` or ``.unv``, a universal file (58b).

        Parameters
        ----------
        path
            Where to.
        raw
            Write the samples as they stood in the file.
        """
        if os.fspath(path).lower().endswith((".uff", ".unv")):
            content = native.universal(self._record, self.path, raw)
        else:
            time, values = self.raw if raw else self._series
            unit = self._about["recorded_unit"] if raw else self.unit
            content = native.table(time, values, self.recorded if raw else self.quantity, unit)
        Path(path).write_bytes(content)

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas frame with one column, indexed by time (s)."""
        import pandas

        index = pandas.Index(self.time, name="time_s")
        return pandas.DataFrame({f"{self.quantity}_{_suffix(self.unit)}": self.values}, index=index)

    def to_xarray(self) -> xarray.DataArray:
        """An xarray array over time, with units and assumptions as attributes."""
        import xarray

        return xarray.DataArray(
            self.values,
            coords={"time": ("time", self.time, {"units": "s"})},
            dims="time",
            name=self.quantity,
            attrs={"units": self.unit, "path": self.path, "sha256": self.sha256, "assumed": self.assumed},
        )

    def to_pyuff(self) -> dict[str, Any]:
        """A data set 58 as pyuff takes it: ``pyuff.UFF(path).write_sets(record.to_pyuff())``, of a path that is not there yet."""
        sampling = self.sampling
        return {
            "type": 58, "func_type": 1, "binary": 1, "id1": self.path[:80], "id2": "NONE", "id3": "NONE", "id4": "NONE", "id5": "NONE",
            "rsp_node": 1, "rsp_dir": 3, "rsp_ent_name": "NONE", "ref_node": 0, "ref_dir": 0, "ref_ent_name": "NONE",
            "load_case_id": 0, "ver_num": 0, "ord_data_type": 4,
            "num_pts": sampling.count, "abscissa_spacing": 1, "abscissa_min": sampling.start, "abscissa_inc": sampling.step,
            "z_axis_value": 0.0,
            "abscissa_spec_data_type": 17, "abscissa_axis_lab": "Time", "abscissa_axis_units_lab": "s",
            "abscissa_len_unit_exp": 0, "abscissa_force_unit_exp": 0, "abscissa_temp_unit_exp": 0,
            "ordinate_spec_data_type": _UFF[self.quantity], "ordinate_axis_lab": self.quantity.capitalize(),
            "ordinate_axis_units_lab": self.unit,
            "ordinate_len_unit_exp": 0, "ordinate_force_unit_exp": 0, "ordinate_temp_unit_exp": 0,
            "orddenom_spec_data_type": 0, "orddenom_len_unit_exp": 0, "orddenom_force_unit_exp": 0,
            "orddenom_temp_unit_exp": 0, "orddenom_axis_lab": "NONE", "orddenom_axis_units_lab": "NONE",
            "z_axis_spec_data_type": 0, "z_axis_len_unit_exp": 0, "z_axis_force_unit_exp": 0, "z_axis_temp_unit_exp": 0,
            "z_axis_axis_lab": "NONE", "z_axis_axis_units_lab": "NONE",
            "x": self.time, "data": self.values,
        }  # fmt: skip

    @classmethod
    def from_pyuff(
        cls, dataset: dict[str, Any], *, kind: Kind, unit: str | None = None, **reading: Unpack[SampleOptions]
    ) -> Record:
        """A record of a data set 58 as pyuff reads it.

        Parameters
        ----------
        dataset
            One of ``pyuff.UFF(path).read_sets()``.
        kind
            What was recorded where.
        unit
            Unit of the samples [default: as the set states, else SI of its quantity].
        **reading
            As for :func:`read`.
        """
        if dataset.get("type") != 58 or dataset.get("func_type") != 1:
            raise native.RecordError(
                f"expected a time response (type 58, func_type 1), found type {dataset.get('type')}, "
                f"func_type {dataset.get('func_type')}; choose another set of the file"
            )
        stated = str(dataset.get("ordinate_axis_units_lab") or "").strip()
        unit = unit or (stated if stated not in ("", "NONE") else _UFF_UNITS.get(int(dataset["ordinate_spec_data_type"])))
        if unit is None:
            raise native.RecordError("the data set states no unit; pass unit='m/s' or what it is")
        return cls.from_arrays(np.real(dataset["data"]), unit=unit, time=dataset["x"], kind=kind, **reading)


def _suffix(unit: str) -> str:
    return unit.replace("/", "_per_").lower()


def read(path: StrPath, *, kind: Kind | None = None, **reading: Unpack[ReadingOptions]) -> Record:
    """Read a record of any form that granchain knows: CSV of a dozen makers, universal files.

    Parameters
    ----------
    path
        The file.
    kind
        Kind of record [default: from the file's name and units].
    **reading
        What the file does not say: see :class:`ReadingOptions`. A plain number is SI, a text carries its unit.

    Returns
    -------
    Record

    Raises
    ------
    RecordError
        With file, line and column, what was expected and found, and what to pass.
    """
    options = flags({"kind": kind, **reading})
    return Record(native.read(path, options), os.fspath(path), options)


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes of a trace, and what was measured on it.

    Attributes
    ----------
    frequency
        Hz.
    amplitude
        In the unit of the trace.
    features
        As ``summary.json`` of ``granchain spectrum``: peaks, lines, distortion, bandwidth, repetition, window.
    """

    frequency: Floats
    amplitude: Floats
    features: dict[str, Any]

    def line(self, ratio: str) -> dict[str, Any] | None:
        """The line at a ratio of the drive frequency, such as ``"1/3"``; ``None`` where it could not be measured."""
        found = (line for line in self.features["lines"] if str(line["ratio"]) == ratio)
        return next(found, None)

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas frame, indexed by frequency (Hz)."""
        import pandas

        index = pandas.Index(self.frequency, name="frequency_hz")
        return pandas.DataFrame({f"amplitude_{_suffix(self.features['unit'])}": self.amplitude}, index=index)


def as_record(record: Record | StrPath, kind: Kind | None, **reading: Unpack[ReadingOptions]) -> Record:
    """A record, read where a file is named."""
    return record if isinstance(record, Record) else read(record, kind=kind, **reading)


def _si(value: Quantity | None, unit: str) -> float | None:
    if isinstance(value, str):
        raise native.UsageError(f"expected a number in {unit}, found `{value}`")
    return None if value is None else float(value)


def spectrum(
    record: Record | StrPath,
    drive: Record | StrPath | None = None,
    *,
    drive_frequency: float | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> Spectrum:
    """Spectrum and features of a record: lines at fractions of the drive, peaks, distortion, bandwidth.

    Parameters
    ----------
    record
        A record, or its file.
    drive
        The horn's record, which says frequency and window [default: ``horn_tip.csv`` beside a file].
    drive_frequency
        f0, Hz [default: refined from the drive, else as stated, else the strongest line].
    start, stop
        Ends of the window, s [default: where the drive's envelope exceeds half its peak].

    Raises
    ------
    FeatureError
        When there is nothing to measure.
    """
    found = as_record(record, None)
    named = "" if drive is None or isinstance(drive, Record) else os.fspath(drive)
    if drive is None and found._bytes is None and found.kind != "horn-tip":
        beside = Path(found.path).parent / "horn_tip.csv"
        if beside.is_file():
            drive, named = beside, "horn_tip.csv beside it"
    horn = None if drive is None else as_record(drive, "horn-tip", force_frequency=True)
    of_drive = None if horn is None else (horn._record, named or horn.path)
    span = (_si(start, "s"), _si(stop, "s"))
    features = json.loads(native.measure(found._record, of_drive, _si(drive_frequency, "Hz"), span))
    window = features["window"]
    sampling = found.sampling
    frequency, amplitude = native.spectrum(found.values, sampling.start, sampling.step, (window["from_s"], window["to_s"]))
    return Spectrum(frequency, amplitude, features)


def features(
    record: Record | StrPath,
    drive: Record | StrPath | None = None,
    *,
    drive_frequency: float | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> dict[str, Any]:
    """Features of a record: the same numbers as :func:`spectrum`, without the spectrum."""
    return spectrum(record, drive, drive_frequency=drive_frequency, start=start, stop=stop).features
