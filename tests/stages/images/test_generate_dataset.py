"""The first stage: what it asks Blender for, and how it takes a dataset from disk."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from rgspipe.blender.models.parameters import kind_of
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.scene import MODELLED
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.location import open_dataset
from rgspipe.errors import InputError
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.models import Corridor
from rgspipe.stages.base import StageContext
from rgspipe.stages.images.generate_dataset import STAGE, dataset_job


def _config(**scene: object) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {f"scene.{key}": value for key, value in scene.items()})


def _run(config: RgspipeConfig, folder: Path) -> StageContext:
    folder.mkdir()
    context = StageContext(config, {}, {}, folder)
    STAGE.run(context)
    return context


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """A dataset of one training and one test view, without depth and targets."""
    root = tmp_path / "foreign"
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.0, -2.0, 0.0]), torch.zeros(3)), 1.0, 4, 4)
    light = PointLight(torch.zeros(3), torch.ones(3))
    for split in ("train", "test"):
        write_image(root / split / "r_0000.exr", np.ones((4, 4, 3)))
        write_transforms(root / f"transforms_{split}.json", [frame_entry(f"{split}/r_0000", camera, light)])
    return root


def test_an_external_dataset_is_checked_and_pointed_at(foreign: Path, tmp_path: Path) -> None:
    context = _run(_config(kind="external", path=str(foreign)), tmp_path / "out")
    assert context.facts == {"kind": "external", "train": 1, "test": 1, "targets": 0}
    assert json.loads((tmp_path / "out/dataset.json").read_text()) == {"root": str(foreign)}
    assert len(open_dataset(tmp_path / "out").train) == 1
    assert STAGE.files(_config(kind="external", path=str(foreign))) == (foreign,)


def test_a_broken_external_dataset_leaves_no_pointer(foreign: Path, tmp_path: Path) -> None:
    (foreign / "test/r_0000.exr").write_text("")
    with pytest.raises(InputError, match=r"test/r_0000\.exr"):
        _run(_config(kind="external", path=str(foreign)), tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("kind", ["external", "blend"])
@pytest.mark.parametrize(("path", "message"), [(None, "found nothing"), ("/gone/away", "no such path: /gone/away")])
def test_a_path_that_leads_nowhere_is_named(kind: str, path: str | None, message: str, tmp_path: Path) -> None:
    config = _config(kind=kind, path=path)
    assert STAGE.files(config) == ()
    with pytest.raises(InputError, match=rf"scene\.path.*{message}"):
        _run(config, tmp_path / "out")


def test_boxes_stand_on_the_floor_of_a_centred_room() -> None:
    tall = {"tall_size": [0.1, 0.2, 0.4], "tall_center": [0.5, 0.4], "tall_angle": 90.0}
    room = {"room": [1.0, 0.8, 0.6]} | tall
    cornell = dataset_job(_config(kind="cornell", **{f"cornell.{key}": value for key, value in room.items()})).model
    tall = cornell.boxes[0]
    assert cornell.room == (1.0, 0.8, 0.6)
    assert tall.center == pytest.approx((0.0, 0.0, -0.1))  # its foot is at −0.3, the floor
    assert tall.turn == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("kind", MODELLED)
def test_every_scene_of_ours_is_built_from_its_own_section(kind: str) -> None:
    assert kind_of(dataset_job(_config(kind=kind)).model) == kind
    assert STAGE.keys(_config(kind=kind)) == ("scene.kind", f"scene.{kind}", "scene.lamps", "dataset")


def test_the_configured_corridor_is_the_model_s_default() -> None:
    assert dataset_job(_config(kind="corner")).model == Corridor()


def test_gloss_that_makes_light_is_refused() -> None:
    config = _config(kind="cornell")
    config = with_changes(config, {"scene.cornell.gloss": 0.28})
    with pytest.raises(InputError, match=r"scene\.cornell\.gloss.*1\.01"):
        dataset_job(config)
    config = with_changes(config, {"scene.cornell.gloss": 0.25})
    assert dataset_job(config).model.gloss == 0.25


def test_only_what_matters_is_in_the_fingerprint() -> None:
    assert STAGE.keys(_config(kind="external")) == ("scene.kind", "scene.lamps")
    assert "scene.cornell" not in STAGE.keys(_config(kind="blend"))
    assert {"scene.cornell", "dataset"} <= set(STAGE.keys(_config(kind="cornell")))


def test_saturated_8_bit_training_images_are_told(
    foreign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    levels = np.full((4, 4, 3), 128, np.uint8)
    levels[0, 0], levels[3, 3, 1] = 255, 255
    Image.fromarray(levels).save(foreign / "train/r_0000.png")
    content = json.loads((foreign / "transforms_train.json").read_text())
    content["frames"][0] |= {"file_path": "train/r_0000.png"}
    content["frames"][0].pop("file_ext", None)
    (foreign / "transforms_train.json").write_text(json.dumps(content))
    context = _run(_config(kind="external", path=str(foreign)), tmp_path / "out")
    assert context.facts["saturated"] == 2 / 16
    assert "12.5 % of the pixels of 1 training images are saturated" in capsys.readouterr().out
