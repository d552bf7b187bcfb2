"""Everything on the page that can be clicked has a key and a line of help."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from lit_room import VISIBLE, room_cameras
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.scene.lights import KINDS
from rgspipe.viewer.material import Case, Photograph
from rgspipe.viewer.serve import Viewer, view

pytest.importorskip("viser")

from websockets.sync.client import ClientConnection

from rgspipe.viewer.page import Page
from viewer.visiting import keys_of, press, visited, wait_for

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "view.md"
LAMP = PointLight(list(VISIBLE), 0.5)


@pytest.fixture(scope="module")
def viewer(frozen: FrozenScene) -> Iterator[Viewer]:
    taken = [Photograph(f"view {k}", one, frozen.render(one, LAMP)) for k, one in enumerate(room_cameras(16)[:2])]
    made = view(frozen, LAMP, cases=[Case("evening", taken)], port=0, resolution=32)
    yield made
    made.stop()


@pytest.fixture
def both(viewer: Viewer) -> Iterator[tuple[Page, ClientConnection]]:
    with visited(viewer) as both:
        yield both


@pytest.fixture
def page(both: tuple[Page, ClientConnection]) -> Page:
    return both[0]


def named(words: str) -> list[str]:
    """The keys in some words, as `U and J`, `6, 7`, `Page Up` or `Shift-G`."""
    found = re.findall(r"\b(?:Shift-)?[A-Z0-9]\b|\b(?:End|Home|Page Up|Page Down)\b", words)
    return [one.replace(" ", "").lower() for one in found]


def test_every_control_has_a_key_and_says_so(page: Page) -> None:
    keys, controls = keys_of(page), {}
    for kind in KINDS:  # lamps of each kind have fields of their own
        page.session.change([KINDS[kind].shaped().at(LAMP.position, None, LAMP.intensity)])
        page.lamps.refresh()
        controls |= page._client.gui._gui_input_handle_from_uuid
    assert len(controls) > 30
    for control in controls.values():
        sentence = (control.hint or "").rpartition("Key")[2]
        its = {*named(sentence)}
        assert its and its <= keys.keys(), f"{control.label}: {control.hint}"
    assert all(one.description for one in keys.values())


def test_the_guide_s_table_has_every_key(page: Page) -> None:
    table = GUIDE.read_text().partition("| key |")[2].partition("\n\n")[0]
    cells = " ".join(row.split("|")[1] for row in table.splitlines()[2:])
    assert {*keys_of(page)} - {*"12345"} <= {*named(cells)}
    assert "1 to 5" in cells


def test_keys_leave_the_photographs_and_reach_the_camera_that_was_advised(
    both: tuple[Page, ClientConnection],
) -> None:
    page, browser = both
    first, second = (one.camera for one in page.session.case.photographs)
    went = []
    page.fit._visit = replace(page.fit._visit, go_to=went.append)
    press(page, browser, "g")
    press(page, browser, "g")
    assert went == [first, second] and page.fit._strip.visible
    press(page, browser, "shift-g")
    assert page.fit._view.value == "free" and not page.fit._strip.visible
    press(page, browser, "shift-v")  # none was asked for
    press(page, browser, "v")
    wait_for(lambda: page.fit._advised is not None)
    press(page, browser, "shift-v")
    assert went[2:] == [page.fit._advised] and page.fit._view.value == "free"


def test_a_key_leaves_light_from_all_around_out(both: tuple[Page, ClientConnection]) -> None:
    page, browser = both
    for is_open in (False, True):
        press(page, browser, "shift-u")
        assert page.session.is_open_to_it is is_open and page.picture._around.value is is_open
