"""Photographs whose cameras look past the scene are told; the scene's own are not."""

from __future__ import annotations

import pytest
import torch

from lit_room import room_cameras
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.viewer.astray import astray
from rgspipe.viewer.material import Case, Photograph
from rgspipe.viewer.serve import view

pytest.importorskip("viser")

from rgspipe.viewer.fit_controls import told


def photograph(name: str, camera: Camera) -> Photograph:
    return Photograph(name, camera, torch.ones(camera.height, camera.width, 3))


@pytest.fixture
def own() -> list[Photograph]:
    return [photograph(f"own {index}", camera) for index, camera in enumerate(room_cameras(8))]


@pytest.fixture
def other() -> Photograph:
    return photograph("other", Camera.look_at([0.0, -3.0, 0.0], [0.0, -6.0, 0.0], width=8, height=8))


def test_cameras_that_look_past_the_scene_are_named(
    frozen: FrozenScene, own: list[Photograph], other: Photograph
) -> None:
    assert astray(own, frozen.surfels.centers) == ""
    assert "before the camera of other. Check that cameras are" in astray([*own, other], frozen.surfels.centers)


def test_the_page_says_so_before_any_search(frozen: FrozenScene, own: list[Photograph], other: Photograph) -> None:
    viewer = view(frozen, cases=[Case("own", own), Case("other", [other])], port=0)
    viewer.stop()
    first, second = viewer._exhibit.cases
    assert told(first, None, 0) == f"{len(own)} photographs."
    assert told(second, None, 0).startswith("1 photograph.\n\nNothing of the scene is before the camera of other.")
