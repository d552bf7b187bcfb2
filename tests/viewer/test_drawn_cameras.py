"""Cameras that are drawn, to look through: of photographs that are searched, and of a dataset."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE, room_cameras
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight
from rgspipe.viewer.material import Case, Photograph
from rgspipe.viewer.serve import view

pytest.importorskip("viser")

from rgspipe.viewer.drawings import MOST_FURTHER
from rgspipe.viewer.page import Page
from viewer.visiting import visited

LAMP = PointLight(list(VISIBLE), 0.5)


def photographs(count: int, name: str) -> list[Photograph]:
    cameras = [room_cameras(8)[index % 2] for index in range(count)]
    return [Photograph(f"{name}_{index}", camera, torch.ones(8, 8, 3)) for index, camera in enumerate(cameras)]


def click(page: Page, index: int) -> None:
    """The frustum of a camera, and until that is done."""
    [entry] = page.drawings._frusta[index]._impl.click_cb
    entry.callback(None)
    page.actions.do("wait", lambda: None).result()


def test_a_dataset_s_cameras_are_drawn_and_looked_through_beside_their_photographs(frozen: FrozenScene) -> None:
    viewer = view(frozen, LAMP, references=photographs(3, "test/r"), port=0, resolution=32)
    with visited(viewer) as (page, _):
        went: list[Camera] = []
        page.fit._visit = replace(page.fit._visit, go_to=went.append)
        assert len(page.drawings._frusta) == 3
        click(page, 1)
        assert went == [page._exhibit.references[1].camera]
        assert page.fit._view.value == "test/r_1" and page.fit._strip.visible
        assert page.fit._strip.label.startswith("test/r_1: ")
    viewer.stop()


def test_of_many_cameras_some_are_drawn_smaller_than_those_of_photographs_that_are_searched(
    frozen: FrozenScene,
) -> None:
    case = Case("evening", photographs(2, "view"), others=photographs(2, "left out"))
    viewer = view(frozen, LAMP, cases=[case], references=photographs(300, "test/r"), port=0, resolution=32)
    with visited(viewer) as (page, _):
        searched, others = page.drawings._frusta[:2], page.drawings._frusta[2:]
        assert len(others) == MOST_FURTHER
        assert max(one.scale for one in others) < min(one.scale for one in searched)
        assert {one.color for one in others}.isdisjoint({one.color for one in searched})
        click(page, 0)
        assert page.fit._view.value == "view_0"
        click(page, 2 + MOST_FURTHER - 1)
        assert page.fit._view.value == "test/r_299"
        page.fit._take()
        assert len(page.drawings._frusta) == 1 + MOST_FURTHER
    viewer.stop()
