"""Whole datasets, tiny: what they hold, and that neither kills nor damage change the result."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import math
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.models.parameters import BlendFile
from rgspipe.blender.render_dataset import render_dataset
from rgspipe.blender.targets import in_frame
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import LAMPS_TRUTH
from rgspipe.datasets.views import Dataset
from rgspipe.errors import InputError
from rgspipe.scene.models import Box

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed"),
]

JOB = DatasetJob(train_views=6, test_views=1, targets_per_class=2, target_views=2, resolution=16, samples=4, seed=3)
FRAMES = 6 + 1 + 3 * 2 * 2

#: The first two of its photographs, and nothing else.
SHORT = replace(JOB, train_views=2, test_views=0, targets_per_class=0)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dataset of JOB, rendered in one go."""
    folder = tmp_path_factory.mktemp("rendered")
    render_dataset(JOB, folder)
    return folder


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dataset of SHORT."""
    folder = tmp_path_factory.mktemp("short")
    render_dataset(SHORT, folder)
    return folder


@pytest.fixture
def copied(short: Path, tmp_path: Path) -> Path:
    """That dataset in a folder of the test's own, files as old as they were."""
    return Path(shutil.copytree(short, tmp_path / "copied"))


@pytest.fixture(scope="module")
def dataset(rendered: Path) -> Dataset:
    return load_dataset(rendered)


def _digests(folder: Path) -> dict[str, str]:
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def _into_box(points: np.ndarray, box: Box) -> np.ndarray:
    """Signed distance (…,) from the surface of a turned box, negative inside."""
    local = points - box.center
    c, s = math.cos(box.turn), math.sin(box.turn)
    local = np.stack([c * local[..., 0] + s * local[..., 1], c * local[..., 1] - s * local[..., 0], local[..., 2]], -1)
    excess = np.abs(local) - 0.5 * np.array(box.size)
    return np.linalg.norm(np.maximum(excess, 0), axis=-1) + np.minimum(excess.max(axis=-1), 0)


def test_it_holds_what_was_asked_for(dataset: Dataset) -> None:
    assert (len(dataset.train), len(dataset.test), len(dataset.targets)) == (6, 1, 6)
    classes = [target.occlusion for target in dataset.targets]
    assert sorted(classes) == sorted(["visible", "out_of_frame", "occluded"] * 2)
    assert all(len(target.views) == 2 for target in dataset.targets)
    assert all(view.image.shape == (16, 16, 3) for view in dataset.train)


def test_depth_and_cameras_put_every_point_on_a_surface(dataset: Dataset) -> None:
    for view in dataset.train:
        origins, directions, lengths = view.camera.rays()
        depth = view.depth.reshape(-1).double()
        there = depth.isfinite()
        points = (origins + directions * (depth * lengths)[:, None])[there].numpy()
        to_walls = np.abs(np.abs(points) - 0.5).min(axis=1)
        to_boxes = np.abs([_into_box(points, box) for box in JOB.model.boxes]).min(axis=0)
        off_centre = depth[there].numpy() * 0.005 / view.camera.fx  # the filter is 0.01 pixel wide
        assert (np.minimum(to_walls, to_boxes) < 1e-5 + off_centre).all()  # measured 5e-7
        facing = (view.normal.reshape(-1, 3)[there].double() * directions[there]).sum(dim=1)
        assert (facing < 0).all()


def test_lights_keep_their_distance_and_their_class(rendered: Path, dataset: Dataset) -> None:
    views = [*dataset.train, *dataset.test]
    lights = {view.name: view.light.position.numpy() for view in views}
    hidden = {target.name: target for target in dataset.targets}
    truth = {name: read_lights(rendered / "truth" / f"{name}.json")[0].position.numpy() for name in hidden}
    for name, position in (lights | truth).items():
        clearance = 0.05 if name.startswith("occluded") else 0.08
        assert (np.abs(position) <= 0.5 - clearance + 1e-6).all(), name
        assert min(_into_box(position, box) for box in JOB.model.boxes) >= clearance - 1e-6, name
    for name, target in hidden.items():
        framed = [in_frame(view.camera, truth[name]) for view in target.views]
        assert all(framed) if target.occlusion == "visible" else framed[0] == (target.occlusion == "occluded")


def test_a_target_does_not_give_its_light_away(rendered: Path) -> None:
    for path in (rendered / "targets").rglob("*.json"):
        assert "pl_" not in path.read_text() and "position" not in path.read_text()


def test_frames_do_not_depend_on_how_many_there_are(rendered: Path, short: Path) -> None:
    digests = _digests(short)
    same = {
        name: digest for name, digest in _digests(rendered).items() if name.startswith(("train/r_0000", "train/r_0001"))
    }
    assert len(same) == 8 and same.items() <= digests.items()


def test_damage_is_repaired_and_the_rest_is_kept(copied: Path, caplog: pytest.LogCaptureFixture) -> None:
    before = _digests(copied)
    kept = copied / "train/r_0001.exr"
    stamp = kept.stat().st_mtime_ns
    cut = copied / "train/r_0000.exr"
    # Whole images in the wrong place can be read, so that reading is no proof.
    cut.write_bytes(kept.read_bytes())
    (copied / "train/r_0000_depth.exr").write_bytes(b"")
    (copied / "transforms_train.json").unlink()
    render_dataset(SHORT, copied)
    assert _digests(copied) == before
    assert kept.stat().st_mtime_ns == stamp
    assert [record.message for record in caplog.records] == [
        "1 of the frames that lie there are not as they were written: rendered again"
    ]


