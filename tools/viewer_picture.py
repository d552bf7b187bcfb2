"""Make docs/images/viewer.jpg, the page of `rgspipe demo` with its lamp found: `python tools/viewer_picture.py [FILE]`.

Further arguments are pixels across, pixels down, and `light` for a light page. Needs Chromium and Playwright.
"""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from rgspipe.demo import TARGET, demo_scene
from rgspipe.viewer.material import case_in
from rgspipe.viewer.serve import Viewer, view

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "viewer.jpg"

#: Software rendering, so that no GPU is needed.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

#: Of a JPEG: letters are clear, and it takes a fourth of a PNG.
QUALITY = 85

#: Seconds that a step may take.
PATIENCE = 400.0


def photographed(viewer: Viewer, path: Path, width: int, height: int, dark: bool) -> None:
    """Find the lamp on the page, and write what the page shows then."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(1e3 * PATIENCE)
        page.on("console", lambda message: print(message.text) if message.type == "error" else None)
        page.goto(viewer.url)
        page.get_by_text("find it from the photographs").click()
        end = time.monotonic() + PATIENCE
        while not any(one.session.found for one in viewer.pages.values()) and time.monotonic() < end:
            page.wait_for_timeout(500)
        if not dark:
            page.get_by_text("picture", exact=True).first.click() if width < 577 else None
            page.get_by_label("dark page").click()
        for close in page.get_by_role("alert").get_by_role("button").all():
            close.click()
        page.wait_for_timeout(6000)
        page.screenshot(path=path, quality=QUALITY if path.suffix == ".jpg" else None)
        browser.close()


if __name__ == "__main__":
    words = sys.argv[1:] + [str(PICTURE), "1280", "720", "dark"][len(sys.argv) - 1 :]
    shown = view(demo_scene(), cases=[case_in(TARGET)], port=8393)
    photographed(shown, Path(words[0]), int(words[1]), int(words[2]), words[3] != "light")
    shown.stop()
