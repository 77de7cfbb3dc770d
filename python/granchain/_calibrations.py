"""Calibrations: which drive level, damping and more make the model answer like the record, how sure that is, and whether it explains the record."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _granchain as native
from ._keywords import Quantity, RecordsOptions, StrPath, assignments, flags, text
from ._records import Floats, Record
from ._scenes import Progress, Scene

if TYPE_CHECKING:
    import arviz
    import pandas
    import xarray
    from typing_extensions import Unpack


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter, SI.

    Attributes
    ----------
    value
        The jointly most likely value.
    low, high
        Ends of the 90 % interval; ``None`` where no interval means anything.
    median
        Marginal median.
    unit
        SI unit, ``1`` for a pure number.
    bounds
        Of the search.
    at_bound
        Whether value or interval touches a bound.
    unidentified
        Whether the interval is hardly narrower than the box: the record says nothing of it.
    """

    value: float
    low: float | None
    high: float | None
    median: float
    unit: str
    bounds: tuple[float, float]
    at_bound: bool
    unidentified: bool = False


@dataclass(frozen=True)
class Posterior:
    """A posterior on its grid, SI.

    Attributes
    ----------
    parameters
        Names, in the order of the columns of `points`.
    points
        Centres of the cells, a row a cell.
    weights
        Probability of each cell; they sum to 1.
    """

    parameters: list[str]
    points: NDArray[np.float64]
    weights: Floats

    def mean(self) -> dict[str, float]:
        """Mean of each parameter."""
        return dict(zip(self.parameters, (self.weights @ self.points).tolist(), strict=True))


