"""Outputs that cannot be written to: what is there is reused, anything else is told in a paragraph with a remedy."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from small_disk import APART, on_small_disk

REFUSED = 2

#: A user of a Unix system who owns nothing.
NOBODY = 65534

#: Where temporary folders are, which everybody may enter.
TEMPORARY = (Path("/tmp"), Path("/dev/shm"))


def toys(folder: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "toys", f"outputs={folder}", "dataset.resolution=8", *words]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, child_environment: Mapping[str, str]) -> Path:
    """A store in which the stage `grow` is made."""
    outputs = tmp_path_factory.mktemp("made") / "outputs"
    subprocess.run(toys(outputs, "stage=grow"), env=child_environment, check=True, capture_output=True)
    return outputs


@pytest.fixture
def store(made: Path, tmp_path: Path) -> Path:
    """That store, for one test to spoil."""
    return Path(shutil.copytree(made, tmp_path / "outputs", symlinks=True))


def read_only(store: Path, environment: Mapping[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    """The command line with toy stages in a world in which the store can only be read."""
    mount = f"mount --bind '{store}' '{store}' && mount -o remount,ro,bind '{store}'"
    if subprocess.run([*APART, "sh", "-c", mount], capture_output=True).returncode != 0:
        pytest.skip("this system lets nobody mount a folder for reading alone")
    command = [*APART, "sh", "-c", f"{mount} && exec {shlex.join(toys(store, *words))}"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)


def as_nobody(store: Path, environment: Mapping[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    """The command line with toy stages as another user, who may read everything."""
    return run_as_nobody(store, environment, toys(store, *words))


def run_as_nobody(
    store: Path, environment: Mapping[str, str], command: Sequence[str]
) -> subprocess.CompletedProcess[str]:
    """A command as another user, who may read the store."""
    if os.geteuid() != 0:
        pytest.skip("only root may become another user")
    if shutil.which("setpriv") is None:
        pytest.skip("no setpriv")
    for place in store.parents:
        if place.stat().st_uid == 0 and any(root in place.parents for root in TEMPORARY):
            place.chmod(0o755)
    user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "--no-new-privs"]
    if subprocess.run([*user, "test", "-r", __file__], capture_output=True).returncode != 0:
        pytest.skip("other users cannot read this checkout")
    if subprocess.run([*user, sys.executable, "-c", ""], cwd="/tmp", capture_output=True).returncode != 0:
        pytest.skip("other users cannot start this Python")
    return subprocess.run([*user, *command], env=environment, cwd="/tmp", capture_output=True, text=True, timeout=120)


OTHERS = {"read only": read_only, "another user's": as_nobody}


def is_a_paragraph(result: subprocess.CompletedProcess[str], *words: str) -> bool:
    told = " ".join(result.stderr.split())
    assert "Traceback" not in told and all(word in told for word in ("Error: ", *words)), result.stderr
    return result.returncode == REFUSED


@pytest.mark.parametrize("how", OTHERS)
def test_what_is_there_is_reused(store: Path, child_environment: Mapping[str, str], how: str) -> None:
    before = sorted(store.rglob("*"))
    result = OTHERS[how](store, child_environment, "stage=grow")
    assert result.returncode == 0, result.stderr
    assert len(result.stderr.splitlines()) == 1 and f"{store} can only be read" in result.stderr
    status = json.loads((Path(result.stderr.split()[-1]) / "status.json").read_text())
    assert status["state"] == "done" and Path(status["result"]).parent == store / "cornell" / "grow"
    assert sorted(store.rglob("*")) == before


@pytest.mark.parametrize("how", OTHERS)
def test_what_is_not_there_is_refused_with_the_folder_and_a_remedy(
    store: Path, child_environment: Mapping[str, str], how: str
) -> None:
    result = OTHERS[how](store, child_environment, "stage=grow", "views.count=3")
    assert is_a_paragraph(result, f"{store}: expected a folder that can be read and written to", "outputs=FOLDER")


def test_a_sweep_of_what_is_there_is_reused(store: Path, child_environment: Mapping[str, str]) -> None:
    result = read_only(store, child_environment, "-m", "stage=grow", "seed=1,2")
    assert result.returncode == 0 and "2 of 2 jobs done" in result.stdout, result.stderr


def test_a_lock_of_another_member_of_the_group_is_told(store: Path, child_environment: Mapping[str, str]) -> None:
    """The folder is everybody's, but the lock was made for its owner alone."""
    stage = store / "cornell" / "grow"
    (made,) = [path for path in stage.iterdir() if path.is_dir() and not path.is_symlink()]
    (stage / f".lock-{made.name}").chmod(0o644)
    shutil.rmtree(made)
    for folder in (store, store / "runs", store / "cornell", stage):
        folder.chmod(0o777)
    result = as_nobody(store, child_environment, "stage=grow")
    assert is_a_paragraph(result, f".lock-{made.name}: Permission denied", "belongs to root", "chmod -R g+rwX")


@pytest.mark.parametrize("name", ["outputs", "outputs/cornell/grow", "manifest.json"])
def test_what_its_owner_keeps_to_himself_is_told(store: Path, child_environment: Mapping[str, str], name: str) -> None:
    closed = store.parent / name if "outputs" in name else next((store / "cornell" / "grow").glob(f"[0-9a-f]*/{name}"))
    closed.chmod(0)
    result = as_nobody(store, child_environment, "stage=harvest", "report.views=[1]")
    assert is_a_paragraph(result, str(closed), "Permission denied", "outputs=FOLDER")


@pytest.mark.parametrize(("left", "begun"), [(0, False), (16, False), (72, True)])
def test_a_full_disk_is_told(tmp_path: Path, child_environment: Mapping[str, str], left: int, begun: bool) -> None:
    """Before anything starts, or, where as many KiB are left as take the run's own files, in the middle of a stage."""
    script = f'head -c {256 - left}k /dev/zero > "$1/ballast"; shift; exec "$@"'
    words = [str(tmp_path), *toys(tmp_path, "stage=grow", "dataset.resolution=64")]
    result = on_small_disk(tmp_path, "256k", script, child_environment, words)
    assert is_a_paragraph(result, "No space left on device", "outputs=FOLDER"), result.stderr
    assert ("Plan for" in result.stdout) == begun


def test_results_of_another_user_are_not_removed(store: Path, child_environment: dict[str, str]) -> None:
    command = [sys.executable, "-m", "toys", "outputs", "prune", f"outputs={store}", "older=0h"]
    assert "say remove=true" in run_as_nobody(store, child_environment, command).stdout
    result = run_as_nobody(store, child_environment, [*command, "remove=true"])
    assert result.returncode == REFUSED and "belongs to root" in result.stderr
    # Measured 7, with paths as long as those of tests, on lines of 80 columns.
    assert len(result.stderr.splitlines()) <= 8 and "Traceback" not in result.stderr
    subprocess.run([sys.executable, "-m", "toys", "verify", f"outputs={store}"], env=child_environment, check=True)
