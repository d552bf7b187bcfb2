"""The wheel has everything that the command line needs, and works from any folder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
import zipfile
from functools import partial
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
    found = (path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to((ROOT / folder).parent).as_posix() for path in found}


def test_a_wheel_holds_code_types_settings_and_pipelines(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert files("src/rgspipe") | files("src/hydra_plugins") <= names
    assert {f"rgspipe/{name}" for name in files("conf") | files("pipelines")} <= names
    assert "rgspipe/py.typed" in names
    assert not [name for name in names if name.startswith(("tests", "docs", "examples"))]


@pytest.fixture(scope="module")
def site(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked."""
    folder = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def test_an_unpacked_wheel_runs_from_any_folder(site: Path, tmp_path: Path) -> None:
    call = "from rgspipe.cli import main; sys.exit(main(['--help', 'scenes']))"
    script = f"import rgspipe, sys; print(rgspipe.__file__); {call}"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    run = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith(str(site))
    assert "cornell" in run.stdout
    assert not list(tmp_path.iterdir())


def test_an_installed_wheel_has_a_program_that_runs_from_any_folder(wheel: Path, tmp_path: Path) -> None:
    """As the install guide says, which calls the file by its name."""
    guide = (ROOT / "docs/guides/install.md").read_text(encoding="utf-8")
    assert f"pip install dist/{wheel.name}" in guide and "rgspipe doctor check=false" in guide
    site = tmp_path / "site"
    command = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--target", str(site), str(wheel)]
    subprocess.run(command, check=True, capture_output=True)
    environment, folder = {**os.environ, "PYTHONPATH": str(site)}, tmp_path / "else"
    folder.mkdir()
    for words, said in ((["--version"], "rgspipe 0."), (["doctor", "check=false"], "Everything that is needed works.")):
        program = [site / "bin" / "rgspipe", *words]
        run = subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert run.returncode == 0 and said in run.stdout, run.stderr
    assert not list(folder.iterdir())


@pytest.mark.slow
def test_the_demo_comes_along(site: Path, tmp_path: Path) -> None:
    """6 s of processor time; nothing but the wheel is read, and nothing written where it runs."""
    script = "import sys; from rgspipe.cli import main; sys.exit(main(['demo', 'port=0']))"
    environment = {**os.environ, "PYTHONPATH": str(site), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", script]
    # What runs in the background of a shell ignores interrupts, and so would its children.
    heeds = partial(signal.signal, signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True, preexec_fn=heeds
    ) as process:
        try:
            url = next((line for line in process.stdout if "Ctrl-C" in line), "").partition(" ")[0]
            with urllib.request.urlopen(url, timeout=60) as page:
                assert page.status == 200
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=60) == 0
        finally:
            process.kill()  # else a failure would wait for it for ever
    assert not list(tmp_path.iterdir())
