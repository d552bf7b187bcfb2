"""The wheel has everything that the command line needs, and works from any folder."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("hatchling", reason="hatchling builds the wheel: make setup")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def files(folder: str) -> set[str]:
    """What belongs to a folder of the checkout, relative to the folder's own."""
    found = (path for path in (ROOT / folder).rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {path.relative_to((ROOT / folder).parent).as_posix() for path in found}


def test_a_wheel_holds_code_types_settings_and_pipelines(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert files("src/rgspipe") | files("src/hydra_plugins") <= names
    assert {f"rgspipe/{name}" for name in files("conf") | files("pipelines")} <= names
    assert "rgspipe/py.typed" in names
    assert not [name for name in names if name.startswith(("tests", "docs", "examples"))]


def test_an_unpacked_wheel_runs_from_any_folder(wheel: Path, tmp_path: Path) -> None:
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    zipfile.ZipFile(wheel).extractall(site)
    elsewhere.mkdir()
    script = "import rgspipe, sys; print(rgspipe.__file__); from rgspipe.cli import main; sys.exit(main(['--help']))"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    run = subprocess.run([sys.executable, "-c", script], cwd=elsewhere, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith(str(site))
    assert "cornell" in run.stdout
    assert not list(elsewhere.iterdir())
