"""The page of the book and the notebooks, as they stand there."""

import json
import pathlib

import numpy
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
        integrated = names["model"].reading(names["solved"].t, names["solved"].y)
        assert abs(integrated - names["model"](names["solved"].t)).max() < 0.01
        assert (names["diagnosis"].status, names["diagnosis"].effects) == ("explained", ["coulomb_friction"])


def test_the_readme_runs(campaign, monkeypatch):
    monkeypatch.chdir(campaign.parent)
    time_s = numpy.arange(0.0, 30.0, 0.005)
    names = {"time_s": time_s, "angle_deg": 15.0 * numpy.exp(-0.05 * time_s) * numpy.cos(6.0 * time_s)}
    (block,) = (ROOT / "host/python/README.md").read_text(encoding="utf-8").split("```python\n")[1:]
    exec(compile(block.split("```")[0], "README.md", "exec"), names)
    assert abs(names["found"].natural_frequency_rad_s.value - 6) < 0.01


def test_both_notebooks_are_there():
    assert [file.stem for file in NOTEBOOKS] == ["campaign", "pendulum"]
