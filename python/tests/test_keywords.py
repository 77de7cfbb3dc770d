"""Keywords are the flags of the program, all of them."""

from __future__ import annotations

import inspect
import re

import granchain
from conftest import Program
from granchain._keywords import flags, text

SESSION = {"json", "quiet", "threads", "cache", "seed", "no-limits", "help"}
# Of the program alone, and those that are called otherwise here.
OF_THE_PROGRAM = {"out", "force", "resume", "dry-run", "strict", "json", "quiet", "threads", "help"}
OTHERWISE = {"input": "drive", "set": "settings", "record-set": "record_settings", "no-limits": "limits"}


def told(program: Program, command: str) -> set[str]:
    return set(re.findall(r"^ {2,6}(?:-\w, )?--([a-z-]+)", program(command, "--help").stdout, re.MULTILINE))


def test_every_flag_of_reading_is_a_keyword(program: Program) -> None:
    options = granchain.ReadingOptions.__optional_keys__
    read = told(program, "inspect") - SESSION - {"kind"}
    assert {name.replace("-", "_") for name in read} - {"column"} | {"channel"} == options
    of_drive = {name for name in granchain.RecordsOptions.__optional_keys__ if name.startswith("drive_")}
    drive = {name for name in told(program, "calibrate") if name.startswith("drive-")} - {"drive-column"}
    assert {name.replace("-", "_") for name in drive} | {"drive_channel"} == of_drive


def test_every_flag_of_calibrate_is_a_keyword(program: Program) -> None:
    known = set(inspect.signature(granchain.calibrate).parameters) | set(granchain.RecordsOptions.__optional_keys__)
    asked = told(program, "calibrate") - OF_THE_PROGRAM - {"column", "drive-column"}
    named = {OTHERWISE.get(name, name.replace("-", "_")) for name in asked}
    assert named <= known, named - known


def test_numbers_get_the_unit_of_their_flag_and_keep_all_digits() -> None:
    assert flags({"bandwidth": 1.5e6, "delay": -2e-6, "invert": True, "resample": False, "unit": None}) == [
        "--bandwidth", "1500000.0 Hz", "--delay=-2e-06 s", "--invert",
    ]  # fmt: skip
    assert flags({"drive_trigger": 0.1, "scale": "2 um/V"}) == ["--drive-trigger", "0.1 s", "--scale", "2 um/V"]
    assert text([0.1, 1 / 3, "2 nm"]) == "[0.1, 0.3333333333333333, 2 nm]" and text(True) == "true"
