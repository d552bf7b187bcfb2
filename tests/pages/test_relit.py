"""The scene in other lights on a page."""

from __future__ import annotations

import base64
import dataclasses

import numpy as np
import pandas as pd

from html_page import Page
from rgspipe.evaluation.images import png_bytes
from rgspipe.pages import report
from rgspipe.pages.relit import ALT, KINDS, VIDEO_BYTES, Relighting, relightings
from rgspipe.relighting.pictures import video

PNG = png_bytes(np.zeros((8, 40, 3), np.uint8))
FRAMES = [np.full((8, 8, 3), value, np.uint8) for value in (0, 200)]
SUMMARY = pd.DataFrame(
    {"lights": [1, 8], "rigs": 2, "images": 6, "psnr": [41.5, np.inf], "ssim": 0.5, "flip": 0.1, "psnr_min": 30.25}
).assign(milliseconds=12.5)


def everything() -> list[Relighting]:
    return [
        Relighting("counts", PNG, 12.5, summary=SUMMARY, remark="Made on <Monday>."),
        Relighting("rig", PNG, 8.0, "light at (0, 0, 1)"),
        Relighting("orbit", PNG, 9.0, video=video(FRAMES, 1.0)),
    ]


def test_every_kind_is_described() -> None:
    assert set(ALT) == set(KINDS)


def test_a_report_shows_what_was_relit_and_nothing_where_nothing_was(full_report, full_contents) -> None:
    before = Page(full_report)
    assert "In other lights" not in before.text
    html = report.render_report(dataclasses.replace(full_contents, relightings=everything()))
    page = Page(html)
    for text in ("In other lights", "41.5", "∞", "light at (0, 0, 1); 8.0 ms an image", "A spot that goes around"):
        assert text in page.text
    assert "Made on &lt;Monday&gt;." in html
    assert len(page.pictures) == len(before.pictures) + 4 and all(words for _, words in page.pictures)
    assert {address.removeprefix("#") for address in page.addresses if address.startswith("#")} <= set(page.names)
    assert all(address.startswith(("data:image/", "#")) for address in page.addresses)


def test_a_video_is_inside_the_page_unless_it_is_too_large() -> None:
    clip = video(FRAMES, 1.0)
    (shown,) = relightings([Relighting("aim", PNG, 9.0, video=clip)])
    kind, content = shown["video"].split(";base64,")
    assert kind == "data:image/webp" and base64.b64decode(content) == clip and not shown["too_long"]
    (shown,) = relightings([Relighting("aim", PNG, 9.0, video=b"0" * (VIDEO_BYTES + 1))])
    assert shown["video"] is None and shown["too_long"]


def test_pictures_that_are_wider_than_the_page_are_made_smaller_smoothly() -> None:
    wide = Relighting("aim", png_bytes(np.zeros((2, 1500, 3), np.uint8)), 9.0)
    assert [one["smooth"] for one in relightings([wide, Relighting("aim", PNG, 9.0)])] == [True, False]
