"""Every example runs, says what it should, and makes its pictures; the notebook's cells run in their order."""

from __future__ import annotations

import ast
import json
import re
import runpy
import sys
from pathlib import Path

import pytest
from PIL import Image

import rgspipe as rg

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
TOUR = EXAMPLES / "tour.ipynb"

#: What each prints, whatever the numbers, and the files that it makes.
SCRIPTS = {
    "relight": (r"a spot +\d", ("relight.png", "relight.json")),
    "gradient": ("step 59: loss", ("gradient.png",)),
    "fit": (r"point at \(-0\.\d{3}, 0\.\d{3}, -0\.\d{3}\) ± 0\.\d+", ("fit.png", "fit.json")),
    "unknown_number": (r"(?s)^2 lights.*With count=1: unexplained.*With count=3: ambiguous", ()),
    "track": (r"frame 7: (tracked|searched|traced_back) +at", ("track.png",)),
}

#: Lines of a screen, and bytes of a notebook that does not weigh on the repository.
SCREEN, LIGHT = 60, 300_000


def run(monkeypatch: pytest.MonkeyPatch, name: str, *arguments: str) -> None:
    """As `python examples/NAME.py ARGUMENTS` does."""
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *arguments])
    monkeypatch.syspath_prepend(EXAMPLES)
    monkeypatch.delitem(sys.modules, "room", raising=False)
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    monkeypatch.delitem(sys.modules, "room")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_runs_in_seconds(name: str, monkeypatch, capsys, tmp_path) -> None:
    told, files = SCRIPTS[name]
    run(monkeypatch, name, "--surfels", "600", "--size", "40", "--out", str(tmp_path))
    printed = capsys.readouterr().out
    assert re.search(told, printed), printed
    assert {path.name for path in tmp_path.iterdir()} == set(files)
    for path in tmp_path.glob("*.png"):
        with Image.open(path) as picture:
            assert picture.height == 40 and picture.width % 40 == 0


def test_a_script_takes_a_frozen_scene(monkeypatch, capsys, tmp_path) -> None:
    rg.FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), 300), gather_rays=16, patches=20).save(tmp_path / "scene")
    run(monkeypatch, "fit", str(tmp_path / "scene"), "--size", "32", "--out", str(tmp_path))
    assert "1 light, converged" in capsys.readouterr().out


def test_all_are_listed_and_short() -> None:
    scripts = {path.stem for path in EXAMPLES.glob("*.py")} - {"room"}
    assert scripts == set(SCRIPTS)
    listed = set(re.findall(r"^\| \[`(.+?)`\]", (EXAMPLES / "README.md").read_text(), re.MULTILINE))
    assert listed == {TOUR.name, *(f"{name}.py" for name in scripts)}
    assert {path.name for path in EXAMPLES.glob("*.py") if len(path.read_text().splitlines()) > SCREEN} == set()


@pytest.fixture(scope="module")
def cells() -> list[dict]:
    """The notebook's cells of code."""
    return [cell for cell in json.loads(TOUR.read_text())["cells"] if cell["cell_type"] == "code"]


def test_the_notebook_was_run_in_order_and_is_light(cells) -> None:
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    kinds = [kind for cell in cells for output in cell["outputs"] for kind in output.get("data", ())]
    assert kinds.count("image/jpeg") >= 6 and kinds.count("text/html") == 1
    assert not [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]
    assert TOUR.stat().st_size < LIGHT


def test_the_notebook_runs(cells, monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    shown = [run_cell("".join(cell["source"]).replace("128, 2000", "40, 400"), names) for cell in cells]
    assert names["size"] == 40, "the cell that sets the size says `size, surfels = 128, 2000` no longer"
    pictures = [value for value in shown if isinstance(value, Image.Image)]
    assert len(pictures) >= 6 and all(picture.height == 40 for picture in pictures)
    assert any(isinstance(value, rg.FitResult) and "<li>" in value._repr_html_() for value in shown)
    printed = capsys.readouterr().out
    assert "ambiguous" in printed and "2 lights" in printed


def run_cell(source: str, names: dict[str, object]) -> object:
    """What a cell shows: the value of its last line, if that is an expression."""
    tree = ast.parse(source)
    if isinstance(last := tree.body[-1], ast.Expr):
        tree.body[-1] = ast.Assign([ast.Name("shown_by_cell", ast.Store())], last.value)
    exec(compile(ast.fix_missing_locations(tree), str(TOUR), "exec"), names)
    return names.pop("shown_by_cell", None)