def test_where_the_job_was_cut_off_all_is_rendered_again(copied: Path, caplog: pytest.LogCaptureFixture) -> None:
    before, stamp = _digests(copied), (copied / "train/r_0000.exr").stat().st_mtime_ns
    (copied / "job.json").write_text("")
    render_dataset(SHORT, copied)
    assert _digests(copied) == before and (copied / "train/r_0000.exr").stat().st_mtime_ns > stamp
    assert "job.json cannot be read" in caplog.records[0].message


def _start(folder: Path, environment: dict[str, str]) -> subprocess.Popen:
    code = (
        "import json, sys; from pathlib import Path; from rgspipe.blender.job import DatasetJob;"
        "from rgspipe.blender.render_dataset import render_dataset;"
        "render_dataset(DatasetJob.from_json(json.loads(sys.argv[1])), Path(sys.argv[2]))"
    )
    command = [sys.executable, "-c", code, json.dumps(JOB.to_json()), str(folder)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _wait(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "gave up waiting"
        time.sleep(0.01)


def _children(folder: Path) -> list[int]:
    """Living processes that render into `folder` (Linux)."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            words = (path / "cmdline").read_bytes().split(b"\0")
            state = (path / "stat").read_text().rsplit(")", 1)[1].split()[0]
        except (OSError, IndexError):
            continue
        if b"rgspipe.blender.render_dataset" in words and str(folder).encode() in words and state != "Z":
            found.append(int(path.name))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_killed_at_any_moment_it_goes_on_and_ends_the_same(
    rendered: Path, tmp_path: Path, child_environment: dict[str, str]
) -> None:
    draw = random.Random(1)
    for wanted in (1, 5):
        parent = _start(tmp_path, child_environment)
        _wait(lambda: len(list(tmp_path.rglob("r_????.exr"))) >= wanted)  # noqa: B023
        time.sleep(draw.uniform(0, 0.15))
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        _wait(lambda: not _children(tmp_path), seconds=10)  # no orphan goes on writing
    done = len(list(tmp_path.rglob("r_????.exr")))
    assert 5 <= done < FRAMES
    render_dataset(JOB, tmp_path)
    assert _digests(tmp_path) == _digests(rendered)


def test_a_blend_file_is_stripped_of_all_that_glows(in_blender: Callable[..., None], tmp_path: Path) -> None:
    in_blender(tmp_path, "save_blends", "normalise")
    job = replace(JOB, train_views=2, test_views=1, targets_per_class=0)
    for name in ("bare", "lit"):
        render_dataset(replace(job, model=BlendFile(str(tmp_path / f"{name}.blend"))), tmp_path / name)
    bare, lit = (_digests(tmp_path / name) for name in ("bare", "lit"))
    assert {name for name in bare if bare[name] != lit[name]} == {"job.json"}
    images = [view.image for view in load_dataset(tmp_path / "lit").train]
    assert all(image.max() > 0 for image in images)
    found = np.load(tmp_path / "normal.npz")
    np.testing.assert_allclose(found["hi"] - found["lo"], [1.0, 1.0, 2.5 / 8], atol=1e-6)  # measured 6e-8
    np.testing.assert_allclose(found["hi"] + found["lo"], 0, atol=1e-6)
    assert found["rescale"] == pytest.approx(1 / 8)
    with pytest.raises(InputError, match=r"empty\.blend.*expected meshes.*none that is rendered"):
        render_dataset(replace(job, model=BlendFile(str(tmp_path / "empty.blend"))), tmp_path / "empty")


@pytest.mark.parametrize(("content", "message"), [(None, "no such file"), ("no blend", "Blender cannot open")])
def test_a_blend_file_that_is_none_is_named(tmp_path: Path, content: str | None, message: str) -> None:
    path = tmp_path / "mine.blend"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=rf"mine\.blend.*{message}"):
        render_dataset(replace(JOB, model=BlendFile(str(path))), tmp_path / "data")


def test_a_room_full_of_boxes_is_refused(tmp_path: Path) -> None:
    full = replace(JOB.model, boxes=(Box((0.0, 0.0, 0.0), (0.98, 0.98, 0.98), 0.0),))
    with pytest.raises(InputError, match="room for"):
        render_dataset(replace(JOB, model=full), tmp_path)


def test_lamps_that_are_on_in_all_views_are_named_nowhere_but_in_the_truth(tmp_path: Path) -> None:
    job = replace(JOB, lamps_known=False, lamps=3, train_views=2, targets_per_class=0)
    render_dataset(job, tmp_path)
    dataset, lamps = load_dataset(tmp_path), read_lights(tmp_path / LAMPS_TRUTH)
    assert [view.light for view in dataset.train] == [None, None] and dataset.test[0].light is not None
    assert len(lamps) == 3
    apart = [float((a.position - b.position).norm()) for a in lamps for b in lamps if a is not b]
    assert min(apart) >= 0.25
    # Brighter than under the least of them alone, as all of them are on.
    assert all(float(view.image.mean()) > 0.02 for view in dataset.train)
