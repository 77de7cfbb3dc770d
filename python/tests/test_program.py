"""The programs in the wheel are the binary."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

from conftest import Program

SCRIPTS = Path(sysconfig.get_path("scripts"))


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["scene", "list"], 0), (["inspect", "nowhere.csv"], 1), (["replay", "--frobnicate"], 2), (["calibrate"], 2)],
)
def test_the_script_says_and_ends_as_the_binary_does(arguments: list[str], code: int, program: Program) -> None:
    theirs = program(*arguments, code=code)
    ours = subprocess.run([SCRIPTS / "granchain", *arguments], capture_output=True, text=True, check=False)
    assert (ours.returncode, ours.stdout, ours.stderr) == (code, theirs.stdout, theirs.stderr)
    module = subprocess.run([sys.executable, "-m", "granchain", *arguments], capture_output=True, text=True, check=False)
    assert (module.returncode, module.stdout, module.stderr) == (code, theirs.stdout, theirs.stderr)


def test_calibrate_is_granchain_calibrate() -> None:
    done = subprocess.run([SCRIPTS / "calibrate", "--measured", "nowhere.csv"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "nowhere.csv" in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_ends_the_script_with_130(twin: Path, tmp_path: Path) -> None:
    words: list[str | Path] = ["calibrate", "--measured", twin / "vib.csv", "--model", "reduced", "--out", tmp_path / "fit"]
    running = subprocess.Popen([SCRIPTS / "granchain", *words], stderr=subprocess.PIPE, text=True)
    time.sleep(1.5)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=300)
    assert running.returncode == 130 and "--resume" in said and "Traceback" not in said, said


def test_the_interpreter_ends_while_a_daemon_thread_calibrates(twin: Path) -> None:
    script = f"""
import threading, time, granchain
threading.Thread(target=granchain.calibrate, args=({str(twin / "vib.csv")!r},), daemon=True).start()
time.sleep(1)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
