"""The page of the book and the notebooks, as they stand there."""

import json
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[3]


def blocks(page):
    """The blocks of Python in a page of the book."""
    parts = page.read_text(encoding="utf-8").split("```python package\n")[1:]
    return [part.split("```")[0] for part in parts]


def cells(notebook):
    """The code of a notebook."""
    found = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]


NOTEBOOKS = sorted((ROOT / "host/python/notebooks").glob("*.ipynb"))
PAGE = ROOT / "docs/src/how-to/python.md"


@pytest.mark.parametrize("file", [PAGE, *NOTEBOOKS], ids=lambda file: file.stem)
def test_it_runs(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    pieces = cells(file) if file.suffix == ".ipynb" else blocks(file)
    assert len(pieces) >= 4
    for piece in pieces:
        exec(compile(piece, str(file), "exec"), names)
    if file == PAGE:
        assert (names["diagnosis"].status, names["diagnosis"].effects) == ("explained", ["coulomb_friction"])


def test_both_notebooks_are_there():
    assert [file.stem for file in NOTEBOOKS] == ["campaign", "pendulum"]
