"""The viewer in a real browser: one page, on which one test goes on where the other left it."""

from __future__ import annotations

import io
import re
import time
import zipfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from frozen_store import frozen_artifact
from lit_room import VISIBLE
from luminaire_files import ies
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import read_image, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.evaluation.images import tone_map
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.lights import KINDS
from rgspipe.stages.base import StageContext
from rgspipe.stages.relight import relight
from rgspipe.store.artifacts import Artifact
from rgspipe.viewer.lamp_controls import ARMS
from rgspipe.viewer.lamp_fields import CHOSEN
from rgspipe.viewer.lamp_numbers import RGB, numbers_of
from rgspipe.viewer.material import Photograph
from rgspipe.viewer.page import Page
from rgspipe.viewer.saving import FRAMES
from rgspipe.viewer.serve import Viewer, view
from rgspipe.viewer.session import ILLUMINANCE, IRRADIANCE, PICTURE, same_lights
from viewer.chromium import CHROMIUM, grip, launched, on_canvas

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(
        CHROMIUM is None or find_spec("playwright") is None,
        reason="needs chromium (Debian: apt-get install chromium) and Playwright (pip install playwright)",
    ),
]

LAMP = PointLight(list(VISIBLE), 0.5)

#: A camera that has the lamp in its middle.
CAMERA = Camera.look_at([-0.45, -0.45, 0.0], [0.1, -0.15, 0.25], fov_degrees=70, width=64, height=64)

#: Of the scene, for lamps that are exported.
NOTE = "Nobody measured these lamps."

#: How long a step may take on a busy machine, s.
PATIENCE = 300.0


