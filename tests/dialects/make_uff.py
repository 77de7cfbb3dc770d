"""Makes the universal files in this folder with pyuff, from plain.csv; and checks with pyuff what granchain writes.

    pip install pyuff==2.5.8
    python3 tests/dialects/make_uff.py
    granchain convert tests/dialects/plain.csv /tmp/out.uff --text
    python3 tests/dialects/make_uff.py /tmp/out.uff     # exits 1 unless pyuff reads plain.csv's samples from it
"""

import pathlib
import sys

import numpy as np
import pyuff

here = pathlib.Path(__file__).parent
rows = np.loadtxt(here / "plain.csv", delimiter=",", skiprows=1)
time, velocity = rows[:, 0] * 1e-6, rows[:, 1]


def check(path):
    sets = pyuff.UFF(path).read_sets()
    sets = sets if isinstance(sets, list) else [sets]
    function = next(it for it in sets if it["type"] == 58)
    assert function["func_type"] == 1 and function["abscissa_spec_data_type"] == 17
    factor = {8: None, 11: 1e-3}[function["ordinate_spec_data_type"]]
    assert function["ordinate_axis_units_lab"].strip() == "m/s"
    instants, values = np.max(np.abs(function["x"] - time)), np.max(np.abs(function["data"] - factor * velocity))
    print(f"{path}: {len(values) if np.ndim(values) else len(function['data'])} samples, off by {instants:.1e} s, {values:.1e} m/s")
    assert len(function["data"]) == len(time) and instants < 1e-11 and values < 1e-7


def function(**given):
    known = dict(func_type=1, rsp_node=12, rsp_dir=3, ref_node=0, ref_dir=0, id1="six beads", abscissa_spacing=1)
    known |= dict(abscissa_spec_data_type=17, abscissa_axis_units_lab="s", ordinate_spec_data_type=11)
    known |= dict(ordinate_axis_units_lab="mm/s", orddenom_spec_data_type=0, data=velocity, x=time, binary=0)
    return pyuff.prepare_58(**(known | given))


def write(name, *functions, force_double=True):
    (here / name).unlink(missing_ok=True)
    file = pyuff.UFF(str(here / name))
    for each in functions:
        file._write_set(each, "add", force_double=force_double)


if len(sys.argv) > 1:
    for path in sys.argv[1:]:
        check(path)
else:
    write("pyuff-58.uff", function())
    write("pyuff-58-single.uff", function(ord_data_type=2), force_double=False)
    write("pyuff-58-uneven.uff", function(abscissa_spacing=0))
    write("pyuff-58b.uff", function(binary=1))
    write("pyuff-58b-uneven.uff", function(binary=1, abscissa_spacing=0))
    spectrum = np.exp(1j * np.arange(4.0))
    frf = function(func_type=4, data=spectrum, x=np.arange(4.0), abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz")
    short = function(data=velocity[:10], x=time[:10], id1="ten samples", binary=1)
    write("pyuff-several.uff", frf, short, function(id1="Häufigkeit"))
