"""Scenes and runs of them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import granchain
from conftest import Program


def test_every_key_of_the_table_has_a_meaning_and_built_in_scenes_use_some_of_them() -> None:
    keys = {key.name: key for key in granchain.scene_keys()}
    assert {"rigid", "annulus", "chain", "water"} <= set(granchain.scenes())
    assert all(key.meaning for key in keys.values()) and keys["alpha"].takes == "a number"
    for name in granchain.scenes():
        scene = granchain.Scene(name)
        assert len(scene) > 20 and scene["chain.beads"] >= 1, name
        assert set(scene.keys()) - set(keys) <= {key for key in scene.keys() if key.startswith("materials.")}


def test_keys_are_read_and_set_in_si_or_with_a_unit() -> None:
    scene = granchain.Scene("annulus", {"alpha": 0.5})
    scene["duration"] = "300 us"
    scene["chain.beads"] = np.int64(5)
    assert scene["alpha"] == 0.5 and scene["duration"] == pytest.approx(300e-6) and scene["chain.beads"] == 5
    assert scene.setting("duration").unit == "s"
    other = scene.with_settings({"alpha": 0.7})
    assert (other["alpha"], scene["alpha"], other["chain.beads"]) == (0.7, 0.5, 5)
    assert granchain.Scene.from_toml(other.to_toml())["alpha"] == 0.7


@pytest.mark.parametrize(
    ("key", "value", "said"), [("chian.beads", 5, "chain.beads"), ("alpha", "3 m", "alpha"), ("chain.beads", -1, "chain.beads")]
)
def test_a_scene_that_cannot_be_is_refused_with_the_key(key: str, value: object, said: str) -> None:
    scene = granchain.Scene("annulus")
    with pytest.raises(granchain.SceneError, match=said):
        scene[key] = value
    assert scene["alpha"] > 0


def test_a_run_has_the_bits_of_the_program_s_response(tmp_path: Path, program: Program) -> None:
    sets = {"model.kind": "chain", "alpha": 0.5, "damping.coefficient": "0.3 N s/m", "duration": "200 us"}
    flags = [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
    program("replay", "--scene", "annulus", *flags, "--out", tmp_path / "run", "--quiet")
    run = granchain.replay("annulus", sets)
    header = (tmp_path / "run" / "response.csv").read_text().splitlines()[0].split(",")
    table = np.loadtxt(tmp_path / "run" / "response.csv", delimiter=",", skiprows=1)
    assert header == ["time_s", *run.columns]
    assert run.time.tobytes() == table[:, 0].tobytes()
    for index, name in enumerate(header[1:], start=1):
        assert run[name].tobytes() == np.ascontiguousarray(table[:, index]).tobytes(), name
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert run.features == summary["features"] and run.energy == summary["energy"]


def test_a_horn_s_record_drives_a_scene_as_it_does_in_the_program(twin: Path, tmp_path: Path, program: Program) -> None:
    program("replay", "--scene", "annulus", "--model", "chain", "--drive", twin / "horn_tip.csv", "--out", tmp_path / "run", "--quiet")
    table = np.loadtxt(tmp_path / "run" / "response.csv", delimiter=",", skiprows=1)
    run = granchain.replay("annulus", drive=twin / "horn_tip.csv", model="chain")
    assert run["pole_velocity_m_per_s"].tobytes() == np.ascontiguousarray(table[:, 8]).tobytes()
    assert run.about["drive_origin"] is not None
    with pytest.raises(granchain.UsageError, match="drive.amplitude"):
        granchain.replay("annulus", {"drive.amplitude": "1 um"}, drive=twin / "horn_tip.csv")


def test_a_run_has_shapes_and_goes_into_frames_and_datasets() -> None:
    run = granchain.replay("annulus", {"model.kind": "chain", "duration": "100 us"})
    beads = len(run.velocity)
    assert run.displacement.shape == run.velocity.shape == (beads, len(run.time)) and len(run.force) == beads + 1
    # Velocity is the rate of the displacement.
    rate = np.gradient(run.displacement[0], run.time)
    assert np.abs(rate - run.velocity[0]).max() < 0.05 * np.abs(run.velocity[0]).max()
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    np.testing.assert_array_equal(run.to_dataframe()["contact1_force_n"].to_numpy(), run.force[0])
    dataset = run.to_xarray()
    np.testing.assert_array_equal(dataset["velocity"].sel(bead=1).to_numpy(), run.velocity[0])


def test_a_sweep_has_the_table_of_the_program(tmp_path: Path, program: Program) -> None:
    program("sweep", "--scene", "rigid", "--model", "chain", "--vary", "alpha=0.5,1", "--vary", "chain.beads=2,3", "--out", tmp_path / "s", "--quiet")
    told: list[tuple[int, int]] = []
    swept = granchain.sweep("rigid", {"alpha": [0.5, 1], "chain.beads": np.array([2, 3])}, model="chain", progress=lambda done, all_: told.append((done, all_)))
    assert swept.csv == (tmp_path / "s" / "sweep.csv").read_text()
    assert swept.shape == (2, 2) and len(swept) == 4 and swept["alpha"].tolist() == [0.5, 0.5, 1, 1]
    assert told == [] or told[-1][1] == 4
    pytest.importorskip("xarray")
    peaks = swept.to_xarray()["positive_peak_m_per_s"]
    assert float(peaks.sel({"alpha": 1.0, "chain.beads": 3.0})) == swept["positive_peak_m_per_s"][3]


def test_a_run_that_cannot_be_ends_in_a_simulation_error() -> None:
    with pytest.raises(granchain.SimulationError, match="limits=False"):
        granchain.replay("annulus", {"model.kind": "chain", "duration": "1 s", "chain.beads": 200})


def test_other_threads_run_while_a_run_is_computed() -> None:
    ticks, ended = [0], threading.Event()

    def tick() -> None:
        while not ended.is_set():
            ticks[0] += 1
            time.sleep(1e-3)

    ticking = threading.Thread(target=tick)
    ticking.start()
    granchain.replay("annulus", {"model.kind": "chain", "duration": "20 ms"})
    ended.set()
    ticking.join()
    assert ticks[0] > 20


def test_an_exception_of_the_progress_stops_the_work_and_is_raised() -> None:
    def refuse(done: int, all_: int) -> None:
        raise LookupError(f"{done} of {all_}")

    with pytest.raises(LookupError, match=" of 400000000"):
        granchain.replay("annulus", {"model.kind": "chain", "duration": "400 ms"}, progress=refuse)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_is_a_keyboard_interrupt() -> None:
    script = (
        "import granchain\n"
        "scene = granchain.Scene('annulus', {'model.kind': 'chain', 'duration': '2 s', 'output_step': '10 us'}, limits=False)\n"
        "print('go', flush=True)\n"
        "try:\n    granchain.replay(scene)\n"
        "except KeyboardInterrupt:\n    print('stopped', flush=True)\n"
    )
    running = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None and running.stdout.readline() == "go\n"
    time.sleep(0.5)
    running.send_signal(signal.SIGINT)
    out, _ = running.communicate(timeout=300)
    assert out == "stopped\n" and running.returncode == 0


def test_a_wrong_scene_of_a_plan_is_a_scene_error_that_names_its_line(tmp_path: Path, twin: Path) -> None:
    plan = tmp_path / "p.toml"
    plan.write_text(f"measured = {str(twin / 'vib.csv')!r}\nset = ['chain.beads=six']\n")
    with pytest.raises(granchain.SceneError, match=r"p\.toml:2: `set`, chain\.beads=six"):
        granchain.calibrate(plan=plan)