@pytest.fixture(scope="module")
def freeze(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    """The room as the stage freeze writes it, for the stage relight too."""
    return frozen_artifact(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def viewer(freeze: Artifact) -> Iterator[Viewer]:
    frozen = FrozenScene.load(freeze.folder())
    # It has the name that the visitor's own photograph is going to have, and is offered no more then.
    reference = Photograph("photograph 0", CAMERA, frozen.render(CAMERA, LAMP))
    made = view(frozen, LAMP, camera=CAMERA, references=[reference], port=8190, resolution=64, notes=[NOTE])
    yield made
    made.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        made = launched(playwright)
        yield made
        made.close()


#: Keeps the image of a size that came last: pictures are as large as their camera, which no other image of a page is.
KEPT = """
const source = Object.getOwnPropertyDescriptor(HTMLImageElement.prototype, "src");
window.came = {};
Object.defineProperty(HTMLImageElement.prototype, "src", {...source, set(url) {
  this.addEventListener("load", () => { window.came[`${this.naturalWidth} ${this.naturalHeight}`] = this; });
  source.set.call(this, url);
}});
"""

#: Its RGBA values.
VALUES_OF = """size => {
  const image = window.came[size], board = document.createElement("canvas");
  [board.width, board.height] = [image.naturalWidth, image.naturalHeight];
  const pen = board.getContext("2d");
  pen.drawImage(image, 0, 0);
  return [...pen.getImageData(0, 0, board.width, board.height).data];
}"""


def frame(window, camera: Camera) -> np.ndarray:
    """(H, W, 3) the picture that the browser was sent last, as it decodes it."""
    values = window.evaluate(VALUES_OF, f"{camera.width} {camera.height}")
    return np.array(values, dtype=float).reshape(camera.height, camera.width, 4)[..., :3]


def opened(browser, url: str, width: int, height: int, dots: float = 1.0):
    """A page with so many dots a pixel, what it was told to log and what it asked for."""
    size = {"width": width, "height": height}
    page = browser.new_page(viewport=size, device_scale_factor=dots, accept_downloads=True)
    page.set_default_timeout(1e3 * PATIENCE)
    page.told, page.asked = [], []
    page.on("console", lambda message: page.told.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.told.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.add_init_script(KEPT)
    page.goto(url)
    page.get_by_text("There are no photographs to find lamps in.").wait_for()
    return page


@pytest.fixture(scope="module")
def window(viewer: Viewer, browser) -> Iterator:
    page = opened(browser, viewer.url, 640, 480)
    page.get_by_text("Brightest colour").wait_for()
    yield page
    elsewhere = [url for url in page.asked if not url.startswith((viewer.url, "data:", "blob:"))]
    assert (page.told, elsewhere) == ([], []), "nothing goes wrong, and nothing leaves the machine"


@pytest.fixture
def page(viewer: Viewer, window) -> Page:
    until(lambda: len(viewer.pages) == 1)
    [page] = viewer.pages.values()
    return page


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.05)


def seen(page: Page, window) -> np.ndarray:
    """(H, W, 3) what the canvas shows once the picture is at rest."""
    until(page.painter.at_rest.is_set)
    window.wait_for_timeout(1500)
    picture = window.locator("canvas").first.screenshot()
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(float)


def relit(freeze: Artifact, folder: Path, camera: Camera, lights: Path) -> np.ndarray:
    """(H, W, 3) what the stage relight writes of a camera under the lamps of a light file."""
    write_image(folder / "view_0.exr", np.zeros((camera.height, camera.width, 3), np.float32))
    write_transforms(folder / "transforms.json", [frame_entry("./view_0", camera)])
    changes = {"relight.lights": str(lights), "fit.target": str(folder)}
    config = with_changes(RgspipeConfig(stage="relight"), changes)
    relight.run(StageContext(config, {"freeze": freeze}, {}, folder / "out"))
    return read_image(folder / "out" / "images" / lights.stem / "view_0.exr")[0]


def test_a_lamp_is_dragged_and_the_picture_is_that_of_the_stage_relight(
    freeze: Artifact, window, page: Page, tmp_path: Path
) -> None:
    session = page.session
    until(lambda: torch.allclose(page.camera(64).origin, CAMERA.origin, atol=1e-6))
    camera = page.camera(64)
    arm = grip(session.images.frozen.size)
    window.mouse.move(*on_canvas(camera, window, LAMP.position + arm))
    window.wait_for_timeout(1500)
    window.mouse.down()
    window.wait_for_timeout(500)
    window.mouse.move(*on_canvas(camera, window, LAMP.position + arm + torch.tensor([0.1, 0.0, 0.0])), steps=8)
    window.wait_for_timeout(1500)
    window.mouse.up()
    until(lambda: float(session.lights[0].position[0]) > VISIBLE[0] + 0.05)
    # Along the arrow alone.
    torch.testing.assert_close(session.lights[0].position[1:], LAMP.position[1:], atol=1e-6, rtol=0.0)
    shown = seen(page, window)
    session.save(tmp_path / "lamps.json")
    expected = torch.from_numpy(relit(freeze, tmp_path, camera, tmp_path / "lamps.json"))
    # Measured 0.
    assert (session.image(camera) - expected).abs().max() <= 1e-3 * expected.max()
    # What the browser has is that in 8 bits: measured no level apart, of 255.
    apart = np.abs(frame(window, camera) - tone_map(expected, session._gain))
    assert apart.mean() <= 1e-3 * 255.0 and apart.max() <= 1.0
    picture = Image.fromarray(session.picture(camera)[0]).resize(shown.shape[1::-1], Image.Resampling.BILINEAR)
    # The gizmo covers a part, and the browser's way of enlarging differs on edges.
    assert np.median(np.abs(shown - np.asarray(picture, dtype=float))) < 3.0
    window.keyboard.press("z")
    until(lambda: torch.equal(session.lights[0].position, LAMP.position))


def test_a_photographed_lamp_is_found_again(window, page: Page) -> None:
    session = page.session
    assert not window.get_by_text("find it from the photographs").is_visible()
    window.get_by_role("button", name="take a photograph").click()
    until(lambda: len(session.case.photographs) == 1)
    window.locator("input[inputmode=decimal]").first.fill("0.2")
    window.keyboard.press("Enter")
    until(lambda: abs(float(session.lights[0].position[0]) - 0.2) < 1e-6)
    for name in ("find it from the photographs", "refit from here"):
        window.get_by_role("button", name=name).click()
        until(lambda: session.found is not None and not page.fit.searching)
        assert torch.allclose(session.lights[0].position, LAMP.position, atol=1e-2)
        assert torch.equal(session.case.truth[0].position, LAMP.position)
        window.mouse.click(20, 450)
        window.keyboard.press("8")
        until(lambda: same_lights(session.lights, session.found.path[-2]))
        session.found = None
        session.change([LAMP.at(LAMP.position - 0.1)])
    assert session.undo()


def test_keys_do_what_buttons_do(window, page: Page) -> None:
    session = page.session
    window.mouse.click(20, 450)
    window.keyboard.press("n")
    until(lambda: len(session.lights) == 2)
    for kind in [*KINDS][1:]:
        window.keyboard.press("k")
        until(lambda kind=kind: session.lights[1].kind == kind)
    window.keyboard.press("x")
    until(lambda: len(session.lights) == 1)
    for shown in (IRRADIANCE, ILLUMINANCE, PICTURE):
        window.keyboard.press("i")
        until(lambda shown=shown: session.shown == shown)
    window.keyboard.press("l")
    until(lambda: session.section is not None and session.section[0] == 0)
    before = session.section[1]
    window.keyboard.press("7")
    until(lambda: session.section[1] > before)
    for _ in range(3):
        window.keyboard.press("l")
    until(lambda: session.section is None)
    window.keyboard.press("u")
    until(lambda: session.exposure == 0.5)
    window.keyboard.press("Shift+U")
    until(lambda: not session.is_open_to_it)
    assert session.exposure == 0.5
    window.keyboard.press("Shift+U")
    until(lambda: session.is_open_to_it)
    for digit, node in enumerate(page.drawings.kinds.values(), start=1):
        window.keyboard.press(str(digit))
        until(lambda node=node: not node.visible)
        window.keyboard.press(str(digit))
        until(lambda node=node: node.visible)
    before = page.camera(64).origin
    window.keyboard.down("w")
    until(lambda: not torch.allclose(page.camera(64).origin, before, atol=1e-3))
    window.keyboard.up("w")


def test_keys_change_every_number_of_a_lamp(window, page: Page) -> None:
    session = page.session
    window.mouse.click(20, 450)
    session.change([KINDS["spot"].shaped().at(LAMP.position, torch.tensor([0.6, 0.0, -0.8]), LAMP.intensity)])
    page.actions.do("refresh", page.lamps.refresh).result()
    for number in numbers_of(session.lights[0], session.images.frozen.size):
        before = number.of(session.lights[0])
        until(lambda label=number.label: window.get_by_text(f"▸ {_told(label)}", exact=True).count() == 1)
        window.keyboard.press("PageDown")
        until(lambda number=number, before=before: number.of(session.lights[0]) < before)
        window.keyboard.press("z")
        until(lambda number=number, before=before: number.of(session.lights[0]) == before)
        window.keyboard.press("End")
    session.change([LAMP])
    page.actions.do("refresh", page.lamps.refresh).result()


#: What stands in the fields.
VALUES = "() => [...document.querySelectorAll('input')].map(field => field.value)"


def test_lamps_of_every_kind_are_made_with_the_fields_of_their_own_numbers(window, page: Page) -> None:
    session = page.session
    for kind in [*[*KINDS][1:], "point"]:
        # All at once, as fields come and go with the kind.
        until(lambda: session.lights[0].kind in window.evaluate(VALUES))
        window.locator("input").nth(window.evaluate(VALUES).index(session.lights[0].kind)).click()
        window.get_by_role("option", name=kind, exact=True).click()
        until(lambda kind=kind: session.lights[0].kind == kind)
        labels = [one.label for one in numbers_of(session.lights[0], session.images.frozen.size)]
        for label in ("exponent", "radius", "heading °", "turn °", "W/sr", "W/unit²"):
            field, is_there = window.get_by_text(re.compile(f"^({CHOSEN})?{label}$")), label in labels
            until(lambda field=field, is_there=is_there: field.is_visible() == is_there)
    session.change([LAMP])
    page.actions.do("refresh", page.lamps.refresh).result()


def test_a_luminaire_s_file_is_opened(window, page: Page) -> None:
    session, button = page.session, window.get_by_role("button", name="luminaire file")
    window.mouse.click(20, 450)
    window.keyboard.press("Shift+K")
    window.get_by_text("expected a lamp that is a profile").wait_for()
    session.as_kind(0, "profile")
    page.actions.do("refresh", page.lamps.refresh).result()
    window.get_by_text("Luminaire: none").wait_for()
    for name, content in (("broken.ies", b"nothing"), ("office.ies", ies().encode())):
        with window.expect_file_chooser() as chooser:
            window.keyboard.press("Shift+K")
        chooser.value.set_files({"name": name, "mimeType": "text/plain", "buffer": content})
        window.get_by_text("a line TILT" if name == "broken.ies" else "Luminaire: office.ies").wait_for()
    assert session.lights[0].label == "profile office.ies"
    expected = session.images.frozen.render(CAMERA, session.lights)
    # Measured 0.
    assert (session.image(CAMERA) - expected).abs().max() <= 1e-5 * expected.max()
    session.change([LAMP])
    page.actions.do("refresh", page.lamps.refresh).result()
    button.wait_for(state="hidden")


def _told(label: str) -> str:
    """Channels are those of one field."""
    return f"colour: {label}" if label in RGB else label


def test_a_gizmo_that_the_camera_stands_in_is_hidden(page: Page) -> None:
    for aside, shown in ((0.5 * ARMS, False), (2.0 * ARMS, True)):
        eye = LAMP.position - torch.tensor([aside * page.session.images.frozen.size, 0.0, 0.0])
        page._go_to(Camera.look_at(eye, LAMP.position + 0.1))
        until(lambda shown=shown: page.lamps._gizmos[0].visible == shown)
    page._go_to(CAMERA)


def test_lamps_are_taken_home(window, page: Page) -> None:
    window.mouse.click(20, 450)
    with window.expect_download() as download:
        window.keyboard.press("h")
    with zipfile.ZipFile(download.value.path()) as archive:
        assert {"lamps_blender.py", "lamps.usda", "lamps.gltf", "lamps.json", "lamps.txt"} <= {*archive.namelist()}
        assert NOTE in archive.read("lamps.txt").decode()


def test_the_picture_and_a_video_through_the_section_are_taken_home(window, page: Page) -> None:
    session = page.session
    window.mouse.click(20, 450)
    page._go_to(CAMERA)
    until(lambda: torch.allclose(page.camera(64).origin, CAMERA.origin, atol=1e-6))
    session.section = (1, -0.3)
    for key, frames in (("m", 1), ("y", FRAMES)):
        with window.expect_download() as download:
            window.keyboard.press(key)
        picture = Image.open(download.value.path())
        assert (getattr(picture, "n_frames", 1), max(picture.size) >= 64) == (frames, True)
        first = np.asarray(picture.convert("RGB"), dtype=float)
        assert first.std() > 1.0, "something is to be seen"
        expected = session.picture(session.seen(page.camera(64)), "sharp" if frames == 1 else "soft")[0]
        enlarged = Image.fromarray(expected).resize(picture.size, Image.Resampling.BILINEAR)
        # The still is exact; the video is compressed and enlarged, measured 2.1 of 255.
        assert np.abs(first - np.asarray(enlarged, dtype=float)).mean() <= (0.0 if frames == 1 else 4.0)
    session.section = None


def test_two_visitors_have_a_session_each(viewer: Viewer, browser, window, page: Page) -> None:
    other = opened(browser, viewer.url, 640, 480)
    until(lambda: len(viewer.pages) == 2)
    [theirs] = [one for one in viewer.pages.values() if one is not page]
    before = page.session.lights, page.session.shown, page.session.case
    other.get_by_text("Brightest colour").wait_for()
    other.mouse.click(20, 450)
    for key, done in (
        ("p", lambda: len(theirs.session.case.photographs) == 1),
        ("n", lambda: len(theirs.session.lights) == 2),
        ("i", lambda: theirs.session.shown == IRRADIANCE),
        ("f", lambda: theirs.session.found is not None and not theirs.fit.searching),
    ):
        other.keyboard.press(key)
        until(done)
    # One lamp was photographed; the second, added since, is not among those that are counted.
    assert len(theirs.session.lights) == 1
    assert torch.allclose(theirs.session.lights[0].position, LAMP.position, atol=1e-2)
    assert (page.session.lights, page.session.shown, page.session.case) == before
    assert other.told == []
    other.close()
    until(lambda: len(viewer.pages) == 1)


def test_fields_are_open_where_the_browser_draws_few_dots(viewer: Viewer, browser) -> None:
    # As browsers do on slow machines: 480 dots of 640 pixels.
    page = opened(browser, f"{viewer.url}?fixedDpr=0.75", 640, 480)
    page.get_by_text("Brightest colour").wait_for()
    page.close()


@pytest.mark.parametrize(("dark", "dots"), [(True, 1.0), (False, 3.0)])
def test_on_a_narrow_page_the_picture_has_most_of_it(viewer: Viewer, browser, dark: bool, dots: float) -> None:
    page = opened(browser, viewer.url + ("?darkMode" if dark else ""), 400, 800, dots)
    sheet = page.get_by_text("photographs", exact=True).first.bounding_box()
    # The fields are folded: measured 575 of 800.
    assert sheet["y"] > 0.6 * 800
    assert not page.get_by_role("button", name="add a lamp").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    assert page.told == []
    page.close()