@dataclass(frozen=True)
class Runs:
    """Every run of a fit, in the order made.

    Attributes
    ----------
    parameters
        Names, in the order of the columns of `points`.
    points
        Values, SI, a row a run.
    misfit
        In scatters of a single run; NaN of a failed run.
    failures
        Why a run failed; ``None`` of a finished one.
    """

    parameters: list[str]
    points: NDArray[np.float64]
    misfit: Floats
    failures: list[str | None]

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas frame, a row a run."""
        import pandas

        columns = {name: self.points[:, index] for index, name in enumerate(self.parameters)}
        return pandas.DataFrame({**columns, "misfit": self.misfit, "failure": self.failures})


def _parameter(found: Mapping[str, Any]) -> Parameter:
    return Parameter(**{**found, "bounds": tuple(found["bounds"])})


class Calibration:
    """What came of a calibration.

    A law is a damping law, on a mount of the disc where mounts compete; ``law=0`` is the best one. ``chain=True`` asks for the fit of the chain
    from which the answer of the reduced model started.
    """

    def __init__(self, calibration: native.Calibration) -> None:
        self._calibration = calibration

    @cached_property
    def json(self) -> dict[str, Any]:
        """``calibration.json``."""
        outcome: dict[str, Any] = json.loads(self.file("calibration.json"))
        return outcome

    @property
    def laws(self) -> list[dict[str, Any]]:
        """What the fit of every law says, best first."""
        return list(self.json["laws"])

    @property
    def verdict(self) -> str:
        """``within scatter``, ``doubtful``, ``outside scatter``, ``not converged``."""
        return str(self.json["verdict"])

    @property
    def p_value(self) -> float:
        """Share of right records that are as far from the model as this one."""
        return float(self.json["p_value"])

    @property
    def model(self) -> str:
        """The model that answers."""
        return str(self.json["model"])

    @property
    def damping_kind(self) -> str:
        """The damping law of the answer."""
        return str(self.json["damping_kind"])

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The fitted parameters by name."""
        return {name: _parameter(found) for name, found in self.json["parameters"].items()}

    @property
    def features(self) -> dict[str, dict[str, Any]]:
        """Watched features of record and model, SI."""
        return dict(self.json.get("features", {}))

    @property
    def diagnosis(self) -> list[dict[str, Any]]:
        """What would explain the record where the model does not, likeliest first."""
        return list(self.json.get("diagnosis", []))

    @property
    def statements(self) -> list[str]:
        """What the data cannot separate, and which further record would."""
        return list(self.json["statements"])

    @property
    def assumed(self) -> list[str]:
        """What was understood and assumed on reading."""
        return list(self.json["assumptions"])

    @property
    def warnings(self) -> list[str]:
        """What looks wrong in the records, though they could be read."""
        return list(self.json.get("warnings", []))

    def posterior(self, law: int = 0, *, chain: bool = False) -> Posterior:
        """The posterior on its grid: weighted points."""
        points, weights = self._calibration.posterior(law, chain)
        return Posterior(self._calibration.parameters(law), points, weights)

    def samples(self, count: int = 4000, *, seed: int = 1, law: int = 0, chain: bool = False) -> dict[str, Floats]:
        """Points drawn from the posterior, independent of one another, by parameter, SI; the same seed draws the same."""
        drawn = self._calibration.draw(law, chain, count, seed)
        return {name: np.ascontiguousarray(drawn[:, i]) for i, name in enumerate(self._calibration.parameters(law))}

    def runs(self, law: int = 0, *, chain: bool = False) -> Runs:
        """Every run of a fit."""
        points, misfit, failures = self._calibration.runs(law, chain)
        return Runs(self._calibration.parameters(law), points, misfit, failures)

    def has_chain(self, law: int = 0) -> bool:
        """Whether a fit of the chain stands below the answer."""
        return self._calibration.has_below(law)

    @property
    def files(self) -> list[str]:
        """Names of the files of the report."""
        return [os.fspath(name) for name in self._calibration.files()]

    def file(self, name: str) -> bytes:
        """The bytes of one of them."""
        found = self._calibration.file(name)
        if found is None:
            raise KeyError(name)
        return found

    def write_report(self, folder: StrPath, *, force: bool = False) -> str:
        """Write the folder that ``granchain calibrate`` writes: ``report.html``, ``calibration.json``, figures, every run.

        Parameters
        ----------
        folder
            Appears whole or not at all.
        force
            Write beside files that granchain did not write.

        Returns
        -------
        str
            Its place.
        """
        return os.fspath(self._calibration.write(folder, force))

    def to_dataframe(self, law: int = 0, *, chain: bool = False) -> pandas.DataFrame:
        """Every run as a pandas frame."""
        return self.runs(law, chain=chain).to_dataframe()

    def _attributes(self) -> dict[str, Any]:
        """What goes with the posterior to other programs."""
        return {"verdict": self.verdict, "p_value": self.p_value, "model": self.model, "damping_kind": self.damping_kind}

    def to_xarray(self, count: int = 4000, *, seed: int = 1, law: int = 0, chain: bool = False) -> xarray.Dataset:
        """Draws from the posterior as an xarray dataset over ``draw``."""
        import xarray

        units = {name: found["unit"] for name, found in self.laws[law]["parameters"].items()}
        drawn = self.samples(count, seed=seed, law=law, chain=chain)
        data = {name: ("draw", values, {"units": units[name]}) for name, values in drawn.items()}
        return xarray.Dataset(data, coords={"draw": np.arange(count)}, attrs=self._attributes())

    def to_arviz(
        self, count: int = 4000, *, chains: int = 4, seed: int = 1, law: int = 0, chain: bool = False
    ) -> arviz.InferenceData:
        """Draws from the posterior as ArviZ ``InferenceData``: `count` in all, independent of one another, dealt out to `chains`."""
        import arviz

        drawn = self.samples(count, seed=seed, law=law, chain=chain)
        dealt = {name: values[: count // chains * chains].reshape(chains, -1) for name, values in drawn.items()}
        data: arviz.InferenceData = arviz.from_dict(posterior=dealt, posterior_attrs=self._attributes())
        return data

    def __repr__(self) -> str:
        return f"<Calibration {self.verdict}: {', '.join(f'{n} {p.value:.4g} {p.unit}' for n, p in self.parameters.items())}>"


def _named(records: Sequence[Record | StrPath]) -> tuple[list[str], list[bytes | None], list[str]]:
    """Paths, contents of those in memory, and the flags by which they were read."""
    options = [_reading(record) if isinstance(record, Record) else [] for record in records]
    if any(other != options[0] for other in options[1:]):
        raise native.UsageError(
            "expected records that are read the same way, found some that are not; say how each is read in a plan: calibrate(plan='plan.toml')"
        )
    paths = [record.path if isinstance(record, Record) else os.fspath(record) for record in records]
    contents = [record._bytes if isinstance(record, Record) else None for record in records]
    return paths, contents, options[0] if options else []


def _reading(record: Record) -> list[str]:
    """How it was read, but for its kind, which its place says."""
    options = list(record._options)
    if "--kind" in options:
        at = options.index("--kind")
        del options[at : at + 2]
    return options


# Flags that hold for record and drive alike.
_SHARED = {"--drive-frequency", "--bench"}

# Keywords of earlier versions, and what takes their place.
_REMOVED = {
    "record_settings": "`set` of a [[record]] in a plan, given as `plan`",
    "scene_drive": "drive='none'",
    "confirm": "model='fea'",
    "features": "`features` of a plan, given as `plan`",
    "mount": "`mount` of a plan, given as `plan`",
    "search": "nothing: the search is the one whose intervals were tested",
}


def _of_drive(options: Sequence[str], present: Sequence[str]) -> list[str]:
    """Flags of a record as those of a drive, without the shared ones that are `present`."""
    words: list[str] = []
    rest = iter(options)
    for word in rest:
        name, joined, value = word.partition("=")
        value = value if joined else next(rest)
        if name in _SHARED:
            words += [] if name in present else [name, value]
        else:
            words += ["--drive-read", value if name == "--read" else f"{name[2:].replace('-', '_')}={value}"]
    return words


def _several(found: Record | StrPath | Sequence[Record | StrPath] | None) -> list[Record | StrPath]:
    if found is None:
        return []
    return [found] if isinstance(found, (Record, str, os.PathLike)) else list(found)


def calibrate(
    measured: Record | StrPath | Sequence[Record | StrPath] | None = None,
    drive: Record | StrPath | Sequence[Record | StrPath] | None = None,
    scene: Scene | StrPath | None = None,
    settings: Mapping[str, object] | None = None,
    *,
    model: Literal["chain", "ladder", "reduced", "fea"] | None = None,
    accuracy: str | None = None,
    plan: StrPath | None = None,
    quantity: Literal["velocity", "pressure"] | None = None,
    fit: Sequence[str] = (),
    bounds: Mapping[str, tuple[Quantity, Quantity]] | None = None,
    damping: Sequence[str] = (),
    uncertainty: Mapping[str, Quantity] | None = None,
    evaluations: int | None = None,
    widen: float | None = None,
    coverage: int | None = None,
    seed: int | None = None,
    alpha: float | None = None,
    limits: bool = True,
    cache: StrPath | None = None,
    progress: Progress | None = None,
    **reading: Unpack[RecordsOptions],
) -> Calibration:
    """Fit a scene to a record, or to several: ``granchain calibrate``.

    Parameters
    ----------
    measured
        Record of a vibrometer or hydrophone, a TOML file of published features, or several records that are fitted together.
    drive
        The horn's record of it, or of each [default: ``horn_tip.csv`` beside the record]; ``"none"`` for the scene's own drive.
    scene, settings
        What stands on the bench [default: ``annulus``, or ``water`` for a pressure], and keys changed in it.
    model
        ``chain``: the chain searches and answers. ``ladder``: the chain searches, the reduced model answers [default, of one record].
    accuracy
        In place of `model` the cheapest model and settings whose error, measured on the built-in scene, is at most this, such as ``"1%"``.
    plan
        Plan of the fit (TOML); keywords win over it.
    quantity
        Recorded quantity [default: velocity].
    fit
        Names of the parameters to fit [default: alpha and damping].
    bounds
        Range (lower and upper limit) of a parameter, by name.
    damping
        Damping laws to fit.
    uncertainty
        What the bench leaves open, drawn into every run, by name.
    evaluations
        Runs a law [default: the number whose intervals were tested].
    widen
        Factor, at least 1, on every 90 % interval.
    coverage
        Number of synthetic records of this bench with which coverage is counted: ``json["coverage"]``.
    seed
        Of everything drawn [default: 1].
    alpha
        Amplitude scale, where it is not fitted.
    limits
        Whether runs that are estimated to take more work or memory than is sensible are refused.
    cache
        Folder in which reduced bodies are kept, or ``"none"``.
    progress
        Told of the work done and of all of it, in runs of the chain. An exception in it, or Ctrl-C, stops the fit.
    **reading
        How the records are read, and with ``drive_`` before it how the horn's.

    Raises
    ------
    RecordError, SceneError, CalibrationError, SimulationError, UsageError
        With place, what was expected and found, and what to pass.
    """
    for name, instead in _REMOVED.items():
        if name in reading:
            raise native.UsageError(f"`{name}` is gone; instead of it pass {instead}")
    records, drives = _several(measured), _several(drive)
    if isinstance(scene, Scene):
        if scene._text is not None:
            raise native.UsageError(
                "a scene from a text has no file that a report could name; write it with scene.save(path) and pass the path"
            )
        if scene._drive is not None and not drives:
            drives = [scene._drive]
        settings = {**scene._given, **(settings or {})}
        limits = limits and scene._limits
        scene = scene._source
    paths, contents, of_records = _named(records)
    drive_paths, drive_contents, of_drives = _named(drives)
    rung = {"chain": "chain", "ladder": "reduced", "reduced": "reduced", "fea": "fea", None: None}[model]
    words = [word for path in paths for word in flags({"measured": path})]
    if len(drive_paths) == 1:
        # One for all records.
        words += flags({"drive": drive_paths[0]})
        drive_contents *= max(len(paths), 1)
    else:
        words += [word for path in drive_paths for word in flags({"drive": path})]
    words += flags({"plan": plan, "scene": scene, "model": rung, "accuracy": accuracy, "quantity": quantity})
    for assignment in assignments(settings):
        words += ["--set", assignment]
    lists = {"fit": fit, "damping": damping}
    words += flags({name: ",".join([names] if isinstance(names, str) else names) or None for name, names in lists.items()})
    for name, (low, high) in (bounds or {}).items():
        words += ["--bounds", f"{name}={text(low)}:{text(high)}"]
    for name, value in (uncertainty or {}).items():
        words += ["--uncertainty", f"{name}={text(value)}"]
    words += flags({"evaluations": evaluations, "widen": widen, "coverage": coverage, "seed": seed})
    words += flags({"alpha": alpha, "no_limits": not limits})
    words += of_records + _of_drive(of_drives, of_records) + flags(reading)
    return Calibration(native.calibrate(words, cache, contents, drive_contents, progress))
