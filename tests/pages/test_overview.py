"""The page over scenes."""

import json
import math
from dataclasses import replace

import numpy as np

from html_page import Page
from rgspipe.evaluation import images
from rgspipe.pages.overview import SceneEntry, render_overview, scene_summary


def test_every_scene_has_its_figures_pictures_and_a_link(full_contents):
    view = full_contents.gallery.train[0].png
    summary = scene_summary(full_contents)
    entry = SceneEntry("corner", "../corner/report.html", "2026-01-02 03:04", summary, view, full_contents.comparison)
    page = Page(render_overview([entry], {"room": "make <it> so"}))
    assert {address for address in page.addresses if not address.startswith("data:image/")} == {"../corner/report.html"}
    assert len(page.pictures) == 2 and all(words for _, words in page.pictures)
    for text in ("1 scene, from images to lights", "38.2", "8 training views", "2026-01-02 03:04", "out of frame"):
        assert text in page.text
    assert "room has no report yet. Make it with make <it> so" in page.text


def test_figures_that_are_not_known_are_dashes():
    summary = {"counts": "", "highlights": {"psnr": 30.0}, "lights": []}
    page = Page(render_overview([SceneEntry("room", "room.html", "today", summary)], {}))
    assert "30.0 — — — — — — — — — —" in page.text and not page.pictures


def test_errors_of_failed_fits_are_infinite_and_not_unknown(full_contents):
    contents = replace(full_contents, summary=full_contents.summary.assign(median_position_error=math.inf))
    summary = json.loads(json.dumps(scene_summary(contents), allow_nan=False))
    page = Page(render_overview([SceneEntry("room", "room.html", "today", summary)], {}))
    # In the row of the scene, and in those of its three classes.
    assert page.text.count("∞") == 4


def test_without_any_report_the_page_says_so():
    page = Page(render_overview([], {"room": "make room", "corner": "make corner"}))
    assert "None of the scenes has a report yet" in page.text and page.text.count("has no report yet. Make it") == 2
    assert not page.addresses


def test_pictures_are_made_smaller_than_their_limits(full_contents):
    large = images.png_bytes(images.tone_map(np.random.default_rng(0).uniform(size=(600, 900, 3)), 1.0))
    entry = SceneEntry("room", "room.html", "today", scene_summary(full_contents), large, large)
    assert len(render_overview([entry], {})) < 900_000
