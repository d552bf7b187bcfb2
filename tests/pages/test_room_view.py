"""What the script of the room in three dimensions is given: places to a fraction of a millimetre, and no NaN."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import shutil

import numpy as np
import pytest

from rgspipe.datasets.alternatives_file import ToldAlternative
from rgspipe.pages import report
from rgspipe.pages.room_view import LampMark, room_view
from rgspipe.scene import PointLight
from rgspipe.scene.models import CornellBox, exact_surfels
from rgspipe.scene.srgb import decode

CHROMIUM = shutil.which("chromium")

SURFELS = exact_surfels(CornellBox(), 500)


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_surfels_are_where_they_were(full_contents: report.ReportContents) -> None:
    view = room_view(SURFELS, full_contents.targets, full_contents.cameras)
    given, step = view["surfels"], view["surfels"]["step"]
    places = unpacked(given["places"], "<u2").reshape(-1, 3) * step + np.array(view["low"])
    # Half a step: measured 7.6e-6 of a room of 1.
    assert np.abs(places - SURFELS.centers.numpy()).max() < step
    sides = unpacked(given["sides"], "<i2").reshape(-1, 2, 3) * step
    normals = np.cross(sides[:, 0], sides[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert (normals * SURFELS.normals.numpy()).sum(axis=1).min() > 0.999
    assert given["count"] == len(places) == len(unpacked(given["colours"], "u1")) // 3


def test_lights_have_places_regions_and_words(full_contents: report.ReportContents) -> None:
    targets = full_contents.targets.copy()
    targets["var_xx"], targets["var_yy"], targets["var_zz"] = 1e-4, 4e-4, math.inf
    targets["var_xy"] = targets["var_xz"] = targets["var_yz"] = 0.0
    targets.loc[0, "x_true"] = math.nan
    targets.loc[1, "var_xx"] = math.nan
    view = room_view(SURFELS, targets, ())
    assert [(group["method"], group["views"], len(group["lights"])) for group in view["groups"]] == [
        ("search_lm", 1, 9),
        ("search_lm", 3, 9),
    ]
    first, second, third = view["groups"][0]["lights"][:3]
    assert first["truth"] is None and second["region"] is None
    lengths = sorted(math.hypot(*axis) for axis in third["region"])
    # √7.815 standard deviations; what is not known at all is as long as two rooms.
    assert lengths[:2] == pytest.approx([0.02796, 0.05591], rel=1e-3) and lengths[2] > 1.0
    assert first["others"] == []
    assert json.loads(json.dumps(view, allow_nan=False)) == json.loads(json.dumps(view))


def test_alternatives_stand_with_the_target_of_their_fit(full_contents: report.ReportContents) -> None:
    others = {("search_lm", 3, "occluded_002"): [ToldAlternative((PointLight([0.1, 0.2, 0.3], 1.0),), "Why.", True)]}
    view = room_view(SURFELS, full_contents.targets, (), others)
    [one] = [light for group in view["groups"] for light in group["lights"] if light["others"]]
    assert one["target"] == "occluded_002" and view["groups"][1]["views"] == 3
    assert one["others"] == [{"places": [[0.1, 0.2, 0.3]], "told": "Why.", "ruled_out": True}]


def test_lamps_of_a_capture_are_in_its_room(full_contents: report.ReportContents) -> None:
    marks = [
        LampMark("lamp 1", np.array([0.1, 0.2, 0.3]), np.diag([1e-4, 4e-4, 9e-4]), "± 0.02 an axis"),
        LampMark("lamp 2", np.array([0.4, 0.2, 0.3]), None, "± not known"),
    ]
    first, second = room_view(SURFELS, full_contents.targets, (), None, marks)["captured"]
    assert first["found"] == [0.1, 0.2, 0.3] and first["told"] == "± 0.02 an axis"
    # √7.815 standard deviations.
    assert sorted(math.hypot(*axis) for axis in first["region"]) == pytest.approx([0.02796, 0.05591, 0.08387], rel=1e-3)
    assert second["region"] is None
    page = report.render_report(dataclasses.replace(full_contents, fits=(), captured_lamps=marks))
    assert 'class="dot captured"' in page


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium (Debian: apt-get install chromium)")
def test_it_turns_and_tells_in_a_browser(full_contents: report.ReportContents, tmp_path) -> None:
    playwright = pytest.importorskip("playwright.sync_api")
    path = tmp_path / "report.html"
    place = SURFELS.centers.double().mean(dim=0).tolist()
    others = {("search_lm", 1, "occluded_002"): [ToldAlternative((PointLight(place, 1.0),), "9 times the cost.", True)]}
    path.write_text(report.render_report(dataclasses.replace(full_contents, fits=(), alternatives=others)))
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 400, "height": 800})
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(path.as_uri())
        canvas = page.locator(".room canvas")
        seen = canvas.evaluate("canvas => canvas.toDataURL()")
        canvas.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("seen => document.querySelector('.room canvas').toDataURL() !== seen", arg=seen)
        page.locator(".room select").nth(1).select_option("occluded_002")
        assert page.locator(".room output").inner_text().startswith("occluded_002, occluded: ")
        # Beside its own light, at the middle of the room, which is turned around it.
        canvas.hover(position={"x": 0.5 * canvas.bounding_box()["width"], "y": 0.5 * canvas.bounding_box()["height"]})
        ruled_out = "occluded_002, occluded: ruled out: 9 times the cost."
        page.wait_for_function("told => document.querySelector('.room output').textContent === told", arg=ruled_out)
        before = canvas.evaluate("canvas => canvas.toDataURL()")
        page.locator(".room input").nth(1).uncheck()
        page.wait_for_function("seen => document.querySelector('.room canvas').toDataURL() !== seen", arg=before)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        assert page.locator(".wide.more").count() > 0 and not errors
        folded = page.locator("details:not([open])")
        count = folded.count()
        # What is folded is on paper, and folded again afterwards.
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert count > 0 and folded.count() == 0
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert folded.count() == count
        browser.close()


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium (Debian: apt-get install chromium)")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_symbols_of_classes_are_seen_on_every_page(full_contents: report.ReportContents, tmp_path, scheme: str) -> None:
    """Contrast with the page as WCAG 2 has it; it wants 3 of what is drawn. Not made paler 1.6 on dark pages."""
    playwright = pytest.importorskip("playwright.sync_api")
    path = tmp_path / "report.html"
    path.write_text(report.render_report(dataclasses.replace(full_contents, fits=())))
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(color_scheme=scheme)
        page.goto(path.as_uri())
        drawn = page.evaluate(
            """() => [document.body, ...document.querySelectorAll(".dot")].map((element) => {
                const pen = document.createElement("canvas").getContext("2d");
                pen.fillStyle = getComputedStyle(element).backgroundColor;
                pen.fillRect(0, 0, 1, 1);
                return [element.className, ...pen.getImageData(0, 0, 1, 1).data.slice(0, 3)];
            })"""
        )
        browser.close()
    (_, *ground), *dots = drawn
    contrast = {name: _contrast(colour, ground) for name, *colour in dots}
    assert set(contrast) >= {"dot visible", "dot out_of_frame", "dot occluded"}
    assert min(contrast.values()) > 3.0  # measured 3.07 on white pages and 4.8 on dark ones


def _contrast(*colours: list[int]) -> float:
    dark, light = sorted(float(decode(np.array(one) / 255.0) @ [0.2126, 0.7152, 0.0722]) for one in colours)
    return (light + 0.05) / (dark + 0.05)
