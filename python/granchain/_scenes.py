"""Scenes: what stands on the bench and how it is driven; runs of them."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _granchain as native
from ._keywords import ReadingOptions, SampleOptions, StrPath, assignments, text
from ._records import Floats, Kind, Record, Spectrum, as_record

if TYPE_CHECKING:
    import pandas
    import xarray
    from typing_extensions import Unpack

Progress: TypeAlias = Callable[[int, int], object]
"""Called with the work done and all of it; an exception in it stops the work and is raised."""


@dataclass(frozen=True)
class Key:
    """Description of one key of scene files.

    Attributes
    ----------
    name
        Name with its tables, such as ``damping.coefficient``.
    takes
        Values that it takes, in words.
    unit
        SI unit of a plain number; empty if there is none.
    default
        Default value, in words.
    meaning
        Meaning of the key.
    conditions
        Other keys, with the values at which this key has an effect.
    alternative
        A key, with the values that replace the conditions; empty if there is none.
    """

    name: str
    takes: str
    unit: str
    default: str
    meaning: str
    conditions: dict[str, list[str]]
    alternative: dict[str, list[str]]


@dataclass(frozen=True)
class Setting:
    """A key of a scene with its value.

    Attributes
    ----------
    key
        Name of the key.
    value
        Value in SI.
    unit
        SI unit of the value; empty if there is none.
    text
        Value with a unit, such as ``4.8 mm``.
    meaning
        Meaning of the key.
    """

    key: str
    value: Any
    unit: str
    text: str
    meaning: str


def scenes() -> list[str]:
    """Return the names of the built-in scenes."""
    return [name for name, _ in native.built_in()]


def scene_keys() -> list[Key]:
    """Return a description of every key of scene files."""
    either = [(key, [key["alternative"]] if key["alternative"] else []) for key in json.loads(native.keys())]
    return [Key(**{**key, "conditions": dict(key["conditions"]), "alternative": dict(other)}) for key, other in either]


class Scene:
    """A bench and its drive. Keys are read and set as in a ``dict``: a number is SI, a text carries its unit.

    Parameters
    ----------
    source
        Name of a built-in scene (`scenes`), or a scene file.
    settings
        Values of the keys to change.
    drive
        Record of the horn tip, or its file. It drives the piston instead of the scene's own drive.
    model
        ``chain``, ``reduced`` or ``fea`` [default: the scene's, otherwise ``reduced``].
    limits
        Refuse runs with a very large estimated work or memory.
    **reading
        Keywords of `ReadingOptions` for the file of the drive.

    Examples
    --------
    >>> scene = Scene("annulus", {"alpha": 0.5, "damping.coefficient": "0.3 N s/m"})
    >>> scene["alpha"], scene.setting("damping.coefficient").unit
    (0.5, 'N·s/m')

    Raises
    ------
    SceneError
        If a key or value is wrong. The message names file and line or the key, and what was expected and found.
    """

    def __init__(
        self,
        source: StrPath = "annulus",
        settings: Mapping[str, object] | None = None,
        *,
        drive: Record | StrPath | None = None,
        model: str | None = None,
        limits: bool = True,
        **reading: Unpack[ReadingOptions],
    ) -> None:
        self._source = os.fspath(source)
        self._text: str | None = None
        self._limits = limits
        self._drive = None if drive is None else as_record(drive, "horn-tip", **reading)
        self._given: dict[str, str] = {}
        named = {} if model is None else {"model.kind": model}
        self._scene = self._make({**named, **(settings or {})})

    @classmethod
    def from_toml(cls, toml: str, settings: Mapping[str, object] | None = None, *, name: str = "scene.toml") -> Scene:
        """Make a scene from the text of a scene file.

        Parameters
        ----------
        toml
            Text of a scene file.
        settings
            Values of the keys to change.
        name
            Path for messages. Relative paths in the text start at its folder.

        Returns
        -------
        Scene
            The scene.
        """
        scene = cls.__new__(cls)
        scene._source, scene._text, scene._limits, scene._drive, scene._given = name, toml, True, None, {}
        scene._scene = scene._make(settings or {})
        return scene

    def _make(self, settings: Mapping[str, object]) -> native.Scene:
        given = {**self._given, **{key: text(value) for key, value in settings.items()}}
        made = self._native(given, False)
        self._given = given
        self.__dict__.pop("_settings", None)
        return made

    def _native(self, given: Mapping[str, str], chain: bool) -> native.Scene:
        drive = None if self._drive is None else self._drive._record
        return native.Scene(self._source, self._text, assignments(given), drive, chain, self._limits)

    @cached_property
    def _settings(self) -> dict[str, Setting]:
        return {setting["key"]: Setting(**setting) for setting in json.loads(self._scene.settings())}

    def with_settings(self, settings: Mapping[str, object]) -> Scene:
        """Return a copy of the scene with other values of some keys."""
        other = Scene.__new__(Scene)
        other.__dict__.update({key: value for key, value in self.__dict__.items() if key != "_settings"})
        other._given = dict(self._given)
        other._scene = other._make(settings)
        return other

    def setting(self, key: str) -> Setting:
        """Return a key with its value, unit and meaning; raise `SceneError` if it has no effect in this scene."""
        try:
            return self._settings[key]
        except KeyError:
            known = any(key == known.name for known in scene_keys())
            why = "has no effect in this scene" if known else "is no key of a scene; see scene_keys()"
            raise native.SceneError(f"`{key}` {why}") from None

    def __getitem__(self, key: str) -> Any:
        return self.setting(key).value

    def __setitem__(self, key: str, value: object) -> None:
        self._scene = self._make({key: value})

    def __contains__(self, key: object) -> bool:
        return key in self._settings

    def __iter__(self) -> Iterator[str]:
        return iter(self._settings)

    def __len__(self) -> int:
        return len(self._settings)

    def keys(self) -> list[str]:
        """Return the keys that have an effect."""
        return list(self._settings)

    @property
    def settings(self) -> dict[str, Setting]:
        """Every key that has an effect, with value, unit and meaning."""
        return dict(self._settings)

    @property
    def about(self) -> dict[str, Any]:
        """Name, description, model, duration (s), drive frequency (Hz), and effects with their reasons."""
        about: dict[str, Any] = json.loads(self._scene.about())
        return about

    @property
    def assumed(self) -> list[str]:
        """Assumptions made on reading the scene and its drive."""
        return list(self.about["assumed"])

    def to_toml(self) -> str:
        """Return the text of a scene file that reads back as the same scene."""
        return self._scene.to_toml()

    def save(self, path: StrPath) -> None:
        """Write a scene file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")

    def __repr__(self) -> str:
        given = "".join(f", {key}={value}" for key, value in self._given.items())
        return f"<Scene {self._source}{given}>"


def as_scene(
    scene: Scene | StrPath, settings: Mapping[str, object] | None, drive: Record | StrPath | None, model: str | None
) -> Scene:
    """A scene, made where one is named."""
    if not isinstance(scene, Scene):
        return Scene(scene, settings, drive=drive, model=model)
    changed = {**({} if model is None else {"model.kind": model}), **(settings or {})}
    made = scene.with_settings(changed) if changed else scene
    if drive is None:
        return made
    other = made.with_settings({})
    other._drive = as_record(drive, "horn-tip")
    other._scene = other._make({})
    return other


class Run:
    """Response of a scene: the columns of ``response.csv`` by name, on one time grid.

    Examples
    --------
    >>> run = replay("annulus", {"duration": "300 us"})  # doctest: +SKIP
    >>> run["pole_velocity_m_per_s"].max(), run.force.max()  # doctest: +SKIP
    """

    def __init__(self, run: native.Run) -> None:
        self._run = run

    @cached_property
    def time(self) -> Floats:
        """Instants, s."""
        return self._run.time()

    @cached_property
    def columns(self) -> dict[str, Floats]:
        """Every column of ``response.csv`` after the time, SI, by its name."""
        return dict(self._run.columns())

    def __getitem__(self, column: str) -> Floats:
        return self.columns[column]

    @cached_property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of the beads, m, one row for each bead, the first at the piston."""
        return np.array(self._run.displacements())

    @cached_property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity of the beads, m/s, one row for each bead, the first at the piston."""
        return np.array([values for name, values in self.columns.items() if name.startswith("bead")])

    @cached_property
    def force(self) -> NDArray[np.float64]:
        """Force of the contacts, N, positive when pressed, one row for each contact, the first at the piston."""
        return np.array([values for name, values in self.columns.items() if name.endswith("_force_n")])

    @cached_property
    def seen(self) -> Floats:
        """Velocity of the observed point after the scene's vibrometer filter, m/s."""
        return self._run.seen()[1]

    @cached_property
    def _features(self) -> dict[str, Any]:
        features: dict[str, Any] = json.loads(self._run.features())
        return features

    @property
    def features(self) -> dict[str, Any]:
        """Features of `seen`, as ``features`` of ``summary.json``."""
        return dict(self._features["velocity"])

    @property
    def pressure_features(self) -> list[dict[str, Any]]:
        """Features of the pressure at each field point; empty without water."""
        return list(self._features["pressure"])

    @cached_property
    def about(self) -> dict[str, Any]:
        """Model, observed point, energy balance (J), counts of work, and warnings."""
        about: dict[str, Any] = json.loads(self._run.about())
        return about

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance: the work of the piston and where it went, J."""
        return dict(self.about["energy"])

    @property
    def warnings(self) -> list[str]:
        """Warnings about the run."""
        return list(self.about["warnings"])

    def spectrum(self) -> Spectrum:
        """Return the spectrum of `seen` over the window of `features`."""
        time, values = self._run.seen()
        window = self.features["window"]
        step = float(time[1] - time[0])
        frequency, amplitude = native.spectrum(values, float(time[0]), step, (window["from_s"], window["to_s"]))
        return Spectrum(frequency, amplitude, self.features)

    def to_record(self, column: str = "pole_velocity_m_per_s", **reading: Unpack[SampleOptions]) -> Record:
        """Return one column as a record, for example to calibrate against a synthetic record.

        Parameters
        ----------
        column
            Name of a velocity (``_m_per_s``), of the piston's displacement, or of a pressure (``_pa``).
        **reading
            Keywords of `SampleOptions`.

        Returns
        -------
        Record
            The column on the time grid of the run.
        """
        kinds: dict[str, tuple[str, Kind]] = {
            "_m_per_s": ("m/s", "vibrometer"),
            "_displacement_m": ("m", "horn-tip"),
            "_pa": ("Pa", "hydrophone"),
        }
        for end, (unit, kind) in kinds.items():
            if column.endswith(end):
                return Record.from_arrays(self[column], unit=unit, time=self.time, kind=kind, name=column, **reading)
        raise native.RecordError(f"`{column}`: expected a velocity, the piston's displacement or a pressure")

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas data frame with the columns of ``response.csv``, indexed by time (s)."""
        import pandas

        return pandas.DataFrame(self.columns, index=pandas.Index(self.time, name="time_s"))

    def to_xarray(self) -> xarray.Dataset:
        """Return an xarray dataset over time (s), bead and contact (both 1 at the piston)."""
        import xarray

        seconds = ("time", self.time, {"units": "s"})
        beads, contacts = len(self.velocity), len(self.force)
        data = {
            "displacement": (("bead", "time"), self.displacement, {"units": "m"}),
            "velocity": (("bead", "time"), self.velocity, {"units": "m/s"}),
            "force": (("contact", "time"), self.force, {"units": "N"}),
            "seen": ("time", self.seen, {"units": "m/s"}),
            "piston_displacement": ("time", self["piston_displacement_m"], {"units": "m"}),
        }
        coords = {"time": seconds, "bead": np.arange(1, beads + 1), "contact": np.arange(1, contacts + 1)}
        return xarray.Dataset(data, coords=coords, attrs={"model": self.about["model"]})

    def __repr__(self) -> str:
        return f"<Run on the model {self.about['model']}: {len(self.columns)} columns of {len(self.time)} samples>"


def replay(
    scene: Scene | StrPath,
    settings: Mapping[str, object] | None = None,
    *,
    drive: Record | StrPath | None = None,
    model: str | None = None,
    cache: StrPath | None = None,
    progress: Progress | None = None,
) -> Run:
    """Simulate a scene once, as ``granchain replay`` does.

    Parameters
    ----------
    scene
        A scene, or the name or file of one.
    settings
        Values of the keys to change.
    drive
        Record of the horn tip, or its file. It drives the piston instead of the scene's own drive.
    model
        ``chain``, ``reduced`` or ``fea`` [default: the scene's, otherwise ``reduced``].
    cache
        Folder for reduced bodies, or ``"none"`` [default: the program's].
    progress
        Function that is called with the nanoseconds simulated and their total.

    Returns
    -------
    Run
        The response.

    Raises
    ------
    SceneError
        If a key or value is wrong.
    SimulationError
        If the run fails, or needs too much work or memory.

    Examples
    --------
    >>> run = replay("annulus", {"alpha": 0.5}, model="chain")  # doctest: +SKIP
    >>> run.velocity.shape  # doctest: +SKIP
    """
    return Run(native.replay(as_scene(scene, settings, drive, model)._scene, cache, progress))


@dataclass(frozen=True)
class Sweep:
    """Results of runs over a grid; the last axis varies fastest. ``sweep["column"]`` is one column.

    Attributes
    ----------
    columns
        Columns of ``sweep.csv``: swept keys, ``status``, results (SI; NaN if there is none) and ``reason`` of a failure.
    csv
        Text of ``sweep.csv``.
    json
        Content of ``sweep.json``.
    """

    columns: dict[str, NDArray[Any]]
    csv: str
    json: dict[str, Any]

    def __getitem__(self, column: str) -> NDArray[Any]:
        return self.columns[column]

    def __len__(self) -> int:
        return int(self.json["runs"])

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points along each axis."""
        return tuple(len(axis["values"]) for axis in self.json["axes"])

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas data frame with one row for each run."""
        import pandas

        return pandas.DataFrame(self.columns)

    def to_xarray(self) -> xarray.Dataset:
        """Return an xarray dataset over the swept keys."""
        import xarray

        axes = self.json["axes"]
        keys = [axis["key"] for axis in axes]
        coords = {axis["key"]: (axis["key"], axis["values"], {"units": axis["unit"]}) for axis in axes}
        behind = list(self.columns)[len(keys) :]
        return xarray.Dataset({name: (keys, self.columns[name].reshape(self.shape)) for name in behind}, coords=coords)


def _columns(table: str) -> dict[str, NDArray[Any]]:
    header, *rows = csv.reader(io.StringIO(table))

    def column(name: str, cells: Sequence[str]) -> NDArray[Any]:
        if name in ("status", "reason"):
            return np.array(cells, dtype=object)
        try:
            return np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            return np.array(cells, dtype=object)

    return {name: column(name, [row[index] for row in rows]) for index, name in enumerate(header)}


def sweep(
    scene: Scene | StrPath,
    axes: Mapping[str, str | ArrayLike],
    settings: Mapping[str, object] | None = None,
    *,
    drive: Record | StrPath | None = None,
    model: str | None = None,
    ensemble: int | None = None,
    seed: int = 1,
    cache: StrPath | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Simulate a scene over a grid of values, as ``granchain sweep`` does.

    Parameters
    ----------
    scene
        A scene, or the name or file of one.
    axes
        Values of each swept key: an array (SI), a list of texts with units or words, or ``"FIRST:LAST:STEP"``.
    settings
        Values of other keys to change.
    drive
        Record of the horn tip, or its file. It drives the piston instead of the scene's own drive.
    model
        ``chain``, ``reduced`` or ``fea`` [default: the scene's, otherwise ``reduced``].
    ensemble
        Number of chain runs with random gaps and drive at each point, for mean, standard deviation and sensitivity.
    seed
        Seed of the random values.
    cache
        Folder for reduced bodies, or ``"none"`` [default: the program's].
    progress
        Function that is called with the points simulated and their total.

    Returns
    -------
    Sweep
        One row for each point of the grid.

    Raises
    ------
    SceneError
        If a key or value is wrong. A run that fails is reported in the column ``status`` instead.

    Examples
    --------
    >>> table = sweep("annulus", {"alpha": [0.3, 0.4]}, model="chain")  # doctest: +SKIP
    >>> table.columns["alpha"], table.columns["status"]  # doctest: +SKIP
    """
    made = as_scene(scene, settings, drive, model)
    on = made._native(made._given, True) if ensemble is not None else made._scene

    def written(values: str | ArrayLike) -> str:
        if isinstance(values, str):
            return values
        return ",".join(text(value) for value in np.atleast_1d(np.asarray(values)).tolist())

    varied = [f"{key}={written(values)}" for key, values in axes.items()]
    table, about = native.sweep(on, varied, ensemble, seed, cache, progress)
    return Sweep(_columns(table), table, json.loads(about))
