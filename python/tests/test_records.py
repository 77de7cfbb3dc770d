"""Records: arrays, units, assumptions, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import granchain
from conftest import Program


def test_a_record_has_arrays_in_si_with_unit_sampling_and_what_was_assumed(twin: Path) -> None:
    record = granchain.read(twin / "vib.csv")
    rows = np.genfromtxt(twin / "vib.csv", delimiter=",", comments="#", skip_header=6)
    assert record.unit == "m/s" and record.kind == "vibrometer" and record.bandwidth == 1.5e6
    assert record.time.dtype == record.values.dtype == np.float64
    np.testing.assert_allclose(record.raw[1], rows[:, 1] * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(record.time, rows[:, 0] * 1e-6, atol=1e-12)
    assert record.sampling.rate == pytest.approx(5e6) and record.sampling.count == len(rows) == len(record)
    assert any("trigger" in text for text in record.assumed)


def test_reading_options_are_keywords_and_a_plain_number_is_si(twin: Path) -> None:
    plain = granchain.read(twin / "vib.csv")
    turned = granchain.read(twin / "vib.csv", invert=True, delay=2e-6, baseline="none")
    named = granchain.read(twin / "vib.csv", invert=True, delay="2 us", baseline="none")
    np.testing.assert_array_equal(turned.values, named.values)
    np.testing.assert_array_equal(turned.values, -turned.raw[1])
    np.testing.assert_allclose(turned.time, plain.time - 2e-6, atol=1e-15)


def test_arrays_are_read_as_the_same_samples_in_a_file(twin: Path) -> None:
    record = granchain.read(twin / "vib.csv", drive_frequency=73e3, bandwidth=1.5e6)
    time, values = record.raw
    made = granchain.Record.from_arrays(values * 1e3, unit="mm/s", time=time, drive_frequency=73e3, bandwidth=1.5e6)
    assert made.path == "(array)/vibrometer"
    np.testing.assert_allclose(made.values, record.values, rtol=0, atol=1e-15)
    volts = granchain.Record.from_arrays(values / 0.125, unit="V", sample_rate=5e6, start=-5e-5, scale="125 mm/s/V")
    np.testing.assert_allclose(volts.raw[1], values, rtol=1e-12)
    np.testing.assert_allclose(volts.time, record.time, atol=1e-12)


def test_a_refusal_says_where_and_what_to_pass_in_keywords(tmp_path: Path) -> None:
    scope = tmp_path / "scope.csv"
    scope.write_text("time (s),CH1 (V)\n" + "".join(f"{i * 1e-7:.1e},{i % 7}\n" for i in range(50)))
    with pytest.raises(granchain.RecordError) as refused:
        granchain.read(scope, kind="vibrometer")
    message = str(refused.value)
    assert "scope.csv" in message and "scale='<VALUE> mm/s/V'" in message and "--" not in message, message
    with pytest.raises(granchain.RecordError, match="nowhere.csv"):
        granchain.read("nowhere.csv")
    with pytest.raises(granchain.UsageError, match="baseline"):
        granchain.read(scope, baseline="plateu")  # type: ignore[arg-type]
    assert issubclass(granchain.RecordError, granchain.GranchainError)


def test_features_of_a_record_are_those_of_the_program(lab: Path, program: Program) -> None:
    said = json.loads(program("spectrum", lab / "vib.csv", "--json", "--quiet").stdout)
    spectrum = granchain.spectrum(lab / "vib.csv")
    assert {**spectrum.features, "file": ""} == {**said, "file": ""}
    third = spectrum.line("1/3")
    assert third is not None
    nearest = np.abs(spectrum.frequency - third["frequency_hz"]).argmin()
    assert spectrum.amplitude[nearest] == pytest.approx(third["amplitude"], rel=0.3)
    assert granchain.features(lab / "vib.csv") == spectrum.features
    with pytest.raises(granchain.FeatureError):
        granchain.features(granchain.Record.from_arrays(np.zeros(4000), unit="m/s", sample_rate=5e6, drive_frequency=73e3))


def test_a_saved_record_reads_back_to_the_same_bits(twin: Path, tmp_path: Path) -> None:
    record = granchain.read(twin / "vib.csv")
    record.save(tmp_path / "raw.csv", raw=True)
    np.testing.assert_array_equal(granchain.read(tmp_path / "raw.csv", kind="vibrometer").raw[1], record.raw[1])
    record.save(tmp_path / "vib.uff")
    again = granchain.read(tmp_path / "vib.uff", kind="vibrometer", baseline="none")
    np.testing.assert_array_equal(again.values, record.values)


def test_frames_and_arrays_of_other_packages_hold_the_same_numbers(twin: Path) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    record = granchain.read(twin / "vib.csv")
    frame = record.to_dataframe()
    np.testing.assert_array_equal(frame["velocity_m_per_s"].to_numpy(), record.values)
    array = record.to_xarray()
    assert array.attrs["units"] == "m/s"
    np.testing.assert_array_equal(array.sel(time=slice(0, None)).to_numpy(), record.values[record.time >= 0])


def test_a_record_goes_through_pyuff_and_back(twin: Path, tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    record = granchain.read(twin / "vib.csv")
    pyuff.UFF(str(tmp_path / "theirs.uff")).write_sets(record.to_pyuff())
    back = granchain.Record.from_pyuff(pyuff.UFF(str(tmp_path / "theirs.uff")).read_sets(0), kind="vibrometer", baseline="none")
    np.testing.assert_array_equal(back.values, record.values)
    np.testing.assert_allclose(back.time, record.time, atol=1e-10)
    # Ours, read by pyuff; theirs, read by ours.
    record.save(tmp_path / "ours.uff")
    np.testing.assert_array_equal(pyuff.UFF(str(tmp_path / "ours.uff")).read_sets(1)["data"], record.values)
    ours = granchain.read(tmp_path / "theirs.uff", kind="vibrometer", baseline="none")
    np.testing.assert_array_equal(ours.values, record.values)


def test_masked_samples_are_refused_and_a_mask_without_any_is_read() -> None:
    samples = np.ma.masked_array(np.sin(np.arange(500) * 0.05), mask=False)
    read = granchain.Record.from_arrays(samples, unit="m/s", sample_rate=1e6)
    np.testing.assert_allclose(read.raw[1], samples.data, rtol=1e-12)
    samples[[3, 7]] = np.ma.masked
    with pytest.raises(granchain.UsageError, match="`values`: expected samples without a mask, found masked ones"):
        granchain.Record.from_arrays(samples, unit="m/s", sample_rate=1e6)
    with pytest.raises(granchain.UsageError, match="`time`: expected samples without a mask"):
        granchain.Record.from_arrays(samples.data, unit="m/s", time=np.ma.masked_less(np.arange(500) * 1e-6, 2e-6))


def test_what_is_passed_in_the_wrong_place_is_answered_with_the_right_call() -> None:
    time, values = np.arange(4000) / 5e6, np.sin(2 * np.pi * 73e3 * np.arange(4000) / 5e6)
    call = r"2 arrays by position; write from_arrays\(values, time=time, unit="
    with pytest.raises(TypeError, match=call):
        granchain.Record.from_arrays(time, values)
    with pytest.raises(TypeError, match=call):
        granchain.Record.from_arrays(time, values, unit="m/s")
    with pytest.raises(TypeError, match="no unit"):
        granchain.Record.from_arrays(values, time=time)
    frame = pytest.importorskip("pandas").DataFrame({"time_us": time, "velocity_mm_per_s": values})
    for data in (frame, values, [values], 3.0):
        with pytest.raises(TypeError, match="Record.from_arrays"):
            granchain.spectrum(data)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="Record.from_arrays"):
            granchain.calibrate(data)  # type: ignore[arg-type]


def test_numbers_without_a_unit_are_shown_without_one() -> None:
    alpha = granchain.Parameter(0.7, 0.69, 0.71, 0.7, "1", (0.1, 2.0), False)
    assert str(alpha) == "0.7000   90 % 0.6900 … 0.7100"


def test_a_flag_in_a_message_is_a_keyword_with_its_value_alone() -> None:
    with pytest.raises(granchain.SceneError, match=r"set='chain\.bead=5': unknown key"):
        granchain.Scene("annulus", {"chain.bead": 5})
