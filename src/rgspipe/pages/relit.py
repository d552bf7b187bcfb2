"""What a page shows of the frozen scene in other lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from rgspipe.pages.html import data_address, decimals, picture_address

#: Most bytes of a picture and of a video, before they are encoded as text.
PICTURE_BYTES, VIDEO_BYTES = 700_000, 1_500_000

#: Pictures that are wider than the page, in pixels, are made smaller smoothly; single pixels of others stay sharp.
PAGE_WIDTH = 980

#: The kinds of relighting in the order in which they are shown: what each is called, and what it is.
KINDS = {
    "counts": (
        "More and more lights",
        "The true lights of targets in the frozen scene, beside path-traced images of them. Each column is the image "
        "with the median PSNR among those of so many lights, exposed for its truth; differences are red where the "
        "frozen scene is too bright and blue where it is too dark, in full colour at a fifth of exposed white.",
    ),
    "targets": (
        "The true lights of the targets",
        "The lights that fits look for, in the frozen scene, beside the targets' own images: what is left between them "
        "is what a perfect fit would leave. Each column is the image with the median PSNR.",
    ),
    "rig": ("In other lights", "One rig, seen by each camera that was asked for; all pictures are exposed alike."),
    "aim": ("A spot that turns", "A spot stays at its place while its axis sweeps over the scene."),
    "orbit": ("A spot that goes around", "A spot goes once around the scene's middle, aimed at it."),
}
#: What the picture of each kind shows, for those who cannot see it.
ALT = {
    "counts": "path-traced truth, frozen scene and difference for each number of lights",
    "targets": "target, frozen scene and difference",
    "rig": "the scene under one rig, a picture for each camera",
    "aim": "frames of a spot that turns, in order",
    "orbit": "frames of a spot that goes around, in order",
}


@dataclass(frozen=True)
class Relighting:
    """One artifact of the frozen scene in other lights.

    Attributes:
        kind: one of `KINDS`.
        png: its picture.
        milliseconds: of an image.
        words: under the picture.
        summary: rows of `relight_summary`, where there is truth.
        video: the sweep as an animated WebP.
        remark: what the reader must know, or "".
    """

    kind: str
    png: bytes
    milliseconds: float
    words: str = ""
    summary: pd.DataFrame | None = None
    video: bytes | None = None
    remark: str = ""


def relightings(found: Sequence[Relighting]) -> list[dict[str, Any]]:
    """Title, words, picture, video and table of each, as text and addresses."""
    return [_shown(one) for one in found]


def _shown(one: Relighting) -> dict[str, Any]:
    title, words = KINDS[one.kind]
    fits = one.video is not None and len(one.video) <= VIDEO_BYTES
    return {
        "title": title,
        "words": words,
        "remark": one.remark,
        "drawn": one.summary is not None,
        "smooth": _width(one.png) > PAGE_WIDTH,
        "source": picture_address(one.png, PICTURE_BYTES),
        "alt": ALT[one.kind],
        "caption": f"{one.words}{'; ' if one.words else ''}{decimals(one.milliseconds, 1)} ms an image",
        "video": data_address(one.video, "image/webp") if fits else None,
        "too_long": one.video is not None and not fits,
        "rows": [] if one.summary is None else one.summary.to_dict("records"),
    }


def _width(png: bytes) -> int:
    """Pixels across, from the file's header."""
    return int.from_bytes(png[16:20], "big")
