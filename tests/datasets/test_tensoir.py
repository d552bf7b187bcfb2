"""Folders of TensoIR load as views; what keeps surfels from being trained on them is said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from rgspipe.cli.compose import compose_config
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.location import open_dataset
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import run
from rgspipe.scene import look_at
from rgspipe.stages import load_stage

WIDTH, HEIGHT = 6, 4


def save(path: Path, values: np.ndarray) -> None:
    Image.fromarray(np.round(255 * values).astype(np.uint8)).save(path)


@pytest.fixture
def tensoir(tmp_path: Path) -> Path:
    """Two training views and a test view, each of a surface that fills all but the first pixel."""
    root, ones = tmp_path / "lego", np.ones((HEIGHT, WIDTH, 1))
    alpha = ones.copy()
    alpha[0, 0] = 0
    for name in ("train_000", "train_001", "test_000", "val_000"):
        folder = root / name
        folder.mkdir(parents=True)
        pose = look_at(torch.tensor([0.0, -2.0, 0.5 * int(name[-1])]), torch.zeros(3))
        content = {
            "cam_transform_mat": ",".join(str(float(x)) for x in pose.reshape(-1)),
            "cam_angle_x": 0.7,
            "imw": WIDTH,
            "imh": HEIGHT,
        }
        (folder / "metadata.json").write_text(json.dumps(content))
        save(folder / "rgba_sunset.png", np.concatenate([0.5 * ones, 0 * ones, ones, alpha], axis=2))
        save(folder / "rgba_city.png", np.concatenate([0.25 * ones] * 3 + [alpha], axis=2))
        save(folder / "albedo.png", np.concatenate([0.8 * ones] * 3 + [alpha], axis=2))
        save(folder / "normal.png", np.concatenate([0.5 * ones, 0 * ones, 0.5 * ones, alpha], axis=2))
    return root


def test_views_masks_albedo_and_normals_are_read_as_linear_tensors(tensoir: Path) -> None:
    dataset = load_dataset(tensoir)
    assert [view.name for view in dataset.train] == ["train_000/rgba_city", "train_001/rgba_city"]
    assert len(dataset.test) == 1 and dataset.targets == ()
    view = dataset.train[1]
    assert view.light is None and view.depth is None
    assert view.alpha[0, 0] == 0 and view.alpha[0, 1] == 1 and view.image[0, 0].abs().max() == 0
    # sRGB 0.25 (64/255) and 0.8.
    torch.testing.assert_close(view.image[2, 2], torch.full((3,), 0.0513), atol=1e-4, rtol=0)
    assert view.albedo is not None and view.normal is not None
    torch.testing.assert_close(view.albedo[2, 2], torch.full((3,), 0.6038), atol=1e-4, rtol=0)
    # 8 bits hold a normal to 0.3°.
    torch.testing.assert_close(view.normal[2, 2], torch.tensor([0.0, -1.0, 0.0]), atol=5e-3, rtol=0)
    assert view.normal[0, 0].abs().max() == 0
    torch.testing.assert_close(view.camera.origin, torch.tensor([0.0, -2.0, 0.5], dtype=torch.float64))
    assert view.camera.fx == pytest.approx(0.5 * WIDTH / np.tan(0.35))


def test_maps_may_be_missing(tensoir: Path) -> None:
    (tensoir / "train_000" / "albedo.png").unlink()
    (tensoir / "train_000" / "normal.png").unlink()
    view = load_dataset(tensoir, test=False).train[0]
    assert view.albedo is None and view.normal is None


def test_the_folder_is_taken_and_training_on_it_says_what_is_missing(tensoir: Path, tmp_path: Path) -> None:
    where = ["scene=external", f"scene.path={tensoir}", f"outputs={tmp_path / 'out'}"]
    artifact = run(compose_config(["stage=generate_dataset", *where]), load_stage)
    assert len(open_dataset(artifact.folder()).train) == 2
    with pytest.raises(InputError, match=r"point light.*2 of 2 views.*environment light.*scene=blend.*albedo_path"):
        run(compose_config(["stage=train_surfels", *where]), load_stage)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cam_transform_mat": "1,2,3"}, r"train_000/metadata\.json: cam_transform_mat: expected 16 numbers"),
        ({"cam_transform_mat": ",".join(["1"] * 16)}, "cam_transform_mat: expected a rigid"),
        ({"cam_transform_mat": None}, "cam_transform_mat"),
        ({"cam_angle_x": 4.0}, "cam_angle_x"),
        ({"cam_angle_x": 1e-320}, "cam_angle_x"),
        ({"imw": 800}, "imw: expected 6"),
    ],
)
def test_impossible_metadata_are_refused(tensoir: Path, change: dict, words: str) -> None:
    path = tensoir / "train_000" / "metadata.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=words):
        load_dataset(tensoir)


def test_missing_images_and_maps_of_another_size_are_refused(tensoir: Path) -> None:
    save(tensoir / "train_000" / "normal.png", np.zeros((2, 2, 3)))
    with pytest.raises(InputError, match=r"normal\.png: expected 6 × 4 pixels"):
        load_dataset(tensoir)
    for path in (tensoir / "train_000").glob("rgba*.png"):
        path.unlink()
    with pytest.raises(InputError, match=r"train_000: expected an image rgba"):
        load_dataset(tensoir)
