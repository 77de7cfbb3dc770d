"""Where the shipped records are, and the program to compare with."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

Program = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def twin() -> Path:
    """A record of known truth: alpha = 0.7, c = 0.6 N s/m, and the horn's record beside it."""
    return ROOT / "measurements" / "twin-annulus"


@pytest.fixture
def lab() -> Path:
    """The shipped reconstruction."""
    return ROOT / "measurements" / "annulus-73khz"


@pytest.fixture
def program() -> Program:
    """The binary that cargo builds, or the console script of this package where there is none."""
    binary = Path(os.environ.get("GRANCHAIN_BINARY", ROOT / "target" / "release" / "granchain"))

    def run(*arguments: object, code: int = 0) -> subprocess.CompletedProcess[str]:
        command = str(binary) if binary.exists() else "granchain"
        done = subprocess.run([command, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == code, done.stderr
        return done

    return run
