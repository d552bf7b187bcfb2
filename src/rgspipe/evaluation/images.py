"""Pictures for people: tone mapping, comparison strips and PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import scipy.ndimage
from PIL import Image, ImageDraw

from rgspipe.arguments import as_file
from rgspipe.errors import InputError
from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.scene import srgb
from rgspipe.scene.arrays import as_tensor, check_levels
from rgspipe.store.files import write_bytes

Bytes = npt.NDArray[np.uint8]

#: The percentile of a target that is exposed to white.
WHITE_PERCENTILE = 97.0
#: A signed difference this large, relative to exposed white, has the strongest colour.
DIFFERENCE_SPAN = 0.2
#: Width of the white gap between panels, pixels.
GAP = 4

#: The colour of outlines.
OUTLINE = (0, 190, 255)

# Ends and middle of the difference colours: too dark, equal, too bright (safe with colour blindness).
_TOO_DARK, _EQUAL, _TOO_BRIGHT = (33, 102, 172), (247, 247, 247), (178, 24, 43)


def display_gain(target: ArrayLike) -> float:
    """The factor that brings the 97th percentile of `target` to white; 1 for a black image."""
    finite = to_array(target)
    finite = finite[np.isfinite(finite)]
    white = float(np.percentile(finite, WHITE_PERCENTILE)) if finite.size else 0.0
    return 1.0 / white if white > 0.0 else 1.0


def tone_map(image: ArrayLike, factor: float | None = None) -> Bytes:
    """(H, W, 3) uint8 sRGB of a linear image times `factor` (None: its `display_gain`); NaN becomes magenta.

    Raises:
        InputError: it is no image of three channels, or one of 8 bits.
    """
    check_levels("image", image)
    linear = _image(image) * (display_gain(image) if factor is None else factor)
    broken = np.isnan(linear).any(axis=-1)
    linear = np.clip(np.nan_to_num(linear, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    result = np.round(255.0 * srgb.encode(linear)).astype(np.uint8)
    result[broken] = (255, 0, 255)
    return result


def signed_difference(target: ArrayLike, render: ArrayLike, factor: float, span: float = DIFFERENCE_SPAN) -> Bytes:
    """(H, W, 3) uint8: red where `render` is too bright, blue where it is too dark, white where equal.

    The channels' mean difference times `factor`, in the strongest colour at ±`span`.
    """
    target, render = _image(target), _image(render)
    if target.shape != render.shape:
        raise ValueError(f"images of one size are needed, got {target.shape} and {render.shape}")
    amount = (render - target).mean(axis=-1) * factor / span
    broken = np.isnan(amount)
    amount = np.clip(np.nan_to_num(amount, nan=0.0), -1.0, 1.0)[..., None]
    ends = np.where(amount > 0.0, np.array(_TOO_BRIGHT, dtype=float), np.array(_TOO_DARK, dtype=float))
    colours = np.array(_EQUAL, dtype=float) * (1.0 - np.abs(amount)) + ends * np.abs(amount)
    result = np.round(colours).astype(np.uint8)
    result[broken] = (255, 0, 255)
    return result


def comparison_strip(target: ArrayLike, render: ArrayLike) -> Bytes:
    """(H, 3·W + gaps, 3) uint8: target | render | signed difference, exposed for the target."""
    return progress_strip(target, [render])


def progress_strip(
    target: ArrayLike, renders: Sequence[ArrayLike], left_out: npt.NDArray[np.bool_] | None = None
) -> Bytes:
    """(H, …, 3) uint8: target | each render in turn | signed difference of the last, exposed for the target.

    Pixels that were left out, a mask (H, W), are outlined in the target and in the difference.
    """
    if not renders:
        raise ValueError("a strip needs at least one render")
    factor = display_gain(target)
    panels = [tone_map(target, factor), *(tone_map(render, factor) for render in renders)]
    panels.append(signed_difference(target, renders[-1], factor))
    if left_out is not None:
        panels[0], panels[-1] = (outlined(panel, left_out) for panel in (panels[0], panels[-1]))
    return beside(panels)


def outlined(panel: Bytes, mask: npt.NDArray[np.bool_]) -> Bytes:
    """A panel (H, W, 3) with the pixels around those of a mask (H, W) in the colour OUTLINE."""
    around = scipy.ndimage.binary_dilation(mask, structure=np.ones((3, 3))) & ~mask
    return np.where(around[:, :, None], np.array(OUTLINE, dtype=np.uint8), panel)


def line_of_text(words: str, width: int) -> Bytes:
    """(16, width, 3) uint8 words in black after a frame of the colour OUTLINE, cut off where they do not fit."""
    picture = Image.new("RGB", (width, 16), "white")
    draw = ImageDraw.Draw(picture)
    draw.rectangle((3, 3, 11, 11), outline=OUTLINE)
    draw.text((17, 2), words, fill="black")
    return np.asarray(picture)


def beside(panels: Sequence[Bytes], gap: int = GAP) -> Bytes:
    """Panels of one height side by side with white gaps."""
    return np.swapaxes(stack([np.swapaxes(panel, 0, 1) for panel in panels], gap), 0, 1)


def stack(rows: Sequence[Bytes], gap: int = GAP) -> Bytes:
    """Rows below each other with white gaps; narrower rows are filled up with white on the right."""
    if not rows:
        raise ValueError("nothing to put together")
    width = max(row.shape[1] for row in rows)
    parts: list[Bytes] = []
    for row in rows:
        if row.ndim != 3 or row.shape[2] != 3 or row.dtype != np.uint8:
            raise ValueError(f"panels must be (H, W, 3) uint8, got {row.shape} {row.dtype}")
        filled = np.full((row.shape[0], width, 3), 255, dtype=np.uint8)
        filled[:, : row.shape[1]] = row
        parts += [filled, np.full((gap, width, 3), 255, dtype=np.uint8)]
    return np.ascontiguousarray(np.concatenate(parts[:-1], axis=0))


def png_bytes(pixels: Bytes) -> bytes:
    """A PNG file of (H, W, 3) uint8 pixels, without metadata: equal pixels give equal bytes.

    Raises:
        InputError: they are something else, such as radiance.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8:
        found = f"shape {tuple(pixels.shape)} of {pixels.dtype}"
        remedy = "rg.tone_map makes them of radiance."
        raise InputError("pixels", expected="levels of 8 bits of shape (H, W, 3)", found=found, remedy=remedy)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def save_png(path: str | Path, pixels: Bytes) -> None:
    """Write (H, W, 3) uint8 pixels; the file appears under its name only when it is whole.

    Raises:
        InputError: the pixels are something else, such as radiance, of which `tone_map` makes them; or the name is that
            of another format.
    """
    file = as_file(path, "image.png")
    if file.suffix.lower() not in ("", ".png"):
        found, remedy = f"{file.name}, another format", f"Call it {file.with_suffix('.png').name}."
        raise InputError(path, expected="the name of a PNG", found=found, remedy=remedy)
    write_bytes(file, png_bytes(pixels))


def fit_within(png: bytes, max_bytes: int, max_width: int = 1600, min_width: int = 240) -> bytes:
    """The same picture, made smaller until it has at most `max_bytes` and `max_width` pixels across.

    A picture that fits is returned untouched; none becomes narrower than `min_width`, whatever its size.
    """
    with Image.open(io.BytesIO(png), formats=["PNG"]) as opened:
        picture = opened.convert("RGB")
    width = min(picture.width, max_width)
    if width == picture.width and len(png) <= max_bytes:
        return png
    while True:
        height = max(1, round(picture.height * width / picture.width))
        smaller = png_bytes(np.asarray(picture.resize((width, height), Image.Resampling.LANCZOS)))
        if len(smaller) <= max_bytes or width <= min_width:
            return smaller
        width = max(min_width, int(width * 0.8))


def _image(image: ArrayLike) -> npt.NDArray[np.float64]:
    return to_array(as_tensor(image, "image", ("H", "W", 3), remedy="Pass linear radiance, colours last."))
