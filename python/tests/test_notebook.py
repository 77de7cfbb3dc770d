"""The notebook, executed again: every line that it prints, and every table, is what it shows.

``GRANCHAIN_UPDATE=1`` writes what came out into it.
"""

from __future__ import annotations

import os
from typing import Any

import pytest

from conftest import ROOT

NOTEBOOK = ROOT / "python" / "examples" / "from_vib_csv_to_a_report.ipynb"


def texts(notebook: Any) -> list[str]:
    """What each code cell says, pictures left out; a kernel may hand what is printed over in several pieces."""
    told = []
    for cell in notebook.cells:
        if cell.cell_type == "code":
            said = [output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.outputs]
            told.append("".join(str(text) for text in said))
    return told


def test_the_notebook_prints_what_it_shows() -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    for needed in ("arviz", "ipykernel", "matplotlib"):
        pytest.importorskip(needed)
    shown, executed = (nbformat.read(NOTEBOOK, as_version=4) for _ in range(2))
    nbclient.NotebookClient(executed, timeout=300, resources={"metadata": {"path": str(NOTEBOOK.parent)}}).execute()
    for cell in executed.cells:
        # Times of the execution.
        cell.metadata.pop("execution", None)
    executed.metadata["language_info"] = {"name": "python"}
    if os.environ.get("GRANCHAIN_UPDATE"):
        nbformat.write(executed, NOTEBOOK)
    else:
        assert texts(executed) == texts(shown)
