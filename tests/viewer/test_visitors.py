"""Visitors whose browsers tell of cameras that cannot be: their pages wait, and go with them."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.viewer.serve import Viewer, view

pytest.importorskip("viser")

import zstandard  # viser brings both
from websockets.sync.client import ClientConnection

from rgspipe.viewer.page import Page
from viewer.visiting import message, visited, visitor, wait_for

NAN = float("nan")

#: First messages of cameras that cannot be.
IMPOSSIBLE: dict[str, dict[str, Any]] = {
    "a canvas without a size": {"image_width": 0, "image_height": 0},
    "a canvas without a height": {"image_height": 0},
    "a place of NaN": {"position": [NAN] * 3},
    "a turn of length zero": {"wxyz": [0.0] * 4},
    "a field of view of NaN": {"fov": NAN},
    "a target that is its place": {"look_at": [0.0, -1.5, 0.0]},
    "up that is nowhere": {"up_direction": [NAN] * 3},
    "a place of one number, a turn of a word": {"position": [1.0], "wxyz": ["x"]},
    "a place beyond all numbers": {"position": [1e300] * 3, "look_at": [-1e308] * 3},
}

#: viser says so in the server's log where a browser tells of words in the place of numbers, as these tests do.
TOLD_OF_WORDS = pytest.mark.filterwarnings(r"ignore:\[viser\] .* does not match annotation")

#: Where the first picture is taken from.
EYE = [-0.45, -0.45, 0.0]


@pytest.fixture(scope="module")
def viewer(frozen: FrozenScene) -> Iterator[Viewer]:
    camera = Camera.look_at(EYE, [0.1, -0.15, 0.25], fov_degrees=70, width=32, height=32)
    made = view(frozen, camera=camera, port=0, resolution=32)
    yield made
    made.stop()


def words(frame: bytes) -> bytes:
    """What viser sends, without its arrays: after two lengths of 8 bytes, the second of them the compressed one."""
    return zstandard.ZstdDecompressor().decompress(frame[16 : 16 + int.from_bytes(frame[8:16], "little")])


def wait_until_told(browser: ClientConnection, *kinds: bytes) -> None:
    """Until each kind of message came."""
    awaited = {*kinds}
    while awaited:
        told = words(browser.recv(timeout=60.0))
        awaited = {one for one in awaited if one not in told}


def threads() -> list[str]:
    """Those of pages."""
    return [one.name for one in threading.enumerate() if one.name.startswith("rgspipe-page")]


@TOLD_OF_WORDS
@pytest.mark.parametrize("first", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_a_page_waits_for_a_camera_that_can_be_and_goes_with_its_visitor(viewer: Viewer, first: dict[str, Any]) -> None:
    with visitor(viewer) as browser:
        browser.send(message(**first))
        wait_for(lambda: viewer.pages)
        [page] = viewer.pages.values()
        wait_for(lambda: hasattr(page, "picture"))
        browser.send(message())
        # The browser is told where to look from, and shown a picture.
        wait_until_told(browser, b"SetCameraPositionMessage", b"BackgroundImageMessage")
        assert threads()
    wait_for(lambda: not viewer.pages and not threads())


@TOLD_OF_WORDS
def test_a_camera_that_can_be_no_more_harms_no_page(viewer: Viewer) -> None:
    with visitor(viewer) as browser:
        browser.send(message())
        wait_for(lambda: viewer.pages)
        [page] = viewer.pages.values()
        wait_for(lambda: page._begun is not None and page._wanted is None)  # it went to its first place
        for other in IMPOSSIBLE.values():
            browser.send(message(**other))
        browser.send(message(position=[1.0, -3.0, 0.0]))
        wait_for(lambda: page._client.camera.position.tolist() == [1.0, -3.0, 0.0])
        page._go_to(viewer._exhibit.camera)
        assert page._client.camera.position.tolist() == pytest.approx(EYE)
    wait_for(lambda: not viewer.pages and not threads())


@pytest.mark.filterwarnings("error")
def test_what_is_made_for_a_visitor_who_has_left_is_no_warning(viewer: Viewer) -> None:
    with visited(viewer) as (page, _):
        pass
    assert page._client._websock_connection.get_message_buffer().done
    page._show(np.zeros((8, 8, 3), np.uint8), 1.0, True)


def test_the_first_picture_is_taken_from_where_browsers_are_told_to_begin(viewer: Viewer) -> None:
    begin = viewer._server.initial_camera
    assert begin.position == pytest.approx(EYE)
    aim = [one - other for one, other in zip(begin.look_at, EYE, strict=True)]
    # Along 0.55, 0.3, 0.25.
    assert [one / aim[0] for one in aim] == pytest.approx([1.0, 0.3 / 0.55, 0.25 / 0.55])


def test_sides_stay_in_sight_where_the_window_becomes_narrow(viewer: Viewer) -> None:
    with visitor(viewer) as browser:
        browser.send(message(image_width=300))
        wait_for(lambda: viewer.pages)
        [page] = viewer.pages.values()
        held, half = page._client.camera, math.radians(35.0)
        wait_for(lambda: page._begun is not None and page._wanted is None)
        assert held.fov == pytest.approx(2.0 * half, abs=1e-6)
        told = {"position": EYE, "look_at": held.look_at.tolist(), "fov": held.fov}
        browser.send(message(**told, image_width=150))
        wait_for(lambda: abs(math.tan(0.5 * held.fov) - 2.0 * math.tan(half)) < 1e-6)
        once = page._begun
        browser.send(message(**told, image_width=150))  # it did not hear of it
        wait_for(lambda: page._begun is not once)
        wait_for(lambda: abs(math.tan(0.5 * held.fov) - 2.0 * math.tan(half)) < 1e-6)
        # Not where the visitor has moved.
        browser.send(message(**(told | {"position": [0.0, -0.4, 0.0]}), image_width=150))
        wait_for(lambda: page._begun is None)
        browser.send(message(**(told | {"position": [0.0, -0.4, 0.0]}), image_width=100))
        wait_for(lambda: held.image_width == 100 and page.actions.do("wait", lambda: None).result() is None)
        assert held.fov == pytest.approx(2.0 * half)
    wait_for(lambda: not viewer.pages and not threads())


@pytest.mark.parametrize(
    ("agent", "width", "height", "is_wide"),
    [
        ("Mozilla/5.0 (X11; Linux x86_64)", 580, 1000, True),
        ("Mozilla/5.0 (X11; Linux x86_64)", 400, 800, False),
        # A telephone whose browser has bars of its own, upright and turned.
        ("Mozilla/5.0 (iPhone) Mobile/15E148", 1170, 1992, False),
        ("Mozilla/5.0 (iPhone) Mobile/15E148", 1992, 1170, True),
    ],
)
def test_fields_begin_folded_on_telephones_alone(
    viewer: Viewer, agent: str, width: int, height: int, is_wide: bool
) -> None:
    with visitor(viewer, agent) as browser:
        browser.send(message(image_width=width, image_height=height))
        wait_for(lambda: viewer.pages)
        [page] = viewer.pages.values()
        assert page._is_wide() is is_wide
    wait_for(lambda: not viewer.pages and not threads())


def test_thirty_visitors_who_leave_at_once_leave_no_thread(viewer: Viewer) -> None:
    for _ in range(30):
        with visitor(viewer) as browser:
            browser.send(message(image_height=0))
    wait_for(lambda: not viewer.pages and not threads())
    with visitor(viewer) as browser:
        browser.send(message())
        wait_for(lambda: viewer.pages)
    wait_for(lambda: not viewer.pages and not threads())


def test_a_viewer_that_ends_waits_for_pages_that_are_being_furnished(
    frozen: FrozenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    furnish, entered, furnished = Page.furnish, threading.Event(), threading.Event()

    def slowly(page: Page) -> None:
        if page._exhibit is not brief._exhibit:  # of the viewer of the other tests, whose visitors may come late
            furnish(page)
            return
        entered.set()
        time.sleep(0.3)
        furnish(page)
        furnished.set()

    monkeypatch.setattr(Page, "furnish", slowly)
    brief = view(frozen, port=0, resolution=32)
    with visitor(brief) as browser:
        browser.send(message())
        assert entered.wait(60.0)
        brief.stop()
    assert furnished.is_set()
    wait_for(lambda: not threads())
