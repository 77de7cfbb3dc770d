"""Calibrations: fitted parameters with intervals, and the verdict on whether the model explains the record."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _granchain as native
from ._keywords import Quantity, RecordsOptions, StrPath, assignments, flags, text
from ._records import Floats, Record, refuse_data
from ._scenes import Progress, Scene

if TYPE_CHECKING:
    import arviz
    import pandas
    import xarray
    from typing_extensions import Unpack


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter in SI.

    Attributes
    ----------
    value
        Jointly most probable value.
    low
        Lower end of the 90 % interval; ``None`` if no interval is quoted.
    high
        Upper end of the 90 % interval; ``None`` if no interval is quoted.
    median
        Marginal median.
    unit
        SI unit; ``1`` for a pure number.
    bounds
        Lower and upper limit of the range of the search.
    at_bound
        Whether the value or its interval touches a limit of the range.
    unidentified
        Whether the interval spans more than 60 % of the range (in logarithms): the record does not determine the parameter.
    """

    value: float
    low: float | None
    high: float | None
    median: float
    unit: str
    bounds: tuple[float, float]
    at_bound: bool
    unidentified: bool = False

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        interval = "" if self.low is None or self.high is None else f"   90 % {self.low:#.4g} … {self.high:#.4g}"
        return f"{self.value:#.4g}{unit}{interval}"


@dataclass(frozen=True)
class Posterior:
    """Posterior as weighted points of a grid, in SI.

    Attributes
    ----------
    parameters
        Names, in the order of the columns of `points`.
    points
        Parameter values, one row for each point.
    weights
        Probability of each point; they sum to 1.
    """

    parameters: list[str]
    points: NDArray[np.float64]
    weights: Floats

    def mean(self) -> dict[str, float]:
        """Return the posterior mean of each parameter, SI."""
        return dict(zip(self.parameters, (self.weights @ self.points).tolist(), strict=True))


