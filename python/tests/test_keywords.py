"""Keywords are the flags of the program, all of them."""

from __future__ import annotations

import inspect
import re

import granchain
import pytest
from conftest import Program
from granchain._keywords import flags, text

# Of the program alone, and those that are called otherwise here.
OF_THE_PROGRAM = {"force", "out", "resume", "dry-run", "strict", "help", "read", "drive-read"}
OTHERWISE = {"set": "settings"}


def listed(program: Program, command: str) -> set[str]:
    return set(re.findall(r"^ {2,6}(?:-\w, )?--([a-z-]+)", program(command, "--help").stdout, re.MULTILINE))


def keys(program: Program, flag: str) -> set[str]:
    refused = program("inspect", "vib.csv", flag, "no_such_key=1", code=2).stderr
    return set(re.findall(r"`(\w+)`", refused.split("expected one of", 1)[1])) - {"column"}


def test_every_key_of_reading_is_a_keyword(program: Program) -> None:
    options = granchain.ReadingOptions.__optional_keys__
    own = {name.replace("-", "_") for name in listed(program, "inspect") - {"kind", "read", "help"}}
    known = keys(program, "--read")
    assert own | known | {"force_frequency"} == options
    of_drive = {name for name in granchain.RecordsOptions.__optional_keys__ if name.startswith("drive_")}
    assert {f"drive_{name}" for name in known} | {"drive_frequency"} == of_drive


def test_every_flag_of_calibrate_is_a_keyword(program: Program) -> None:
    known = set(inspect.signature(granchain.calibrate).parameters) | set(granchain.RecordsOptions.__optional_keys__)
    named = {OTHERWISE.get(name, name.replace("-", "_")) for name in listed(program, "calibrate") - OF_THE_PROGRAM}
    assert named <= known, named - known


def test_a_keyword_that_is_gone_says_what_to_pass() -> None:
    with pytest.raises(granchain.UsageError, match="drive='none'"):
        granchain.calibrate("vib.csv", scene_drive=True)  # type: ignore[call-arg]


def test_numbers_get_the_unit_of_their_flag_and_keep_all_digits() -> None:
    assert flags({"bandwidth": 1.5e6, "delay": -2e-6, "invert": True, "resample": False, "unit": None}) == [
        "--read", "bandwidth=1500000.0 Hz", "--read", "delay=-2e-06 s", "--read", "invert=true",
    ]  # fmt: skip
    assert flags({"drive_trigger": 0.1, "scale": "2 um/V"}) == ["--drive-read", "trigger=0.1 s", "--scale", "2 um/V"]
    assert text([0.1, 1 / 3, "2 nm"]) == "[0.1, 0.3333333333333333, 2 nm]" and text(True) == "true"
