"""Calibrations: what comes out, and that it is what the program writes, byte by byte."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import granchain
from conftest import ROOT, Program

RUNS = 400


@pytest.fixture(scope="module")
def outcome() -> granchain.Calibration:
    folder = ROOT / "measurements" / "twin-annulus"
    return granchain.calibrate(folder / "vib.csv", folder / "horn_tip.csv", "annulus", model="chain", evaluations=RUNS)


def test_the_truth_of_a_twin_lies_in_the_intervals(outcome: granchain.Calibration) -> None:
    truth = {"alpha": 0.7, "damping": 0.6}
    assert outcome.verdict == "within scatter" and outcome.p_value > 0.05 and outcome.diagnosis == []
    for name, parameter in outcome.parameters.items():
        assert parameter.low is not None and parameter.high is not None
        assert parameter.low < truth[name] < parameter.high and parameter.low < parameter.value < parameter.high
    assert outcome.parameters["damping"].unit == "N s/m"


def test_hits_of_a_striker_are_left_to_another_program(tmp_path: Path) -> None:
    with pytest.raises(granchain.UsageError, match="granchain-impact fit"):
        granchain.calibrate(tmp_path / "hit.csv", scene="impact")


def test_a_report_has_the_bytes_of_the_program_s(
    outcome: granchain.Calibration, tmp_path: Path, program: Program
) -> None:
    arguments = json.loads(outcome.file("manifest.json"))["arguments"]
    program("calibrate", *arguments, "--out", tmp_path / "theirs", "--quiet")
    place = Path(outcome.write_report(tmp_path / "ours"))
    names = {path.relative_to(tmp_path / "theirs") for path in (tmp_path / "theirs").rglob("*") if path.is_file()}
    assert names == {path.relative_to(place) for path in place.rglob("*") if path.is_file()}
    for name in names:
        ours, theirs = (place / name).read_bytes(), (tmp_path / "theirs" / name).read_bytes()
        assert name.name == "timing.json" or ours == theirs, name
    program("verify", place, "--quiet")
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "report.html").write_text("of somebody else")
    with pytest.raises(granchain.GranchainError, match="report.html"):
        outcome.write_report(foreign)


def test_samples_of_the_posterior_have_its_quantiles_and_depend_on_the_seed_alone(outcome: granchain.Calibration) -> None:
    drawn = outcome.samples(20_000, seed=3)
    for name, parameter in outcome.parameters.items():
        assert parameter.low is not None and parameter.high is not None
        width = parameter.high - parameter.low
        low, median, high = np.quantile(drawn[name], [0.05, 0.5, 0.95])
        # 20 000 draws tell a 5 % quantile to a few per cent of the interval.
        assert abs(low - parameter.low) < 0.05 * width and abs(high - parameter.high) < 0.05 * width
        assert abs(median - parameter.median) < 0.05 * width
    np.testing.assert_array_equal(drawn["alpha"], outcome.samples(20_000, seed=3)["alpha"])
    assert not np.array_equal(drawn["alpha"], outcome.samples(20_000, seed=4)["alpha"])
    grid = outcome.posterior()
    assert grid.parameters == ["alpha", "damping"] and grid.points.shape == (len(grid.weights), 2)
    assert grid.weights.sum() == pytest.approx(1.0)
    assert grid.mean()["alpha"] == pytest.approx(float(drawn["alpha"].mean()), rel=2e-3)


def test_every_run_comes_out_with_its_misfit(outcome: granchain.Calibration) -> None:
    runs = outcome.runs()
    assert len(runs.misfit) == len(runs.failures) == len(runs.points) >= RUNS
    assert [math.isnan(misfit) for misfit in runs.misfit] == [failure is not None for failure in runs.failures]
    best = runs.points[np.nanargmin(runs.misfit)]
    assert abs(best[0] - 0.7) < 0.1
    assert not outcome.has_chain()
    with pytest.raises(IndexError):
        outcome.runs(law=1)


def test_arrays_give_to_the_last_bit_what_the_same_samples_in_files_give(twin: Path, tmp_path: Path) -> None:
    vib, horn = granchain.read(twin / "vib.csv"), granchain.read(twin / "horn_tip.csv", kind="horn-tip")
    vib.save(tmp_path / "vib.csv", raw=True)
    horn.save(tmp_path / "tip.csv", raw=True)
    of_files = granchain.calibrate(
        tmp_path / "vib.csv", tmp_path / "tip.csv", "annulus", model="chain", evaluations=RUNS, bandwidth=1.5e6
    )
    measured = granchain.Record.from_arrays(vib.raw[1], unit="m/s", time=vib.raw[0], bandwidth=1.5e6)
    drive = granchain.Record.from_arrays(horn.raw[1], unit="m", time=horn.raw[0], kind="horn-tip")
    of_arrays = granchain.calibrate(measured, drive, "annulus", model="chain", evaluations=RUNS)
    named = {"inputs", "assumptions", "overrides"}
    alike = [{key: value for key, value in it.json.items() if key not in named} for it in (of_files, of_arrays)]
    assert alike[0] == alike[1]
    assert of_files.file("fingerprints.csv") == of_arrays.file("fingerprints.csv")
    inputs = [json.loads(it.file("manifest.json"))["inputs"] for it in (of_files, of_arrays)]
    assert [inputs[0][role]["sha256"] for role in ("measured", "drive")] == [
        inputs[1][role]["sha256"] for role in ("measured", "drive")
    ]
    assert inputs[1]["measured"]["path"] == "(array)/vibrometer" and inputs[1]["drive"]["path"] == "(array)/horn-tip"
    assert of_arrays.verdict == "within scatter"


def test_a_keyword_that_is_of_no_use_is_refused_by_its_name(twin: Path) -> None:
    with pytest.raises(granchain.UsageError, match="evaluations"):
        granchain.calibrate(twin / "vib.csv", evaluations=3)
    with pytest.raises(granchain.UsageError):
        granchain.calibrate()
    with pytest.raises(granchain.UsageError, match="bounds"):
        granchain.calibrate(twin / "vib.csv", model="chain", bounds={"alpha": (0.9, 0.1)})
    with pytest.raises(granchain.UsageError, match="save"):
        granchain.calibrate(twin / "vib.csv", scene=granchain.Scene.from_toml('extends = "annulus"'))
    with pytest.raises(granchain.RecordError, match="nowhere"):
        granchain.calibrate("nowhere.csv")


def test_progress_is_reported_and_stops_the_fit(twin: Path) -> None:
    told: list[tuple[int, int]] = []

    def progress(done: int, everything: int) -> None:
        told.append((done, everything))
        if len(told) == 2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        granchain.calibrate(twin / "vib.csv", model="chain", evaluations=3000, progress=progress)
    assert told[0][0] < told[1][0] < told[1][1]


def test_the_posterior_goes_to_arviz_xarray_and_pandas(outcome: granchain.Calibration) -> None:
    arviz = pytest.importorskip("arviz")
    data = outcome.to_arviz(2000)
    table = arviz.summary(data, hdi_prob=0.9)
    assert table.loc["alpha", "mean"] == pytest.approx(outcome.posterior().mean()["alpha"], rel=1e-2)
    assert data["posterior"].attrs["verdict"] == "within scatter"
    assert outcome.to_xarray(100)["damping"].attrs["units"] == "N s/m"
    assert list(outcome.to_dataframe().columns) == ["alpha", "damping", "misfit", "failure"]
