"""How often and how soon a browser shows a lamp that is dragged: `python tests/viewer/browser_speed.py [FOLDER]`.

Chromium draws without a GPU, on the same processor that makes the pictures; whose time a picture takes is told on
Linux. Without the folder of a frozen scene it is a Cornell box of 10000 surfels on its true surfaces.
"""

from __future__ import annotations

import contextlib
import math
import os
import statistics
import sys
import time
from pathlib import Path

import torch
from chromium import grip, launched, on_canvas

import rgspipe as rg
from rgspipe.viewer.cameras import first_camera
from rgspipe.viewer.page import Page
from rgspipe.viewer.serve import Viewer, view

#: Pixels of windows.
WINDOWS = ((1280, 800), (640, 480))

#: Seconds of a drag without rest, times the mouse is moved in each, and single moves with a rest after each, s.
DRAGGED, HERTZ, MOVES, REST = 10.0, 60.0, 15, 1.5

#: Pixels that the mouse is moved by.
FAR = 40.0

#: Notes when the mouse moves, and when a picture is drawn: its texture has come, and a frame has been asked for.
NOTES = """
window.moved = []; window.drawn = [];
window.addEventListener("pointermove", () => window.moved.push(performance.now()), true);
const source = Object.getOwnPropertyDescriptor(HTMLImageElement.prototype, "src");
Object.defineProperty(HTMLImageElement.prototype, "src", {...source, set(url) {
  if (url.startsWith("blob:")) this.addEventListener("load",
    () => requestAnimationFrame(() => window.drawn.push(performance.now())));
  source.set.call(this, url);
}});
"""


def main() -> None:
    """Print pictures a second while a lamp is dragged, and the time from a move of the mouse to its picture."""
    from playwright.sync_api import sync_playwright

    given = sys.argv[1:]
    frozen = rg.FrozenScene.load(given[0]) if given else rg.FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), 10000))
    lower, upper = frozen.bounds
    lamp = rg.PointLight((0.5 * (lower + upper)).tolist(), 1.0)
    viewer = view(frozen, lamp, camera=first_camera(lower, upper), port=8290)
    print(f"{len(frozen.surfels)} surfels, {torch.get_num_threads()} threads", flush=True)
    with sync_playwright() as playwright:
        browser = launched(playwright)
        for width, height in WINDOWS:
            print(f"a window of {width} by {height}: ", end="", flush=True)
            window = browser.new_page(viewport={"width": width, "height": height})
            _measure(viewer, window, lamp)
            window.close()
        browser.close()
    viewer.stop()


def _measure(viewer: Viewer, window, lamp: rg.PointLight) -> None:
    window.add_init_script(NOTES)
    window.goto(viewer.url)
    window.get_by_text("Brightest colour").wait_for(timeout=3e5)
    start = _held(window, _page(viewer), lamp)
    _dragged(window, start)
    window.wait_for_timeout(1e3 * REST)
    _moved_once(window, start)
    window.mouse.up()


def _page(viewer: Viewer) -> Page:
    while len(viewer.pages) != 1:
        time.sleep(0.1)
    [page] = viewer.pages.values()
    page.painter.at_rest.wait()
    return page


def _held(window, page: Page, lamp: rg.PointLight) -> tuple[float, float]:
    """Where on the page the mouse holds the lamp by an arrow of its gizmo."""
    window.wait_for_timeout(3e3)
    start = on_canvas(page.camera(256), window, lamp.position + grip(page.session.images.frozen.size))
    window.mouse.move(*start)
    window.wait_for_timeout(1e3 * REST)
    window.mouse.down()
    window.wait_for_timeout(1e3 * REST)
    return start


def _dragged(window, start: tuple[float, float]) -> None:
    x, y = start
    window.evaluate("window.moved = []; window.drawn = []")
    own, others, began = time.process_time(), _of_children(), time.monotonic()
    while (gone := time.monotonic() - began) < DRAGGED:
        window.mouse.move(x + FAR * math.sin(gone), y)
        time.sleep(max(0.0, began + gone + 1.0 / HERTZ - time.monotonic()))
    moved, drawn = window.evaluate("[window.moved, window.drawn]")
    seconds = 1e-3 * (moved[-1] - moved[0])
    rate = sum(when <= moved[-1] for when in drawn) / seconds
    print(f"{rate:.1f} pictures a second for {len(moved) / seconds:.0f} moves of the mouse, ", end="", flush=True)
    parts = [1e3 * spent / len(drawn) for spent in (time.process_time() - own, _of_children() - others)]
    print("of a picture's processor time {:.0f} ms here and {:.0f} in the browser, ".format(*parts), end="", flush=True)


def _of_children() -> float:
    """Seconds of the processor that the processes which this one started have taken, and those that these did."""
    spent, parents = {}, {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            told = place.read_text().rpartition(")")[2].split()
            parents[int(place.parent.name)] = int(told[1])
            spent[int(place.parent.name)] = (int(told[11]) + int(told[12])) / os.sysconf("SC_CLK_TCK")
    mine = {os.getpid()}
    while further := {one for one, parent in parents.items() if parent in mine} - mine:
        mine |= further
    return sum(spent[one] for one in mine - {os.getpid()})


def _moved_once(window, start: tuple[float, float]) -> None:
    took = []
    for move in range(MOVES):
        window.evaluate("window.moved = []; window.drawn = []")
        window.mouse.move(start[0] + (FAR if move % 2 else 0.0), start[1])
        window.wait_for_timeout(1e3 * REST)
        moved, drawn = window.evaluate("[window.moved, window.drawn]")
        took.append(min(when for when in drawn if when > moved[0]) - moved[0])
    print(f"each {statistics.median(took):.0f} ms after its move, {max(took):.0f} at most", flush=True)


if __name__ == "__main__":
    main()
