"""Bad input at the command line: one paragraph that names the place, status 2, and nothing made is touched."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.exr import write_channels
from tiny_dataset import write_tiny_dataset
from warm_start import WarmStart

REFUSED = 2


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    returncode: int
    stderr: str


def ended(place: WarmStart, folder: Path, *arguments: str) -> Ended:
    """What a command in a folder came to."""
    status = place.start(folder, arguments).wait(timeout=120)
    return Ended(status, (folder / "stderr").read_text())


@pytest.fixture
def run_cli(tmp_path: Path, warm_start: WarmStart) -> Callable[..., Ended]:
    return partial(ended, warm_start, tmp_path)


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory, warm_start: WarmStart) -> Path:
    """A folder with a dataset, `scene`, and the results of having read it."""
    folder = tmp_path_factory.mktemp("checked")
    write_tiny_dataset(folder / "scene")
    good = ended(warm_start, folder, "stage=generate_dataset", "scene=external", "scene.path=scene")
    assert good.returncode == 0, good.stderr
    assert artifacts(folder)
    return folder


def artifacts(folder: Path) -> dict[str, str]:
    """Every file under outputs/ but the notes of runs, with its content's hash."""
    files = [path for path in (folder / "outputs").rglob("*") if path.is_file() and not path.is_symlink()]
    kept = [path for path in files if "runs" not in path.parts and not path.name.startswith(".")]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in kept}


def fill(path: Path, channels: str, value: float) -> None:
    write_channels(path, {name: np.full((4, 6), value, np.float32) for name in channels})


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-40])


def remove_depth(root: Path, change: Callable) -> None:
    change("transforms_train.json", lambda content: content["frames"][0].pop("depth_path"))


def shear(root: Path, change: Callable) -> None:
    def edit(content: dict) -> None:
        content["frames"][0]["transform_matrix"][0][1] = 0.5

    change("transforms_train.json", edit)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda root, _: (root / "train/r_0000.exr").unlink(), ["train/r_0000.exr", "no such file"]),
        (lambda root, _: truncate(root / "train/r_0000.exr"), ["train/r_0000.exr", "whole OpenEXR"]),
        (lambda root, _: fill(root / "train/r_0000.exr", "RGBA", float("nan")), ["train/r_0000.exr", "NaN"]),
        (lambda root, _: fill(root / "train/r_0000.exr", "RG", 1.0), ["train/r_0000.exr", "channels"]),
        (lambda root, _: fill(root / "train/r_0000_depth.exr", "Z", -1.0), ["r_0000_depth.exr", "negative"]),
        (shear, ["transforms_train.json", "transform_matrix", "rigid"]),
        (remove_depth, ["depth_path", "depth_convention"]),
        (lambda root, _: (root / "targets/one/view_0.exr").unlink(), ["targets/one", "view_0"]),
    ],
    ids=["missing file", "truncated", "NaN", "channels", "negative depth", "no rotation", "no depth", "no images"],
)
def test_a_bad_dataset_is_refused(
    checked: Path, change: Callable, dataset: Path, run_cli: Callable, tmp_path: Path, spoil: Callable, words: list[str]
) -> None:
    shutil.copytree(checked, tmp_path, symlinks=True, dirs_exist_ok=True)
    before = artifacts(tmp_path)
    assert before == artifacts(checked)
    spoil(dataset, change)
    result = run_cli("stage=init_depth", "scene=external", "scene.path=scene")
    message = " ".join(result.stderr.split())
    assert result.returncode == REFUSED, result.stderr
    assert all(word in message for word in words), message
    assert "Traceback" not in result.stderr
    assert "\n\n" not in result.stderr[result.stderr.index("Error: ") :].strip(), "one paragraph"
    after = artifacts(tmp_path)
    assert {name: after[name] for name in before} == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["stage=fit_light", "fit.metod=search_lm"], ["fit.metod", "fit.method"]),
        (["stage=freeze", "init.surfels=many"], ["init.surfels", "many"]),
        (["stage=freeze", "hydra.joob.name=x"], ["hydra.joob"]),
        (["stage=init_depth", "scene=external"], ["scene.path"]),
        (["stage=init_depth", "scene=external", "scene.path=nowhere"], ["scene.path", "nowhere"]),
        (["stage=generate_dataset", "scene=blend", "scene.path=gone.blend"], ["scene.path", "gone.blend"]),
        (["stage=freeze", "scene.name=a\\b"], ["scene.name", "plain folder name"]),
        (["stage=freeze", "hydra.run.dir=${outputs}/${nope}"], ["nope", "not found"]),
        (["stage=freeze", "hydra.job.name='a/b'"], ["hydra.job.name", "plain name"]),
        (["stage=freeze", "hydra.job_logging.root.level=NOPE"], ["root.level", "INFO or WARNING"]),
        (["-m", "stage=freeze", "seed=1,2", "hydra.sweeper.max_batch_size=0"], ["max_batch_size", "above 0"]),
        (["stage=freeze", "hydra.mode=MULTIRUN"], ["hydra.mode", "add -m"]),
        (["status", f"outputs={'x' * 5000}"], ["folder of results", "too long"]),
        (["doctor", "check=false", f"outputs={'x' * 5000}"], ["folder of results", "too long"]),
        (["stage=freeze", "scene.name=\udcc3"], ["command line", "LC_ALL=C.UTF-8"]),
        (["stage=fit_light", "upstream=require"], ["freeze"]),
    ],
    ids=lambda value: ascii(value[-1][:40]) if isinstance(value, list) else None,
)
def test_a_bad_configuration_is_refused(run_cli: Callable, arguments: list[str], words: list[str]) -> None:
    result = run_cli(*arguments)
    message = " ".join(result.stderr.split())
    assert result.returncode == REFUSED, result.stderr
    assert all(word in message for word in words), message
    assert "Traceback" not in result.stderr


def test_a_target_without_images_is_refused_before_anything_is_made(
    dataset: Path, run_cli: Callable, tmp_path: Path
) -> None:
    (dataset / "targets/one/view_0.exr").unlink()
    target = f"fit.target={dataset / 'targets/one'}"
    result = run_cli("stage=fit_light", "scene=external", f"scene.path={dataset}", target)
    assert result.returncode == REFUSED
    assert "view_0.exr" in result.stderr and "Traceback" not in result.stderr
    assert artifacts(tmp_path) == {}


def test_the_traceback_is_there_when_asked_for(run_cli: Callable) -> None:
    result = run_cli("stage=init_depth", "scene=external", "scene.path=nowhere", "debug.traceback=true")
    assert result.returncode == REFUSED
    assert "Traceback" in result.stderr