@dataclass(frozen=True)
class Runs:
    """Every run of a fit, in the order of its calculation.

    Attributes
    ----------
    parameters
        Names, in the order of the columns of `points`.
    points
        Parameter values, SI, one row for each run.
    misfit
        Mean squared deviation of the features from the record, in SD²; NaN for a failed run.
    failures
        Reason of the failure; ``None`` for a finished run.
    """

    parameters: list[str]
    points: NDArray[np.float64]
    misfit: Floats
    failures: list[str | None]

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas data frame with one row for each run."""
        import pandas

        columns = {name: self.points[:, index] for index, name in enumerate(self.parameters)}
        return pandas.DataFrame({**columns, "misfit": self.misfit, "failure": self.failures})


def _parameter(found: Mapping[str, Any]) -> Parameter:
    return Parameter(**{**found, "bounds": tuple(found["bounds"])})


class Calibration:
    """Result of `calibrate`: verdict, parameters, posterior, report.

    Methods take `law` and `chain`. ``law=0`` is the best of the fitted damping laws (for a pressure combined with mounts of the disc). ``chain=True``
    gives the fit of the chain, from which the fit of the reduced model started.

    Examples
    --------
    >>> outcome = calibrate("vib.csv", "horn_tip.csv", "annulus")  # doctest: +SKIP
    >>> outcome.verdict, outcome.parameters["alpha"].low, outcome.parameters["alpha"].high  # doctest: +SKIP
    >>> outcome.write_report("report")  # doctest: +SKIP
    """

    def __init__(self, calibration: native.Calibration) -> None:
        self._calibration = calibration

    @cached_property
    def json(self) -> dict[str, Any]:
        """Content of ``calibration.json``."""
        outcome: dict[str, Any] = json.loads(self.file("calibration.json"))
        return outcome

    @property
    def laws(self) -> list[dict[str, Any]]:
        """Results of every fitted law, best first."""
        return list(self.json["laws"])

    @property
    def verdict(self) -> str:
        """Verdict: ``within scatter``, ``doubtful``, ``outside scatter`` or ``not converged``."""
        return str(self.json["verdict"])

    @property
    def p_value(self) -> float:
        """p-value of the verdict: share of simulated records that fit as badly as this one or worse."""
        return float(self.json["p_value"])

    @property
    def model(self) -> str:
        """Model that gives the values."""
        return str(self.json["model"])

    @property
    def damping_kind(self) -> str:
        """Damping law of the values."""
        return str(self.json["damping_kind"])

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Fitted parameters by name."""
        return {name: _parameter(found) for name, found in self.json["parameters"].items()}

    @property
    def features(self) -> dict[str, dict[str, Any]]:
        """Features of record and model, SI: ``measured``, ``simulated``, ``scatter``, ``sensitivity``, ``unit``."""
        return dict(self.json.get("features", {}))

    @property
    def diagnosis(self) -> list[dict[str, Any]]:
        """Likely causes if the model does not explain the record, most probable first."""
        return list(self.json.get("diagnosis", []))

    @property
    def statements(self) -> list[str]:
        """Sentences on what the record cannot determine, and which further record would."""
        return list(self.json["statements"])

    @property
    def assumed(self) -> list[str]:
        """Assumptions made on reading."""
        return list(self.json["assumptions"])

    @property
    def warnings(self) -> list[str]:
        """Warnings about the records."""
        return list(self.json.get("warnings", []))

    def posterior(self, law: int = 0, *, chain: bool = False) -> Posterior:
        """Return the posterior as weighted points."""
        points, weights = self._calibration.posterior(law, chain)
        return Posterior(self._calibration.parameters(law), points, weights)

    def samples(self, count: int = 4000, *, seed: int = 1, law: int = 0, chain: bool = False) -> dict[str, Floats]:
        """Draw independent points from the posterior.

        Parameters
        ----------
        count
            Number of points.
        seed
            Seed of the random values.
        law
            Index of the damping law, best first.
        chain
            Whether to use the fit of the chain.

        Returns
        -------
        dict
            One array for each parameter, SI.
        """
        drawn = self._calibration.draw(law, chain, count, seed)
        return {name: np.ascontiguousarray(drawn[:, i]) for i, name in enumerate(self._calibration.parameters(law))}

    def runs(self, law: int = 0, *, chain: bool = False) -> Runs:
        """Return every run of a fit."""
        points, misfit, failures = self._calibration.runs(law, chain)
        return Runs(self._calibration.parameters(law), points, misfit, failures)

    def has_chain(self, law: int = 0) -> bool:
        """Return whether ``chain=True`` is possible: the values come from a more exact model than the chain."""
        return self._calibration.has_below(law)

    @property
    def files(self) -> list[str]:
        """Names of the report's files."""
        return [os.fspath(name) for name in self._calibration.files()]

    def file(self, name: str) -> bytes:
        """Return the bytes of one of `files`; raise ``KeyError`` for another name."""
        found = self._calibration.file(name)
        if found is None:
            raise KeyError(name)
        return found

    def write_report(self, folder: StrPath, *, force: bool = False) -> str:
        """Write the folder that ``granchain calibrate`` writes: ``report.html``, ``calibration.json``, figures and runs.

        Parameters
        ----------
        folder
            Folder to write, as a whole or not at all.
        force
            Also write beside files that granchain did not write.

        Returns
        -------
        str
            Path of the folder.
        """
        return os.fspath(self._calibration.write(folder, force))

    def to_dataframe(self, law: int = 0, *, chain: bool = False) -> pandas.DataFrame:
        """Return every run as a pandas data frame."""
        return self.runs(law, chain=chain).to_dataframe()

    def _attributes(self) -> dict[str, Any]:
        """What goes with the posterior to other programs."""
        return {"verdict": self.verdict, "p_value": self.p_value, "model": self.model, "damping_kind": self.damping_kind}

    def to_xarray(self, count: int = 4000, *, seed: int = 1, law: int = 0, chain: bool = False) -> xarray.Dataset:
        """Return `count` draws from the posterior as an xarray dataset over ``draw``, with units (see `samples`)."""
        import xarray

        units = {name: found["unit"] for name, found in self.laws[law]["parameters"].items()}
        drawn = self.samples(count, seed=seed, law=law, chain=chain)
        data = {name: ("draw", values, {"units": units[name]}) for name, values in drawn.items()}
        return xarray.Dataset(data, coords={"draw": np.arange(count)}, attrs=self._attributes())

    def to_arviz(
        self, count: int = 4000, *, chains: int = 4, seed: int = 1, law: int = 0, chain: bool = False
    ) -> arviz.InferenceData:
        """Return `count` independent draws from the posterior as ArviZ ``InferenceData``, divided among `chains` (see `samples`)."""
        import arviz

        drawn = self.samples(count, seed=seed, law=law, chain=chain)
        dealt = {name: values[: count // chains * chains].reshape(chains, -1) for name, values in drawn.items()}
        data: arviz.InferenceData = arviz.from_dict(posterior=dealt, posterior_attrs=self._attributes())
        return data

    def __repr__(self) -> str:
        shown = (f"{name} {str(parameter).split('   ')[0]}" for name, parameter in self.parameters.items())
        return f"<Calibration {self.verdict}: {', '.join(shown)}>"


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
    # Arrays and data frames are no lists of records.
    one_alone = isinstance(found, (Record, str, os.PathLike)) or hasattr(found, "__array__") or not isinstance(found, Iterable)
    several: list[Any] = [found] if one_alone else list(found)  # type: ignore[arg-type]
    for one in several:
        refuse_data(one)
    return several


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
    """Fit a scene to one or several records, as ``granchain calibrate`` does.

    Parameters
    ----------
    measured
        Record of a vibrometer or hydrophone, a TOML file of published values, or several records to fit together.
    drive
        Record of the horn, for all records or for each [default: ``horn_tip.csv`` beside the record]. ``"none"`` takes the scene's own drive.
    scene
        Scene, or the name or file of one [default: ``annulus``, or ``water`` for a pressure].
    settings
        Values of the scene's keys to change.
    model
        Model that gives the values: ``chain``, ``reduced`` or ``fea`` [default: ``reduced`` for a single velocity record]. ``ladder`` is ``reduced``.
    accuracy
        Instead of `model`, the largest error, such as ``"1%"``: the fastest model and settings that reach it on this scene are used.
    plan
        Plan of the fit (TOML). Keywords win over it.
    quantity
        Recorded quantity [default: ``velocity``].
    fit
        Names of the parameters to fit [default: ``alpha`` and ``damping``].
    bounds
        Range of a parameter by name: lower and upper limit.
    damping
        Damping laws to fit, such as ``["linear", "kuwabara-kono"]`` [default: the scene's].
    uncertainty
        Uncertainty by name of what the laboratory does not control, such as ``{"gap": "0.5 nm"}``.
    evaluations
        Number of runs for each damping law [default: the number with which intervals were tested].
    widen
        Factor, at least 1, on every 90 % interval.
    coverage
        Number of synthetic records of this bench. Their coverage is in ``json["coverage"]``.
    seed
        Seed of the random values [default: 1].
    alpha
        α, the first bead's drive divided by the true horn motion, if it is not fitted.
    limits
        Refuse runs with a very large estimated work or memory.
    cache
        Folder for reduced bodies, or ``"none"`` [default: the program's].
    progress
        Function that is called with the work done and the total, in runs of the chain. An exception in it stops the fit.
    **reading
        Keywords of `RecordsOptions`.

    Returns
    -------
    Calibration
        Verdict, parameters with 90 % intervals, posterior and report.

    Raises
    ------
    RecordError
        If a record cannot be read or fitted.
    SceneError
        If a key or value of the scene is wrong.
    CalibrationError
        If the fit is not possible.
    SimulationError
        If the runs fail.
    UsageError
        If arguments are wrong or contradict each other.

    Examples
    --------
    >>> outcome = calibrate("vib.csv", "horn_tip.csv", "annulus", fit=["alpha", "damping"], model="chain")  # doctest: +SKIP
    >>> outcome.verdict, outcome.parameters["alpha"].value  # doctest: +SKIP
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
