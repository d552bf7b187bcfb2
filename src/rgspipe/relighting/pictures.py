"""Pictures of a scene in other lights: contact sheets, strips, videos, and comparisons with path-traced truth."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from PIL import Image

from rgspipe.evaluation.images import Bytes, beside, display_gain, signed_difference, stack, tone_map
from rgspipe.evaluation.plots import STYLE

#: Most pictures of a contact sheet side by side.
COLUMNS = 6
#: A video's frames are enlarged by whole numbers until they have about so many pixels across: compression would blur
#: the single pixels of small ones.
VIDEO_WIDTH = 384
#: Quality of a video's frames, of 100.
VIDEO_QUALITY = 93
#: Width of a column of a comparison, inches.
COLUMN_WIDTH = 1.75

Radiance = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Relit:
    """One image beside its truth, (H, W, 3) linear radiance each, under so many lights, and its PSNR [dB]."""

    lights: int
    truth: Radiance
    render: Radiance
    psnr: float


def common_gain(renders: Sequence[Radiance]) -> float:
    """The gain of several pictures that are to be compared: that of all their pixels together."""
    return display_gain(np.concatenate([render.reshape(-1, 3) for render in renders]))


def contact_sheet(renders: Sequence[Radiance]) -> Bytes:
    """(…, …, 3) uint8: images (H, W, 3) in rows of at most six, all exposed alike."""
    return grid(developed(renders))


def developed(renders: Sequence[Radiance]) -> list[Bytes]:
    """Linear radiance (H, W, 3) as uint8 sRGB, all exposed alike."""
    factor = common_gain(renders)
    return [tone_map(render, factor) for render in renders]


def grid(panels: Sequence[Bytes], columns: int = COLUMNS) -> Bytes:
    """Panels of one size in rows."""
    columns = min(columns, len(panels))
    return stack([beside(panels[first : first + columns]) for first in range(0, len(panels), columns)])


def video(frames: Sequence[Bytes], seconds: float) -> bytes:
    """An animated WebP of frames (H, W, 3) that repeats forever and lasts `seconds` a time.

    Raises:
        ValueError: fewer than two frames.
    """
    if len(frames) < 2:
        raise ValueError(f"a video needs at least two frames, got {len(frames)}")
    larger = max(1, round(VIDEO_WIDTH / frames[0].shape[1]))
    first, *others = (Image.fromarray(frame.repeat(larger, axis=0).repeat(larger, axis=1)) for frame in frames)
    buffer = io.BytesIO()
    first.save(
        buffer,
        format="WEBP",
        save_all=True,
        append_images=others,
        duration=max(1, round(1000.0 * seconds / len(frames))),
        loop=0,
        quality=VIDEO_QUALITY,
        method=4,
    )
    return buffer.getvalue()


def comparison_figure(columns: Sequence[Relit], truth: str = "path traced") -> Figure:
    """A column for each number of lights: truth, render, and signed difference with the PSNR.

    Each column is exposed for its truth.

    Args:
        truth: what the images are that are compared with.

    Raises:
        ValueError: there are no columns.
    """
    if not columns:
        raise ValueError("nothing to compare")
    rows = (truth, "frozen scene", "difference")
    height, width = columns[0].truth.shape[:2]
    with matplotlib.rc_context(STYLE):
        row_height = COLUMN_WIDTH * height / width + 0.1
        size = (COLUMN_WIDTH * len(columns) + 0.4, 3.0 * row_height + 0.5)
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots(3, len(columns), squeeze=False)
        for column, relit in enumerate(columns):
            factor = display_gain(relit.truth)
            difference = signed_difference(relit.truth, relit.render, factor)
            panels = (tone_map(relit.truth, factor), tone_map(relit.render, factor), difference)
            for axis, panel, name in zip(axes[:, column], panels, rows, strict=True):
                axis.imshow(panel, interpolation="nearest")
                axis.set(xticks=[], yticks=[])
                axis.spines[:].set_visible(False)
                if column == 0:
                    axis.set_ylabel(name)
            axes[0, column].set_title(f"{relit.lights} light{'s' if relit.lights != 1 else ''}")
            axes[2, column].set_xlabel(f"{relit.psnr:.1f} dB", loc="left")
    return figure
