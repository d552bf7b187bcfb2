"""The viewer in a real browser."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec

import pytest
import torch

from lit_room import VISIBLE, frozen_room, room_cameras
from rgspipe.scene import PointLight
from rgspipe.viewer.page import Page
from rgspipe.viewer.serve import Viewer, view

CHROMIUM = shutil.which("chromium")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(
        CHROMIUM is None or find_spec("playwright") is None,
        reason="needs chromium (Debian: apt-get install chromium) and Playwright (pip install playwright)",
    ),
]

#: Software rendering, so that no GPU is needed.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

LAMP = PointLight(list(VISIBLE), 0.5)


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    made = view(frozen_room(), LAMP, camera=room_cameras(64)[0], port=8190, resolution=64)
    yield made
    made.stop()


@pytest.fixture
def browser_page(viewer: Viewer) -> Iterator:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 900, "height": 700})
        page.told = []
        page.on("console", lambda message: page.told.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: page.told.append(str(error)))
        page.asked = []
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto(viewer.url)
        page.get_by_text("add a lamp").wait_for(timeout=60_000)
        yield page
        browser.close()


def until(true: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.1)


def the_page(viewer: Viewer) -> Page:
    until(lambda: len(viewer.pages) == 1)
    [page] = viewer.pages.values()
    return page


def test_a_lamp_is_moved_photographed_and_found(viewer: Viewer, browser_page) -> None:
    page = the_page(viewer)
    session = page._session
    browser_page.get_by_text("Brightest colour").wait_for(timeout=60_000)
    # The picture is what the scene renders for the camera of the page.
    camera = page.camera(64)
    expected = session.images.frozen.render(camera, session.lights)
    assert (session.image(camera) - expected).abs().max() < 1e-3 * expected.max()
    browser_page.get_by_role("button", name="take a photograph").click()
    until(lambda: len(session.photographs) == 1)
    browser_page.locator("input[inputmode=decimal]").first.fill("0.2")
    browser_page.keyboard.press("Enter")
    until(lambda: abs(float(session.lights[0].position[0]) - 0.2) < 1e-6)
    browser_page.get_by_role("button", name="find the lights").click()
    until(lambda: session.found is not None and not page._searching)
    assert torch.allclose(session.lights[0].position, LAMP.position, atol=1e-2)
    browser_page.get_by_role("button", name="undo").click()
    until(lambda: abs(float(session.lights[0].position[0]) - 0.2) < 1e-6)
    assert browser_page.told == []
    elsewhere = [url for url in browser_page.asked if not url.startswith((viewer.url, "data:", "blob:"))]
    assert elsewhere == [], "nothing leaves the machine"
