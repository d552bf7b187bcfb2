"""What `stage=view` shows of a capture: lamps with what was said of them, and photographs that a search can take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from frozen_store import artifact
from rgspipe.cli.view_capture import MOST_SEARCHED, captured
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.covariance_file import covariance_fields
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_transforms
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.demo import ROOM
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_json
from rgspipe.viewer.material import Case
from tiny_dataset import HEIGHT, WIDTH, tiny_camera

LIGHTS = read_lights(ROOM / "truth" / "hidden.json")

#: Twice the light in each photograph as in the one before.
GAINS = [2.0**index for index in range(7)]


def _dataset(root: Path, lightings: list[str]) -> Artifact:
    """Seven photographs a lighting of a wall of radiance 0.25, the brightest of them saturated on the left."""

    def make(folder: Path) -> None:
        entries = []
        for lighting in lightings:
            for index, gain in enumerate(GAINS):
                name, image = f"train/{lighting}{index}", np.full((HEIGHT, WIDTH, 3), 0.25 * gain, np.float32)
                image[:, 0] *= 4.0
                write_image(folder / f"{name}.exr", image, np.ones((HEIGHT, WIDTH)))
                own = {"lighting": lighting, "saturated_from": GAINS[-1]}
                entries.append(frame_entry(name, tiny_camera()) | own)
        write_transforms(folder / "transforms_train.json", entries)
        write_info(folder, "tiny", [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)

    return artifact(root, "generate_dataset", make)


def _capture(root: Path) -> Artifact:
    """The lamps of two lightings."""
    spread = {"lights": covariance_fields(1, {"covariance": [1e-4 * torch.eye(3)]})}
    exposures = [[gain] * 3 for gain in GAINS]

    def make(folder: Path) -> None:
        for name in ("lamps.json", "lamps_night.json"):
            write_lights(folder / name, LIGHTS, spread)
        night = {"words": "1 lamp was on at night.", "exposures": exposures}
        own = {"words": "1 lamp was on.", "exposures": exposures, "others": {"night": night}}
        write_json(folder / "metrics.json", own)

    return artifact(root, "capture_surfels", make)


def _shown(root: Path, lightings: list[str], **changes: object) -> list[Case]:
    made = {"capture_surfels": _capture(root), "generate_dataset": _dataset(root, lightings) if lightings else None}
    named = {"scene.lamps": "unknown"} | {key.replace("__", "."): value for key, value in changes.items()}
    return captured(made.get, with_changes(RgspipeConfig(stage="freeze"), named))


def test_each_lighting_has_its_lamps_with_what_was_said_of_them(tmp_path: Path) -> None:
    first, night = _shown(tmp_path, ["", "night"])
    assert (first.name, night.name) == ("capture", "capture night")
    assert first.found.lights == LIGHTS and len(first.found.covariance) == 1
    assert (first.found.told, night.found.told) == ("1 lamp was on.", "1 lamp was on at night.")
    assert {one.name[:6] for one in first.photographs} == {"train/"}
    assert all("night" in one.name for one in night.photographs)


def test_photographs_are_brought_to_one_exposure(tmp_path: Path) -> None:
    photographs = _shown(tmp_path, ["", "night"])[0].photographs
    assert 1 < len(photographs) <= MOST_SEARCHED
    for one in photographs:
        assert torch.equal(one.image[:, 1:], torch.full_like(one.image[:, 1:], 0.25))
    # What is saturated in the last, brightest one says nothing of its radiance.
    assert photographs[-1].mask[:, 0].eq(0.0).all() and photographs[-1].mask[:, 1:].eq(1.0).all()


@pytest.mark.parametrize(
    ("lightings", "changes", "why"),
    [
        ([], {}, "gone"),
        (["", "night", "off"], {}, "other light"),
        (["", "night"], {"lamps__vignetting": True}, "darker towards their corners"),
        (["", "night"], {"lamps__response": "free"}, "curve"),
    ],
)
def test_photographs_that_a_search_would_misread_are_left_out_with_the_reason(
    lightings: list[str], changes: dict[str, object], why: str, tmp_path: Path
) -> None:
    for case in _shown(tmp_path, lightings, **changes):
        assert not case.photographs and why in case.lacking and case.found.lights == LIGHTS


def test_a_scene_of_known_lamps_is_no_capture(tmp_path: Path) -> None:
    assert _shown(tmp_path, [""], scene__lamps="known") == []
