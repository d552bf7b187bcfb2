"""Photographs that say nothing of lamps end in a sentence."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from photographed_room import LAMPS, frozen_room, painted_room, photographs
from rgspipe.capture.captured import capture_scene
from rgspipe.capture.options import CaptureOptions
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.scene import Camera, look_at

#: The room is closed: there is nothing unseen to look for before what is refused late.
OPTIONS = CaptureOptions(gather_rays=16, supersampling=1, grid=2, unseen=False)


def refusal(views: list[View], **changes: object) -> str:
    with pytest.raises(InputError) as error:
        capture_scene(views, painted_room(), replace(OPTIONS, **changes), where="room")
    return str(error.value)


def test_no_photographs() -> None:
    assert "found none" in refusal([])


def test_photographs_with_lamps_of_their_own() -> None:
    views = [replace(view, light=LAMPS[0]) for view in photographs()[:2]]
    assert "2 of 2 with a known light" in refusal(views) and "rg.train(views)" in refusal(views)


def test_photographs_that_state_other_exposures() -> None:
    first, second, *others = photographs()
    views = [replace(first, exposure=1.0), replace(second, exposure=4.0), *others]
    said = refusal(views)
    assert f"{second.name} exposed 4 times as much as {first.name}" in said and "exposure='free'" in said


def test_several_lightings_under_a_curve_that_nobody_knows() -> None:
    first, *others = photographs()
    said = refusal([replace(first, lighting="off"), *others], response="free")
    assert said.startswith("CaptureOptions.response") and "ScanOptions(response='linear')" in said


def test_black_photographs() -> None:
    views = [replace(view, image=torch.zeros_like(view.image)) for view in photographs()[:3]]
    assert "black" in refusal(views)


def test_saturated_photographs() -> None:
    views = [replace(view, image=torch.ones_like(view.image), saturated_from=1.0) for view in photographs()[:3]]
    assert "100 % of the pixels saturated" in refusal(views)


def test_photographs_of_unknown_exposure_that_share_nothing() -> None:
    apart = []
    for z in (-0.45, 0.45):
        pose = look_at(torch.tensor([-0.3, -0.3, 0.0]), torch.tensor([-0.35, -0.35, z]))
        camera = Camera.from_field_of_view(pose, 0.5, 24, 24)
        with torch.no_grad():
            image = frozen_room().render(camera, LAMPS)
        apart.append(View(f"train/{z}", camera, image, torch.ones(24, 24)))
    assert "2 groups of 1, 1 photographs that share nothing" in refusal(apart, exposure="free")
