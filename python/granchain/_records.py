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
    """Instants of an evenly sampled record.

    Attributes
    ----------
    start
        First instant, s.
    step
        Interval between samples, s.
    rate
        Sample rate, Hz.
    count
        Number of samples.
    """

    start: float
    step: float
    rate: float
    count: int


class Record:
    """One record of the laboratory in SI. Motion is positive from piston to support; t = 0 is the trigger.

    `read` and `Record.from_arrays` make it. ``len(record)`` is the number of samples.

    Examples
    --------
    >>> record = read("vib.csv")  # doctest: +SKIP
    >>> record.unit, len(record), record.values.max()  # doctest: +SKIP
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
        *others: ArrayLike,
        unit: str = "",
        time: ArrayLike | None = None,
        sample_rate: float | None = None,
        start: float = 0.0,
        kind: Kind = "vibrometer",
        name: str | None = None,
        **reading: Unpack[SampleOptions],
    ) -> Record:
        """Make a record of samples in memory. They are treated as the same samples in a file.

        Parameters
        ----------
        values
            Samples in `unit`. All else is passed by keyword.
        *others
            None: instants are ``time=``.
        unit
            Unit of the samples (needed): ``"m/s"``, ``"um"``, ``"kPa"``, or ``"V"`` with `scale`.
        time
            Instants, s. Without them pass `sample_rate`.
        sample_rate
            Sample rate, Hz.
        start
            First instant, s, with `sample_rate`.
        kind
            ``vibrometer`` (last bead), ``horn-tip`` or ``hydrophone``.
        name
            Name in messages and reports [default: `kind`].
        **reading
            Keywords of `SampleOptions`.

        Returns
        -------
        Record
            The record in SI.

        Raises
        ------
        UsageError
            If the arguments contradict each other.
        RecordError
            If the samples cannot be used as a record.

        Examples
        --------
        >>> time = np.arange(4000) / 5e6
        >>> record = Record.from_arrays(0.1 * np.sin(2 * np.pi * 73e3 * time), unit="m/s", time=time)  # doctest: +SKIP
        """
        if others or not unit:
            found = f"{1 + len(others)} arrays by position" if others else "no unit"
            raise TypeError(f"from_arrays: expected the samples alone and their unit, found {found}; write from_arrays(values, time=time, unit='mm/s')")
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
        """Samples in `unit`: displacement of a horn tip, velocity of a bead or pressure of a hydrophone."""
        return self._series[1]

    @cached_property
    def raw(self) -> tuple[Floats, Floats]:
        """Instants (s) and samples (SI unit of `recorded`) as they stand in the file."""
        return self._record.raw()

    @property
    def unit(self) -> str:
        """SI unit of `values`."""
        return str(self._about["unit"])

    @property
    def quantity(self) -> str:
        """Quantity of `values`: ``displacement``, ``velocity`` or ``pressure``."""
        return str(self._about["quantity"])

    @property
    def recorded(self) -> str:
        """Quantity of the file's column. The velocity of a horn tip is integrated to a displacement."""
        return str(self._about["recorded"])

    @property
    def kind(self) -> str:
        """Kind of record: ``horn-tip``, ``vibrometer`` or ``hydrophone``."""
        return str(self._about["kind"])

    @property
    def path(self) -> str:
        """Path of the file, or ``(array)/NAME`` for samples in memory."""
        return self._path

    @property
    def sha256(self) -> str:
        """SHA-256 of the file's bytes."""
        return str(self._about["sha256"])

    @property
    def sampling(self) -> Sampling:
        """First instant, interval and number of the samples."""
        return Sampling(**self._about["sampling"])

    @property
    def assumed(self) -> list[str]:
        """Assumptions made on reading, one sentence each."""
        return list(self._about["assumed"])

    @property
    def warnings(self) -> list[str]:
        """Warnings: what was found, why it matters, what to do."""
        return list(self._about["warnings"])

    @property
    def noise_rms(self) -> float:
        """Noise, rms in `unit`; 0 if unknown."""
        return float(self._about["noise_rms"])

    @property
    def bandwidth(self) -> float | None:
        """−6 dB bandwidth of the vibrometer, Hz; ``None`` if not stated."""
        found = self._about["bandwidth"]
        return None if found is None else float(found)

    @property
    def drive_frequency(self) -> float | None:
        """Drive frequency f0, Hz: as stated, otherwise the strongest line of a horn's record."""
        found = self._about["drive_frequency"]
        return None if found is None else float(found)

    @property
    def about(self) -> dict[str, Any]:
        """All metadata: baseline, clipping, columns, comments and so on."""
        return dict(self._about)

    def __len__(self) -> int:
        return self.sampling.count

    def __repr__(self) -> str:
        sampling = self.sampling
        return f"<Record {self.path}: {self.quantity} in {self.unit}, {sampling.count} samples at {sampling.rate:.6g} Hz>"

    def save(self, path: StrPath, *, raw: bool = False) -> None:
        """Write the record as a table (``.csv``) or as a universal file (``.uff``, ``.unv``; data set 58b).

        Parameters
        ----------
        path
            File to write. Its ending decides the format.
        raw
            Write the samples as they stood in the file.

        Examples
        --------
        >>> record.save("vib.uff")  # doctest: +SKIP
        """
        if os.fspath(path).lower().endswith((".uff", ".unv")):
            content = native.universal(self._record, self.path, raw)
        else:
            time, values = self.raw if raw else self._series
            unit = self._about["recorded_unit"] if raw else self.unit
            content = native.table(time, values, self.recorded if raw else self.quantity, unit)
        Path(path).write_bytes(content)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas data frame with one column, indexed by time (s)."""
        import pandas

        index = pandas.Index(self.time, name="time_s")
        return pandas.DataFrame({f"{self.quantity}_{_suffix(self.unit)}": self.values}, index=index)

    def to_xarray(self) -> xarray.DataArray:
        """Return an xarray array over time (s), with unit, path, SHA-256 and assumptions as attributes."""
        import xarray

        return xarray.DataArray(
            self.values,
            coords={"time": ("time", self.time, {"units": "s"})},
            dims="time",
            name=self.quantity,
            attrs={"units": self.unit, "path": self.path, "sha256": self.sha256, "assumed": self.assumed},
        )

    def to_pyuff(self) -> dict[str, Any]:
        """Return a data set 58 for pyuff: ``pyuff.UFF(path).write_sets(record.to_pyuff())``. The file must not exist yet."""
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
        """Make a record of a data set 58 that pyuff has read.

        Parameters
        ----------
        dataset
            One of ``pyuff.UFF(path).read_sets()``.
        kind
            ``vibrometer`` (last bead), ``horn-tip`` or ``hydrophone``.
        unit
            Unit of the samples [default: the set's, otherwise the SI unit of its quantity].
        **reading
            Keywords of `SampleOptions`.

        Returns
        -------
        Record
            The record in SI.

        Raises
        ------
        RecordError
            If the set is no time response or has no unit.
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
    """Read a record: a text table, a universal file, or an oscilloscope's own file.

    Parameters
    ----------
    path
        File to read.
    kind
        ``vibrometer`` (last bead), ``horn-tip`` or ``hydrophone`` [default: from the file's name and units].
    **reading
        Keywords of `ReadingOptions`. A number is SI, a text carries its unit.

    Returns
    -------
    Record
        The record in SI, with its assumptions and warnings.

    Raises
    ------
    RecordError
        If the file cannot be read. The message names file, line, column, what was expected and found, and what to pass.

    Examples
    --------
    >>> record = read("scope.csv", channel="CH2", scale="125 mm/s/V", delay="4 us")  # doctest: +SKIP
    >>> record.time, record.values, record.unit, record.assumed  # doctest: +SKIP
    """
    options = flags({"kind": kind, **reading})
    return Record(native.read(path, options), os.fspath(path), options)


@dataclass(frozen=True)
class Spectrum:
    """Amplitude spectrum of a trace, with its features.

    Attributes
    ----------
    frequency
        Frequencies, Hz.
    amplitude
        Amplitudes in the unit of the trace.
    features
        Features as in ``summary.json`` of ``granchain spectrum``: peaks, lines, distortion, bandwidth, repetition, window.
    """

    frequency: Floats
    amplitude: Floats
    features: dict[str, Any]

    def line(self, ratio: str) -> dict[str, Any] | None:
        """Return the line at a ratio of the drive frequency.

        Parameters
        ----------
        ratio
            Text such as ``"1/3"``.

        Returns
        -------
        dict or None
            ``ratio``, ``frequency_hz``, ``amplitude`` (SI), ``relative`` and ``db``; ``None`` if the line could not be measured.
        """
        found = (line for line in self.features["lines"] if str(line["ratio"]) == ratio)
        return next(found, None)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas data frame of the amplitudes, indexed by frequency (Hz)."""
        import pandas

        index = pandas.Index(self.frequency, name="frequency_hz")
        return pandas.DataFrame({f"amplitude_{_suffix(self.features['unit'])}": self.amplitude}, index=index)


def refuse_data(found: object) -> None:
    """Raise ``TypeError`` if this is neither a record nor the path of one."""
    if not isinstance(found, (Record, str, os.PathLike)):
        raise TypeError(
            f"expected a granchain.Record or the path of a file, found {type(found).__name__}; "
            "make a record of arrays: granchain.Record.from_arrays(values, time=time, unit='mm/s')"
        )


def as_record(record: Record | StrPath, kind: Kind | None, **reading: Unpack[ReadingOptions]) -> Record:
    """A record, read where a file is named."""
    refuse_data(record)
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
    """Compute spectrum and features of a record: lines at fractions of the drive frequency, peaks, distortion, bandwidth.

    Parameters
    ----------
    record
        A record, or its file.
    drive
        Record of the horn, which gives drive frequency and window [default: ``horn_tip.csv`` beside a file].
    drive_frequency
        Drive frequency f0, Hz [default: from `drive`, otherwise as stated, otherwise the strongest line].
    start
        Beginning of the window, s [default: where the drive's envelope rises above half its peak].
    stop
        End of the window, s [default: where that envelope falls below half its peak].

    Returns
    -------
    Spectrum
        Frequencies, amplitudes and features.

    Raises
    ------
    FeatureError
        If there is nothing to measure.

    Examples
    --------
    >>> spectrum("vib.csv").line("1/3")["db"]  # doctest: +SKIP
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
    """Compute the features of a record. Arguments and numbers are those of `spectrum`.

    Returns
    -------
    dict
        ``Spectrum.features``.
    """
    return spectrum(record, drive, drive_frequency=drive_frequency, start=start, stop=stop).features
